//! Settings in flash, through `sequential-storage`: each under its key, the newest one counts.
//!
//! Written only while the arm rests: who asks for a store holds the arm at rest meanwhile.

use crate::log::warning;
use core::fmt::{self, Debug};
use core::ops::Range;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_sync::signal::Signal;
use embedded_storage_async::nor_flash::NorFlash;
use protocol_core::settings::{MAX_SETTING, Setting, Settings};
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

/// Room for the longest setting with its key, rounded up to any flash's word.
const BUFFER: usize = (MAX_SETTING + 1).next_multiple_of(32) + 32;

/// The setting could not be written, or did not read back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoreError;

impl fmt::Display for StoreError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("the memory did not take it")
    }
}

/// The way of the other services to the memory.
#[derive(Default)]
pub struct Store {
    turn: Mutex<CriticalSectionRawMutex, ()>,
    request: Signal<CriticalSectionRawMutex, Setting>,
    outcome: Signal<CriticalSectionRawMutex, Result<(), StoreError>>,
}

impl Store {
    /// With nothing to do.
    pub const fn new() -> Self {
        Self {
            turn: Mutex::new(()),
            request: Signal::new(),
            outcome: Signal::new(),
        }
    }

    /// Stores a setting; returns when it has been read back. The arm must rest meanwhile.
    ///
    /// # Errors
    /// [`StoreError`] when the flash refuses; the old value is what a restart finds then.
    pub async fn save(&self, setting: Setting) -> Result<(), StoreError> {
        let _turn = self.turn.lock().await;
        self.outcome.reset();
        self.request.signal(setting);
        self.outcome.wait().await
    }

    /// The storage service of a board without memory: nothing is stored, and everybody is told so.
    pub async fn refuse(&self) -> ! {
        loop {
            self.request.wait().await;
            self.outcome.signal(Err(StoreError));
        }
    }

    /// The storage service: writes what [`Self::save`] is given, for ever.
    pub async fn run<F: NorFlash>(&self, mut memory: Memory<F>) -> ! {
        loop {
            let setting = self.request.wait().await;
            let outcome = memory.store(&setting).await;
            if outcome.is_err() {
                warning!("setting {} could not be stored", setting.key());
            }
            self.outcome.signal(outcome);
        }
    }
}

/// Nothing is cached: settings are read at the start and written by hand.
type NoCache = Cache<Uncached, Uncached, Uncached, u8>;

/// A range of flash that holds the settings.
pub struct Memory<F: NorFlash> {
    map: MapStorage<u8, F, NoCache>,
}

impl<F: NorFlash> Memory<F> {
    /// Over `range` of `flash`, which is made of at least two whole pages; `None` when it is not.
    pub fn new(flash: F, range: Range<u32>) -> Option<Self> {
        let config = MapConfig::try_new(range).ok()?;
        Some(Self {
            map: MapStorage::new(flash, config, Cache::new_uncached()),
        })
    }

    /// What is remembered; what is absent has its default. Flash that holds something else than
    /// settings is erased, or nothing could ever be stored there.
    pub async fn load(&mut self) -> Settings {
        let mut settings = Settings::default();
        for key in Setting::KEYS {
            match self.fetch(key).await {
                Ok(Some(setting)) => settings.set(setting),
                Ok(None) => {}
                Err(StoreError) => {
                    warning!("the settings cannot be read: starting with defaults");
                    if self.map.erase_all().await.is_err() {
                        warning!("the settings cannot be erased");
                    }
                    return Settings::default();
                }
            }
        }
        settings
    }

    async fn fetch(&mut self, key: u8) -> Result<Option<Setting>, StoreError> {
        let mut buffer = [0; BUFFER];
        let bytes = self.map.fetch_item::<&[u8]>(&mut buffer, &key).await;
        let bytes = bytes.map_err(|_| StoreError)?;
        Ok(bytes.and_then(|bytes| Setting::from_bytes(key, bytes)))
    }

    async fn store(&mut self, setting: &Setting) -> Result<(), StoreError> {
        let key = setting.key();
        // Writing the same value again would only wear the flash.
        if self.fetch(key).await?.as_ref() == Some(setting) {
            return Ok(());
        }
        let mut buffer = [0; BUFFER];
        let bytes = setting.to_bytes();
        self.map
            .store_item(&mut buffer, &key, &bytes.as_slice())
            .await
            .map_err(|_| StoreError)?;
        match self.fetch(key).await? == Some(setting.clone()) {
            true => Ok(()),
            false => Err(StoreError),
        }
    }
}
