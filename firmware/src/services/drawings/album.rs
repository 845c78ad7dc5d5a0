//! Drawings in flash, on sheets.
//!
//! A sheet is a page of the range, with a head (`sheet.rs`) and a part of one drawing. A drawing's sheets lie
//! anywhere. The first one tells that the drawing is complete, by a seal that is written last; until then
//! its sheets are as good as empty, and whatever was in its slot before is what is there. Of two complete
//! drawings in one slot the later one counts, and the earlier one is struck at once.
//!
//! So there is one write that makes a drawing exist and another that ends it, and either is there or is not:
//! a seal is good only as a whole, and a strike is one as soon as any bit of it is there. A start finishes
//! what it finds unfinished.
//!
//! Nothing is assumed of a sheet that belongs to no drawing: it is erased before it is used, whatever it
//! looks like. The next sheet to be used is the next one in the order of the range, also after a restart,
//! so that all that are free wear alike.
//!
//! `sequential-storage`, which keeps the settings, holds items up to a page; the file systems that there are
//! for flash are written in C, or need room for compaction, and one drawing is to take nearly all there is.

use super::sheet::{Adding, HEAD, Head, SEAL, STRIKE, STRUCK, SUM, Seal, Strike};
use crate::log::warning;
use core::fmt;
use core::ops::Range;
use embedded_storage_async::nor_flash::NorFlash;
use protocol_core::drawings::{Contents, MAX_DRAWINGS, Slot, Space};

/// Most sheets that are used: as many as the partition has pages (`partitions.csv`).
pub const MAX_SHEETS: usize = 360;
/// Pages that do not take anything, one after the other, until the whole flash is thought not to.
const BAD_AT_MOST: u8 = 8;
/// Longest word of a flash that drawings can be kept in.
const WORD: usize = 4;
/// Bytes that are written or read at once, at most.
const BUFFER: usize = 256;

/// Why drawings could not be stored, deleted or read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlbumError {
    /// This board keeps no drawings.
    Missing,
    /// There is no room.
    Full,
    /// The flash did not take it, or cannot be read.
    Worn,
    /// There is no such drawing any more.
    Gone,
    /// What is read is not what was written.
    Damaged,
}

impl AlbumError {
    /// In words, without a double quote.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Missing => "this arm has no memory for drawings",
            Self::Full => "the memory for drawings is full",
            Self::Worn => "the memory did not take it",
            Self::Gone => "it is no longer stored",
            Self::Damaged => "the memory has lost a part of it",
        }
    }
}

impl fmt::Display for AlbumError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.text())
    }
}

/// A complete drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    /// The number of this drawing alone.
    pub(super) sequence: u32,
    pub(super) seal: Seal,
    /// Where its first sheet is.
    first: u16,
}

/// A table with a place for each slot.
pub(super) type Catalogue = [Option<Stored>; MAX_DRAWINGS as usize];

/// Whose a sheet is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Owner {
    Nobody,
    /// The drawing that is being recorded.
    Draft,
    Drawing(Slot),
    /// It does not take what is written, as far as is known since the start.
    Worn,
}

#[derive(Clone, Copy, Debug)]
struct Sheet {
    owner: Owner,
    /// Its place in the drawing.
    index: u16,
}

const BLANK: Sheet = Sheet {
    owner: Owner::Nobody,
    index: 0,
};

/// A drawing that is being recorded.
struct Draft {
    head: Head,
    /// Its first sheet and the one that is being filled, as soon as there is one.
    sheets: Option<(u16, u16)>,
    /// Bytes on the sheet that is being filled.
    fill: usize,
    length: u32,
    adding: Adding,
}

/// Some flash can be written from aligned memory only.
#[repr(align(4))]
struct Buffer([u8; BUFFER]);

