//! Other ways to look at a flash: one page of it by itself, and a whole range of it, unrepaired.
//!
//! `sequential-storage` looks at the marks at the beginning and the end of each page, and where the marks
//! of pages contradict each other it repairs, which erases pages. In these views nothing contradicts.

use core::ops::Range;
use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Bytes that are written at once, and how long a page's mark is.
pub(super) const fn word<F: NorFlash>() -> usize {
    if F::WRITE_SIZE > F::READ_SIZE {
        F::WRITE_SIZE
    } else {
        F::READ_SIZE
    }
}

/// Whether a word is one of a page's marks, which are zero; the crate takes half a byte of zeros for one.
pub(super) fn is_mark(word: &[u8]) -> bool {
    word.iter().map(|byte| byte.count_zeros()).sum::<u32>() >= 4
}

/// What may be done with a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Access {
    /// It is read.
    Read,
    /// It looks as if it were marked as begun, and items may be added to it.
    Append,
}

/// A flash of two pages, which is as few as a map takes: one of another flash, and one that is always
/// erased.
///
/// So the items of a page can be read whatever the other pages are like.
pub(super) struct Page<'a, F> {
    flash: &'a mut F,
    start: u32,
    access: Access,
}

impl<'a, F: NorFlash> Page<'a, F> {
    /// The page and the one that is always erased.
    pub(super) const RANGE: Range<u32> = 0..2 * F::ERASE_SIZE as u32;

    /// The page at `start`.
    pub(super) const fn new(flash: &'a mut F, start: u32, access: Access) -> Self {
        Self {
            flash,
            start,
            access,
        }
    }
}

impl<F: NorFlash> ErrorType for Page<'_, F> {
    type Error = NorFlashErrorKind;
}

impl<F: NorFlash> ReadNorFlash for Page<'_, F> {
    const READ_SIZE: usize = F::READ_SIZE;

    // Nothing is read across the boundaries of pages and marks.
    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        if offset >= F::ERASE_SIZE as u32 {
            bytes.fill(0xff);
            return Ok(());
        }
        if offset == 0 && self.access == Access::Append {
            bytes.fill(0);
            return Ok(());
        }
        let read = self.flash.read(self.start + offset, bytes).await;
        read.map_err(|error| error.kind())
    }

    fn capacity(&self) -> usize {
        2 * F::ERASE_SIZE
    }
}

impl<F: NorFlash> NorFlash for Page<'_, F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, _: u32, _: u32) -> Result<(), NorFlashErrorKind> {
        Err(NorFlashErrorKind::Other)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        // All but the marks: a page that is full is not closed.
        let items = word::<F>()..F::ERASE_SIZE - word::<F>();
        if self.access != Access::Append || !items.contains(&(offset as usize)) {
            return Err(NorFlashErrorKind::Other);
        }
        let written = self.flash.write(self.start + offset, bytes).await;
        written.map_err(|error| error.kind())
    }
}

/// A flash to be read only, where a page that is marked at its end alone, because its erase was cut short,
/// looks erased.
pub(super) struct Unrepaired<'a, F>(pub(super) &'a mut F);

impl<F: NorFlash> ErrorType for Unrepaired<'_, F> {
    type Error = NorFlashErrorKind;
}

impl<F: NorFlash> ReadNorFlash for Unrepaired<'_, F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let start = offset - offset % F::ERASE_SIZE as u32;
        let last_word = start + (F::ERASE_SIZE - F::READ_SIZE) as u32;
        let read = async {
            if offset == last_word {
                self.0.read(start, bytes).await?;
                if !is_mark(bytes) {
                    bytes.fill(0xff);
                    return Ok(());
                }
            }
            self.0.read(offset, bytes).await
        };
        read.await.map_err(|error: F::Error| error.kind())
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<F: NorFlash> NorFlash for Unrepaired<'_, F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, _: u32, _: u32) -> Result<(), NorFlashErrorKind> {
        Err(NorFlashErrorKind::Other)
    }

    async fn write(&mut self, _: u32, _: &[u8]) -> Result<(), NorFlashErrorKind> {
        Err(NorFlashErrorKind::Other)
    }
}
