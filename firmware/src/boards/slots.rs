//! Two slots for firmware and the choice between them, as partitions of a flash.

use crate::board::FirmwareSlots;
use embassy_embedded_hal::flash::partition::Partition;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embedded_storage_async::nor_flash::MultiwriteNorFlash;
use protocol_core::update::Slot;

/// The slots of a flash of the kind `F`.
pub struct PartitionedSlots<F: MultiwriteNorFlash + 'static> {
    /// What manifests call this board.
    pub board: &'static str,
    /// The slot that runs.
    pub running: Slot,
    /// The other one.
    pub other: Partition<'static, NoopRawMutex, F>,
    /// The boot choice.
    pub choice: Partition<'static, NoopRawMutex, F>,
    /// Starts the firmware that is chosen.
    pub restart: fn() -> !,
}

impl<F: MultiwriteNorFlash + 'static> FirmwareSlots for PartitionedSlots<F> {
    type Slot = Partition<'static, NoopRawMutex, F>;
    type Choice = Partition<'static, NoopRawMutex, F>;

    fn board(&self) -> &'static str {
        self.board
    }

    fn running(&self) -> Slot {
        self.running
    }

    fn other(&mut self) -> &mut Self::Slot {
        &mut self.other
    }

    fn choice(&mut self) -> &mut Self::Choice {
        &mut self.choice
    }

    async fn restart(&mut self) -> ! {
        (self.restart)()
    }
}
