//! One module a service; [`House`] is what they share.

pub mod arm;
pub mod dhcp;
pub mod line_us;
pub mod network;
pub mod panel;
pub mod storage;
pub mod update;

use crate::board::Vitals;
use arm::Arm;
use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::{Duration, Instant, Timer};
use network::Wifi;
use panel::Panel;
use protocol_core::lineus::Identity;
use protocol_core::machine::{ArmData, Client, Machine};
use protocol_core::motion::WAVE;
use protocol_core::settings::{MachineName, Settings};
use storage::{Store, StoreError};
use update::Update;

/// What the services of one arm share.
pub struct House {
    /// The arm.
    pub arm: Arm,
    /// Where settings go.
    pub store: Store,
    /// The network to be in.
    pub wifi: Wifi,
    /// Light and button.
    pub panel: Panel,
    /// New firmware.
    pub update: Update,
    /// Who this machine is.
    pub identity: Identity,
    /// How it is.
    pub vitals: Vitals,
    settings: Mutex<CriticalSectionRawMutex, RefCell<Settings>>,
    greeted: AtomicBool,
    started: Instant,
}

impl House {
    /// An arm at home, with the settings it remembers.
    pub fn new(data: ArmData, settings: Settings, identity: Identity, vitals: Vitals) -> Self {
        Self {
            arm: Arm::new(Machine::new(data, settings.calibration)),
            store: Store::new(),
            wifi: Wifi::new(),
            panel: Panel::new(),
            update: Update::new(),
            identity,
            vitals,
            settings: Mutex::new(RefCell::new(settings)),
            greeted: AtomicBool::new(false),
            started: Instant::now(),
        }
    }

    /// Time since the firmware started.
    pub fn uptime(&self) -> Duration {
        self.started.elapsed()
    }

    /// Something short with the settings in force.
    pub fn settings<T>(&self, f: impl FnOnce(&Settings) -> T) -> T {
        self.settings.lock(|settings| f(&settings.borrow()))
    }

    /// The machine's name.
    pub fn name(&self) -> MachineName {
        self.settings(|settings| settings.name.clone())
    }

    /// A little wave, if the arm is to make any and has nothing else to do; says whether it makes one.
    fn wave(&self) -> bool {
        self.settings(|settings| settings.waves) && self.arm.wave()
    }

    /// Waves before the first client after power-on is greeted, and is home again.
    async fn greet_first_client(&self) {
        // Workers share one executor: nobody comes in between.
        let greeted = self.greeted.load(Ordering::Relaxed);
        self.greeted.store(true, Ordering::Relaxed);
        if !greeted && self.wave() {
            Timer::after_micros(WAVE.get()).await;
        }
    }

    /// Forgets everything: factory reset.
    ///
    /// # Errors
    /// When the memory does not take it: nothing has changed then.
    async fn forget_everything(&self) -> Result<(), StoreError> {
        let forget = |settings: &mut Settings| *settings = Settings::default();
        self.change(Client::HOUSE, forget).await?;
        self.wifi.restart();
        Ok(())
    }

    /// Changes settings: waits until the arm rests, and keeps it at rest while the changed settings are
    /// stored. Then they are in force. Gives what `change` gave.
    ///
    /// `change` works on a copy. It is short, and the arm rests when it is called. If it changes nothing,
    /// nothing is written.
    ///
    /// # Errors
    /// When the memory does not take them: nothing has changed then.
    pub async fn change<T>(
        &self,
        client: Client,
        change: impl FnOnce(&mut Settings) -> T,
    ) -> Result<T, StoreError> {
        let _rest = self.arm.rest(client).await;
        let mut turn = self.store.turn().await;
        let answer = self.store.propose(|proposal| {
            let now = self.settings(Settings::clone);
            change(proposal.insert(now))
        });
        self.store.perform(&mut turn).await?;
        if let Some(new) = self.store.propose(Option::take) {
            self.put_in_force(new);
        }
        Ok(answer)
    }

    fn put_in_force(&self, new: Settings) {
        let calibration = new.calibration;
        let old = self.settings.lock(|settings| settings.replace(new));
        if old.calibration != calibration {
            self.arm
                .with(|machine| machine.set_calibration(calibration));
        }
    }
}
