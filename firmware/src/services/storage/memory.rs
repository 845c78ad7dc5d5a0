//! The settings in flash, twice, through `sequential-storage`.
//!
//! The range of flash is two halves. Each holds a copy: the record of all settings, behind a sequence number
//! that grows with each store. The newest record of a half is its copy, and the newest of both counts.
//!
//! What makes it safe: a store writes one half, reads it back, and then does so with the other. So whatever
//! a power cut, or the flash, makes of a half that is being written, the other one is whole, with the old
//! settings or with the new ones, and the next start makes the two equal again. And within a half,
//! [`pages`](super::pages) never touches what its copy consists of.
//!
//! Where one half does not take a copy any more, because it is worn out, there is only the other. Then
//! a store is good when that one has it, and the health says so.

use super::{MemoryHealth, StoreError};
use crate::log::warning;
use core::ops::Range;
use embedded_storage_async::nor_flash::NorFlash;
use heapless::Vec;
use protocol_core::settings::{MAX_RECORD, Settings};
use sequential_storage::map::MapConfig;

/// Bytes of the sequence number, little-endian.
pub(super) const SEQUENCE: usize = 4;
/// Longest item: sequence number and record.
const MAX_ITEM: usize = SEQUENCE + MAX_RECORD;
/// Any flash's word, and a divisor of any page.
pub(super) const LONGEST_WORD: usize = 32;
/// Room for the item with its key, rounded up to any flash's word.
const BUFFER: usize = (1 + MAX_ITEM).next_multiple_of(LONGEST_WORD);
/// Pages of the smallest range: in each half one that holds the copy, and one for the next.
const MIN_PAGES: u32 = 4;

/// Some flash can be written from aligned memory only.
#[repr(align(4))]
pub(super) struct Buffer(pub(super) [u8; BUFFER]);

/// The newest record of a half.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Copy {
    /// Its sequence number.
    pub(super) sequence: u32,
    /// Where its page begins.
    pub(super) page: u32,
    /// Whether its settings are the staged ones.
    pub(super) same: bool,
}

/// What the lower half holds, and what the upper one does.
type Copies = [Option<Copy>; 2];

/// A range of flash that holds the settings.
pub struct Memory<F> {
    pub(super) flash: F,
    pub(super) range: Range<u32>,
    /// What is to be in both halves: sequence number and record.
    pub(super) item: Vec<u8, MAX_ITEM>,
    pub(super) buffer: Buffer,
    /// The last sequence number that was given, whether or not it could be stored.
    last: u32,
    health: MemoryHealth,
}

impl<F: NorFlash> Memory<F> {
    /// Over `range` of `flash`: an even number of whole pages, four at least; `None` when it is not.
    ///
    /// What does not fit into one page cannot be stored: pages of 1 kB have room for the longest record.
    pub fn new(flash: F, range: Range<u32>) -> Option<Self> {
        let page = F::ERASE_SIZE as u32;
        let length = range.end.checked_sub(range.start)?;
        if !length.is_multiple_of(2 * page) || length < MIN_PAGES * page {
            return None;
        }
        MapConfig::<F>::try_new(range.clone()).ok()?;
        Some(Self {
            flash,
            range,
            item: Vec::new(),
            buffer: Buffer([0; BUFFER]),
            last: 0,
            health: MemoryHealth::Fresh,
        })
    }

    /// How it is.
    pub const fn health(&self) -> MemoryHealth {
        self.health
    }

    /// What is remembered, or defaults. A copy that was lost is written again. A flash that holds
    /// something else stays as it is, until something is stored.
    pub async fn load(&mut self) -> (Settings, MemoryHealth) {
        let settings = self.recall().await;
        if !matches!(self.health, MemoryHealth::Fresh | MemoryHealth::Sound) {
            warning!("memory: {}", self.health.text());
        }
        (settings, self.health)
    }

    async fn recall(&mut self) -> Settings {
        let mut copies = self.look_and_adopt().await;
        let mut is_whole = true;
        if newest(copies).is_none() {
            if self.is_blank(self.range.clone()).await {
                self.health = MemoryHealth::Fresh;
                return Settings::default();
            }
            let Some(parts) = self.parts().await else {
                self.health = MemoryHealth::Foreign;
                return Settings::default();
            };
            self.stage(&parts);
            self.number(1);
            self.bring_over().await;
            copies = self.look().await;
        } else {
            is_whole = copies.into_iter().all(|copy| self.is_item(copy));
        }
        let Some(settings) = self.item.get(SEQUENCE..).and_then(Settings::from_bytes) else {
            // Of later firmware, perhaps, which may come back.
            self.health = MemoryHealth::Foreign;
            return Settings::default();
        };
        self.last = newest(copies).unwrap_or_default();
        self.health = match self.spread(copies).await {
            [true, true] if is_whole => MemoryHealth::Sound,
            [true, true] => MemoryHealth::Repaired,
            [false, false] => MemoryHealth::WornOut,
            _ => MemoryHealth::Single,
        };
        settings
    }

