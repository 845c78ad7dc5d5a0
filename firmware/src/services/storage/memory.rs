//! The settings in flash, twice, through `sequential-storage`.
//!
//! The range of flash is two halves, each a map of its own with one item: the record of all settings,
//! behind a sequence number that grows with each store. The newest record counts.
//!
//! What makes it safe: **a half is written only while the other one holds a good copy**, of the old
//! settings or of the new ones. So whatever a power cut, or the flash, makes of the half that is being
//! written, the other one is whole, and the next start writes the damaged one anew. Nothing is assumed of
//! a half that was being written: what it holds is found by looking at each of its pages by itself.
//!
//! Where one half is worn out, there is no such second copy. The other one is then written nevertheless,
//! behind its old record, and the health says so.

use super::view::{Access, LONGEST_WORD, Page};
use super::{MemoryHealth, StoreError};
use crate::log::warning;
use core::ops::Range;
use embedded_storage_async::nor_flash::NorFlash;
use heapless::Vec;
use protocol_core::settings::{MAX_RECORD, Settings};
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

/// The record's key; 1 to 3 were those of single settings.
pub(super) const KEY: u8 = b'Q';
/// Bytes of the sequence number, little-endian.
const SEQUENCE: usize = 4;
/// The sequence number of a record that lies among settings stored by themselves, `parts.rs`: its half has
/// to be erased before it is written again.
pub(super) const ON_ITS_WAY: u32 = 0;
/// Longest item: sequence number and record.
const MAX_ITEM: usize = SEQUENCE + MAX_RECORD;
/// Room for the item with its key, rounded up to any flash's word.
const BUFFER: usize = (1 + MAX_ITEM).next_multiple_of(LONGEST_WORD);
/// Pages of the smallest range: an erased one and another in each half.
const MIN_PAGES: u32 = 4;

/// Nothing is cached: what is read comes from flash.
pub(super) type NoCache = Cache<Uncached, Uncached, Uncached, u8>;

/// Some flash can be written from aligned memory only.
#[repr(align(4))]
pub(super) struct Buffer(pub(super) [u8; BUFFER]);

/// What a half holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Holding {
    /// Nothing: it is erased.
    Blank,
    /// Something, but no record.
    Other,
    /// A record, the newest of the half.
    Record {
        /// Its sequence number.
        sequence: u32,
        /// Whether its settings are the staged ones.
        same: bool,
    },
}

impl Holding {
    const fn sequence(self) -> Option<u32> {
        match self {
            Self::Record { sequence, .. } => Some(sequence),
            Self::Blank | Self::Other => None,
        }
    }

    const fn is_record(self) -> bool {
        self.sequence().is_some()
    }
}

/// One of the halves.
#[derive(Clone, Copy)]
enum Half {
    Lower,
    Upper,
}

/// Both halves, in some order, as they are found.
struct Halves {
    lower: Holding,
    upper: Holding,
}

impl Halves {
    const fn of(&mut self, half: Half) -> (&mut Holding, Holding) {
        match half {
            Half::Lower => (&mut self.lower, self.upper),
            Half::Upper => (&mut self.upper, self.lower),
        }
    }

    fn are_blank(&self) -> bool {
        [self.lower, self.upper] == [Holding::Blank; 2]
    }

