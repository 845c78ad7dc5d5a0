//! virtio-blk as the NOR flash of an ESP chip: sectors of 4096 bytes erase to 0xFF, words of 4 bytes are written, and a write
//! can only clear bits; one that would set a bit is an error, because on the chip it would silently store something else.
//!
//! Each write is on the host's disk image, beyond the emulator's own death, when its future completes.
#![allow(unsafe_code)]

use core::{future::poll_fn, task::Poll};

use embedded_storage_async::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use static_cell::StaticCell;
use virtio_drivers::device::blk::{BlkReq, BlkResp, SECTOR_SIZE, VirtIOBlk};

use crate::boards::virt::virtio::{Device, Slot, Transport, dma::BoardHal};

/// Bytes erased at a time.
pub const SECTOR: usize = 4096;
/// Bytes written at a time.
pub const WORD: usize = 4;

/// What the device reads and writes while a request runs: never moved, never freed.
struct Transfer {
    request: BlkReq,
    response: BlkResp,
    data: [u8; SECTOR],
}

#[derive(Clone, Copy)]
enum Direction {
    Read,
    Write,
}

/// A request that the device has not finished.
#[derive(Clone, Copy)]
struct Pending {
    token: u16,
    direction: Direction,
    length: usize,
}

/// The flash of the board.
pub struct Flash {
    slot: Slot,
    disk: VirtIOBlk<BoardHal, Transport>,
    transfer: &'static mut Transfer,
    pending: Option<Pending>,
}

/// Why the flash refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// Offset or length is not a multiple of the word (write) or sector (erase).
    NotAligned,
    /// Beyond the end.
    OutOfBounds,
    /// The write would set a bit that is cleared, at this offset.
    NotErased(u32),
    /// The device or the host's file failed.
    Device(virtio_drivers::Error),
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::NotAligned => NorFlashErrorKind::NotAligned,
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            Self::NotErased(_) | Self::Device(_) => NorFlashErrorKind::Other,
        }
    }
}

impl From<virtio_drivers::Error> for Error {
    fn from(error: virtio_drivers::Error) -> Self {
        Self::Device(error)
    }
}

/// Part of a flash sector, widened to whole disk sectors.
struct Piece {
    /// First disk sector.
    first: usize,
    /// Where the part begins within the disk sectors.
    skip: usize,
    /// Length of the part.
    length: usize,
    /// Length of the disk sectors.
    whole: usize,
}

impl Piece {
    /// The beginning of `offset..offset + length` up to the end of the flash sector.
    fn first_of(offset: usize, length: usize) -> Self {
        let length = length.min(SECTOR - offset % SECTOR);
        let skip = offset % SECTOR_SIZE;
        Self {
            first: offset / SECTOR_SIZE,
            skip,
            length,
            whole: (skip + length).next_multiple_of(SECTOR_SIZE),
        }
    }
}

impl Flash {
    /// Takes the disk.
    ///
    /// # Panics
    /// When the device refuses, or when called twice.
    pub fn new(device: Device) -> Self {
        static TRANSFER: StaticCell<Transfer> = StaticCell::new();
        let disk = VirtIOBlk::new(device.transport).expect("virtio-blk");
        device.slot.enable_interrupt();
        let transfer = TRANSFER.init_with(|| Transfer {
            request: BlkReq::default(),
            response: BlkResp::default(),
            data: [0; SECTOR],
        });
        Self {
            slot: device.slot,
            disk,
            transfer,
            pending: None,
        }
    }

    fn check(&self, offset: u32, length: usize, unit: usize) -> Result<(), Error> {
        if !(offset as usize).is_multiple_of(unit) || !length.is_multiple_of(unit) {
            return Err(Error::NotAligned);
        }
        match (offset as usize).checked_add(length) {
            Some(end) if end <= self.capacity() => Ok(()),
            _ => Err(Error::OutOfBounds),
        }
    }

    /// Starts a request on the first `length` bytes of the transfer buffer and waits for its end. A future dropped on the way
    /// leaves the request running; the next one waits for it first.
    async fn request(
        &mut self,
        direction: Direction,
        first: usize,
        length: usize,
    ) -> Result<(), Error> {
        // How the one before ended was its own caller's business.
        let _ = self.finish().await;
        let Transfer {
            request,
            response,
            data,
        } = &mut *self.transfer;
        let data = &mut data[..length];
        // SAFETY: the transfer lives for ever, and nothing touches it while `pending` says that a request runs.
        let token = unsafe {
            match direction {
                Direction::Read => self.disk.read_blocks_nb(first, request, data, response),
                Direction::Write => self.disk.write_blocks_nb(first, request, data, response),
            }
        }?;
        self.pending = Some(Pending {
            token,
            direction,
            length,
        });
        self.finish().await
    }

    /// Waits for the end of the request that runs, if one does.
    async fn finish(&mut self) -> Result<(), Error> {
        let Some(Pending {
            token,
            direction,
            length,
        }) = self.pending
        else {
            return Ok(());
        };
        poll_fn(|cx| {
            self.slot.waker().register(cx.waker());
            if self.disk.peek_used().is_some() {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
        .await;
        self.pending = None;
        let Transfer {
            request,
            response,
            data,
        } = &mut *self.transfer;
        let data = &mut data[..length];
        // SAFETY: the very buffers that the request was started with.
        unsafe {
            match direction {
                Direction::Read => self
                    .disk
                    .complete_read_blocks(token, request, data, response),
                Direction::Write => self
                    .disk
                    .complete_write_blocks(token, request, data, response),
            }
        }?;
        Ok(())
    }
}

impl ErrorType for Flash {
    type Error = Error;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        self.check(offset, bytes.len(), Self::READ_SIZE)?;
        let (mut offset, mut rest) = (offset as usize, bytes);
        while !rest.is_empty() {
            let piece = Piece::first_of(offset, rest.len());
            self.request(Direction::Read, piece.first, piece.whole)
                .await?;
            let (now, later) = rest.split_at_mut(piece.length);
            now.copy_from_slice(&self.transfer.data[piece.skip..][..piece.length]);
            offset += piece.length;
            rest = later;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        // Whole sectors only: the tail of an odd image could not be erased.
        self.disk.capacity() as usize * SECTOR_SIZE / SECTOR * SECTOR
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let length = to.checked_sub(from).ok_or(Error::OutOfBounds)?;
        self.check(from, length as usize, SECTOR)?;
        for offset in (from..to).step_by(SECTOR) {
            // Before the buffer may be filled, a request that was abandoned must have let go of it.
            let _ = self.finish().await;
            self.transfer.data.fill(0xff);
            self.request(Direction::Write, offset as usize / SECTOR_SIZE, SECTOR)
                .await?;
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.check(offset, bytes.len(), WORD)?;
        let (mut offset, mut rest) = (offset as usize, bytes);
        while !rest.is_empty() {
            let piece = Piece::first_of(offset, rest.len());
            self.request(Direction::Read, piece.first, piece.whole)
                .await?;
            let (now, later) = rest.split_at(piece.length);
            let stored = &mut self.transfer.data[piece.skip..][..piece.length];
            if let Some(at) = stored
                .iter()
                .zip(now)
                .position(|(old, new)| new & !old != 0)
            {
                return Err(Error::NotErased((offset + at) as u32));
            }
            stored.copy_from_slice(now);
            self.request(Direction::Write, piece.first, piece.whole)
                .await?;
            offset += piece.length;
            rest = later;
        }
        Ok(())
    }
}

// As on the ESP chips without flash encryption: a word may be written again as long as bits are only cleared.
impl MultiwriteNorFlash for Flash {}
