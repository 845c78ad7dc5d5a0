//! A drawing that the machine holds and draws by itself, whoever sent it.
//!
//! It is one more client of the arm ([`Client::JOB`]): its lines go through a session of their own and
//! are done as any client's. What is held is bounded; a larger drawing comes in pieces while the arm draws.
//! `docs/api.md` is the contract.

#![allow(
    clippy::result_large_err,
    reason = "there is no heap: why a line is refused is carried as it is"
)]

mod draw;
mod forecast;
mod hold;

pub use forecast::{MAX_REASON, RefusedLine};

use super::House;
use core::cell::RefCell;
use embassy_futures::yield_now;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::{Mutex as Turns, MutexGuard as Turn};
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant};
use forecast::{Check, Forecast};
use heapless::String;
use hold::Hold;
use protocol_core::lineus::Reply;
use protocol_core::machine::Limited;

/// Longest name of a drawing, in bytes.
pub const MAX_NAME: usize = 64;
/// Bytes that are looked at before others have their turn.
const STRETCH: usize = 256;

/// What is done with the drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Drawing,
    /// For the next piece.
    Waiting,
    Paused,
    Done,
    Stopped,
}

/// What is to be done with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wish {
    Go,
    PauseAtPenUp,
    PauseNow,
    Stop,
}

/// What a person is told about a drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// It is drawn.
    Drawing,
    /// What is there is drawn: the next piece has yet to come.
    Waiting,
    /// It will pause.
    Pausing,
    /// It pauses, with the pen up.
    Paused,
    /// It will stop.
    Stopping,
    /// It is finished.
    Done,
    /// It was stopped.
    Stopped,
}

impl State {
    /// Its name in the API.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drawing => "drawing",
            Self::Waiting => "waiting",
            Self::Pausing => "pausing",
            Self::Paused => "paused",
            Self::Stopping => "stopping",
            Self::Done => "done",
            Self::Stopped => "stopped",
        }
    }

    /// Neither done nor stopped.
    pub const fn is_under_way(self) -> bool {
        !matches!(self, Self::Done | Self::Stopped)
    }
}

/// What whoever sends a drawing says about it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Title {
    /// For people.
    pub name: String<MAX_NAME>,
    /// How many lines there will be, if it comes in pieces.
    pub lines: Option<u32>,
    /// How many seconds it will take, if it comes in pieces.
    pub seconds: Option<u32>,
}

/// How a drawing is.
#[derive(Clone, Debug)]
pub struct Report {
    /// Counts drawings since the start.
    pub id: u32,
    /// For people.
    pub name: String<MAX_NAME>,
    /// What is done with it.
    pub state: State,
    /// Lines that have begun.
    pub lines_done: u32,
    /// Lines in all, if that is known.
    pub lines_total: Option<u32>,
    /// Bytes received.
    pub received: usize,
    /// Bytes drawn.
    pub drawn: usize,
    /// Bytes that fit.
    pub free: usize,
    /// Time drawn, without pauses.
    pub time: Duration,
    /// Time left, if that can be known.
    pub left: Option<Duration>,
    /// Lines that do not go where they say.
    pub limited: u32,
    /// The first of them.
    pub first_limited: Option<(u32, Limited)>,
    /// All of it is held.
    pub whole: bool,
}

/// Why something cannot be done with a drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotNow {
    /// A drawing is under way, or somebody else is sending one.
    Busy,
    /// There is no such drawing, or it is over.
    NoJob,
    /// It does not fit: so much would.
    TooLarge(usize),
    /// It does not fit yet: so much would.
    NoRoom(usize),
    /// It does not follow what was received, which is so much.
    WrongPlace(usize),
}

struct Record {
    id: u32,
    title: Title,
    phase: Phase,
    wish: Wish,
    /// No piece follows.
    ended: bool,
    lines_done: u32,
    lines_received: u32,
    /// Of what was received.
    forecast: Duration,
    limited: u32,
    first_limited: Option<(u32, Limited)>,
    time: Duration,
    /// Since when it is drawn, if it is.
    since: Option<Instant>,
}

impl Record {
    fn state(&self) -> State {
        match (self.phase, self.wish) {
            (Phase::Done, _) => State::Done,
            (Phase::Stopped, _) => State::Stopped,
            (_, Wish::Stop) => State::Stopping,
            (Phase::Paused, Wish::PauseAtPenUp | Wish::PauseNow) => State::Paused,
            (_, Wish::PauseAtPenUp | Wish::PauseNow) => State::Pausing,
            (Phase::Waiting, Wish::Go) => State::Waiting,
            (_, Wish::Go) => State::Drawing,
        }
    }

    fn time(&self) -> Duration {
        self.time + self.since.map_or(Duration::MIN, |since| since.elapsed())
    }

    fn enter(&mut self, phase: Phase) {
        self.time = self.time();
        self.since = (phase == Phase::Drawing).then(Instant::now);
        self.phase = phase;
    }

