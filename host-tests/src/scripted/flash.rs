//! The memory: a NOR flash of 4-byte words and 4 kB pages, whose bits only an erase sets, and which outlives
//! the power.

use super::journal::note;
use super::power::Power;
use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use std::cell::RefCell;
use std::future::pending;
use std::rc::Rc;

/// Bytes of the flash, all for settings, as many as the boards have for them.
pub const SIZE: u32 = 8 * 4096;

/// The cells, with or without power.
#[derive(Clone, Debug)]
pub struct Cells {
    bytes: Vec<u8>,
    /// It takes nothing any more.
    worn: bool,
    /// The power fails when this many bytes more are written.
    fails_after: Option<u32>,
}

impl Default for Cells {
    fn default() -> Self {
        Self {
            bytes: vec![0xff; SIZE as usize],
            worn: false,
            fails_after: None,
        }
    }
}

impl Cells {
    /// Noise, the same each time.
    pub fn fill_with_garbage(&mut self) {
        let mut noise: u32 = 1;
        for byte in &mut self.bytes {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *byte = (noise >> 24) as u8;
        }
    }

    /// From now on it refuses to be written and erased, or takes it again.
    pub const fn wear_out(&mut self, worn: bool) {
        self.worn = worn;
    }

    /// The power fails with the next byte but `bytes`; an erase counts as one.
    pub const fn fail_after(&mut self, bytes: u32) {
        self.fails_after = Some(bytes);
    }

    /// Power is back: it fails by itself only if that is said again.
    pub const fn stop_failing(&mut self) {
        self.fails_after = None;
    }

    /// Counts a byte, and says whether the power fails before it.
    fn fails_now(&mut self) -> bool {
        match &mut self.fails_after {
            Some(0) => true,
            Some(left) => {
                *left -= 1;
                false
            }
            None => false,
        }
    }
}

/// What the flash does not do.
#[derive(Clone, Copy, Debug)]
pub struct Refused(NorFlashErrorKind);

impl NorFlashError for Refused {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

/// The flash of the board.
pub struct Flash {
    /// What it holds.
    pub cells: Rc<RefCell<Cells>>,
    /// What fails in the middle of a write.
    pub power: Power,
    /// Whether a move is under way, when nothing must be written: that would stall a chip.
    pub moving: Rc<dyn Fn() -> bool>,
}

impl Flash {
    async fn change(&mut self, begin: u32, length: u32, new: impl Fn(usize, &mut u8)) {
        if (self.moving)() {
            self.power
                .offend("the memory is written while a move is under way");
        }
        let mut fails = false;
        {
            let mut cells = self.cells.borrow_mut();
            for index in 0..length as usize {
                fails = !self.power.is_on() || cells.fails_now();
                if fails {
                    break;
                }
                new(index, &mut cells.bytes[begin as usize + index]);
            }
        }
        if fails {
            if self.power.is_on() {
                note(format_args!(
                    "    memory: power fails while {begin:#x} is written"
                ));
                self.power.switch(false);
            }
            // Nothing comes after this.
            pending::<()>().await;
        }
    }

    fn worn(&self) -> Result<(), Refused> {
        if self.cells.borrow().worn {
            note("    memory: refuses");
            return Err(Refused(NorFlashErrorKind::Other));
        }
        Ok(())
    }
}

/// Whole words or pages, inside the flash.
fn check(begin: u32, length: u32, unit: u32) -> Result<(), Refused> {
    if !begin.is_multiple_of(unit) || !length.is_multiple_of(unit) {
        return Err(Refused(NorFlashErrorKind::NotAligned));
    }
    match begin.checked_add(length) {
        Some(..=SIZE) => Ok(()),
        _ => Err(Refused(NorFlashErrorKind::OutOfBounds)),
    }
}

impl ErrorType for Flash {
    type Error = Refused;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refused> {
        check(offset, bytes.len() as u32, Self::READ_SIZE as u32)?;
        let begin = offset as usize;
        bytes.copy_from_slice(&self.cells.borrow().bytes[begin..begin + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE as usize
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 4096;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Refused> {
        let length = to.checked_sub(from);
        let length = length.ok_or(Refused(NorFlashErrorKind::OutOfBounds))?;
        check(from, length, Self::ERASE_SIZE as u32)?;
        self.worn()?;
        for page in (from..to).step_by(Self::ERASE_SIZE) {
            // An erase that is cut short leaves the end of its page as it was.
            let fails = self.cells.borrow_mut().fails_now();
            let length = Self::ERASE_SIZE as u32;
            let whole = std::mem::take(&mut self.cells.borrow_mut().fails_after);
            let done = if fails { length / 2 } else { length };
            self.change(page, done, |_, byte| *byte = 0xff).await;
            self.cells.borrow_mut().fails_after = whole;
            if fails {
                self.change(page, 1, |_, _| {}).await;
            }
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        check(offset, bytes.len() as u32, Self::WRITE_SIZE as u32)?;
        self.worn()?;
        self.change(offset, bytes.len() as u32, |index, byte| {
            *byte &= bytes[index]
        })
        .await;
        Ok(())
    }
}
