//! The two slots of a desktop arm, files that are programs, and the choice between them.

use super::bootloader::Running;
use super::flash::{FileFlash, FlashError};
use crate::board::FirmwareSlots;
use core::future::pending;
use embassy_embedded_hal::adapter::BlockingAsync;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, ReadNorFlash, check_erase, check_read, check_write,
};
use protocol_core::update::{PAGE, Slot};
use std::env::consts::{ARCH, OS};
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Most bytes of an image. A program of 2026 has 19 MB, one for a debugger 59 MB.
pub const SLOT_SIZE: u32 = 128 << 20;
/// Bytes of the flash of the boot choice.
pub const CHOICE_SIZE: u32 = 2 * PAGE;

/// What manifests call a desktop: a program is for one kind of processor and system.
pub fn board() -> &'static str {
    static BOARD: LazyLock<String> =
        LazyLock::new(|| format!("desktop-{ARCH}-{OS}").replace('_', "-"));
    &BOARD
}

/// A slot's name.
pub const fn name(slot: Slot) -> &'static str {
    match slot {
        Slot::First => "first",
        Slot::Second => "second",
    }
}

/// Where a slot's image is.
pub fn image_file(folder: &Path, slot: Slot) -> PathBuf {
    folder.join(name(slot))
}

/// Where the boot choice is.
pub fn choice_file(folder: &Path) -> PathBuf {
    folder.join("choice")
}

/// The slots of the firmware that runs.
pub struct FileSlots {
    running: Slot,
    image: PathBuf,
    other: BlockingAsync<FileSlot>,
    choice: BlockingAsync<FileFlash>,
}

impl FileSlots {
    /// Opens the boot choice. A slot is opened when it is written.
    ///
    /// # Errors
    /// When the choice cannot be read and written.
    pub fn open(running: &Running) -> io::Result<Self> {
        let choice = FileFlash::open(&choice_file(&running.folder), CHOICE_SIZE)?;
        let image = image_file(&running.folder, running.slot.other());
        Ok(Self {
            running: running.slot,
            other: BlockingAsync::new(FileSlot::at(image.clone())),
            image,
            choice: BlockingAsync::new(choice),
        })
    }
}

static RESTART: AtomicBool = AtomicBool::new(false);

/// Whether the firmware wants to be started again: the program ends as if it had been told to, and does
/// that.
pub fn restart_is_wanted() -> bool {
    RESTART.load(Ordering::Relaxed)
}

impl FirmwareSlots for FileSlots {
    type Slot = BlockingAsync<FileSlot>;
    type Choice = BlockingAsync<FileFlash>;

    fn board(&self) -> &'static str {
        board()
    }

    fn running(&self) -> Slot {
        self.running
    }

    fn other(&mut self) -> &mut Self::Slot {
        &mut self.other
    }

    fn choice(&mut self) -> &mut Self::Choice {
        &mut self.choice
    }

    async fn restart(&mut self) -> ! {
        // A program that is open for writing does not start.
        self.other = BlockingAsync::new(FileSlot::at(self.image.clone()));
        RESTART.store(true, Ordering::Relaxed);
        pending().await
    }
}

/// A slot: a program's file, as long as what has been written; the rest of the slot is erased.
#[derive(Debug)]
pub struct FileSlot {
    path: PathBuf,
    /// Open from the first use on.
    file: Option<File>,
    /// Something is not on the disk yet.
    unsynced: bool,
}

impl FileSlot {
    /// The slot in a file, which is made when it is needed.
    pub const fn at(path: PathBuf) -> Self {
        Self {
            path,
            file: None,
            unsynced: false,
        }
    }

    fn file(&mut self) -> io::Result<&File> {
        if self.file.is_none() {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create(true).truncate(false);
            // A program, and its owner's alone.
            self.file = Some(options.mode(0o700).open(&self.path)?);
        }
        let missing = || io::ErrorKind::NotFound.into();
        self.file.as_ref().ok_or_else(missing)
    }
}

impl ErrorType for FileSlot {
    type Error = FlashError;
}

impl ReadNorFlash for FileSlot {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len())?;
        let unsynced = self.unsynced;
        let file = self.file()?;
        // What is read back has to be there after a power cut as well.
        if unsynced {
            file.sync_all()?;
        }
        let length = file.metadata()?.len().saturating_sub(offset.into());
        let there = bytes
            .len()
            .min(usize::try_from(length).unwrap_or(usize::MAX));
        let (written, erased) = bytes.split_at_mut(there);
        file.read_exact_at(written, offset.into())?;
        erased.fill(0xff);
        self.unsynced = false;
        Ok(())
    }

    fn capacity(&self) -> usize {
        SLOT_SIZE as usize
    }
}

impl NorFlash for FileSlot {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to)?;
        self.unsynced = true;
        let file = self.file()?;
        let length = file.metadata()?.len();
        if length <= to.into() {
            file.set_len(length.min(from.into()))?;
        } else {
            file.write_all_at(&vec![0xff; (to - from) as usize], from.into())?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len())?;
        self.unsynced = true;
        let file = self.file()?;
        let length = file.metadata()?.len();
        if let Some(gap @ 1..) = u64::from(offset).checked_sub(length) {
            let erased = vec![0xff; usize::try_from(gap).unwrap_or_default()];
            file.write_all_at(&erased, length)?;
        }
        file.write_all_at(bytes, offset.into())?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    fn read<const N: usize>(slot: &mut FileSlot, at: u32) -> [u8; N] {
        let mut bytes = [0; N];
        slot.read(at, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn a_slot_is_a_program_as_long_as_what_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("second");
        let mut slot = FileSlot::at(path.clone());
        assert!(!path.exists());
        assert_eq!(read(&mut slot, SLOT_SIZE - 4), [0xff; 4]);
        slot.erase(0, PAGE).unwrap();
        slot.write(0, b"#!/bin/true\n").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"#!/bin/true\n");
        assert_eq!(
            fs::metadata(&path).unwrap().permissions().mode() & 0o777,
            0o700
        );
        assert_eq!(read(&mut slot, 8), *b"rue\n\xff\xff\xff\xff");

        // Page by page, as images are written; what is skipped is erased.
        slot.write(2 * PAGE, b"more").unwrap();
        assert_eq!(read(&mut slot, 2 * PAGE - 4), *b"\xff\xff\xff\xffmore");
        slot.erase(0, PAGE).unwrap();
        assert_eq!(read(&mut slot, 0), [0xff; PAGE as usize]);
        assert_eq!(read(&mut slot, 2 * PAGE), *b"more");
        slot.erase(PAGE, 3 * PAGE).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().len(), u64::from(PAGE));
        slot.erase(0, SLOT_SIZE).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().len(), 0);
    }

    #[test]
    fn a_slot_has_an_end_and_whole_words() {
        let folder = tempfile::tempdir().unwrap();
        let mut slot = FileSlot::at(folder.path().join("second"));
        assert!(slot.write(SLOT_SIZE, b"four").is_err());
        assert!(slot.write(0, b"odd").is_err());
        assert!(slot.erase(0, 1).is_err());
        assert!(slot.read(SLOT_SIZE, &mut [0]).is_err());
        assert!(!folder.path().join("second").exists());
    }

    #[test]
    fn a_manifest_can_name_this_board() {
        let allowed = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
        assert!(board().bytes().all(allowed), "{}", board());
        assert!(board().len() <= protocol_core::update::MAX_BOARD);
    }
}