    fn left(&self) -> Option<Duration> {
        if !self.state().is_under_way() {
            return Some(Duration::MIN);
        }
        let said = self
            .title
            .seconds
            .map(|seconds| Duration::from_secs(seconds.into()));
        let total = match self.ended {
            true => self.forecast,
            false => said?.max(self.forecast),
        };
        Some(Duration::from_ticks(
            total.as_ticks().saturating_sub(self.time().as_ticks()),
        ))
    }
}

#[derive(Default)]
struct Shared {
    /// `None` until the service runs.
    hold: Option<Hold>,
    job: Option<Record>,
    drawings: u32,
}

impl Shared {
    fn free(&self) -> usize {
        // One byte is for the end of the last line.
        self.hold
            .as_ref()
            .map_or(0, |hold| hold.free().saturating_sub(1))
    }
}

/// Where a drawing is looked at before it is drawn; one at a time.
struct Desk {
    forecast: Option<Forecast>,
    reply: Reply,
}

/// The way of the other services to the drawing.
pub struct Job {
    shared: Mutex<CriticalSectionRawMutex, RefCell<Shared>>,
    desk: Turns<CriticalSectionRawMutex, Desk>,
    /// There is something new for the service.
    changed: Signal<CriticalSectionRawMutex, ()>,
}

impl Default for Job {
    fn default() -> Self {
        Self::new()
    }
}

impl Job {
    /// No drawing, and no room for one until the service runs.
    pub const fn new() -> Self {
        Self {
            shared: Mutex::new(RefCell::new(Shared {
                hold: None,
                job: None,
                drawings: 0,
            })),
            desk: Turns::new(Desk {
                forecast: None,
                reply: Reply::new(),
            }),
            changed: Signal::new(),
        }
    }

    fn with<T>(&self, f: impl FnOnce(&mut Shared) -> T) -> T {
        self.shared.lock(|shared| f(&mut shared.borrow_mut()))
    }

    /// Bytes of G-code that can be held.
    pub fn capacity(&self) -> usize {
        self.with(|shared| {
            let hold = shared.hold.as_ref();
            hold.map_or(0, |hold| hold.capacity().saturating_sub(1))
        })
    }

    /// How the drawing is, `None` where there has been none.
    pub fn report(&self) -> Option<Report> {
        self.with(|shared| {
            let (job, hold) = (shared.job.as_ref()?, shared.hold.as_ref()?);
            Some(Report {
                id: job.id,
                name: job.title.name.clone(),
                state: job.state(),
                lines_done: job.lines_done,
                lines_total: match job.ended {
                    true => Some(job.lines_received),
                    false => job.title.lines,
                },
                received: hold.received(),
                drawn: hold.drawn(),
                free: shared.free(),
                time: job.time(),
                left: job.left(),
                limited: job.limited,
                first_limited: job.first_limited,
                whole: job.ended && hold.has_beginning(),
            })
        })
    }

    /// What is done with the drawing, `None` where there has been none.
    pub fn state(&self) -> Option<State> {
        self.with(|shared| shared.job.as_ref().map(Record::state))
    }

    /// Copies what is held of a drawing that is held whole; gives how many bytes, `None` if it is not, or
    /// not any more.
    pub fn read(&self, id: u32, place: usize, into: &mut [u8]) -> Option<usize> {
        self.with(|shared| {
            let (job, hold) = (shared.job.as_ref()?, shared.hold.as_ref()?);
            let whole = job.id == id && job.ended && hold.has_beginning();
            whole.then(|| hold.read(place, into))
        })
    }

    /// Pauses where the pen is up next, or after the move under way.
    ///
    /// # Errors
    /// [`NotNow::NoJob`].
    pub fn pause(&self, now: bool) -> Result<(), NotNow> {
        self.wish(match now {
            true => Wish::PauseNow,
            false => Wish::PauseAtPenUp,
        })
    }

    /// Goes on.
    ///
    /// # Errors
    /// [`NotNow::NoJob`].
    pub fn resume(&self) -> Result<(), NotNow> {
        self.wish(Wish::Go)
    }

    /// Stops after the move under way.
    ///
    /// # Errors
    /// [`NotNow::NoJob`].
    pub fn stop(&self) -> Result<(), NotNow> {
        self.wish(Wish::Stop)
    }

    fn wish(&self, wish: Wish) -> Result<(), NotNow> {
        self.with(|shared| {
            let job = shared.job.as_mut();
            let job = job.filter(|job| job.state().is_under_way());
            let job = job.ok_or(NotNow::NoJob)?;
            // A drawing that is being stopped stays so.
            if job.wish != Wish::Stop {
                job.wish = wish;
            }
            Ok(())
        })?;
        self.changed.signal(());
        Ok(())
    }

