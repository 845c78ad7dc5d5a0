//! The flash in partitions, and the two slots for firmware. The emulator's driver is the bootloader: it reads
//! the boot choice, and loads the image of the slot.

use super::{flash::Flash, power};
use crate::boards::slots::PartitionedSlots;
use crate::boards::{BOOT_CHOICE, SLOTS};
use core::ops::Range;
use embassy_embedded_hal::flash::partition::Partition;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use protocol_core::update::Slot;
use static_cell::StaticCell;

/// What manifests call this board.
const BOARD: &str = "virt";

/// The flash, shared.
pub type Chip = Mutex<NoopRawMutex, Flash>;
/// A part of it. Addresses count from its beginning.
pub type FlashPartition = Partition<'static, NoopRawMutex, Flash>;

/// Shares the flash.
///
/// # Panics
/// When it is called twice.
pub fn share(flash: Flash) -> &'static Chip {
    static CHIP: StaticCell<Chip> = StaticCell::new();
    CHIP.init(Mutex::new(flash))
}

/// A part of the flash.
pub const fn partition(chip: &'static Chip, place: Range<u32>) -> FlashPartition {
    Partition::new(chip, place.start, place.end - place.start)
}

/// The boot choice.
pub const fn choice(chip: &'static Chip) -> FlashPartition {
    partition(chip, BOOT_CHOICE)
}

/// The slots, where this one runs.
pub fn slots(chip: &'static Chip, running: Slot) -> PartitionedSlots<Flash> {
    let places = SLOTS.map(|place| partition(chip, place));
    PartitionedSlots::new(BOARD, running, places, choice(chip), || {
        power::exit(power::RESTART_STATUS)
    })
}
