//! The memory: a NOR flash of 4-byte words and 4 kB pages, whose bits only an erase sets, and which outlives
//! the power.

use super::journal::note;
use super::power::Power;
use super::slots;
use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use std::cell::RefCell;
use std::future::pending;
use std::rc::Rc;

/// Bytes for settings, as many as the boards have for them.
pub const SETTINGS: u32 = 8 * 4096;
/// Bytes for settings and then drawings, as many as the boards have for those.
pub const SIZE: u32 = SETTINGS + 360 * 4096;
/// Bytes for settings, drawings, and then firmware and the choice of it.
const WHOLE: u32 = SIZE + slots::SIZE as u32;

/// How the memory answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wear {
    /// It does what it says.
    #[default]
    Well,
    /// It takes nothing any more.
    WornOut,
    /// It takes nothing any more, and says it does.
    Silent,
}

/// The cells, with or without power.
#[derive(Clone, Debug)]
pub struct Cells {
    bytes: Vec<u8>,
    wear: Wear,
    /// The power fails when this many bytes more are written.
    fails_after: Option<u32>,
}

impl Default for Cells {
    fn default() -> Self {
        let mut bytes = vec![0xff; SIZE as usize];
        bytes.extend(slots::of_a_new_machine());
        Self {
            bytes,
            wear: Wear::Well,
            fails_after: None,
        }
    }
}

impl Cells {
    /// What is there for firmware and the choice of it.
    pub fn firmware(&self) -> &[u8] {
        &self.bytes[SIZE as usize..]
    }

    /// No settings and no drawings.
    pub fn erase(&mut self) {
        self.bytes[..SIZE as usize].fill(0xff);
        self.wear = Wear::Well;
        self.fails_after = None;
    }

    /// Noise instead of settings and drawings, the same each time.
    pub fn fill_with_garbage(&mut self) {
        let mut noise: u32 = 1;
        for byte in &mut self.bytes[..SIZE as usize] {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *byte = (noise >> 24) as u8;
        }
    }

