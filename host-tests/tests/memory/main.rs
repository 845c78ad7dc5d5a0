//! Settings and drawings in flash: power cuts, garbage, worn pages, wear, and the form of earlier firmware.
//!
//! `QUILL_HISTORIES=5000 cargo test --release -p host-tests --test memory -- --nocapture` tries as many
//! histories, and takes its time; the figures are printed.

mod chip;
mod damage;
mod dice;
mod drawings;
mod drawings_wear;
mod earlier;
mod owner;
mod power_cuts;
mod wear;

use chip::Chip;
use embassy_futures::block_on;
use firmware::services::storage::{Memory, MemoryHealth, StoreError};
use protocol_core::settings::Settings;

/// Starts a machine; `None` if the power fails before it has its settings.
fn boot<const PAGE: usize>(
    chip: &Chip<PAGE>,
) -> Option<(Memory<Chip<PAGE>>, Settings, MemoryHealth)> {
    let whole = 0..Chip::<PAGE>::SIZE as u32;
    let mut memory = Memory::new(chip.clone(), whole).expect("eight pages are enough");
    let (settings, health) = block_on(memory.load());
    chip.is_powered().then_some((memory, settings, health))
}

fn store<const PAGE: usize>(
    memory: &mut Memory<Chip<PAGE>>,
    settings: &Settings,
) -> Result<(), StoreError> {
    block_on(memory.store(settings))
}

/// How many histories to try, where somebody wants to know it exactly.
fn long_run() -> Option<u64> {
    let many = std::env::var("QUILL_HISTORIES").ok()?;
    Some(many.parse().expect("QUILL_HISTORIES is a number"))
}