    fn newest(&self) -> Option<u32> {
        self.lower.sequence().max(self.upper.sequence())
    }
}

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
    /// Over `range` of `flash`: an even number of whole pages, four at least, of which each can hold
    /// the longest record; `None` when it is not.
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
        if self.health != MemoryHealth::Fresh && self.health != MemoryHealth::Sound {
            warning!("memory: {}", self.health.text());
        }
        (settings, self.health)
    }

    async fn recall(&mut self) -> Settings {
        let mut halves = self.look_and_adopt().await;
        let mut moved = false;
        if let (None, false) = (halves.newest(), halves.are_blank()) {
            let Some(parts) = self.parts().await else {
                self.health = MemoryHealth::Foreign;
                return Settings::default();
            };
            self.bring_over(&parts).await;
            halves = self.look_at_both().await;
            moved = true;
            if halves.newest().is_none() {
                self.health = MemoryHealth::WornOut;
                return parts;
            }
        }
        let Some(newest) = halves.newest() else {
            self.health = MemoryHealth::Fresh;
            return Settings::default();
        };
        let Some(settings) = self.item.get(SEQUENCE..).and_then(Settings::from_bytes) else {
            // Of later firmware, perhaps, which may come back.
            self.health = MemoryHealth::Foreign;
            return Settings::default();
        };
        moved |= newest == ON_ITS_WAY;
        self.last = newest.max(ON_ITS_WAY + 1);
        self.number(self.last);
        let whole = moved || self.is_item(halves.lower) && self.is_item(halves.upper);
        let held = self.spread(halves).await;
        self.health = match (held, whole) {
            ([true, true], true) => MemoryHealth::Sound,
            ([true, true], false) => MemoryHealth::Repaired,
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
        let halves = self.look_at_both().await;
        let newest = halves.newest();
        let known = |holding| matches!(holding, Holding::Record { sequence, same: true } if Some(sequence) == newest);
        let kept = [known(halves.lower), known(halves.upper)];
        if kept == [true; 2] || (kept.contains(&true) && self.health == MemoryHealth::Single) {
            return Ok(());
        }
        let sequence = match newest {
            Some(newest) if kept.contains(&true) => newest,
            // As many stores as numbers outlive any flash.
            newest => newest.unwrap_or_default().max(self.last).saturating_add(1),
        };
        self.last = sequence;
        self.number(sequence);
        let held = self.spread(halves).await;
        self.health = match held {
            [true, true] => match self.health {
                told @ (MemoryHealth::Foreign | MemoryHealth::Repaired) => told,
                _ => MemoryHealth::Sound,
            },
            [false, false] => MemoryHealth::WornOut,
            _ => MemoryHealth::Single,
        };
        match held {
            [false, false] => Err(StoreError),
            _ => Ok(()),
        }
    }

    /// Writes the item into the halves that do not hold it, and tells which do now.
    async fn spread(&mut self, mut halves: Halves) -> [bool; 2] {
        // A half without a copy first: the other one keeps the old settings meanwhile.
        let order = match (halves.lower.is_record(), halves.upper.is_record()) {
            (true, false) => [Half::Upper, Half::Lower],
            _ => [Half::Lower, Half::Upper],
        };
        for half in order {
            let (&mut this, other) = halves.of(half);
            if !self.is_item(this) {
                let now = self.put(half, this, other.is_record()).await;
                *halves.of(half).0 = now;
            }
        }
        [self.is_item(halves.lower), self.is_item(halves.upper)]
    }

    /// Writes the item into a half, and reads back what the half holds then. A half that holds no
    /// record, or does not take one, is erased before, unless it holds the only good copy.
    async fn put(&mut self, half: Half, before: Holding, other_is_good: bool) -> Holding {
        let range = self.half(half);
        let clean = match before {
            Holding::Blank => true,
            Holding::Other => false,
            Holding::Record { sequence, .. } => sequence != ON_ITS_WAY || !other_is_good,
        };
        if clean {
            self.append(range.clone()).await;
            let now = self.look(half).await;
            if self.is_item(now) || (now.is_record() && !other_is_good) {
                return now;
            }
            if before.is_record() {
                warning!("a copy of the settings is damaged: erasing its place");
                self.health = MemoryHealth::Repaired;
            }
        }
        // What cannot be erased is looked at below.
        let _ = self.flash.erase(range.start, range.end).await;
        self.append(range).await;
        self.look(half).await
    }

    /// Writes the item as the newest of the map over `range`. Whether it is there is for the reader to
    /// find out.
    async fn append(&mut self, range: Range<u32>) {
        let Ok(config) = MapConfig::try_new(range) else {
            return;
        };
        let mut map: MapStorage<u8, _, NoCache> =
            MapStorage::new(&mut self.flash, config, Cache::new_uncached());
        let item = self.item.as_slice();
        let _ = map.store_item(&mut self.buffer.0, &KEY, &item).await;
    }

    /// What a half holds now.
    async fn look(&mut self, half: Half) -> Holding {
        self.examine(half, None).await
    }

    /// What the halves hold now.
    async fn look_at_both(&mut self) -> Halves {
        Halves {
            lower: self.look(Half::Lower).await,
            upper: self.look(Half::Upper).await,
        }
    }

    /// What the halves hold; the newest record becomes the item.
    async fn look_and_adopt(&mut self) -> Halves {
        let lower = self.examine(Half::Lower, Some(None)).await;
        let upper = self.examine(Half::Upper, Some(lower.sequence())).await;
        Halves { lower, upper }
    }

    /// What a half holds now. With `adopt`, a record that is newer than that becomes the item.
    async fn examine(&mut self, half: Half, mut adopt: Option<Option<u32>>) -> Holding {
        let range = self.half(half);
        let mut holding = Holding::Other;
        for start in range.clone().step_by(F::ERASE_SIZE) {
            let page = Page::new(&mut self.flash, start, Access::Read);
            let Ok(config) = MapConfig::try_new(0..Page::<F>::SIZE) else {
                break;
            };
            let mut map: MapStorage<u8, _, NoCache> =
                MapStorage::new(page, config, Cache::new_uncached());
            let found = map.fetch_item::<&[u8]>(&mut self.buffer.0, &KEY).await;
            // A page that cannot be read holds nothing.
            let Ok(Some(found)) = found else { continue };
            let Some((number, record)) = found.split_first_chunk() else {
                continue;
            };
            let sequence = u32::from_le_bytes(*number);
            if holding.sequence().is_some_and(|newer| newer >= sequence) {
                continue;
            }
            if let Some(newest) = &mut adopt
                && newest.is_none_or(|newest| newest < sequence)
            {
                *newest = Some(sequence);
                self.item.clear();
                let _ = self.item.extend_from_slice(found);
            }
            let same = self.item.get(SEQUENCE..) == Some(record);
            holding = Holding::Record { sequence, same };
        }
        match holding {
            Holding::Other if self.is_blank(range).await => Holding::Blank,
            holding => holding,
        }
    }

    async fn is_blank(&mut self, range: Range<u32>) -> bool {
        for offset in range.step_by(LONGEST_WORD) {
            let piece = self.buffer.0.first_chunk_mut::<LONGEST_WORD>();
            let Some(piece) = piece else { return false };
            let read = self.flash.read(offset, piece).await;
            if read.is_err() || piece.iter().any(|byte| *byte != 0xff) {
                return false;
            }
        }
        true
    }

    /// Numbers the item.
    pub(super) fn number(&mut self, sequence: u32) {
        if let Some(number) = self.item.first_chunk_mut() {
            *number = sequence.to_le_bytes();
        }
    }

    fn is_item(&self, holding: Holding) -> bool {
        let Holding::Record { sequence, same } = holding else {
            return false;
        };
        same && self.item.first_chunk::<SEQUENCE>() == Some(&sequence.to_le_bytes())
    }

    const fn half(&self, half: Half) -> Range<u32> {
        let middle = self.range.start.midpoint(self.range.end);
        match half {
            Half::Lower => self.range.start..middle,
            Half::Upper => middle..self.range.end,
        }
    }
}