    /// How it answers from now on.
    pub const fn wear(&mut self, wear: Wear) {
        self.wear = wear;
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
#[derive(Clone)]
pub struct Flash {
    /// What it holds.
    pub cells: Rc<RefCell<Cells>>,
    /// What fails in the middle of a write.
    pub power: Power,
    /// Whether a move is under way, when nothing must be written: that would stall a chip.
    pub moving: Rc<dyn Fn() -> bool>,
}

impl Flash {
    /// Looks whether it may be changed, and says whether it will be.
    async fn begin(&mut self) -> Result<bool, Refused> {
        if !self.power.is_on() {
            pending::<()>().await;
        }
        if (self.moving)() {
            self.power
                .offend("the memory is written while a move is under way");
        }
        let wear = self.cells.borrow().wear;
        match wear {
            Wear::Well => Ok(true),
            Wear::Silent => Ok(false),
            Wear::WornOut => {
                note("    memory: refuses");
                Err(Refused(NorFlashErrorKind::Other))
            }
        }
    }

    /// The power fails: nothing comes after this.
    async fn fail(&self, at: u32) -> ! {
        note(format_args!(
            "    memory: power fails while {at:#x} is written"
        ));
        self.power.switch(false);
        pending().await
    }
}

/// Whole words or pages, inside the flash.
fn check(begin: u32, length: u32, unit: u32) -> Result<(), Refused> {
    if !begin.is_multiple_of(unit) || !length.is_multiple_of(unit) {
        return Err(Refused(NorFlashErrorKind::NotAligned));
    }
    match begin.checked_add(length) {
        Some(..=WHOLE) => Ok(()),
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
        WHOLE as usize
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 4096;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Refused> {
        let length = to.checked_sub(from);
        let length = length.ok_or(Refused(NorFlashErrorKind::OutOfBounds))?;
        check(from, length, Self::ERASE_SIZE as u32)?;
        if !self.begin().await? {
            return Ok(());
        }
        for page in (from..to).step_by(Self::ERASE_SIZE) {
            // An erase that is cut short leaves the end of its page as it was.
            let fails = self.cells.borrow_mut().fails_now();
            let parts = if fails { 2 } else { 1 };
            let begin = page as usize;
            self.cells.borrow_mut().bytes[begin..begin + Self::ERASE_SIZE / parts].fill(0xff);
            if fails {
                self.fail(page).await;
            }
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        check(offset, bytes.len() as u32, Self::WRITE_SIZE as u32)?;
        if !self.begin().await? {
            return Ok(());
        }
        for (at, byte) in (offset..).zip(bytes) {
            if self.cells.borrow_mut().fails_now() {
                self.fail(at).await;
            }
            self.cells.borrow_mut().bytes[at as usize] &= byte;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_futures::{block_on, poll_once};

    fn flash(moving: bool) -> Flash {
        Flash {
            cells: Rc::default(),
            power: Power::present(),
            moving: Rc::new(move || moving),
        }
    }

    fn first<const N: usize>(flash: &Flash) -> [u8; N] {
        let mut bytes = [0; N];
        bytes.copy_from_slice(&flash.cells.borrow().bytes[..N]);
        bytes
    }

    #[test]
    fn writing_clears_bits_and_erasing_sets_them() {
        let mut flash = flash(false);
        block_on(flash.write(0, &[0x0f; 4])).unwrap();
        block_on(flash.write(0, &[0x3c; 4])).unwrap();
        assert_eq!(first(&flash), [0x0c, 0x0c, 0x0c, 0x0c, 0xff]);
        block_on(flash.erase(0, 4096)).unwrap();
        assert_eq!(first(&flash), [0xff; 4]);
        assert_eq!(flash.power.offence(), None);
    }

    #[test]
    fn it_is_made_of_words_and_pages() {
        let mut flash = flash(false);
        for refused in [
            block_on(flash.write(2, &[0; 4])),
            block_on(flash.write(0, &[0; 3])),
            block_on(flash.write(WHOLE, &[0; 4])),
            block_on(flash.erase(0, 4)),
            block_on(flash.erase(4096, 0)),
            block_on(flash.erase(0, WHOLE + 4096)),
            block_on(flash.read(WHOLE - 1, &mut [0; 2])),
        ] {
            assert!(refused.is_err());
        }
        assert_eq!(first(&flash), [0xff; 4]);
    }

    #[test]
    fn power_fails_after_so_many_bytes() {
        for bytes in 0..8 {
            let mut flash = flash(false);
            flash.cells.borrow_mut().fail_after(bytes);
            assert!(poll_once(flash.write(0, &[0; 8])).is_pending());
            assert!(!flash.power.is_on());
            let mut expected = [0xff; 8];
            expected[..bytes as usize].fill(0);
            assert_eq!(first(&flash), expected);
        }
        let mut flash = flash(false);
        flash.cells.borrow_mut().fail_after(8);
        assert!(poll_once(flash.write(0, &[0; 8])).is_ready());
        assert!(flash.power.is_on());
    }

    #[test]
    fn an_erase_that_is_cut_short_is_half_an_erase() {
        let mut flash = flash(false);
        flash.cells.borrow_mut().fill_with_garbage();
        let before = flash.cells.borrow().bytes.clone();
        flash.cells.borrow_mut().fail_after(1);
        assert!(poll_once(flash.erase(0, 8192)).is_pending());
        assert!(!flash.power.is_on());
        let cells = flash.cells.borrow();
        assert!(cells.bytes[..6144].iter().all(|byte| *byte == 0xff));
        assert_eq!(cells.bytes[6144..], before[6144..]);
    }

    #[test]
    fn worn_out_it_is_read_only() {
        let mut flash = flash(false);
        flash.cells.borrow_mut().wear(Wear::Silent);
        block_on(flash.write(0, &[0; 4])).unwrap();
        assert_eq!(first(&flash), [0xff; 4]);
        flash.cells.borrow_mut().wear(Wear::WornOut);
        assert!(block_on(flash.write(0, &[0; 4])).is_err());
        assert!(block_on(flash.erase(0, 4096)).is_err());
        assert!(block_on(flash.read(0, &mut [0; 4])).is_ok());
    }

    #[test]
    fn it_must_not_be_written_in_motion() {
        let mut flash = flash(true);
        block_on(flash.read(0, &mut [0; 4])).unwrap();
        assert_eq!(flash.power.offence(), None);
        block_on(flash.write(0, &[0; 4])).unwrap();
        assert!(flash.power.offence().is_some());
    }
}