/// The drawings in a range of flash.
pub struct Album<F> {
    flash: F,
    range: Range<u32>,
    /// Sheets that there are.
    count: u16,
    sheets: [Sheet; MAX_SHEETS],
    stored: Catalogue,
    draft: Option<Draft>,
    /// The sheet that is looked at first when one is needed.
    next: u16,
    /// The last sequence number that was given.
    sequence: u32,
    buffer: Buffer,
}

impl<F: NorFlash> Album<F> {
    /// Bytes of a drawing on each sheet.
    pub const ROOM: usize = F::ERASE_SIZE - HEAD;

    /// Over `range` of `flash`: whole pages, of which at most [`MAX_SHEETS`] are used; `None` when it is
    /// not, or the flash has longer words than 4 bytes.
    pub fn new(flash: F, range: Range<u32>) -> Option<Self> {
        let page = F::ERASE_SIZE as u32;
        let length = range.end.checked_sub(range.start)?;
        let words = WORD.is_multiple_of(F::WRITE_SIZE) && WORD.is_multiple_of(F::READ_SIZE);
        let pages = range.start.is_multiple_of(page) && length.is_multiple_of(page);
        if !words || !pages || length == 0 || F::ERASE_SIZE <= HEAD {
            return None;
        }
        let count = (length / page).min(MAX_SHEETS as u32) as u16;
        Some(Self {
            flash,
            range,
            count,
            sheets: [BLANK; MAX_SHEETS],
            stored: [None; MAX_DRAWINGS as usize],
            draft: None,
            next: 0,
            sequence: 0,
            buffer: Buffer([0; BUFFER]),
        })
    }

    /// Finds what is stored, and finishes what a power cut has left unfinished. The arm must rest.
    pub async fn open(&mut self) {
        self.find_drawings().await;
        self.find_sheets().await;
        for slot in Slot::all() {
            if let Some(stored) = self.stored(slot)
                && self.count_of(Owner::Drawing(slot)) != sheets_for::<F>(stored.seal.length)
            {
                warning!("drawing {} has lost a part: it is gone", slot.number());
                self.forget(slot);
            }
        }
    }

    async fn find_drawings(&mut self) {
        let mut newest = None;
        for sheet in 0..self.count {
            let Some(bytes) = self.read_head(sheet).await else {
                self.set(sheet, Owner::Worn, 0);
                continue;
            };
            let Some(head) = Head::read(&bytes) else {
                continue;
            };
            if newest.is_none_or(|newest| newest < (head.sequence, head.index)) {
                newest = Some((head.sequence, head.index));
                self.next = (sheet + 1) % self.count;
            }
            let Some(seal) = head.read_seal(&bytes) else {
                continue;
            };
            match Strike::read(&bytes) {
                Strike::Done => continue,
                Strike::Torn => {
                    self.erase(sheet).await;
                    continue;
                }
                Strike::None => {}
            }
            let found = Stored {
                sequence: head.sequence,
                seal,
                first: sheet,
            };
            let old = match self.stored(head.slot) {
                Some(other) if other.sequence > found.sequence => Some(found),
                other => {
                    self.put(head.slot, Some(found));
                    other
                }
            };
            if let Some(old) = old {
                self.erase(old.first).await;
            }
        }
        self.sequence = newest.map_or(0, |(sequence, _)| sequence);
    }

    async fn find_sheets(&mut self) {
        for sheet in 0..self.count {
            let Some(bytes) = self.read_head(sheet).await else {
                continue;
            };
            let Some(head) = Head::read(&bytes) else {
                continue;
            };
            if let Some(stored) = self.stored(head.slot)
                && stored.sequence == head.sequence
                && head.index < sheets_for::<F>(stored.seal.length)
                && self
                    .sheet_of(Owner::Drawing(head.slot), head.index)
                    .is_none()
            {
                self.set(sheet, Owner::Drawing(head.slot), head.index);
            }
        }
    }

    /// Which drawings there are.
    pub fn contents(&self) -> Contents {
        contents(&self.stored)
    }

