//! What has happened, each with its time: what is said when a scenario fails.
//!
//! It belongs to the thread, as the time of a scenario does; the firmware's own log goes there too.

use embassy_time::Instant;
use std::cell::RefCell;
use std::fmt::{self, Display};

thread_local! {
    static ENTRIES: RefCell<Option<Vec<Entry>>> = const { RefCell::new(None) };
}

#[derive(Clone, Debug)]
struct Entry {
    at: Instant,
    text: String,
}

impl Display for Entry {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:>11} {}", seconds(self.at), self.text)
    }
}

/// A time as it is told: seconds with three decimals.
pub fn seconds(at: Instant) -> String {
    format!("{:.3} s", at.as_micros() as f64 / 1e6)
}

/// As long as this lives, this thread's journal is kept.
#[derive(Debug)]
pub struct Journal(());

impl Journal {
    /// Begins an empty journal.
    pub fn begin() -> Self {
        ENTRIES.set(Some(Vec::new()));
        // The second time it is there already.
        if log::set_logger(&FirmwareLog).is_ok() {
            log::set_max_level(log::LevelFilter::Info);
        }
        Self(())
    }

    /// The last entries, at most `count` of them, the oldest first.
    pub fn last(&self, count: usize) -> Vec<String> {
        ENTRIES.with_borrow(|entries| {
            let entries = entries.as_deref().unwrap_or_default();
            let skipped = entries.len().saturating_sub(count);
            entries
                .iter()
                .skip(skipped)
                .map(ToString::to_string)
                .collect()
        })
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        ENTRIES.set(None);
    }
}

/// Notes that something happens now.
pub fn note(what: impl Display) {
    ENTRIES.with_borrow_mut(|entries| {
        if let Some(entries) = entries {
            entries.push(Entry {
                at: Instant::now(),
                text: what.to_string(),
            });
        }
    });
}

struct FirmwareLog;

impl log::Log for FirmwareLog {
    fn enabled(&self, _: &log::Metadata<'_>) -> bool {
        true
    }

    fn log(&self, record: &log::Record<'_>) {
        note(format_args!("    log: {}", record.args()));
    }

    fn flush(&self) {}
}