    /// Stores settings. The same ones again are not written.
    ///
    /// `Ok` means that they have been read back from flash in both halves, or in the one that is
    /// not worn out: then [`Self::health`] says so.
    ///
    /// # Errors
    /// [`StoreError`] when neither half takes them: then the old ones are what a restart finds.
    pub async fn store(&mut self, settings: &Settings) -> Result<(), StoreError> {
        self.stage(settings);
        self.commit().await
    }

    /// Makes settings those that [`Self::commit`] stores.
    pub(super) fn stage(&mut self, settings: &Settings) {
        self.item.clear();
        // They fit: MAX_ITEM is the sum of the two.
        let _ = self.item.extend_from_slice(&[0; SEQUENCE]);
        let _ = self.item.extend_from_slice(&settings.to_bytes());
    }

    /// Stores what was staged.
    pub(super) async fn commit(&mut self) -> Result<(), StoreError> {
        let copies = self.look().await;
        let newest = newest(copies);
        let is_kept = |copy: Option<Copy>| {
            copy.is_some_and(|copy| copy.same && Some(copy.sequence) == newest)
        };
        let kept = copies.map(is_kept);
        let is_single = self.health == MemoryHealth::Single;
        if kept == [true; 2] || (is_single && kept.contains(&true)) {
            return Ok(());
        }
        self.last = match newest {
            // It is the other half that has to follow.
            Some(newest) if kept.contains(&true) => newest,
            // No flash outlives the numbers.
            newest => newest.unwrap_or_default().max(self.last).saturating_add(1),
        };
        self.number(self.last);
        self.health = match (self.spread(copies).await, self.health) {
            // What was found at the start stays told.
            ([true, true], told @ (MemoryHealth::Foreign | MemoryHealth::Repaired)) => told,
            ([true, true], _) => MemoryHealth::Sound,
            ([false, false], _) => MemoryHealth::WornOut,
            _ => MemoryHealth::Single,
        };
        match self.health {
            MemoryHealth::WornOut => Err(StoreError),
            _ => Ok(()),
        }
    }

    /// Writes the item into the halves that do not hold it, one after the other, and tells which do now.
    async fn spread(&mut self, copies: Copies) -> [bool; 2] {
        let [lower_half, upper_half] = self.halves();
        let [mut lower, mut upper] = copies;
        // A half without a copy first: the other one keeps the old settings meanwhile.
        if upper.is_none() {
            upper = self.ensure(upper_half.clone(), upper).await;
        }
        lower = self.ensure(lower_half, lower).await;
        upper = self.ensure(upper_half, upper).await;
        [self.is_item(lower), self.is_item(upper)]
    }

    async fn ensure(&mut self, half: Range<u32>, copy: Option<Copy>) -> Option<Copy> {
        match self.is_item(copy) {
            true => copy,
            false => self.put(half, copy).await,
        }
    }

    /// What the halves hold now.
    async fn look(&mut self) -> Copies {
        let [lower, upper] = self.halves();
        [self.newest(lower).await, self.newest(upper).await]
    }

    /// What the halves hold now; the newest record becomes the item.
    async fn look_and_adopt(&mut self) -> Copies {
        let copies = self.look().await;
        let newest = copies
            .into_iter()
            .flatten()
            .max_by_key(|copy| copy.sequence);
        if let Some(newest) = newest {
            self.adopt(newest.page).await;
        }
        // Once more, to know which are equal to the item.
        self.look().await
    }

    const fn halves(&self) -> [Range<u32>; 2] {
        let Range { start, end } = self.range;
        let middle = start.midpoint(end);
        [start..middle, middle..end]
    }

    /// Numbers the item.
    fn number(&mut self, sequence: u32) {
        if let Some(number) = self.item.first_chunk_mut() {
            *number = sequence.to_le_bytes();
        }
    }

    /// Whether a half holds the item.
    pub(super) fn is_item(&self, copy: Option<Copy>) -> bool {
        let number = self.item.first_chunk().copied().map(u32::from_le_bytes);
        copy.is_some_and(|copy| copy.same && Some(copy.sequence) == number)
    }
}

fn newest([lower, upper]: Copies) -> Option<u32> {
    let sequence = |copy: Option<Copy>| copy.map(|copy| copy.sequence);
    sequence(lower).max(sequence(upper))
}
