//! How fast the junctions of the plan may be passed.

use super::block::Block;
use super::moment::Moment;
use super::profile::{Profile, Task};
use super::stages::Stage;
use super::{APPROACH, Planner};

impl Planner {
    /// Settles the speeds at all junctions.
    pub(super) fn look_ahead(&mut self, told: Moment) {
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
            self.ends = running.ends();
        }
    }

    /// The first blocks are new: the speeds at their junctions are too.
    pub(super) fn link_the_first(&mut self) {
        let mut prior: Option<Block> = None;
        for block in self.queue.iter_mut().take(APPROACH + 2) {
            block.most_entry = prior.map_or(0, |prior| block.junction_with(&prior, &self.limits));
            prior = Some(*block);
        }
    }
}
