//! A model of a NOR flash chip whose power can fail at any byte, and whose pages can wear out.
//!
//! Words of four bytes are written, and writing clears bits; one that would set a bit is an error. An
//! erase sets all bits of whole pages. What is being written or erased when the power fails is torn.

use crate::dice::Dice;
use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use std::cell::RefCell;
use std::rc::Rc;

/// Pages of the chip, all for settings.
pub const PAGES: usize = 8;
const WORD: usize = 4;
/// Moments within the erase of a page at which the power can fail, its end included.
const ERASE_STEPS: usize = 16;

/// What is left of an erase that the power did not let finish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tear {
    /// The first part of the page is erased, the rest is as it was.
    Prefix,
    /// Each byte is as it was, erased, all zero, or anything.
    Mixture,
}

/// How a page that is worn out answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wear {
    /// With errors.
    Honest,
    /// As if all were well.
    Silent,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChipError {
    NoPower,
    NotErased,
    WornOut,
    OutOfRange,
}

impl NorFlashError for ChipError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::OutOfRange => NorFlashErrorKind::OutOfBounds,
            _ => NorFlashErrorKind::Other,
        }
    }
}

/// Everything there is to a chip.
#[derive(Clone)]
pub struct State {
    pub cells: Vec<u8>,
    pub erases: [u32; PAGES],
    /// Bytes written and steps of erasing so far.
    pub work: u64,
    worn: [Option<Wear>; PAGES],
    /// As much work again, and the power fails.
    budget: Option<u64>,
    powered: bool,
    tear: Tear,
    dice: Dice,
}

/// A chip; clones are the same chip.
#[derive(Clone)]
pub struct Chip<const PAGE: usize>(Rc<RefCell<State>>);

impl<const PAGE: usize> Chip<PAGE> {
    pub const SIZE: usize = PAGES * PAGE;

    /// As it comes from the factory.
    pub fn erased() -> Self {
        Self::with(vec![0xff; Self::SIZE])
    }

    pub fn with(cells: Vec<u8>) -> Self {
        assert_eq!(cells.len(), Self::SIZE);
        Self(Rc::new(RefCell::new(State {
            cells,
            erases: [0; PAGES],
            work: 0,
            worn: [None; PAGES],
            budget: None,
            powered: true,
            tear: Tear::Prefix,
            dice: Dice::new(0),
        })))
    }

    pub fn state(&self) -> State {
        self.0.borrow().clone()
    }

    /// Makes it again what it was.
    pub fn restore(&self, state: &State) {
        self.0.borrow_mut().clone_from(state);
    }

    pub fn work(&self) -> u64 {
        self.0.borrow().work
    }

    /// The power fails after so many bytes written and steps of erasing.
    pub fn fail_after(&self, work: u64, tear: Tear) {
        let mut state = self.0.borrow_mut();
        state.budget = Some(work);
        state.tear = tear;
        state.dice = Dice::new(work);
    }

    /// Power, for good.
    pub fn power_on(&self) {
        let mut state = self.0.borrow_mut();
        state.budget = None;
        state.powered = true;
    }

    pub fn is_powered(&self) -> bool {
        self.0.borrow().powered
    }

    pub fn wear_out(&self, page: usize, wear: Wear) {
        self.0.borrow_mut().worn[page] = Some(wear);
    }

    pub fn set_byte(&self, at: usize, byte: u8) {
        self.0.borrow_mut().cells[at] = byte;
    }

    fn check(at: u32, length: usize, unit: usize) -> Result<usize, ChipError> {
        let at = at as usize;
        let fits =
            at + length <= Self::SIZE && at.is_multiple_of(unit) && length.is_multiple_of(unit);
        fits.then_some(at).ok_or(ChipError::OutOfRange)
    }
}

impl State {
    /// One piece of work; `false` when the power fails instead.
    fn goes_on(&mut self) -> bool {
        match &mut self.budget {
            Some(0) => {
                self.powered = false;
                false
            }
            budget => {
                if let Some(left) = budget {
                    *left -= 1;
                }
                self.work += 1;
                true
            }
        }
    }

    fn write_byte(&mut self, at: usize, byte: u8) -> Result<(), ChipError> {
        let cell = self.cells[at];
        if byte & !cell != 0 {
            return Err(ChipError::NotErased);
        }
        if !self.goes_on() {
            // Some of the bits have been cleared.
            if self.tear == Tear::Mixture {
                self.cells[at] = cell & (byte | self.dice.byte());
            }
            return Err(ChipError::NoPower);
        }
        self.cells[at] = byte;
        Ok(())
    }

    fn erase_page(&mut self, page: usize, size: usize) -> Result<(), ChipError> {
        self.erases[page] += 1;
        for step in 0..=ERASE_STEPS {
            if !self.goes_on() {
                self.tear_page(page * size, size, step);
                return Err(ChipError::NoPower);
            }
        }
        self.cells[page * size..][..size].fill(0xff);
        Ok(())
    }

    fn tear_page(&mut self, start: usize, size: usize, step: usize) {
        let cells = &mut self.cells[start..][..size];
        match self.tear {
            Tear::Prefix => cells[..size * step / ERASE_STEPS].fill(0xff),
            // Nothing has happened yet, or everything.
            Tear::Mixture if step == 0 => {}
            Tear::Mixture if step == ERASE_STEPS => cells.fill(0xff),
            Tear::Mixture => {
                for cell in cells {
                    *cell = match self.dice.below(4) {
                        0 => *cell,
                        1 => 0xff,
                        2 => 0,
                        _ => self.dice.byte(),
                    };
                }
            }
        }
    }
}

impl<const PAGE: usize> ErrorType for Chip<PAGE> {
    type Error = ChipError;
}

impl<const PAGE: usize> ReadNorFlash for Chip<PAGE> {
    const READ_SIZE: usize = WORD;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), ChipError> {
        let at = Self::check(offset, bytes.len(), WORD)?;
        let state = self.0.borrow();
        if !state.powered {
            return Err(ChipError::NoPower);
        }
        bytes.copy_from_slice(&state.cells[at..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        Self::SIZE
    }
}

impl<const PAGE: usize> NorFlash for Chip<PAGE> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), ChipError> {
        let length = to.checked_sub(from).ok_or(ChipError::OutOfRange)?;
        let start = Self::check(from, length as usize, PAGE)?;
        let state = &mut *self.0.borrow_mut();
        for page in start / PAGE..(start + length as usize) / PAGE {
            if !state.powered {
                return Err(ChipError::NoPower);
            }
            match state.worn[page] {
                None => state.erase_page(page, PAGE)?,
                Some(Wear::Silent) => {}
                Some(Wear::Honest) => return Err(ChipError::WornOut),
            }
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), ChipError> {
        let start = Self::check(offset, bytes.len(), WORD)?;
        let state = &mut *self.0.borrow_mut();
        for (at, byte) in (start..).zip(bytes) {
            if !state.powered {
                return Err(ChipError::NoPower);
            }
            match state.worn[at / PAGE] {
                None => state.write_byte(at, *byte)?,
                Some(Wear::Silent) => {}
                Some(Wear::Honest) => return Err(ChipError::WornOut),
            }
        }
        Ok(())
    }
}
