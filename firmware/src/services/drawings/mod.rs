//! Drawings that the arm keeps: the way of the other services to them.
//!
//! One task owns the flash; who wants something of it asks for it here, and waits. What writes is asked for
//! only while the arm rests. At most one connection records at a time: what it sends is collected in one
//! buffer, and written when that is full.

mod album;
mod reader;
mod sheet;

pub use album::{Album, AlbumError, MAX_SHEETS};
pub use reader::Reader;

use super::arm::Arm;
use super::window::{Ticket, Window};
use crate::log::warning;
use album::{Catalogue, contents};
use core::borrow::BorrowMut;
use core::cell::RefCell;
use core::fmt;
use embassy_sync::blocking_mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embedded_storage_async::nor_flash::NorFlash;
use heapless::Vec;
use protocol_core::drawings::{Contents, FIRST_LINE, MAX_DRAWINGS, Slot, Space};
use protocol_core::machine::Client;
use protocol_core::text::MAX_LINE;

/// Bytes of a recording that are collected before they are written; whole words of any flash.
pub const COLLECTED: usize = 1024;
/// Bytes that are read at a time: an interrupt may have to wait for a read.
const CHUNK: usize = 256;

// A line and its end fit behind what is left of another one.
const _: () = assert!(COLLECTED > 2 * (MAX_LINE + 1) && COLLECTED.is_multiple_of(4));

/// Why a line was not recorded, or a drawing not stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordError {
    /// Another connection records.
    Busy,
    /// This connection does not record.
    NotRecording,
    /// What the memory says.
    Album(AlbumError),
}

impl From<AlbumError> for RecordError {
    fn from(error: AlbumError) -> Self {
        Self::Album(error)
    }
}

impl fmt::Display for RecordError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Busy => out.write_str("another client records a drawing"),
            Self::NotRecording => out.write_str("nothing is recorded: M28 begins that"),
            Self::Album(error) => error.fmt(out),
        }
    }
}

/// How a line was recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recorded {
    /// At once.
    AtOnce,
    /// The buffer was full, and the arm had to come to rest before.
    AfterRest,
}

/// What is asked for.
#[derive(Clone, Copy, Debug)]
enum Job {
    Begin(Slot),
    /// What is collected is written.
    Append,
    /// What is collected is written, and is a drawing then.
    Commit,
    Abandon,
    Delete(Slot),
    /// Bytes are put into the chunk.
    Read {
        slot: Slot,
        sequence: u32,
        offset: u32,
    },
}

#[derive(Clone, Copy)]
struct Recording {
    client: Client,
    slot: Slot,
    /// Why it cannot be stored any more.
    trouble: Option<AlbumError>,
}

/// What everybody sees and the task works on.
struct Desk {
    job: Job,
    recording: Option<Recording>,
    collected: Vec<u8, COLLECTED>,
    chunk: [u8; CHUNK],
    stored: Catalogue,
    space: Space,
}

/// The way of the other services to the drawings.
pub struct Drawings {
    window: Window<Result<usize, AlbumError>>,
    desk: blocking_mutex::Mutex<CriticalSectionRawMutex, RefCell<Desk>>,
}

impl Default for Drawings {
    fn default() -> Self {
        Self::new()
    }
}

impl Drawings {
    /// With nothing known.
    pub const fn new() -> Self {
        Self {
            window: Window::new(),
            desk: blocking_mutex::Mutex::new(RefCell::new(Desk {
                job: Job::Abandon,
                recording: None,
                collected: Vec::new(),
                chunk: [0; CHUNK],
                stored: [None; MAX_DRAWINGS as usize],
                space: Space { total: 0, used: 0 },
            })),
        }
    }

    /// Which drawings there are.
    pub fn contents(&self) -> Contents {
        self.desk(|desk| contents(&desk.stored))
    }

    /// How much room there is.
    pub fn space(&self) -> Space {
        self.desk(|desk| desk.space)
    }

    /// Whether a client records one.
    pub fn is_recording(&self) -> bool {
        self.desk(|desk| desk.recording.is_some())
    }

