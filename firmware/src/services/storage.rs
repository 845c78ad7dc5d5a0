//! What is remembered: the way of the other services to the memory, and how the memory is.
//!
//! Written only while the arm rests: who asks for a store holds the arm at rest meanwhile.

mod memory;
mod pages;
mod parts;
mod view;

pub use memory::Memory;

use super::window::{Ticket, Turn, Window};
use crate::log::warning;
use core::borrow::BorrowMut;
use core::cell::{Cell, RefCell};
use core::fmt;
use embassy_sync::blocking_mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embedded_storage_async::nor_flash::NorFlash;
use protocol_core::settings::Settings;

/// The settings could not be written, or did not read back: what was stored before still is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoreError;

impl fmt::Display for StoreError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("the memory did not take it")
    }
}

/// How the memory is, for diagnostics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MemoryHealth {
    /// This board has none, or has not found it.
    #[default]
    Missing,
    /// Nothing has ever been stored.
    Fresh,
    /// Two good copies.
    Sound,
    /// The flash held something else than settings: the arm started with defaults.
    Foreign,
    /// One of the two copies was damaged, or its store cut short, and has been written again.
    Repaired,
    /// One of the two copies cannot be written any more: there is only the other.
    Single,
    /// What was to be stored last is not.
    WornOut,
}

impl MemoryHealth {
    /// In words, without a double quote.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Missing => "none",
            Self::Fresh => "ok, nothing stored yet",
            Self::Sound => "ok",
            Self::Foreign => "held no settings, started with defaults",
            Self::Repaired => "ok, one of two copies had to be written again",
            Self::Single => "worn out, one of two copies cannot be written",
            Self::WornOut => "worn out, does not take what is stored",
        }
    }
}

impl fmt::Display for MemoryHealth {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.text())
    }
}

/// The way of the other services to the memory.
///
/// Settings are a kilobyte: there is one place for those that are being stored, here, instead of one in
/// each task that may want to.
pub struct Store {
    window: Window<Result<(), StoreError>>,
    proposal: blocking_mutex::Mutex<CriticalSectionRawMutex, RefCell<Option<Settings>>>,
    health: blocking_mutex::Mutex<CriticalSectionRawMutex, Cell<MemoryHealth>>,
}

impl Default for Store {
    fn default() -> Self {
        Self::new()
    }
}

impl Store {
    /// With nothing to do.
    pub const fn new() -> Self {
        Self {
            window: Window::new(),
            proposal: blocking_mutex::Mutex::new(RefCell::new(None)),
            health: blocking_mutex::Mutex::new(Cell::new(MemoryHealth::Missing)),
        }
    }

    /// Stores settings; returns when they have been read back. The arm must rest meanwhile. To change
    /// settings, use [`super::House::change`].
    ///
    /// # Errors
    /// [`StoreError`] when the flash refuses; the old settings are what a restart finds then.
    pub async fn save(&self, settings: Settings) -> Result<(), StoreError> {
        let mut turn = self.turn().await;
        self.propose(|proposal| *proposal = Some(settings));
        self.perform(&mut turn).await
    }

    /// How the memory is.
    pub fn health(&self) -> MemoryHealth {
        self.health.lock(Cell::get)
    }

    /// Waits until nobody else stores.
    pub(super) async fn turn(&self) -> Turn<'_> {
        self.window.turn().await
    }

    /// Something short with what is to be stored; only for whose turn it is.
    pub(super) fn propose<T>(&self, f: impl FnOnce(&mut Option<Settings>) -> T) -> T {
        self.proposal.lock(|proposal| f(&mut proposal.borrow_mut()))
    }

    /// Has the proposal stored.
    pub(super) async fn perform(&self, turn: &mut Ticket) -> Result<(), StoreError> {
        self.window.ask(turn).await
    }

    /// The storage service of a board without memory: nothing is stored, and everybody is told so.
    pub async fn refuse(&self) -> ! {
        self.tell(MemoryHealth::Missing);
        loop {
            let ticket = self.window.next().await;
            self.window.tell(ticket, Err(StoreError));
        }
    }

    /// The storage service: writes what it is given, for ever.
    ///
    /// A memory is 2 kB: a chip lends it, or its task would have a few of them on the way in here.
    pub async fn run<F: NorFlash>(&self, mut memory: impl BorrowMut<Memory<F>>) -> ! {
        let memory = memory.borrow_mut();
        self.tell(memory.health());
        loop {
            let ticket = self.window.next().await;
            self.propose(|proposal| {
                if let Some(settings) = proposal {
                    memory.stage(settings);
                }
            });
            let outcome = memory.commit().await;
            self.tell(memory.health());
            if outcome.is_err() {
                warning!("the settings could not be stored");
            }
            self.window.tell(ticket, outcome);
        }
    }

    fn tell(&self, health: MemoryHealth) {
        self.health.lock(|told| told.set(health));
    }
}

#[cfg(test)]
#[cfg(feature = "desktop")]
mod tests;
