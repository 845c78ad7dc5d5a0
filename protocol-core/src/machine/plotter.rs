//! The arm as a plotter: a plan of segments in millimetres on the table, and stopping.

use super::{Errand, Machine, PlanEvent, Report, Turn};
use crate::machine::Client;
use crate::motion::{
    Assist, Feed, Intensity, Micros, Outputs, Position, Segment, Side, TablePoint,
};

/// Why the machine is stopped (`spec LasaurGrbl, Return Format`; `reference/lasaurgrbl.md`, section 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The supply is off.
    Power,
    /// The plan leads over a side of the table.
    Limit(Side),
    /// Somebody asked for it.
    Requested,
    /// The serial port's buffer had no room for a byte.
    ReceiveOverflow,
    /// A line was longer than lines may be.
    LineOverflow,
    /// A line did not arrive as it was sent.
    Transmission,
    /// Anything else, by number.
    Other(u8),
}

/// Why something was not planned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotPlanned {
    /// [`PLAN_SEGMENTS`](crate::motion::PLAN_SEGMENTS) wait already: try again when
    /// [`Machine::plan_has_changed`].
    Full,
    /// The machine is stopped.
    Stopped,
}

impl Machine {
    /// Adds a segment to the plan.
    ///
    /// The way begins where the last one ends. A segment to where that is adds nothing. Where the way
    /// leaves the table, the arm goes to the edge and the machine stops there with
    /// [`StopReason::Limit`]; what is added in the meantime is forgotten with the rest of the plan.
    ///
    /// # Errors
    /// When there is no room, or the machine is stopped; then nothing has changed.
    pub fn plan(&mut self, segment: &Segment) -> Result<(), NotPlanned> {
        self.add(|machine| machine.plan.segment(segment, machine.frame))
    }

    /// Adds a dwell to the plan (G4): the arm stays where it is then, with the pen down, lightly, unless the
    /// intensity is off. At most [`MOST_DWELL`](crate::motion::MOST_DWELL).
    ///
    /// # Errors
    /// As for [`Self::plan`].
    pub fn dwell(&mut self, duration: Micros, intensity: Intensity) -> Result<(), NotPlanned> {
        self.add(|machine| machine.plan.dwell(duration, intensity, machine.frame))
    }

    /// Adds the way to physical home, (0, 0) of the table, with the pen up; it is reached when
    /// [`Self::plan_is_done`].
    ///
    /// # Errors
    /// As for [`Self::plan`].
    pub fn home(&mut self) -> Result<(), NotPlanned> {
        self.plan(&Segment {
            to: TablePoint::HOME,
            feed: Feed::DEFAULT,
            intensity: Intensity::OFF,
        })
    }

    /// Switches an output (M80 to M85) when everything planned so far has been done; at once where that
    /// is so. A stop forgets what has not been switched, and leaves what has.
    ///
    /// # Errors
    /// [`NotPlanned::Stopped`]; then nothing has changed.
    pub fn switch(&mut self, assist: Assist, on: bool) -> Result<(), NotPlanned> {
        if self.stopped.is_some() {
            return Err(NotPlanned::Stopped);
        }
        self.plan.switch(assist, on);
        Ok(())
    }

    /// Whether air, aux1 and aux2 are on.
    pub const fn outputs(&self) -> Outputs {
        self.plan.outputs()
    }

    /// How many more segments fit into the plan.
    pub fn plan_room(&self) -> usize {
        self.plan.room()
    }

    /// Whether everything planned has been done, or forgotten in a stop.
    pub fn plan_is_done(&self) -> bool {
        self.plan.is_done()
    }

    /// Whether there is more room in the plan than before, or nothing left to do, since the last call.
    pub const fn plan_has_changed(&mut self) -> bool {
        self.plan.has_changed()
    }

    /// Where the nib is now, by the table's axes from physical home; it may be off the table, where
    /// others have moved it.
    pub fn table_position(&self) -> TablePoint {
        let Position { x, y, .. } = self.position();
        self.data.plan.table.to_table(x, y)
    }

    /// Where the last thing planned ends, on the table: where the host knows the arm, and where the next
    /// way begins. After a stop it is where the arm was stopped.
    pub fn planned_position(&self) -> TablePoint {
        let (x, y) = self.plan.end();
        self.data.plan.table.to_table(x, y)
    }

    /// Stops the arm, whoever moves it: it stays where it is, the pen rises in place, the plan is
    /// forgotten, and moves that wait are answered with [`Report::Stopped`]. The last reason counts.
    pub fn stop(&mut self, reason: StopReason) {
        self.stopped = Some(reason);
        self.halt(self.position(), self.frame);
    }

    /// Ends a stop.
    pub const fn resume(&mut self) {
        self.stopped = None;
        self.limit = None;
    }

    /// Why the machine is stopped.
    pub const fn stopped(&self) -> Option<StopReason> {
        self.stopped
    }

    /// The side of the table at which the plan was stopped, until [`Self::resume`], whatever
    /// other reason to stop came after it.
    pub const fn limit(&self) -> Option<Side> {
        self.limit
    }

    fn add<E>(&mut self, add: impl FnOnce(&mut Self) -> Result<(), E>) -> Result<(), NotPlanned> {
        if self.stopped.is_some() {
            return Err(NotPlanned::Stopped);
        }
        add(self).map_err(|_| NotPlanned::Full)?;
        let comes = !self.plan.is_done() && !self.plan.has_the_arm();
        if comes && !self.waiting.iter().any(|turn| matches!(turn, Turn::Plan)) {
            // There is one place for the plan.
            let _ = self.waiting.push_back(Turn::Plan);
        }
        self.advance(self.clock);
        Ok(())
    }

    pub(super) fn begin_plan(&mut self) {
        self.last_mover = Some(Client::SERIAL);
        self.lift_at = None;
        self.short = false;
        self.plan.begin(self.position, self.clock);
    }

    pub(super) fn plan_came_to(&mut self, event: PlanEvent) {
        let (position, since) = self.plan.rests_at();
        match event {
            PlanEvent::Over => {
                self.position = position;
                self.clock = since;
            }
            PlanEvent::Limit(side) => {
                self.stopped = Some(StopReason::Limit(side));
                self.limit = Some(side);
                self.halt(position, since);
            }
        }
    }

    fn halt(&mut self, position: Position, now: Micros) {
        self.active = None;
        self.position = position;
        self.short = false;
        self.clock = now;
        self.plan.halt(position, now);
        let reports = &mut self.reports;
        self.waiting.retain(|turn| match turn {
            Turn::Errand(_, Errand::Rest) => true,
            Turn::Errand(client, _) => {
                // A client has one errand at a time, so one report at a time as well.
                let _ = reports.push_back((*client, Report::Stopped));
                false
            }
            Turn::Plan => false,
        });
    }
}

#[cfg(test)]
mod tests;
