//! Two slots for firmware and the choice between them, as partitions of a flash.

use crate::board::FirmwareSlots;
use embassy_embedded_hal::flash::partition::Partition;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embedded_storage_async::nor_flash::MultiwriteNorFlash;
use protocol_core::update::Slot;

/// The slots of a flash of the kind `F`.
pub struct PartitionedSlots<F: MultiwriteNorFlash + 'static> {
    board: &'static str,
    running: Slot,
    other: Partition<'static, NoopRawMutex, F>,
    choice: Partition<'static, NoopRawMutex, F>,
    restart: fn() -> !,
}

impl<F: MultiwriteNorFlash + 'static> PartitionedSlots<F> {
    /// Of the board that manifests call `board`, with the slot that runs and both slots' places; `restart` starts
    /// the firmware that is chosen.
    pub fn new(
        board: &'static str,
        running: Slot,
        [first, second]: [Partition<'static, NoopRawMutex, F>; 2],
        choice: Partition<'static, NoopRawMutex, F>,
        restart: fn() -> !,
    ) -> Self {
        Self {
            board,
            running,
            other: match running {
                Slot::First => second,
                Slot::Second => first,
            },
            choice,
            restart,
        }
    }
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
