//! A flash chip in a file: words of four bytes, pages of 4 kB, bits that only an erase sets.

use embedded_storage::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
    check_erase, check_read, check_write,
};
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;

/// Bytes of the flash for settings.
pub const SIZE: u32 = 8 * 4096;
/// Bytes of the flash for drawings, as many as the chips have.
pub const DRAWINGS_SIZE: u32 = 360 * 4096;

/// A flash chip whose contents live in a file, or in memory only.
#[derive(Debug)]
pub struct FileFlash {
    contents: Vec<u8>,
    file: Option<File>,
}

/// Why an operation failed.
#[derive(Debug)]
pub enum FlashError {
    /// The range is not whole words or pages of this flash.
    Range(NorFlashErrorKind),
    /// The file could not be written.
    File(io::Error),
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Range(kind) => *kind,
            Self::File(_) => NorFlashErrorKind::Other,
        }
    }
}

impl From<NorFlashErrorKind> for FlashError {
    fn from(kind: NorFlashErrorKind) -> Self {
        Self::Range(kind)
    }
}

impl From<io::Error> for FlashError {
    fn from(error: io::Error) -> Self {
        Self::File(error)
    }
}

impl FileFlash {
    /// Opens the flash of `size` bytes in a file, which is made if it does not exist.
    ///
    /// # Errors
    /// When the file cannot be read and written, or is of another size than this flash: then it is
    /// something else, and stays as it is.
    pub fn open(path: &Path, size: u32) -> io::Result<Self> {
        if !path.exists() {
            // Whole or not at all.
            let folder = path
                .parent()
                .filter(|folder| !folder.as_os_str().is_empty());
            let mut new = tempfile::NamedTempFile::new_in(folder.unwrap_or(Path::new(".")))?;
            new.write_all(&vec![0xff; size as usize])?;
            new.persist(path).map_err(|error| error.error)?;
        }
        let file = OpenOptions::new().read(true).write(true).open(path)?;
        if file.metadata()?.len() != u64::from(size) {
            return Err(io::Error::other(
                "is not the state of an arm, and stays as it is",
            ));
        }
        let mut contents = Vec::new();
        (&file).take(size.into()).read_to_end(&mut contents)?;
        Ok(Self {
            contents,
            file: Some(file),
        })
    }

    /// A flash of `size` bytes that is forgotten with the program.
    pub fn in_memory(size: u32) -> Self {
        Self {
            contents: vec![0xff; size as usize],
            file: None,
        }
    }

    /// The same with something in it; `None` unless it is as much as the flash has room for.
    pub fn holding(contents: Vec<u8>) -> Option<Self> {
        (contents.len() == SIZE as usize).then_some(Self {
            contents,
            file: None,
        })
    }

    /// Everything that is in it.
    pub fn contents(&self) -> &[u8] {
        &self.contents
    }

    fn change(
        &mut self,
        range: Range<usize>,
        new: impl Fn(usize, u8) -> u8,
    ) -> Result<(), FlashError> {
        let start = range.start;
        let Some(cells) = self.contents.get_mut(range) else {
            return Err(NorFlashErrorKind::OutOfBounds.into());
        };
        for (index, cell) in cells.iter_mut().enumerate() {
            *cell = new(index, *cell);
        }
        if let Some(file) = &mut self.file {
            file.seek(SeekFrom::Start(start as u64))?;
            file.write_all(cells)?;
            file.sync_data()?;
        }
        Ok(())
    }
}

impl ErrorType for FileFlash {
    type Error = FlashError;
}

impl ReadNorFlash for FileFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len())?;
        let range = offset as usize..offset as usize + bytes.len();
        bytes.copy_from_slice(self.contents.get(range).unwrap_or_default());
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.contents.len()
    }
}

impl NorFlash for FileFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 4096;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to)?;
        self.change(from as usize..to as usize, |_, _| 0xff)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len())?;
        let range = offset as usize..offset as usize + bytes.len();
        self.change(range, |index, cell| {
            cell & bytes.get(index).copied().unwrap_or(0xff)
        })
    }
}

impl MultiwriteNorFlash for FileFlash {}
