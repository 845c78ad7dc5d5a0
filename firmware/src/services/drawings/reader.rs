//! A stored drawing as a stream of bytes.

use super::album::{AlbumError, Stored};
use super::sheet::SUM;
use super::{CHUNK, Drawings};
use embedded_io_async::{ErrorKind, ErrorType, Read};
use protocol_core::drawings::Slot;

/// A drawing that is read from its beginning to its end. When it is replaced or deleted meanwhile, reading
/// fails.
pub struct Reader<'a> {
    drawings: &'a Drawings,
    slot: Slot,
    stored: Stored,
    at: u32,
}

impl<'a> Reader<'a> {
    pub(super) const fn new(drawings: &'a Drawings, slot: Slot, stored: Stored) -> Self {
        Self {
            drawings,
            slot,
            stored,
            at: 0,
        }
    }

    /// Reads all of it, and tells whether it is what was written. The reader is at the beginning again.
    ///
    /// # Errors
    /// [`AlbumError::Damaged`] when it is not.
    pub async fn check(&mut self) -> Result<(), AlbumError> {
        self.at = 0;
        let mut adding = SUM.digest();
        let mut chunk = [0; CHUNK];
        loop {
            let length = self.read(&mut chunk).await?;
            if length == 0 {
                break;
            }
            adding.update(chunk.get(..length).unwrap_or_default());
        }
        self.at = 0;
        match adding.finalize() == self.stored.seal.sum {
            true => Ok(()),
            false => Err(AlbumError::Damaged),
        }
    }
}

impl ErrorType for Reader<'_> {
    type Error = AlbumError;
}

impl Read for Reader<'_> {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, AlbumError> {
        let bytes = match bytes.len() {
            0..=CHUNK => bytes,
            _ => bytes.get_mut(..CHUNK).unwrap_or_default(),
        };
        let sequence = self.stored.sequence;
        let read = self.drawings.read(self.slot, sequence, self.at, bytes);
        let length = read.await?;
        self.at += length as u32;
        Ok(length)
    }
}

impl embedded_io_async::Error for AlbumError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Gone | Self::Missing => ErrorKind::NotFound,
            Self::Full => ErrorKind::OutOfMemory,
            Self::Damaged => ErrorKind::InvalidData,
            Self::Worn => ErrorKind::Other,
        }
    }
}

impl core::error::Error for AlbumError {}