    /// The number that the drawing in this slot has alone, for [`Self::read`].
    pub fn sequence_of(&self, slot: Slot) -> Option<u32> {
        self.stored(slot).map(|stored| stored.sequence)
    }

    pub(super) const fn catalogue(&self) -> &Catalogue {
        &self.stored
    }

    /// How much room there is.
    pub fn space(&self) -> Space {
        let bytes = |sheets: u16| u32::from(sheets) * Self::ROOM as u32;
        let free = bytes(self.count_of(Owner::Nobody));
        let total = bytes(self.count - self.count_of(Owner::Worn));
        Space {
            total,
            used: total - free,
        }
    }

    /// Begins to record a drawing for a slot; one that was being recorded is abandoned. Writes nothing.
    pub fn begin(&mut self, slot: Slot) {
        self.abandon();
        self.sequence = self.sequence.saturating_add(1);
        self.draft = Some(Draft {
            head: Head {
                sequence: self.sequence,
                slot,
                index: 0,
            },
            sheets: None,
            fill: 0,
            length: 0,
            adding: SUM.digest(),
        });
    }

    /// Forgets what was being recorded. Writes nothing.
    pub fn abandon(&mut self) {
        self.draft = None;
        for sheet in &mut self.sheets {
            if sheet.owner == Owner::Draft {
                *sheet = BLANK;
            }
        }
    }

    /// Writes the next bytes of what is being recorded: all but the last ones whole words of 4 bytes. The arm must
    /// rest.
    ///
    /// # Errors
    /// When they are not stored: then the recording is abandoned.
    pub async fn append(&mut self, bytes: &[u8]) -> Result<(), AlbumError> {
        let outcome = self.append_to_draft(bytes).await;
        if outcome.is_err() {
            self.abandon();
        }
        outcome
    }

    async fn append_to_draft(&mut self, mut bytes: &[u8]) -> Result<(), AlbumError> {
        while !bytes.is_empty() {
            let draft = self.draft.as_ref().ok_or(AlbumError::Gone)?;
            let fill = draft.fill;
            let sheet = match draft.sheets {
                Some((_, sheet)) if fill < Self::ROOM => sheet,
                _ => {
                    self.begin_sheet().await?;
                    continue;
                }
            };
            let length = bytes.len().min(Self::ROOM - fill).min(BUFFER);
            let (now, later) = bytes.split_at_checked(length).unwrap_or((bytes, &[]));
            if !self.write(sheet, HEAD + fill, now).await {
                self.set(sheet, Owner::Worn, 0);
                return Err(AlbumError::Worn);
            }
            if let Some(draft) = &mut self.draft {
                draft.fill += length;
                draft.length += length as u32;
                draft.adding.update(now);
            }
            bytes = later;
        }
        Ok(())
    }

    /// Takes the next free sheet for what is being recorded. One that does not take its head is passed over.
    async fn begin_sheet(&mut self) -> Result<(), AlbumError> {
        let mut bad = 0;
        for _ in 0..self.count {
            let sheet = self.next;
            self.next = (sheet + 1) % self.count;
            if self.owner(sheet) != Owner::Nobody {
                continue;
            }
            let draft = self.draft.as_ref().ok_or(AlbumError::Gone)?;
            let head = match draft.sheets {
                Some(_) => Head {
                    index: draft.head.index + 1,
                    ..draft.head
                },
                None => draft.head,
            };
            let taken = self.erase(sheet).await && self.write(sheet, 0, &head.to_bytes()).await;
            if !taken {
                warning!("a page of the drawings' memory is worn out");
                self.set(sheet, Owner::Worn, 0);
                bad += 1;
                if bad == BAD_AT_MOST {
                    return Err(AlbumError::Worn);
                }
                continue;
            }
            self.set(sheet, Owner::Draft, head.index);
            if let Some(draft) = &mut self.draft {
                let (first, _) = draft.sheets.unwrap_or((sheet, sheet));
                draft.sheets = Some((first, sheet));
                draft.head = head;
                draft.fill = 0;
            }
            return Ok(());
        }
        Err(AlbumError::Full)
    }

