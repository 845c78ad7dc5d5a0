//! The pages of a half of the memory: how its copy is found, and how the next one gets in.
//!
//! Each page is a log of records, marked at its beginning when its first record is whole. A record goes behind
//! the copy, into the same page; where that is full, or does not take it, into another page, which is
//! erased for it. The page of the copy is erased by nobody, so the copy stays until the next one is
//! there.
//!
//! `sequential-storage` would do all this by itself in one map over the pages, but not as safely: after an
//! erase that was cut short, pages may look as if they held something that they do not, and its repair can
//! then erase the page that held the newest item. So it is given one page at a time, and which page
//! is the newest is a matter of the records' sequence numbers.

use super::memory::{Copy, LONGEST_WORD, Memory, SEQUENCE};
use super::view::{Access, Page, is_mark, word};
use core::ops::Range;
use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

/// The record's key; 1 to 3 were those of single settings.
const KEY: u8 = b'Q';

/// Nothing is cached: what is read comes from flash.
type NoCache = Cache<Uncached, Uncached, Uncached, u8>;

/// A map without a memory of its own.
pub(super) type Map<F> = MapStorage<u8, F, NoCache>;

/// A map over a range; `None` if it is not made of pages.
pub(super) fn map<F: NorFlash>(flash: F, range: Range<u32>) -> Option<Map<F>> {
    let config = MapConfig::try_new(range).ok()?;
    Some(MapStorage::new(flash, config, Cache::new_uncached()))
}

impl<F: NorFlash> Memory<F> {
    /// The copy that a half holds now.
    pub(super) async fn newest(&mut self, half: Range<u32>) -> Option<Copy> {
        let mut copy: Option<Copy> = None;
        for page in half.step_by(F::ERASE_SIZE) {
            let view = Page::new(&mut self.flash, page, Access::Read);
            let mut map = map(view, Page::<F>::RANGE)?;
            let found = map.fetch_item::<&[u8]>(&mut self.buffer.0, &KEY).await;
            // A page that cannot be read holds nothing.
            let Ok(Some((number, record))) =
                found.map(|item| item?.split_first_chunk::<SEQUENCE>())
            else {
                continue;
            };
            let sequence = u32::from_le_bytes(*number);
            if copy.is_none_or(|older| older.sequence < sequence) {
                let same = self.item.get(SEQUENCE..) == Some(record);
                copy = Some(Copy {
                    sequence,
                    page,
                    same,
                });
            }
        }
        copy
    }

    /// Makes the newest record of a page the item.
    pub(super) async fn adopt(&mut self, page: u32) {
        self.item.clear();
        let view = Page::new(&mut self.flash, page, Access::Read);
        let Some(mut map) = map(view, Page::<F>::RANGE) else {
            return;
        };
        let found = map.fetch_item::<&[u8]>(&mut self.buffer.0, &KEY).await;
        if let Ok(Some(found)) = found {
            // Longer than any record, it is none.
            let _ = self.item.extend_from_slice(found);
        }
    }

    /// Writes the item into a half that holds `copy`, and gives what it holds then.
    pub(super) async fn put(&mut self, half: Range<u32>, copy: Option<Copy>) -> Option<Copy> {
        let first = copy.map_or(half.start, |copy| copy.page);
        // The page of the copy, and from there once round.
        let pages = (first..half.end).chain(half.start..first);
        for page in pages.step_by(F::ERASE_SIZE) {
            let is_copy = copy.is_some_and(|copy| copy.page == page);
            let is_there = match is_copy {
                true => self.add(page).await,
                false => self.clear(page).await && self.add(page).await && self.begin(page).await,
            };
            if is_there {
                break;
            }
        }
        self.newest(half).await
    }

    /// Adds the item to what a page holds, and reads it back.
    pub(super) async fn add(&mut self, page: u32) -> bool {
        let view = Page::new(&mut self.flash, page, Access::Append);
        let Some(mut map) = map(view, Page::<F>::RANGE) else {
            return false;
        };
        let item = self.item.as_slice();
        let stored = map.store_item(&mut self.buffer.0, &KEY, &item).await;
        let read = map.fetch_item::<&[u8]>(&mut self.buffer.0, &KEY).await;
        stored.is_ok() && read.is_ok_and(|read| read == Some(item))
    }

    /// Marks a page as begun, which is what makes its records count.
    pub(super) async fn begin(&mut self, page: u32) -> bool {
        let mark = [0; LONGEST_WORD];
        let mark = mark.get(..word::<F>()).unwrap_or(&mark);
        let written = self.flash.write(page, mark).await;
        written.is_ok() && self.is_marked(page).await
    }

    /// Erases a page, unless it is erased.
    async fn clear(&mut self, page: u32) -> bool {
        let whole = page..page + F::ERASE_SIZE as u32;
        if self.is_blank(whole.clone()).await {
            return true;
        }
        let erased = self.flash.erase(whole.start, whole.end).await;
        erased.is_ok() && self.is_blank(whole).await
    }

    /// Whether there is a page's mark.
    pub(super) async fn is_marked(&mut self, at: u32) -> bool {
        let Some(mark) = self.buffer.0.get_mut(..F::READ_SIZE) else {
            return false;
        };
        self.flash.read(at, mark).await.is_ok() && is_mark(mark)
    }

    /// Whether a range is erased.
    pub(super) async fn is_blank(&mut self, range: Range<u32>) -> bool {
        for offset in range.step_by(LONGEST_WORD) {
            let Some(piece) = self.buffer.0.first_chunk_mut::<LONGEST_WORD>() else {
                return false;
            };
            let read = self.flash.read(offset, piece).await;
            if read.is_err() || piece.iter().any(|byte| *byte != 0xff) {
                return false;
            }
        }
        true
    }
}
