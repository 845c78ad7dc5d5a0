//! The plan of a plotter: segments in millimetres become motion with steady acceleration.
//!
//! Segments wait in a queue. Each time one is added, the speeds at all junctions are settled anew, the
//! running segment's rest included, so that a stream that comes segment by segment does not stop
//! at each: backwards, no junction is faster than what can still be braked before the last segment's
//! end, where the arm stops; forwards, none is faster than what can be reached. Then a segment is a
//! function of the time ([`profile`]), with its costs paid when it begins: a set-point takes a few
//! multiplications.
//!
//! The pen belongs to the plan. Before a stroke the arm stops until the pen is down, before a travel
//! until it is up, no longer than its servo takes. While it draws, it is the deeper the nearer the
//! speed is to the nominal one, and as deep as light contact at least.

mod block;
mod feed;
mod moment;
mod pen;
mod profile;

pub use block::{MOST_DWELL, Segment};
pub use feed::{Acceleration, Feed, LEAST_FEED, MOST_FEED};
pub use pen::{Intensity, PenDepth};

use super::table::{Millimetres, Side, Table, UNITS_PER_MILLIMETRE};
use super::units::{Coordinate, HOME, Micros, PEN_UP, Position};
use crate::arm::PenLift;
use block::{Block, Limits, Place};
use heapless::Deque;
use moment::{Moment, fine};
use pen::Pen;
use profile::{Profile, Task};

/// Segments that wait; the next one does not fit until one of them has begun.
pub const PLAN_SEGMENTS: usize = 32;
/// So many more ways may lead to where the first one begins: onto the table, and along it.
const APPROACH: usize = 2;

/// How long a plan that has run dry keeps the arm, and the pen down, for the host to go on.
pub const STREAM_GAP: Micros = Micros::new(500_000);

/// What a board says about the arm as a plotter.
#[derive(Clone, Copy, Debug)]
pub struct PlanData {
    /// Where millimetres are.
    pub table: Table,
    /// Along the way.
    pub acceleration: Acceleration,
    /// How far the arc that a corner's speed is reckoned by may stay off the corner.
    pub junction_deviation: Millimetres,
    /// Heights of the drawing pen.
    pub depth: PenDepth,
    /// Speed of the pen's servo, in degrees a second.
    pub pen_speed: u16,
}

impl Default for PlanData {
    /// 500 mm/s2 and 0.006 mm (`reference/lasaurgrbl.md`, section 5), a pen at 600 degrees a second.
    fn default() -> Self {
        Self {
            table: Table::DEFAULT,
            acceleration: Acceleration::new(500),
            // 0.006 * 65536, rounded.
            junction_deviation: Millimetres::from_bits(393),
            depth: PenDepth::default(),
            pen_speed: 600,
        }
    }
}

/// The plan has no room: [`PLAN_SEGMENTS`] wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Full;

/// What happened while time went on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlanEvent {
    /// Everything is done, the pen is up, and no more came in time.
    Over,
    /// The arm stands at the edge of the table, over which the plan would lead.
    Limit(Side),
}

#[derive(Clone, Copy, Debug)]
struct Running {
    block: Block,
    profile: Profile,
    begun: Moment,
    /// Square of the speed at its end.
    exit: u64,
    /// Height at rest, and how much of it goes with the speed, in 2^16 / (1/2^32 units a microsecond).
    contact: i32,
    pressure: i32,
}

#[derive(Clone, Copy, Debug)]
enum Stage {
    /// The arm is somebody else's.
    Idle,
    /// The pen goes up or down.
    Pen(Moment),
    Moving(Running),
    Dwelling(Moment),
    /// The queue is empty; the host may go on.
    Lingering(Moment),
}

/// The plan, and its motion while it has the arm.
#[derive(Debug)]
pub(crate) struct Planner {
    table: Table,
    depth: PenDepth,
    limits: Limits,
    queue: Deque<Block, { PLAN_SEGMENTS + APPROACH }>,
    stage: Stage,
    pen: Pen,
    /// Where the segment under way begins, or the arm stands.
    place: Place,
    /// Where the last segment planned ends: where the host knows the arm.
    end: Place,
    /// When the stage under way began.
    clock: Moment,
    /// The last segment leads over the table's edge: what follows will never be.
    leads_off: bool,
    changed: bool,
}

impl Planner {
    pub(crate) fn new(data: &PlanData, lift: PenLift, degrees_per_second: u16) -> Self {
        let deviation = data.junction_deviation.bits().unsigned_abs();
        let deviation = deviation.saturating_mul(UNITS_PER_MILLIMETRE.unsigned_abs());
        Self {
            table: data.table,
            depth: data.depth,
            limits: Limits {
                acceleration: data.acceleration,
                junction: data.acceleration.energy(deviation) / 2,
                degrees_per_second,
            },
            queue: Deque::new(),
            stage: Stage::Idle,
            pen: Pen::new(lift, data.pen_speed),
            place: (HOME.x, HOME.y),
            end: (HOME.x, HOME.y),
            clock: Moment::default(),
            leads_off: false,
            changed: false,
        }
    }