    /// Makes a drawing of what was recorded. The arm must rest.
    ///
    /// # Errors
    /// When it is not one: then what was in its slot before still is.
    pub async fn commit(&mut self) -> Result<(), AlbumError> {
        let outcome = self.seal_draft().await;
        if outcome.is_err() {
            self.abandon();
        }
        outcome
    }

    async fn seal_draft(&mut self) -> Result<(), AlbumError> {
        let draft = self.draft.as_ref().ok_or(AlbumError::Gone)?;
        let (first, _) = draft.sheets.ok_or(AlbumError::Gone)?;
        let seal = Seal {
            length: draft.length,
            sum: draft.adding.clone().finalize(),
        };
        let head = Head {
            index: 0,
            ..draft.head
        };
        if !self.write(first, SEAL as usize, &head.seal(seal)).await {
            // Half a seal that a restart takes for a whole one would be a promise that was not given.
            self.erase(first).await;
            self.set(first, Owner::Worn, 0);
            return Err(AlbumError::Worn);
        }
        let slot = head.slot;
        self.draft = None;
        if let Some(old) = self.stored(slot) {
            self.forget(slot);
            self.strike(old).await;
        }
        self.put(
            slot,
            Some(Stored {
                sequence: head.sequence,
                seal,
                first,
            }),
        );
        for sheet in &mut self.sheets {
            if sheet.owner == Owner::Draft {
                sheet.owner = Owner::Drawing(slot);
            }
        }
        Ok(())
    }

    /// Deletes a drawing. The arm must rest.
    ///
    /// # Errors
    /// When there is none, or the flash does not take that: then it is still there.
    pub async fn delete(&mut self, slot: Slot) -> Result<(), AlbumError> {
        let stored = self.stored(slot).ok_or(AlbumError::Gone)?;
        if !self.strike(stored).await {
            return Err(AlbumError::Worn);
        }
        self.forget(slot);
        Ok(())
    }

    /// Marks a drawing as ended; where the mark is not taken, its first sheet is erased. Says whether a restart
    /// finds it no more: a worn flash may take both without doing either.
    async fn strike(&mut self, stored: Stored) -> bool {
        if self.write(stored.first, STRIKE as usize, &STRUCK).await {
            return true;
        }
        let erased = self.erase(stored.first).await;
        let left = self.read_head(stored.first).await;
        erased && left.is_some_and(|bytes| Head::read(&bytes).is_none())
    }

    /// Reads bytes of the drawing of this sequence number into `bytes`, and gives how many: at least one,
    /// unless the drawing ends at `offset`.
    ///
    /// # Errors
    /// [`AlbumError::Gone`] where that drawing is not in the slot any more.
    pub async fn read(
        &mut self,
        slot: Slot,
        sequence: u32,
        offset: u32,
        bytes: &mut [u8],
    ) -> Result<usize, AlbumError> {
        let stored = self.stored(slot).ok_or(AlbumError::Gone)?;
        if stored.sequence != sequence {
            return Err(AlbumError::Gone);
        }
        let rest = stored.seal.length.saturating_sub(offset) as usize;
        let within = offset as usize % Self::ROOM;
        let skip = within % WORD;
        let length = rest
            .min(bytes.len())
            .min(Self::ROOM - within)
            .min(BUFFER - skip);
        if length == 0 {
            return Ok(0);
        }
        let index = (offset as usize / Self::ROOM) as u16;
        let sheet = self
            .sheet_of(Owner::Drawing(slot), index)
            .ok_or(AlbumError::Gone)?;
        let at = self.start_of(sheet) + (HEAD + within - skip) as u32;
        let whole = (skip + length).next_multiple_of(WORD);
        let buffer = self.buffer.0.get_mut(..whole).unwrap_or_default();
        let read = self.flash.read(at, buffer).await;
        read.map_err(|_| AlbumError::Worn)?;
        let found = buffer.get(skip..skip + length).unwrap_or_default();
        for (byte, found) in bytes.iter_mut().zip(found) {
            *byte = *found;
        }
        Ok(length)
    }

