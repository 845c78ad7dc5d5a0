//! Settings of firmware before 0.1.0 are carried over: each was stored by itself, under a key, in one map
//! over the whole range.
//!
//! There they lie once, in any pages, so nothing may be erased before they are somewhere else as well.
//! What is not theirs is the free space of pages: into that goes one record of them all, which is
//! good as soon as it is whole. Then its half has a good copy, and the other half can be erased and
//! written as after any damage; at last the half of the old settings is.

use super::memory::{KEY, Memory, NoCache, ON_ITS_WAY};
use super::view::{Access, LONGEST_WORD, Page, Unrepaired, is_mark, word};
use embedded_storage_async::nor_flash::NorFlash;
use protocol_core::settings::Settings;
use sequential_storage::cache::Cache;
use sequential_storage::map::{MapConfig, MapStorage};

impl<F: NorFlash> Memory<F> {
    /// Settings that are stored by themselves, if there are any.
    pub(super) async fn parts(&mut self) -> Option<Settings> {
        let mut settings = Settings::default();
        let mut found = None;
        for key in Settings::PART_KEYS {
            let config = MapConfig::try_new(self.range.clone()).ok()?;
            let flash = Unrepaired(&mut self.flash);
            let mut map: MapStorage<u8, _, NoCache> =
                MapStorage::new(flash, config, Cache::new_uncached());
            let part = map.fetch_item::<&[u8]>(&mut self.buffer.0, &key).await;
            if let Ok(Some(bytes)) = part {
                found = found.or(settings.take_part(key, bytes));
            }
        }
        found.map(|()| settings)
    }

    /// Puts one record of settings that are stored by themselves into the free space of one of their
    /// pages, if there is any.
    pub(super) async fn bring_over(&mut self, parts: &Settings) {
        self.stage(parts);
        self.number(ON_ITS_WAY);
        // A page that is begun is the surest: its mark is there already.
        for is_begun in [true, false] {
            for page in self.range.clone().step_by(F::ERASE_SIZE) {
                let end = page + (F::ERASE_SIZE - F::READ_SIZE) as u32;
                let is_full = self.is_marked(end).await;
                if is_full || self.is_marked(page).await != is_begun {
                    continue;
                }
                if self.add(page).await && (is_begun || self.begin(page).await) {
                    return;
                }
            }
        }
    }

    /// Adds the item to what a page holds, and reads it back.
    async fn add(&mut self, page: u32) -> bool {
        let Ok(config) = MapConfig::try_new(0..Page::<F>::SIZE) else {
            return false;
        };
        let view = Page::new(&mut self.flash, page, Access::Append);
        let mut map: MapStorage<u8, _, NoCache> =
            MapStorage::new(view, config, Cache::new_uncached());
        let item = self.item.as_slice();
        let stored = map.store_item(&mut self.buffer.0, &KEY, &item).await;
        // There is no cache: this comes from flash.
        let read = map.fetch_item::<&[u8]>(&mut self.buffer.0, &KEY).await;
        stored.is_ok() && read.is_ok_and(|read| read == Some(item))
    }

    /// Marks a page as begun, which is what makes its items count. The old settings stay readable for as
    /// long as it is not marked, and the record is readable as soon as it is.
    async fn begin(&mut self, page: u32) -> bool {
        let mark = [0; LONGEST_WORD];
        let mark = mark.get(..word::<F>()).unwrap_or(&mark);
        let written = self.flash.write(page, mark).await;
        written.is_ok() && self.is_marked(page).await
    }

    async fn is_marked(&mut self, at: u32) -> bool {
        let Some(mark) = self.buffer.0.get_mut(..F::READ_SIZE) else {
            return false;
        };
        self.flash.read(at, mark).await.is_ok() && is_mark(mark)
    }
}
