//! One page of a flash by itself, to be read only.

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// A flash of two pages: one of another flash, and one that is always erased, which is as few as a map
/// takes. It refuses to be written.
///
/// So the records of a page can be read whatever the other pages are like, and without the repairs that
/// `sequential-storage` attempts where pages contradict each other.
pub(super) struct Page<'a, F> {
    flash: &'a mut F,
    start: u32,
}

impl<'a, F: NorFlash> Page<'a, F> {
    /// Bytes of the page and the one that is always erased.
    pub(super) const SIZE: u32 = 2 * F::ERASE_SIZE as u32;

    /// The page at `start`.
    pub(super) const fn new(flash: &'a mut F, start: u32) -> Self {
        Self { flash, start }
    }
}

impl<F: NorFlash> ErrorType for Page<'_, F> {
    type Error = NorFlashErrorKind;
}

impl<F: NorFlash> ReadNorFlash for Page<'_, F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        // Nothing is read across the boundary of pages.
        if offset >= F::ERASE_SIZE as u32 {
            bytes.fill(0xff);
            return Ok(());
        }
        self.flash
            .read(self.start + offset, bytes)
            .await
            .map_err(|error| error.kind())
    }

    fn capacity(&self) -> usize {
        Self::SIZE as usize
    }
}

impl<F: NorFlash> NorFlash for Page<'_, F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, _: u32, _: u32) -> Result<(), NorFlashErrorKind> {
        Err(NorFlashErrorKind::Other)
    }

    async fn write(&mut self, _: u32, _: &[u8]) -> Result<(), NorFlashErrorKind> {
        Err(NorFlashErrorKind::Other)
    }
}
