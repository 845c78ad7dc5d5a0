//! What starts: the bootloader, the watchdog, and what has been built.

use super::journal::note;
use super::release::Release;
use super::{Board, firmware_tasks, flash, slots};
use embassy_time::{Duration, Instant};
use protocol_core::update::Slot;

/// The watchdog restarts a firmware that hangs for so long, as on the chips.
pub const WATCHDOG: Duration = Duration::from_secs(5);

impl Board {
    /// The firmware or the watchdog has the machine start again; power stays.
    pub(super) fn start_again(&mut self, reason: &'static str) {
        note(format_args!("    the machine starts again: {reason}"));
        self.restarts += 1;
        // What ends does so as without power: nothing is sent any more.
        let power = self.power.clone();
        power.interrupt(|| self.stop());
        self.boot(reason);
    }

    /// The bootloader: starts the firmware that is chosen.
    pub(super) fn boot(&mut self, reason: &'static str) {
        let choice = slots::choice(self.at_rest(), flash::SIZE as usize);
        let slot = choice.slot();
        self.running = self.firmware_in(slot);
        if self.running.is_none() {
            self.power
                .offend("what the bootloader starts is no whole firmware");
        }
        firmware_tasks::start(self, reason, slot);
    }

    /// What a slot holds, if that is a whole firmware.
    fn firmware_in(&self, slot: Slot) -> Option<String> {
        let cells = self.cells.borrow();
        let content = slots::content(cells.firmware(), slot);
        let built = self.built.iter().rev();
        let mut whole = built.filter(|(_, image)| content.starts_with(image));
        whole.next().map(|(name, _)| name.clone())
    }

    /// The firmware that runs.
    pub fn running(&self) -> Option<&str> {
        let running = self.running.as_deref();
        running.filter(|_| self.power.is_on())
    }

    /// A release on the server, from now on.
    pub fn offer(&mut self, release: &Release) {
        let built = (release.version.clone(), release.image.clone());
        self.built.push(built);
        release.put_on(&self.server);
    }

    /// The firmware does nothing any more, until the watchdog bites.
    pub fn hang(&mut self) {
        note("    the firmware hangs");
        self.hangs_until = Some(Instant::now() + WATCHDOG);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_futures::block_on;
    use embedded_storage_async::nor_flash::NorFlash;

    #[test]
    fn half_a_firmware_is_told() {
        let mut board = Board::new();
        board.power_on("a test");
        assert_eq!(board.running(), Some("the old firmware"));
        let first = flash::SIZE + slots::start_of(Slot::First) as u32;
        block_on(board.at_rest().erase(first, first + 4096)).unwrap();
        board.power_on("a test");
        let offence = board.power.offence().unwrap();
        assert!(offence.contains("no whole firmware"), "{offence}");
    }

    #[test]
    fn the_watchdog_bites_after_five_seconds_and_no_alarm_before() {
        let mut board = Board::new();
        board.power_on("a test");
        board.settle();
        board.hang();
        for (at, restarts) in [(1, 0), (4, 0), (5, 1)] {
            board.step(Instant::from_secs(at));
            board.settle();
            assert_eq!(board.restarts, restarts, "{at}");
        }
        assert_eq!(board.power.offence(), None);
    }
}
