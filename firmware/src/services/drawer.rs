//! Draws what comes from anywhere but a connection, and above all from memory: no network is needed for
//! that, and none of its losses matters.

use super::House;
use super::line_us::perform;
use crate::log::{info, warning};
use core::cell::Cell;
use core::fmt;
use core::pin::pin;
use embassy_futures::select::{Either, Either3, select, select3};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Instant, Timer};
use embedded_io_async::Read;
use protocol_core::drawings::{Replay, Slot};
use protocol_core::lineus::{Reply, Request, Session};
use protocol_core::machine::{Client, Errand, Manner, Target};

/// Bytes taken from a source at a time.
const CHUNK: usize = 256;
/// Orders that may wait; one more is refused.
const ORDERS: usize = 4;
/// How long a replay waits before it looks again whether the arm has nothing else to do.
const BUSY: Duration = Duration::from_secs(1);

/// What to do with the pen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pen {
    /// As it is written.
    AsWritten,
    /// It stays up.
    Up,
}

/// Another drawing is being drawn from memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Busy(pub Slot);

impl fmt::Display for Busy {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            out,
            "drawing {} is being drawn: M23 K0 stops it",
            self.0.number()
        )
    }
}

enum Order {
    Draw(Slot),
    Stop,
    /// What is to be replayed has changed.
    Replay,
}

#[derive(Clone, Copy)]
struct State {
    drawing: Option<Slot>,
    /// What was drawn last.
    last: Option<Slot>,
    replay: Option<Replay>,
}

/// The way of the other services to what is drawn from memory.
pub struct Drawer {
    orders: Channel<CriticalSectionRawMutex, Order, ORDERS>,
    state: Mutex<CriticalSectionRawMutex, Cell<State>>,
}

impl Default for Drawer {
    fn default() -> Self {
        Self::new()
    }
}

impl Drawer {
    /// With nothing to do.
    pub const fn new() -> Self {
        Self {
            orders: Channel::new(),
            state: Mutex::new(Cell::new(State {
                drawing: None,
                last: None,
                replay: None,
            })),
        }
    }

    /// Draws this one.
    ///
    /// # Errors
    /// [`Busy`] while one is being drawn.
    pub fn draw(&self, slot: Slot) -> Result<(), Busy> {
        self.change(|state| match state.drawing {
            Some(other) => Err(Busy(other)),
            // It is taken at once by a task that waits for nothing else now.
            None => match self.orders.try_send(Order::Draw(slot)) {
                Ok(()) => {
                    state.drawing = Some(slot);
                    Ok(())
                }
                Err(_) => Err(Busy(slot)),
            },
        })
    }

    /// Stops what is being drawn, if anything is, and lifts the pen; says whether something was.
    pub fn stop(&self) -> bool {
        let drawing = self.is_drawing();
        if drawing {
            // While something is drawn, orders are taken at once: there is a place.
            let _ = self.orders.try_send(Order::Stop);
        }
        drawing
    }

    /// Whether one is being drawn, or will be.
    pub fn is_drawing(&self) -> bool {
        self.state().drawing.is_some()
    }

    /// What was drawn from memory last.
    pub fn last(&self) -> Option<Slot> {
        self.state().last
    }

    /// What is replayed.
    pub fn replay(&self) -> Option<Replay> {
        self.state().replay
    }

    /// From now on, this is replayed, or nothing.
    pub fn set_replay(&self, replay: Option<Replay>) {
        self.change(|state| state.replay = replay);
        let _ = self.orders.try_send(Order::Replay);
    }

    fn state(&self) -> State {
        self.state.lock(Cell::get)
    }

    fn change<T>(&self, f: impl FnOnce(&mut State) -> T) -> T {
        self.state.lock(|cell| {
            let mut state = cell.get();
            let answer = f(&mut state);
            cell.set(state);
            answer
        })
    }
}

/// Draws what is ordered, and replays, for ever.
pub async fn run(house: &House) -> ! {
    let drawer = &house.drawer;
    let mut due = None;
    // An order that ended a replay.
    let mut waiting = None;
    loop {
        let order = match (waiting.take(), due) {
            (Some(order), _) => Some(order),
            (None, Some(due)) => match select(drawer.orders.receive(), Timer::at(due)).await {
                Either::First(order) => Some(order),
                Either::Second(()) => None,
            },
            (None, None) => Some(drawer.orders.receive().await),
        };
        match order {
            Some(Order::Draw(slot)) => {
                if draw_stored(slot, house).await == ReplayChanged(true) {
                    waiting = Some(Order::Replay);
                }
            }
            Some(Order::Stop) => {}
            Some(Order::Replay) => due = drawer.replay().map(|_| Instant::now()),
            None => {
                let now = Instant::now();
                (due, waiting) = match drawer.replay() {
                    Some(replay) => match replay_once(replay, house).await {
                        Some(order) => {
                            let every = Duration::from_secs(replay.every.into());
                            (Some(now + every), order)
                        }
                        None => (Some(now + BUSY), None),
                    },
                    None => (None, None),
                };
            }
        }
    }
}