    /// A drawing to be read from its beginning; `None` if there is none in this slot.
    pub fn open(&self, slot: Slot) -> Option<Reader<'_>> {
        let stored = self.desk(|desk| desk.stored.get(slot.index()).copied().flatten());
        stored.map(|stored| Reader::new(self, slot, stored))
    }

    /// Begins to record for a slot what `client` sends. Nothing is written yet.
    ///
    /// # Errors
    /// When somebody records already, or there is no room at all.
    pub async fn begin(&self, client: Client, slot: Slot) -> Result<(), RecordError> {
        let begun = self.desk(|desk| {
            if desk.recording.is_some() {
                return Err(RecordError::Busy);
            }
            if desk.space.total > 0 && desk.space.free() == 0 {
                return Err(AlbumError::Full.into());
            }
            desk.recording = Some(Recording {
                client,
                slot,
                trouble: None,
            });
            desk.collected.clear();
            let _ = desk.collected.extend_from_slice(FIRST_LINE);
            Ok(())
        });
        begun?;
        let outcome = self.perform(Job::Begin(slot)).await;
        if let Err(error) = outcome {
            self.desk(|desk| desk.recording = None);
            return Err(error.into());
        }
        Ok(())
    }

    /// Records a line, which is not longer than [`MAX_LINE`]. Where the buffer is full, it is written before,
    /// and that waits until the arm rests.
    ///
    /// # Errors
    /// When it is not recorded. Where that is the memory's fault, nothing more of this drawing is.
    pub async fn record(
        &self,
        client: Client,
        line: &[u8],
        arm: &Arm,
    ) -> Result<Recorded, RecordError> {
        let rest = self.desk(|desk| {
            desk.ready(client)?;
            Ok::<_, RecordError>(desk.collect(line))
        })?;
        let Some(rest) = rest else {
            return Ok(Recorded::AtOnce);
        };
        let waited = arm.with(|machine| !machine.is_idle());
        let outcome = {
            let _rest = arm.rest(client).await;
            self.perform(Job::Append).await
        };
        self.desk(|desk| {
            desk.note(outcome)?;
            desk.collected.clear();
            desk.collect(line.get(rest..).unwrap_or_default());
            Ok(match waited {
                true => Recorded::AfterRest,
                false => Recorded::AtOnce,
            })
        })
    }

    /// Makes a drawing of what was recorded, when the arm rests. The recording is over in any case.
    ///
    /// # Errors
    /// When it is none: then what was in the slot before still is.
    pub async fn end(&self, client: Client, arm: &Arm) -> Result<Slot, RecordError> {
        let ready = self.desk(|desk| desk.ready(client));
        let outcome = match ready {
            Ok(()) => {
                let _rest = arm.rest(client).await;
                self.perform(Job::Commit).await.map_err(Into::into)
            }
            Err(error) => Err(error),
        };
        let recording = self.desk(|desk| {
            desk.recording
                .take_if(|recording| recording.client == client)
        });
        outcome?;
        recording
            .map(|recording| recording.slot)
            .ok_or(RecordError::NotRecording)
    }

    /// What `client` was recording, if anything, is forgotten. Nothing is written.
    pub async fn abandon(&self, client: Client) {
        let recorded = self.desk(|desk| {
            desk.recording
                .take_if(|recording| recording.client == client)
        });
        if recorded.is_some() {
            // Where there is no memory, there is nothing to forget.
            let _ = self.perform(Job::Abandon).await;
        }
    }

    /// Deletes a drawing when the arm rests.
    ///
    /// # Errors
    /// [`AlbumError::Gone`] when there is none, or when the memory does not take it: then it is still there.
    pub async fn delete(&self, slot: Slot, client: Client, arm: &Arm) -> Result<(), AlbumError> {
        if self.contents().bytes(slot).is_none() {
            return Err(AlbumError::Gone);
        }
        let _rest = arm.rest(client).await;
        self.perform(Job::Delete(slot)).await.map(|_| ())
    }

    /// Reads into `bytes`, at most a chunk; gives how many.
    async fn read(
        &self,
        slot: Slot,
        sequence: u32,
        offset: u32,
        bytes: &mut [u8],
    ) -> Result<usize, AlbumError> {
        let mut turn = self.window.turn().await;
        let job = Job::Read {
            slot,
            sequence,
            offset,
        };
        let length = self.perform_in(&mut turn, job).await?.min(bytes.len());
        self.desk(|desk| {
            for (byte, read) in bytes.iter_mut().zip(&desk.chunk) {
                *byte = *read;
            }
        });
        Ok(length)
    }

    async fn perform(&self, job: Job) -> Result<usize, AlbumError> {
        let mut turn = self.window.turn().await;
        self.perform_in(&mut turn, job).await
    }

    async fn perform_in(&self, turn: &mut Ticket, job: Job) -> Result<usize, AlbumError> {
        self.desk(|desk| desk.job = job);
        self.window.ask(turn).await
    }

    fn desk<T>(&self, f: impl FnOnce(&mut Desk) -> T) -> T {
        self.desk.lock(|desk| f(&mut desk.borrow_mut()))
    }

    /// The service of a board without memory for drawings: everybody is told so.
    pub async fn refuse(&self) -> ! {
        loop {
            let ticket = self.window.next().await;
            self.window.tell(ticket, Err(AlbumError::Missing));
        }
    }

    /// The service, for ever. The album is open.
    pub async fn run<F: NorFlash>(&self, mut album: impl BorrowMut<Album<F>>) -> ! {
        let album = album.borrow_mut();
        // Of the task that owns the flash alone: the desk is never locked for as long as a write takes.
        let mut bytes = [0; COLLECTED];
        self.tell(album);
        loop {
            let ticket = self.window.next().await;
            let job = self.desk(|desk| desk.job);
            let outcome = self.work(job, album, &mut bytes).await;
            if !matches!(job, Job::Read { .. }) {
                self.tell(album);
            }
            if let Err(error @ (AlbumError::Worn | AlbumError::Damaged)) = outcome {
                warning!("drawings: {}", error.text());
            }
            self.window.tell(ticket, outcome);
        }
    }

    async fn work<F: NorFlash>(
        &self,
        job: Job,
        album: &mut Album<F>,
        bytes: &mut [u8; COLLECTED],
    ) -> Result<usize, AlbumError> {
        let done = match job {
            Job::Begin(slot) => {
                album.begin(slot);
                Ok(())
            }
            Job::Append => album.append(self.take_collected(bytes)).await,
            Job::Commit => match album.append(self.take_collected(bytes)).await {
                Ok(()) => album.commit().await,
                error => error,
            },
            Job::Abandon => {
                album.abandon();
                Ok(())
            }
            Job::Delete(slot) => album.delete(slot).await,
            Job::Read {
                slot,
                sequence,
                offset,
            } => {
                let chunk = bytes.first_chunk_mut::<CHUNK>();
                let chunk = chunk.ok_or(AlbumError::Worn)?;
                let length = album.read(slot, sequence, offset, chunk).await?;
                self.desk(|desk| desk.chunk = *chunk);
                return Ok(length);
            }
        };
        done.map(|()| 0)
    }

    fn take_collected<'a>(&self, bytes: &'a mut [u8; COLLECTED]) -> &'a [u8] {
        let length = self.desk(|desk| {
            for (byte, collected) in bytes.iter_mut().zip(&desk.collected) {
                *byte = *collected;
            }
            desk.collected.len()
        });
        bytes.get(..length).unwrap_or_default()
    }

    fn tell<F: NorFlash>(&self, album: &Album<F>) {
        self.desk(|desk| {
            desk.stored = *album.catalogue();
            desk.space = album.space();
        });
    }
}

impl Desk {
    /// Whether this client records, and all is well.
    fn ready(&self, client: Client) -> Result<(), RecordError> {
        let recording = self
            .recording
            .filter(|recording| recording.client == client);
        match recording.ok_or(RecordError::NotRecording)?.trouble {
            Some(trouble) => Err(trouble.into()),
            None => Ok(()),
        }
    }

    /// Puts a line and its end behind what is collected. Where it does not fit, the buffer is filled up with its
    /// beginning, and the length of that is given.
    fn collect(&mut self, line: &[u8]) -> Option<usize> {
        let room = COLLECTED - self.collected.len();
        if line.len() < room {
            // It fits.
            let _ = self.collected.extend_from_slice(line);
            let _ = self.collected.push(b'\n');
            return None;
        }
        let beginning = line.get(..room).unwrap_or(line);
        let _ = self.collected.extend_from_slice(beginning);
        Some(beginning.len())
    }

    /// Remembers that something was not written.
    fn note(&mut self, outcome: Result<usize, AlbumError>) -> Result<(), RecordError> {
        if let (Err(error), Some(recording)) = (outcome, &mut self.recording) {
            recording.trouble = Some(error);
        }
        outcome.map(|_| ()).map_err(Into::into)
    }
}
