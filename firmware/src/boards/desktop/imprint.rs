//! Settings as the bytes of a flash, for arms that are to have settings when they first start.

use super::flash::{FileFlash, SIZE};
use crate::services::storage::{Memory, MemoryHealth};
use embassy_embedded_hal::adapter::BlockingAsync;
use embassy_futures::block_on;
use embedded_storage::nor_flash::NorFlash;
use protocol_core::settings::Settings;

/// What a flash of [`SIZE`] bytes holds when an arm has stored settings in it. `None` if they do not come
/// back from there.
pub fn imprint(settings: &Settings) -> Option<Vec<u8>> {
    let mut flash = FileFlash::in_memory(SIZE);
    block_on(memory(&mut flash)?.store(settings)).ok()?;
    let bytes = flash.contents().to_vec();
    let (found, health) = recall(bytes.clone())?;
    (found == *settings && health == MemoryHealth::Sound).then_some(bytes)
}

/// The settings that an arm finds in a flash of these bytes; `None` if they are not [`SIZE`].
pub fn recall(bytes: Vec<u8>) -> Option<(Settings, MemoryHealth)> {
    let mut flash = FileFlash::holding(bytes)?;
    Some(block_on(memory(&mut flash)?.load()))
}

fn memory<F: NorFlash>(flash: F) -> Option<Memory<BlockingAsync<F>>> {
    Memory::new(BlockingAsync::new(flash), 0..SIZE)
}