    /// Writes at most a buffer of bytes, filled up to whole words, and says whether they read back.
    async fn write(&mut self, sheet: u16, at: usize, bytes: &[u8]) -> bool {
        let whole = bytes.len().next_multiple_of(WORD);
        let Some(buffer) = self.buffer.0.get_mut(..whole) else {
            return false;
        };
        let filled = bytes.iter().copied().chain(core::iter::repeat(0xff));
        for (place, byte) in buffer.iter_mut().zip(filled) {
            *place = byte;
        }
        let at = self.range.start + u32::from(sheet) * F::ERASE_SIZE as u32 + at as u32;
        if self.flash.write(at, buffer).await.is_err() {
            return false;
        }
        buffer.fill(0);
        self.flash.read(at, buffer).await.is_ok() && buffer.get(..bytes.len()) == Some(bytes)
    }

    async fn erase(&mut self, sheet: u16) -> bool {
        let start = self.start_of(sheet);
        let erased = self.flash.erase(start, start + F::ERASE_SIZE as u32).await;
        erased.is_ok()
    }

    async fn read_head(&mut self, sheet: u16) -> Option<[u8; HEAD]> {
        let at = self.start_of(sheet);
        let buffer = self.buffer.0.first_chunk_mut::<HEAD>()?;
        self.flash.read(at, buffer).await.ok()?;
        Some(*buffer)
    }

    const fn start_of(&self, sheet: u16) -> u32 {
        self.range.start + sheet as u32 * F::ERASE_SIZE as u32
    }

    fn stored(&self, slot: Slot) -> Option<Stored> {
        self.stored.get(slot.index()).copied().flatten()
    }

    fn put(&mut self, slot: Slot, stored: Option<Stored>) {
        if let Some(place) = self.stored.get_mut(slot.index()) {
            *place = stored;
        }
    }

    /// The drawing in this slot is no more, and its sheets are free.
    fn forget(&mut self, slot: Slot) {
        self.put(slot, None);
        for sheet in &mut self.sheets {
            if sheet.owner == Owner::Drawing(slot) {
                *sheet = BLANK;
            }
        }
    }

    fn owner(&self, sheet: u16) -> Owner {
        let sheet = self.sheets.get(usize::from(sheet));
        sheet.map_or(Owner::Worn, |sheet| sheet.owner)
    }

    fn set(&mut self, sheet: u16, owner: Owner, index: u16) {
        if let Some(place) = self.sheets.get_mut(usize::from(sheet)) {
            *place = Sheet { owner, index };
        }
    }

    fn sheet_of(&self, owner: Owner, index: u16) -> Option<u16> {
        let place = self
            .sheets
            .iter()
            .position(|sheet| sheet.owner == owner && sheet.index == index)?;
        u16::try_from(place).ok()
    }

    fn count_of(&self, owner: Owner) -> u16 {
        let sheets = self.sheets.iter().take(usize::from(self.count));
        sheets.filter(|sheet| sheet.owner == owner).count() as u16
    }
}

/// How many sheets a drawing of so many bytes has.
const fn sheets_for<F: NorFlash>(length: u32) -> u16 {
    length.div_ceil((F::ERASE_SIZE - HEAD) as u32) as u16
}

/// Which drawings a catalogue has.
pub(super) fn contents(catalogue: &Catalogue) -> Contents {
    let mut contents = Contents::EMPTY;
    for (slot, stored) in Slot::all().zip(catalogue) {
        contents.set(slot, stored.map(|stored| stored.seal.length));
    }
    contents
}