/// Whether what is to be replayed has changed meanwhile.
#[derive(Clone, Copy, PartialEq, Eq)]
struct ReplayChanged(bool);

/// Draws a stored drawing to its end, or until it is told to stop.
async fn draw_stored(slot: Slot, house: &House) -> ReplayChanged {
    let mut replay = ReplayChanged(false);
    let orders = &house.drawer.orders;
    if let Some(mut reader) = house.drawings.open(slot) {
        info!("drawing {} begins", slot.number());
        let mut drawing = pin!(async {
            reader.check().await?;
            draw(&mut reader, Pen::AsWritten, Client::DRAWER, house).await
        });
        loop {
            match select(&mut drawing, orders.receive()).await {
                Either::First(Ok(())) | Either::Second(Order::Stop) => break,
                Either::First(Err(error)) => {
                    warning!("drawing {}: {}", slot.number(), error.text());
                    break;
                }
                Either::Second(Order::Replay) => replay = ReplayChanged(true),
                // One at a time is ordered.
                Either::Second(Order::Draw(_)) => {}
            }
        }
        // Nobody is there who could still mean to go on.
        lift(Client::DRAWER, house).await;
        house
            .arm
            .with(|machine| machine.client_gone(Client::DRAWER));
        info!("drawing {} has ended", slot.number());
    }
    house.drawer.change(|state| {
        state.drawing = None;
        state.last = Some(slot);
    });
    replay
}

/// Draws the beginning of a drawing with the pen up, if the arm has nothing else to do: `None` if it has. Gives
/// the order that ended it before its time.
async fn replay_once(replay: Replay, house: &House) -> Option<Option<Order>> {
    let free = house
        .arm
        .with(|machine| machine.is_idle() && !machine.position().pen_is_down());
    if !free {
        return None;
    }
    let Some(mut reader) = house.drawings.open(replay.slot) else {
        return Some(None);
    };
    let drawing = async {
        reader.check().await?;
        draw(&mut reader, Pen::Up, Client::DRAWER, house).await
    };
    let time = Timer::after_secs(replay.seconds.into());
    let ended = select3(drawing, time, house.drawer.orders.receive()).await;
    // The move that waits is forgotten with it.
    house
        .arm
        .with(|machine| machine.client_gone(Client::DRAWER));
    Some(match ended {
        Either3::Third(order) => Some(order),
        _ => None,
    })
}

/// Draws what a source gives: lines of G-code. What is no drawing is passed over. It ends where the machine
/// is stopped. May be dropped at any time; then [`lift`] ends it.
///
/// # Errors
/// When the source fails.
pub async fn draw<S: Read>(
    source: &mut S,
    pen: Pen,
    client: Client,
    house: &House,
) -> Result<(), S::Error> {
    let mut session = Session::new();
    let mut reply = Reply::new();
    let mut chunk = [0; CHUNK];
    loop {
        let length = source.read(&mut chunk).await?;
        if length == 0 {
            return Ok(());
        }
        let mut input = chunk.get(..length).unwrap_or_default();
        while let Some(request) = session.next_request(&mut input, &mut reply) {
            let request = match (request, pen) {
                (Request::Errand(errand), Pen::Up) => Request::Errand(with_pen_up(errand)),
                (request @ (Request::Errand(_) | Request::SetSpeed { .. }), _) => request,
                _ => continue,
            };
            perform(&request, &mut reply, client, house).await;
            // What was not drawn meanwhile would be missing in the picture.
            if house.arm.with(|machine| machine.stopped().is_some()) {
                return Ok(());
            }
        }
    }
}

fn with_pen_up(errand: Errand) -> Errand {
    let lifted = |target| Target {
        z: Target::PEN_UP.z,
        ..target
    };
    match errand {
        Errand::Move(manner, target) => Errand::Move(manner, lifted(target)),
        Errand::Uncalibrated(target, bare) => Errand::Uncalibrated(lifted(target), bare),
        Errand::Dwell(_) | Errand::Wave | Errand::Rest => errand,
    }
}

/// Ends what `client` draws: the move under way is the last one, and then the pen rises.
pub async fn lift(client: Client, house: &House) {
    // It takes the place of the move that waits.
    house
        .arm
        .errand(client, &Errand::Move(Manner::Straight, Target::PEN_UP))
        .await;
}