    /// Begins a drawing with its first piece, which will be of that length. What was held before is
    /// forgotten.
    ///
    /// # Errors
    /// [`NotNow::Busy`], [`NotNow::TooLarge`]; nothing has changed then.
    pub fn begin(&self, house: &House, title: Title, length: usize) -> Result<Upload<'_>, NotNow> {
        let mut desk = self.desk.try_lock().map_err(|_| NotNow::Busy)?;
        let capacity = self.capacity();
        self.with(|shared| {
            let under_way = |job: &Record| job.state().is_under_way();
            if shared.job.as_ref().is_some_and(under_way) {
                return Err(NotNow::Busy);
            }
            if length > capacity {
                return Err(NotNow::TooLarge(capacity));
            }
            shared.job = None;
            if let Some(hold) = &mut shared.hold {
                hold.clear();
            }
            Ok(())
        })?;
        let (data, steps) = house.arm.with(|machine| (*machine.data(), machine.steps()));
        let forecast = desk.forecast.insert(Forecast::new(data, steps));
        Ok(Upload {
            check: Check::after(forecast),
            job: self,
            desk,
            title: Some(title),
            last: None,
        })
    }

    /// Continues a drawing with a piece of that length, which belongs at that place.
    ///
    /// # Errors
    /// All but [`NotNow::TooLarge`]; nothing has changed then.
    pub fn proceed(&self, id: u32, place: usize, length: usize) -> Result<Upload<'_>, NotNow> {
        let desk = self.desk.try_lock().map_err(|_| NotNow::Busy)?;
        self.with(|shared| {
            let job = shared.job.as_ref();
            let open = |job: &&Record| job.id == id && !job.ended && job.state().is_under_way();
            job.filter(open).ok_or(NotNow::NoJob)?;
            let received = shared.hold.as_ref().map_or(0, Hold::received);
            if place != received {
                return Err(NotNow::WrongPlace(received));
            }
            match shared.free() {
                free if length > free => Err(NotNow::NoRoom(free)),
                _ => Ok(()),
            }
        })?;
        let forecast = desk.forecast.as_ref().ok_or(NotNow::NoJob)?;
        Ok(Upload {
            check: Check::after(forecast),
            job: self,
            desk,
            title: None,
            last: None,
        })
    }
}

/// A piece on its way; dropped before [`Self::keep`], it never came.
pub struct Upload<'a> {
    job: &'a Job,
    desk: Turn<'a, CriticalSectionRawMutex, Desk>,
    check: Check,
    /// Of the first piece.
    title: Option<Title>,
    /// The last byte.
    last: Option<u8>,
}

impl Upload<'_> {
    /// Takes some bytes of the piece.
    ///
    /// # Errors
    /// [`RefusedLine`] where a line of them cannot be drawn.
    pub fn take(&mut self, bytes: &[u8]) -> Result<(), RefusedLine> {
        self.check.take(bytes, &mut self.desk.reply)?;
        self.last = bytes.last().copied().or(self.last);
        // It fits: the length was announced, and no more than that is given.
        self.job
            .with(|shared| shared.hold.as_mut().is_some_and(|hold| hold.write(bytes)));
        Ok(())
    }

    /// Whether what was taken ends with a whole line.
    pub fn ends_with_a_line(&self) -> bool {
        matches!(self.last, None | Some(b'\n' | b'\r' | 0))
    }

    /// The piece is complete: it is drawn from now on. `ended` says that no other follows.
    ///
    /// # Errors
    /// [`RefusedLine`] where the last line, which had no end, cannot be drawn.
    pub async fn keep(mut self, ended: bool) -> Result<(), RefusedLine> {
        if !self.ends_with_a_line() {
            self.take(b"\n")?;
        }
        let from = self.job.with(|shared| {
            let hold = shared.hold.as_mut();
            hold.map_or(0, |hold| {
                let from = hold.received();
                hold.keep();
                from
            })
        });
        self.reckon(from).await;
        let title = self.title.take();
        if let Some(forecast) = &self.desk.forecast {
            self.job.with(|shared| {
                if let Some(title) = title {
                    shared.drawings = shared.drawings.wrapping_add(1);
                    shared.job = Some(Record::new(shared.drawings, title));
                }
                if let Some(job) = &mut shared.job {
                    job.ended = ended;
                    job.lines_received = forecast.line;
                    job.forecast = Duration::from_micros(forecast.time.get());
                    (job.limited, job.first_limited) = (forecast.limited, forecast.first);
                }
            });
        }
        self.job.changed.signal(());
        Ok(())
    }

    /// Reckons what was taken since then.
    async fn reckon(&mut self, mut place: usize) {
        let mut stretch = [0; STRETCH];
        let Desk { forecast, reply } = &mut *self.desk;
        let Some(forecast) = forecast else { return };
        loop {
            let read = self.job.with(|shared| {
                let hold = shared.hold.as_ref();
                hold.map_or(0, |hold| hold.read(place, &mut stretch))
            });
            let Some(read @ [_, ..]) = stretch.get(..read) else {
                return;
            };
            forecast.take(read, reply);
            place += read.len();
            yield_now().await;
        }
    }
}

impl Drop for Upload<'_> {
    fn drop(&mut self) {
        self.job.with(|shared| {
            if let Some(hold) = &mut shared.hold {
                hold.drop_piece();
            }
        });
    }
}

impl Record {
    fn new(id: u32, title: Title) -> Self {
        Self {
            id,
            title,
            phase: Phase::Drawing,
            wish: Wish::Go,
            ended: false,
            lines_done: 0,
            lines_received: 0,
            forecast: Duration::MIN,
            limited: 0,
            first_limited: None,
            time: Duration::MIN,
            since: Some(Instant::now()),
        }
    }
}
