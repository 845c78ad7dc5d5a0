//! Draws what is held: the service.

use super::forecast::ends;
use super::{Hold, Job, Phase, Wish};
use crate::services::House;
use crate::services::line_us::perform;
use embassy_time::{Duration, with_timeout};
use protocol_core::lineus::{Reply, Request, Session};
use protocol_core::machine::{Client, Errand, Manner, Report, Target};
use protocol_core::motion::{PEN_UP, Position};

/// Bytes of the drawing that are read at a time.
const CHUNK: usize = 128;
/// How long the pen waits on the paper for the next piece of the drawing.
const ON_PAPER: Duration = Duration::from_millis(500);

impl Job {
    /// The service: draws what comes, for ever. `room` is what can be held.
    pub async fn run(&self, house: &House, room: &'static mut [u8]) -> ! {
        self.with(|shared| shared.hold = Some(Hold::new(room)));
        let mut reply = Reply::new();
        loop {
            while !self.state().is_some_and(|state| state.is_under_way()) {
                self.changed.wait().await;
            }
            let mut drawing = Drawing {
                job: self,
                house,
                at: house.arm.with(|machine| machine.position()),
                away: false,
            };
            let outcome = drawing.draw(&mut reply).await;
            drawing.lift().await;
            house.arm.rest(Client::JOB).await;
            self.enter(outcome);
        }
    }

    fn enter(&self, phase: Phase) {
        self.with(|shared| {
            if let Some(job) = &mut shared.job {
                job.enter(phase);
            }
        });
    }

    fn wanted(&self) -> Wish {
        self.with(|shared| shared.job.as_ref().map_or(Wish::Stop, |job| job.wish))
    }

    /// Copies what is to be drawn next; gives how many bytes, and whether nothing comes after what is held.
    fn next(&self, into: &mut [u8]) -> (usize, bool) {
        self.with(|shared| {
            let hold = shared.hold.as_ref();
            let read = hold.map_or(0, |hold| hold.read(hold.drawn(), into));
            (read, shared.job.as_ref().is_none_or(|job| job.ended))
        })
    }

    fn advance(&self, before: &[u8], after: &[u8]) {
        self.with(|shared| {
            if let Some(hold) = &mut shared.hold {
                hold.advance(before.len() - after.len());
            }
            if let Some(job) = &mut shared.job {
                job.lines_done += ends(before, after);
            }
        });
    }

    /// Somebody wants the drawing to pause or stop at once.
    async fn interrupted(&self) {
        while !matches!(self.wanted(), Wish::PauseNow | Wish::Stop) {
            self.changed.wait().await;
        }
    }
}

/// A drawing that is being drawn.
struct Drawing<'a> {
    job: &'a Job,
    house: &'a House,
    /// Where the last move of the drawing ends.
    at: Position,
    /// The pen was lifted there, and may be elsewhere now.
    away: bool,
}

/// It is to be stopped.
struct Stopped;

impl Drawing<'_> {
    async fn draw(&mut self, reply: &mut Reply) -> Phase {
        let mut session = Session::new();
        let mut chunk = [0; CHUNK];
        loop {
            if self.obey().await.is_err() {
                return Phase::Stopped;
            }
            let (read, ended) = self.job.next(&mut chunk);
            let mut input = chunk.get(..read).unwrap_or_default();
            if input.is_empty() {
                if ended {
                    return Phase::Done;
                }
                self.wait().await;
                continue;
            }
            let mut before = input;
            while let Some(request) = session.next_request(&mut input, reply) {
                if self.perform(&request, reply).await.is_err() {
                    return Phase::Stopped;
                }
                self.job.advance(before, input);
                before = input;
                if self.obey().await.is_err() {
                    return Phase::Stopped;
                }
            }
            self.job.advance(before, input);
        }
    }

    /// Does what a line asks for; a move has begun then.
    async fn perform(&mut self, request: &Request, reply: &mut Reply) -> Result<(), Stopped> {
        let Request::Errand(errand) = request else {
            perform(request, reply, Client::JOB, self.house).await;
            return Ok(());
        };
        loop {
            self.come_back().await;
            let interrupted = self.job.interrupted();
            let arm = &self.house.arm;
            match arm.errand_unless(Client::JOB, errand, interrupted).await {
                Some(Report::Moving { end, .. }) => self.at = end,
                Some(Report::Resting) => {}
                // Who stopped the machine does not want the rest of the drawing when it may move again.
                Some(Report::Stopped) => return Err(Stopped),
                None => {
                    self.obey().await?;
                    continue;
                }
            }
            return Ok(());
        }
    }

    /// Pauses if that is wanted, until it is not wanted any more.
    async fn obey(&mut self) -> Result<(), Stopped> {
        loop {
            match self.job.wanted() {
                Wish::Go => return Ok(()),
                Wish::Stop => return Err(Stopped),
                Wish::PauseAtPenUp if self.at.pen_is_down() && !self.away => return Ok(()),
                Wish::PauseAtPenUp | Wish::PauseNow => {}
            }
            self.lift().await;
            // Paused is who has come to rest.
            self.house.arm.rest(Client::JOB).await;
            self.job.enter(Phase::Paused);
            while matches!(self.job.wanted(), Wish::PauseAtPenUp | Wish::PauseNow) {
                self.job.changed.wait().await;
            }
            self.job.enter(Phase::Drawing);
        }
    }

    /// Waits for the next piece, or for another wish.
    async fn wait(&mut self) {
        if with_timeout(ON_PAPER, self.job.changed.wait())
            .await
            .is_ok()
        {
            return;
        }
        self.lift().await;
        self.job.enter(Phase::Waiting);
        self.job.changed.wait().await;
        self.job.enter(Phase::Drawing);
    }

    /// Lifts the pen where it is.
    async fn lift(&mut self) {
        if self.at.pen_is_down() && !self.away {
            self.go(Target::PEN_UP).await;
        }
        self.away = true;
    }

    /// Goes back to where the drawing was, with the pen up, and lowers it there.
    async fn come_back(&mut self) {
        if !self.away {
            return;
        }
        let Position { x, y, z } = self.at;
        let there = Target {
            x: Some(x.into()),
            y: Some(y.into()),
            ..Target::PEN_UP
        };
        self.go(Target::PEN_UP).await;
        self.go(there).await;
        if z != PEN_UP {
            self.go(Target {
                z: Some(z.into()),
                ..Target::default()
            })
            .await;
        }
        self.away = false;
    }

    async fn go(&self, target: Target) {
        let errand = Errand::Move(Manner::Straight, target);
        self.house.arm.errand(Client::JOB, &errand).await;
    }
}
