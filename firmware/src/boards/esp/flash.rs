//! The flash as `embedded_storage_async::nor_flash::NorFlash`, one value for each partition.
//!
//! The partitions are those of `firmware/partitions.csv`, read from the table that was flashed.
//!
//! Writing and erasing stop everything that runs from flash, interrupts included: about 45 ms for a
//! sector of 4 kB (data sheets of the usual flash chips; 400 ms at worst). Write only while the
//! arm rests. The adapter yields between sectors, so that the network is served in between.

use embassy_embedded_hal::adapter::{BlockingAsync, YieldingAsync};
use embassy_embedded_hal::flash::partition::Partition;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use esp_bootloader_esp_idf::partitions::{PARTITION_TABLE_MAX_LEN, read_partition_table};
use esp_hal::peripherals::FLASH;
use esp_storage::FlashStorage;
use static_cell::StaticCell;

/// The flash chip.
pub type Chip = YieldingAsync<BlockingAsync<FlashStorage<'static>>>;

/// A partition. Addresses count from its beginning; clones share the chip.
pub type FlashPartition = Partition<'static, NoopRawMutex, Chip>;

/// Opens the flash and finds partitions by their names; `None` where the table has no such one. Beside
/// them, the address of the firmware that runs, if it is known.
pub(super) fn open<const N: usize>(
    flash: FLASH<'static>,
    names: [&str; N],
) -> ([Option<FlashPartition>; N], Option<u32>) {
    static CHIP: StaticCell<Mutex<NoopRawMutex, Chip>> = StaticCell::new();

    let mut flash = FlashStorage::new(flash);
    let (places, running) = find(&mut flash, names);
    let chip = CHIP.init(Mutex::new(YieldingAsync::new(BlockingAsync::new(flash))));
    let partition = |at: Place| Partition::new(chip, at.offset, at.size);
    (places.map(|place| place.map(partition)), running)
}

#[derive(Clone, Copy)]
struct Place {
    offset: u32,
    size: u32,
}

fn find<const N: usize>(
    flash: &mut FlashStorage<'static>,
    names: [&str; N],
) -> ([Option<Place>; N], Option<u32>) {
    let mut buffer = [0; PARTITION_TABLE_MAX_LEN];
    match read_partition_table(flash, &mut buffer) {
        Ok(table) => {
            let places = names.map(|name| {
                table
                    .iter()
                    .find(|entry| entry.label_as_str() == name)
                    .map(|entry| Place {
                        offset: entry.offset(),
                        size: entry.len(),
                    })
            });
            let running = table.booted_partition().ok().flatten();
            (places, running.map(|entry| entry.offset()))
        }
        Err(error) => {
            defmt::error!("partition table: {}", error);
            ([None; N], None)
        }
    }
}
