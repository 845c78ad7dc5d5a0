//! Settings of firmware before 0.1.0 are carried over: each was stored by itself, under a key, in one map
//! over the whole range.
//!
//! There they lie once, in any pages, so nothing may be erased before they are somewhere else as well.
//! What is not theirs is the free space of pages: into that goes one record of them all. Once it is whole,
//! it is the copy of its half, and the old settings are not looked at any more.

use super::memory::Memory;
use super::pages::map;
use super::view::Unrepaired;
use embedded_storage_async::nor_flash::NorFlash;
use protocol_core::settings::Settings;

impl<F: NorFlash> Memory<F> {
    /// Settings that are stored by themselves, if there are any.
    pub(super) async fn parts(&mut self) -> Option<Settings> {
        let mut settings = Settings::default();
        let mut found = None;
        for key in Settings::PART_KEYS {
            let mut map = map(Unrepaired(&mut self.flash), self.range.clone())?;
            let part = map.fetch_item::<&[u8]>(&mut self.buffer.0, &key).await;
            if let Ok(Some(bytes)) = part {
                found = found.or(settings.take_part(key, bytes));
            }
        }
        found.map(|()| settings)
    }

    /// Puts the item into the free space of a page, if there is any.
    pub(super) async fn bring_over(&mut self) {
        // Where a page is begun, its mark is there already. In another one, the mark comes last, and the
        // old settings can be read until then.
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
}
