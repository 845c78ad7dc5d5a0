//! The plan in time: what is under way, when it ends, what is next.

use super::super::table::Side;
use super::super::units::{Coordinate, Micros, PEN_UP, Position};
use super::block::Block;
use super::moment::{Moment, fine};
use super::profile::{Profile, Task};
use super::{Planner, STREAM_GAP};
use crate::arm::high_half;

/// What happened while time went on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlanEvent {
    /// Everything is done, the pen is up, and no more came in time.
    Over,
    /// The arm stands at the edge of the table, over which the plan would lead.
    Limit(Side),
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Running {
    pub(super) block: Block,
    pub(super) profile: Profile,
    pub(super) begun: Moment,
    /// Square of the speed at its end.
    pub(super) exit: u64,
    /// Height at rest, and how much of it goes with the speed, in 2^16 / (1/2^32 units a microsecond).
    contact: i32,
    pressure: i32,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Stage {
    /// The arm is somebody else's.
    Idle,
    /// The pen goes up or down.
    Pen,
    Moving(Running),
    Dwelling,
    /// The queue is empty; the host may go on.
    Lingering,
}

impl Planner {
    /// Lets everything happen that happens until `now`, or until something has to be told.
    #[inline]
    pub(crate) fn advance(&mut self, now: Micros) -> Option<PlanEvent> {
        let now = Moment::from(now);
        if self.ends > now {
            return None;
        }
        self.go_on(now)
    }

    /// Whether what is under way is still so after `now`.
    #[inline]
    pub(crate) fn lasts_beyond(&self, now: Micros) -> bool {
        self.ends > now.into()
    }

    #[inline(never)]
    fn go_on(&mut self, now: Moment) -> Option<PlanEvent> {
        // Each turn ends a stage; a block has at most three.
        while self.ends <= now {
            let ends = self.ends;
            self.clock = ends;
            match self.stage {
                Stage::Idle => return None,
                Stage::Pen => {
                    self.pen.arrive(ends);
                    if self.queue.is_empty() {
                        return Some(self.over());
                    }
                }
                Stage::Moving(running) => {
                    let speed = running.profile.at(running.profile.duration()).1;
                    self.pen.follow(running.height(speed), ends);
                    self.place = running.block.to;
                    if let Some(side) = running.block.leaves {
                        return Some(PlanEvent::Limit(side));
                    }
                    if running.block.dwell > Micros::default() {
                        self.enter(Stage::Dwelling, ends.after(fine(running.block.dwell)));
                        continue;
                    }
                    self.then.switch(&mut self.outputs);
                }
                Stage::Dwelling => self.then.switch(&mut self.outputs),
                Stage::Lingering => {
                    if self.queue.is_empty() {
                        if self.pen.is_up() {
                            return Some(self.over());
                        }
                        self.send_pen(PEN_UP, ends);
                        continue;
                    }
                }
            }
            if let Some(side) = self.next(ends) {
                return Some(PlanEvent::Limit(side));
            }
        }
        None
    }

    fn over(&mut self) -> PlanEvent {
        self.enter(Stage::Idle, Moment::default());
        self.changed = true;
        PlanEvent::Over
    }

    /// Where the arm stands; when the stage under way began.
    pub(crate) fn rests_at(&self) -> (Position, Micros) {
        let (x, y) = self.place;
        let z = self.pen.height();
        (Position { x, y, z }, self.clock.micros())
    }

    /// The set-point at `now`, which lies in the stage under way.
    #[inline]
    pub(crate) fn at(&mut self, now: Micros) -> Position {
        let now = Moment::from(now);
        let Stage::Moving(running) = &self.stage else {
            self.pen.wait(now);
            return self.rests_at().0;
        };
        let (distance, speed) = running.profile.at(now.since(running.begun));
        self.pen.follow(running.height(speed), now);
        let Block { from, to, unit, .. } = &running.block;
        let [along_x, along_y] = unit;
        Position {
            x: on_the_way(from.0, to.0, *along_x, distance),
            y: on_the_way(from.1, to.1, *along_y, distance),
            z: self.pen.height(),
        }
    }

    pub(super) fn enter(&mut self, stage: Stage, ends: Moment) {
        (self.stage, self.ends) = (stage, ends);
    }

    /// Sends the pen somewhere.
    pub(super) fn send_pen(&mut self, to: Coordinate, now: Moment) {
        let takes = self.pen.send(to, now);
        self.enter(Stage::Pen, now.after(fine(takes)));
    }

    /// Begins what is next; a side of the table when that is in the way at once.
    fn next(&mut self, now: Moment) -> Option<Side> {
        while let Some(block) = self.queue.front() {
            let leaves = block.leaves;
            if block.is_nothing() {
                let mut then = block.then;
                then.switch(&mut self.outputs);
                self.queue.pop_front();
                self.changed = true;
                match leaves {
                    None => continue,
                    side => return side,
                }
            }
            let (ready, height) = if block.intensity.is_off() {
                (self.pen.is_up(), PEN_UP)
            } else {
                (self.pen.is_down(), self.depth.contact())
            };
            if !ready {
                self.send_pen(height, now);
                return None;
            }
            let Some(block) = self.queue.pop_front() else {
                break;
            };
            self.changed = true;
            self.then = block.then;
            let running = self.run(block, now);
            self.enter(Stage::Moving(running), running.ends());
            return None;
        }
        self.changed = true;
        self.enter(Stage::Lingering, now.after(fine(STREAM_GAP)));
        None
    }

    fn run(&self, block: Block, now: Moment) -> Running {
        let exit = self.queue.front().map_or(0, |next| next.entry);
        let task = Task {
            done: 0,
            length: block.length,
            entry: block.entry.isqrt() as u32,
            nominal: block.nominal,
            exit: exit.isqrt() as u32,
        };
        let (contact, pressure) = if block.intensity.is_off() {
            (PEN_UP, 0)
        } else {
            let below = i64::from(self.depth.below_contact(block.intensity));
            let pressure = (below << 16) / i64::from(block.nominal.max(1));
            let pressure = i32::try_from(pressure).unwrap_or(i32::MAX);
            (self.depth.contact(), pressure)
        };
        Running {
            profile: Profile::new(task, self.limits.acceleration),
            block,
            begun: now,
            exit,
            contact: contact.bits(),
            pressure,
        }
    }
}

impl Running {
    pub(super) const fn ends(&self) -> Moment {
        self.begun.after(self.profile.duration())
    }

    /// Of the pen at a speed.
    #[inline]
    fn height(&self, speed: u32) -> i32 {
        self.contact - ((i64::from(self.pressure) * i64::from(speed)) >> 16) as i32
    }
}

/// A coordinate after some distance, within a last place; never beyond either end.
#[inline]
fn on_the_way(from: Coordinate, to: Coordinate, unit: i32, distance: u32) -> Coordinate {
    // The direction is in 1/2^30, a distance has 28 bits.
    let along = high_half(unit, (distance << 2).cast_signed());
    let whole = to.bits() - from.bits();
    let along = if whole < 0 {
        along.max(whole)
    } else {
        along.min(whole)
    };
    Coordinate::from_bits(from.bits() + along)
}
