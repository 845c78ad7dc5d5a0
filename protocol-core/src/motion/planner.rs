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

mod assist;
mod block;
mod feed;
mod look_ahead;
mod moment;
mod pen;
mod profile;
mod stages;

pub use assist::{Assist, Outputs};
pub use block::{MOST_DWELL, Segment};
pub use feed::{Acceleration, Feed, LEAST_FEED, MOST_FEED};
pub use pen::{Intensity, PenDepth};
pub(crate) use stages::PlanEvent;

use super::table::{Millimetres, Table, UNITS_PER_MILLIMETRE};
use super::units::{HOME, Micros, PEN_UP, Position};
use crate::arm::PenLift;
use assist::Switches;
use block::{Block, Limits, Place};
use heapless::Deque;
use moment::Moment;
use pen::Pen;
use stages::Stage;

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
    /// Speed of the pen's servo, in degrees a second; never above that of all servos.
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

/// The plan, and its motion while it has the arm.
///
/// In the order written, for the same reason as [`Machine`](crate::machine::Machine).
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Planner {
    table: Table,
    depth: PenDepth,
    limits: Limits,
    /// When the stage under way ends; 0 when there is none.
    ends: Moment,
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
    outputs: Outputs,
    /// What is switched when the segment under way, and its dwell, have been done.
    then: Switches,
    changed: bool,
    queue: Deque<Block, { PLAN_SEGMENTS + APPROACH }>,
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
            ends: Moment::default(),
            stage: Stage::Idle,
            pen: Pen::new(lift, data.pen_speed.min(degrees_per_second)),
            place: (HOME.x, HOME.y),
            end: (HOME.x, HOME.y),
            clock: Moment::default(),
            leads_off: false,
            outputs: Outputs::default(),
            then: Switches::default(),
            changed: false,
        }
    }

    /// Whether air, aux1 and aux2 are on.
    pub(crate) const fn outputs(&self) -> Outputs {
        self.outputs
    }

    /// Switches an output when everything planned so far has been done.
    pub(crate) fn switch(&mut self, assist: Assist, on: bool) {
        match (self.queue.back_mut(), &self.stage) {
            (Some(last), _) => last.then.set(assist, on),
            (None, Stage::Moving(_) | Stage::Dwelling) => self.then.set(assist, on),
            (None, Stage::Idle | Stage::Pen | Stage::Lingering) => {
                self.then.set(assist, on);
                self.then.switch(&mut self.outputs);
            }
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
        self.queue.is_empty() && matches!(self.stage, Stage::Idle | Stage::Lingering | Stage::Pen)
    }

    /// Whether a segment has begun or been forgotten, or everything is done, since the last call.
    pub(crate) const fn has_changed(&mut self) -> bool {
        core::mem::replace(&mut self.changed, false)
    }

    /// When the last motion that is planned ends.
    pub(crate) fn ends(&self) -> Option<Micros> {
        let last = self.has_the_arm() && self.queue.is_empty();
        last.then(|| self.ends.micros())
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
        if matches!(self.stage, Stage::Lingering) {
            self.ends = self.ends.min(told.max(self.clock));
        }
        self.look_ahead(told);
        Ok(())
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
        self.enter(Stage::Lingering, self.clock);
    }

    /// Everything planned is forgotten. The arm stays at `position`, and the pen rises.
    pub(crate) fn halt(&mut self, position: Position, now: Micros) {
        self.forget(position);
        self.clock = now.into();
        self.pen.put(position.z, self.clock);
        if position.z != PEN_UP {
            self.send_pen(PEN_UP, self.clock);
        }
    }

    /// Everything planned is forgotten, and the arm is somebody else's.
    pub(crate) fn forget(&mut self, position: Position) {
        self.queue.clear();
        self.enter(Stage::Idle, Moment::default());
        self.place = (position.x, position.y);
        self.end = self.place;
        self.leads_off = false;
        self.then = Switches::default();
        self.changed = true;
    }
}
