//! The last words of a firmware that failed: kept in RTC memory, which survives a reset but not a power
//! cut, and read once after the restart.

use core::fmt::{self, Write};
use core::panic::PanicInfo;
use esp_hal::ram;
use heapless::String;
use portable_atomic::{AtomicU32, Ordering};
use static_cell::StaticCell;

/// Words of text kept; the rest is cut off.
const WORDS: usize = 60;
/// Longest text kept, in bytes.
const MAX_TEXT: usize = 4 * WORDS;

/// The text, in atomic words because these need no `unsafe`.
#[ram(unstable(rtc_fast, persistent))]
static TEXT: [AtomicU32; WORDS] = [const { AtomicU32::new(0) }; WORDS];
/// Its length in bytes.
#[ram(unstable(rtc_fast, persistent))]
static LENGTH: AtomicU32 = AtomicU32::new(0);
/// [`seal`] of both; after power-up the memory holds noise, which has another one.
#[ram(unstable(rtc_fast, persistent))]
static SEAL: AtomicU32 = AtomicU32::new(0);

/// Takes the text that the last panic left; empty if there was none since power-up.
///
/// # Panics
/// When it is called twice.
pub fn take() -> &'static str {
    static TAKEN: StaticCell<String<MAX_TEXT>> = StaticCell::new();

    let taken = TAKEN.init(String::new());
    if SEAL.load(Ordering::Relaxed) == seal() {
        let bytes = TEXT
            .iter()
            .flat_map(|word| word.load(Ordering::Relaxed).to_le_bytes());
        for byte in bytes.take(LENGTH.load(Ordering::Relaxed) as usize) {
            // A cut may have split a character.
            let character = if byte.is_ascii() {
                char::from(byte)
            } else {
                '?'
            };
            // It is as long as all words together.
            let _ = taken.push(character);
        }
    }
    SEAL.store(!seal(), Ordering::Relaxed);
    taken
}

/// A sum over text and length, not 0 where both are.
fn seal() -> u32 {
    let start = 0x5155_1c4c ^ LENGTH.load(Ordering::Relaxed);
    TEXT.iter().fold(start, |sum, word| {
        sum.rotate_left(5) ^ word.load(Ordering::Relaxed)
    })
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    // Nothing is logged here: the panic may have come out of the logger.
    let mut pen = Pen { used: 0 };
    for word in &TEXT {
        word.store(0, Ordering::Relaxed);
    }
    let _ = write!(pen, "{info}");
    LENGTH.store(pen.used as u32, Ordering::Relaxed);
    SEAL.store(seal(), Ordering::Relaxed);
    esp_hal::system::software_reset()
}

/// Writes bytes into the words.
struct Pen {
    used: usize,
}

impl Write for Pen {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for &byte in text.as_bytes() {
            let Some(word) = TEXT.get(self.used / 4) else {
                break;
            };
            let byte = u32::from(byte) << (8 * (self.used % 4));
            word.store(word.load(Ordering::Relaxed) | byte, Ordering::Relaxed);
            self.used += 1;
        }
        Ok(())
    }
}