    /// How many more segments fit.
    pub(crate) fn room(&self) -> usize {
        PLAN_SEGMENTS.saturating_sub(self.queue.len())
    }

    /// Where the next way begins.
    pub(crate) fn end(&self) -> Place {
        self.table.closest(self.end)
    }

    /// Whether the plan has the arm.
    pub(crate) const fn has_the_arm(&self) -> bool {
        !matches!(self.stage, Stage::Idle)
    }

    /// Whether everything planned has been done; the pen may still be on its way up.
    pub(crate) fn is_done(&self) -> bool {
        self.queue.is_empty()
            && matches!(
                self.stage,
                Stage::Idle | Stage::Lingering(_) | Stage::Pen(_)
            )
    }

    /// Whether a segment has begun or been forgotten, or everything is done, since the last call.
    pub(crate) const fn has_changed(&mut self) -> bool {
        core::mem::replace(&mut self.changed, false)
    }

    /// When the last motion that is planned ends.
    pub(crate) fn ends(&self) -> Option<Micros> {
        if !self.queue.is_empty() {
            return None;
        }
        self.stage_ends().map(Moment::micros)
    }

    /// Adds a segment. The set-points up to `told` have been given, what comes later can be planned anew.
    pub(crate) fn segment(&mut self, segment: &Segment, told: Micros) -> Result<(), Full> {
        let from = self.end();
        let (to, leaves) = self.table.aim(from, segment.to);
        // The arm may be elsewhere when the first segment begins.
        let goes_on = self.has_the_arm() || !self.queue.is_empty();
        if self.leads_off || (goes_on && from == to && leaves.is_none()) {
            return Ok(());
        }
        let mut block = Block::segment(from, to, segment.feed, segment.intensity, &self.limits);
        block.leaves = leaves;
        self.push(block, told)?;
        self.leads_off = leaves.is_some();
        Ok(())
    }

    /// Adds a dwell, with the pen down unless the intensity is off.
    pub(crate) fn dwell(
        &mut self,
        duration: Micros,
        intensity: Intensity,
        told: Micros,
    ) -> Result<(), Full> {
        if self.leads_off || duration == Micros::default() {
            return Ok(());
        }
        let at = self.end();
        self.push(Block::dwell(at, duration, intensity), told)
    }

    fn push(&mut self, mut block: Block, told: Micros) -> Result<(), Full> {
        if self.room() == 0 {
            return Err(Full);
        }
        let prior = match (self.queue.back(), &self.stage) {
            (Some(last), _) => Some(last),
            (None, Stage::Moving(running)) => Some(&running.block),
            (None, _) => None,
        };
        block.most_entry = prior.map_or(0, |prior| block.junction_with(prior, &self.limits));
        // There is room, and more places than that.
        let _ = self.queue.push_back(block);
        self.end = block.to;
        let told = Moment::from(told);
        if let Stage::Lingering(until) = &mut self.stage {
            *until = (*until).min(told.max(self.clock));
        }
        self.look_ahead(told);
        Ok(())
    }

    /// Settles the speeds at all junctions.
    fn look_ahead(&mut self, told: Moment) {
        let mut exit = 0;
        for block in self.queue.iter_mut().rev() {
            block.entry = block.most_entry.min(exit + block.energy);
            exit = block.entry;
        }
        let mut reach = 0;
        let mut now = None;
        if let Stage::Moving(running) = &self.stage {
            let (done, speed) = running.profile.at(told.since(running.begun));
            let left = running.block.length.saturating_sub(done);
            let square = u64::from(speed) * u64::from(speed);
            reach = square + self.limits.acceleration.energy(left);
            now = Some((done, speed));
        }
        let mut first = None;
        for block in &mut self.queue {
            block.entry = block.entry.min(reach);
            reach = block.entry + block.energy;
            first.get_or_insert(block.entry);
        }
        let (Stage::Moving(running), Some((done, speed)), Some(exit)) =
            (&mut self.stage, now, first)
        else {
            return;
        };
        // More segments never mean less speed, but for rounding.
        if exit > running.exit {
            let task = Task {
                done,
                length: running.block.length,
                entry: speed,
                nominal: running.block.nominal,
                exit: exit.isqrt() as u32,
            };
            running.profile = Profile::new(task, self.limits.acceleration);
            running.begun = running.begun.max(told);
            running.exit = exit;
        }
    }

