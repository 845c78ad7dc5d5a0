//! Two small slots for firmware and the choice between them, in eight pages of a flash: two for the choice,
//! three for each slot.

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::{ErrorType, MultiwriteNorFlash, NorFlash, ReadNorFlash};
use firmware::board::FirmwareSlots;
use firmware::services::update;
use protocol_core::update::{BootChoice, Slot};
use std::fmt::Debug;
use std::rc::Rc;

/// What manifests call this board.
pub const BOARD: &str = "scripted";
const PAGE: usize = 4096;
const CHOICE: usize = 2 * PAGE;
/// Bytes of a slot.
pub const SLOT: usize = 3 * PAGE;
/// Bytes of all.
pub const SIZE: usize = CHOICE + 2 * SLOT;
/// What a new machine runs.
pub const OLD: &[u8] = b"the old firmware";

/// What is in these pages of a new machine: the old firmware in the first slot, chosen as a bootloader does at
/// its first start.
pub fn of_a_new_machine() -> Vec<u8> {
    let mut cells = vec![0xff; SIZE];
    cells[start_of(Slot::First)..][..OLD.len()].copy_from_slice(OLD);
    cells[..4].copy_from_slice(&[1, 0, 0, 0]);
    cells[24..32].copy_from_slice(&[2, 0, 0, 0, 154, 152, 67, 71]);
    cells
}

/// Where a slot begins.
pub const fn start_of(slot: Slot) -> usize {
    match slot {
        Slot::First => CHOICE,
        Slot::Second => CHOICE + SLOT,
    }
}

/// What is in a slot, of these pages.
pub fn content(cells: &[u8], slot: Slot) -> &[u8] {
    &cells[start_of(slot)..][..SLOT]
}

/// What the bootloader chooses, with the pages at `base`.
pub fn choice<F: NorFlash<Error: Debug>>(flash: F, base: usize) -> BootChoice {
    let mut part = Part::new(flash, base, CHOICE);
    block_on(update::choice(&mut part)).expect("it can be read")
}

/// Part of a flash; whoever reaches beyond it has a fault.
pub struct Part<F> {
    flash: F,
    start: u32,
    size: u32,
}

impl<F> Part<F> {
    fn new(flash: F, start: usize, size: usize) -> Self {
        Self {
            flash,
            start: start as u32,
            size: size as u32,
        }
    }

    /// The boot choice, with the pages at `base`.
    pub fn choice(flash: F, base: usize) -> Self {
        Self::new(flash, base, CHOICE)
    }

    fn place(&self, at: u32, length: usize) -> u32 {
        let end = at as usize + length;
        assert!(
            end <= self.size as usize,
            "{at}..{end} is beyond this part of the flash"
        );
        self.start + at
    }
}

impl<F: ErrorType> ErrorType for Part<F> {
    type Error = F::Error;
}

impl<F: ReadNorFlash> ReadNorFlash for Part<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, at: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        let place = self.place(at, bytes.len());
        self.flash.read(place, bytes).await
    }

    fn capacity(&self) -> usize {
        self.size as usize
    }
}

impl<F: NorFlash> NorFlash for Part<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        let place = self.place(from, (to - from) as usize);
        self.flash.erase(place, place + (to - from)).await
    }

    async fn write(&mut self, at: u32, bytes: &[u8]) -> Result<(), F::Error> {
        let place = self.place(at, bytes.len());
        self.flash.write(place, bytes).await
    }
}

/// What is written here is a word that clears bits, and any flash of a script takes that.
impl<F: NorFlash> MultiwriteNorFlash for Part<F> {}

/// The slots of a machine that runs.
pub struct Slots<F> {
    running: Slot,
    other: Part<F>,
    choice: Part<F>,
    restart: Rc<dyn Fn()>,
}

impl<F: Clone> Slots<F> {
    /// With the pages at `base`; `restart` is called when the machine is to start again.
    pub fn new(flash: &F, base: usize, running: Slot, restart: Rc<dyn Fn()>) -> Self {
        let other = base + start_of(running.other());
        Self {
            running,
            other: Part::new(flash.clone(), other, SLOT),
            choice: Part::choice(flash.clone(), base),
            restart,
        }
    }
}

impl<F: NorFlash> FirmwareSlots for Slots<F> {
    type Slot = Part<F>;
    type Choice = Part<F>;

    fn board(&self) -> &'static str {
        BOARD
    }

    fn running(&self) -> Slot {
        self.running
    }

    fn other(&mut self) -> &mut Part<F> {
        &mut self.other
    }

    fn choice(&mut self) -> &mut Part<F> {
        &mut self.choice
    }

    async fn restart(&mut self) -> ! {
        (self.restart)();
        std::future::pending().await
    }
}