    /// The plan has the arm, which stands at `position`, from now on.
    ///
    /// A stroke begins where the host knows the arm, wherever somebody else has left it meanwhile; a
    /// travel begins where the arm is. Off the table, the arm first goes to the table.
    pub(crate) fn begin(&mut self, position: Position, now: Micros) {
        self.clock = now.into();
        self.place = (position.x, position.y);
        self.pen.put(position.z, self.clock);
        let entrance = self.table.closest(self.place);
        let mut start = entrance;
        if let Some(first) = self.queue.front_mut() {
            if first.intensity.is_off() && first.dwell == Micros::default() {
                *first = first.begun_at(entrance, &self.limits);
            }
            start = first.from;
        }
        let mut corner = start;
        for from in [entrance, self.place] {
            let way = Block::segment(from, corner, Feed::DEFAULT, Intensity::OFF, &self.limits);
            if from != corner {
                // Two places are kept for these.
                let _ = self.queue.push_front(way);
            }
            corner = from;
        }
        self.link_the_first();
        self.look_ahead(self.clock);
        // The next call of `advance` begins.
        self.stage = Stage::Lingering(self.clock);
    }

    /// The first blocks are new: the speeds at their junctions are too.
    fn link_the_first(&mut self) {
        let mut prior: Option<Block> = None;
        for block in self.queue.iter_mut().take(APPROACH + 2) {
            block.most_entry = prior.map_or(0, |prior| block.junction_with(&prior, &self.limits));
            prior = Some(*block);
        }
    }

    /// Everything planned is forgotten. The arm stays at `position`, and the pen rises.
    pub(crate) fn halt(&mut self, position: Position, now: Micros) {
        self.forget(position);
        self.clock = now.into();
        self.pen.put(position.z, self.clock);
        self.stage = if position.z == PEN_UP {
            Stage::Idle
        } else {
            self.send_pen(PEN_UP, self.clock)
        };
    }

    /// Everything planned is forgotten, and the arm is somebody else's.
    pub(crate) fn forget(&mut self, position: Position) {
        self.queue.clear();
        self.stage = Stage::Idle;
        self.place = (position.x, position.y);
        self.end = self.place;
        self.leads_off = false;
        self.changed = true;
    }

    /// Lets everything happen that happens until `now`, or until something has to be told.
    pub(crate) fn advance(&mut self, now: Micros) -> Option<PlanEvent> {
        let now = Moment::from(now);
        // Each turn ends a stage; a block has at most three.
        while let Some(ends) = self.stage_ends().filter(|ends| *ends <= now) {
            self.clock = ends;
            match self.stage {
                Stage::Idle => return None,
                Stage::Pen(_) => {
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
                        self.stage = Stage::Dwelling(ends.after(fine(running.block.dwell)));
                        continue;
                    }
                }
                Stage::Dwelling(_) => {}
                Stage::Lingering(_) => {
                    if self.queue.is_empty() {
                        if self.pen.is_up() {
                            return Some(self.over());
                        }
                        self.stage = self.send_pen(PEN_UP, ends);
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
        self.stage = Stage::Idle;
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

    const fn stage_ends(&self) -> Option<Moment> {
        match &self.stage {
            Stage::Idle => None,
            Stage::Pen(ends) | Stage::Dwelling(ends) | Stage::Lingering(ends) => Some(*ends),
            Stage::Moving(running) => Some(running.begun.after(running.profile.duration())),
        }
    }

    /// Sends the pen somewhere.
    fn send_pen(&mut self, to: Coordinate, now: Moment) -> Stage {
        Stage::Pen(now.after(fine(self.pen.send(to, now))))
    }

    /// Begins what is next; a side of the table when that is in the way at once.
    fn next(&mut self, now: Moment) -> Option<Side> {
        while let Some(block) = self.queue.front() {
            let leaves = block.leaves;
            if block.is_nothing() {
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
                (self.pen.is_down(), self.depth.contact)
            };
            if !ready {
                self.stage = self.send_pen(height, now);
                return None;
            }
            let Some(block) = self.queue.pop_front() else {
                break;
            };
            self.changed = true;
            self.stage = Stage::Moving(self.run(block, now));
            return None;
        }
        self.changed = true;
        self.stage = Stage::Lingering(now.after(fine(STREAM_GAP)));
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
            (self.depth.contact, pressure)
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
    /// Of the pen at a speed.
    #[inline]
    fn height(&self, speed: u32) -> i32 {
        self.contact - ((i64::from(self.pressure) * i64::from(speed)) >> 16) as i32
    }
}

/// A coordinate after some distance; never beyond either end.
#[inline]
fn on_the_way(from: Coordinate, to: Coordinate, unit: i32, distance: u32) -> Coordinate {
    const HALF: i64 = 1 << 29;
    let along = ((i64::from(unit) * i64::from(distance) + HALF) >> 30) as i32;
    let whole = to.bits() - from.bits();
    let along = if whole < 0 {
        along.max(whole)
    } else {
        along.min(whole)
    };
    Coordinate::from_bits(from.bits() + along)
}

#[cfg(test)]
mod tests;
