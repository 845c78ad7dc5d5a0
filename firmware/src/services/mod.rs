//! One module a service; [`House`] is what they share.

pub mod arm;
pub mod dhcp;
pub mod discovery;
pub mod drawer;
pub mod drawings;
pub mod job;
pub mod line_us;
pub mod names;
pub mod network;
pub mod panel;
pub mod portal;
pub mod serial;
pub mod storage;
pub mod update;
pub mod web;
mod window;

use crate::board::Vitals;
use arm::Arm;
use core::cell::{Cell, RefCell};
use core::net::IpAddr;
use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use discovery::Discovery;
use drawer::Drawer;
use drawings::Drawings;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::{Duration, Instant, Timer};
use job::Job;
use network::Wifi;
use panel::Panel;
use protocol_core::arm::Calibration;
use protocol_core::drawings::Slot;
use protocol_core::lineus::Identity;
use protocol_core::machine::{ArmData, Client, Machine};
use protocol_core::settings::{MachineName, Settings};
use storage::{Store, StoreError};
use update::Update;

/// What the services of one arm share.
pub struct House {
    /// The arm.
    pub arm: Arm,
    /// Where settings go.
    pub store: Store,
    /// The drawings that it keeps.
    pub drawings: Drawings,
    /// What is drawn of them.
    pub drawer: Drawer,
    /// The network to be in.
    pub wifi: Wifi,
    /// How the machine is found.
    pub discovery: Discovery,
    /// Light and button.
    pub panel: Panel,
    /// New firmware.
    pub update: Update,
    /// The drawing that the machine draws by itself.
    pub job: Job,
    /// Line-us clients that are connected.
    pub clients: AtomicU8,
    /// Under which the machine can be reached, if it knows.
    pub address: Mutex<CriticalSectionRawMutex, Cell<Option<IpAddr>>>,
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
        let mut machine = Machine::new(data, settings.calibration);
        machine.set_compensation(settings.compensation());
        machine.set_directions(settings.directions);
        Self {
            arm: Arm::new(machine),
            store: Store::new(),
            drawings: Drawings::new(),
            drawer: Drawer::new(),
            wifi: Wifi::new(),
            discovery: Discovery::new(),
            panel: Panel::new(),
            update: Update::new(),
            job: Job::new(),
            clients: AtomicU8::new(0),
            address: Mutex::new(Cell::new(None)),
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

    /// Whether something is drawn from memory or by the web interface, paused included, or is recorded.
    fn has_drawing_under_way(&self) -> bool {
        let job = self.job.state().is_some_and(job::State::is_under_way);
        job || self.drawer.is_drawing() || self.drawings.is_recording()
    }

    /// A little wave, if the arm is to make any and has nothing else to do, not even between two lines of a drawing;
    /// says whether it makes one.
    fn wave(&self) -> bool {
        let wanted = self.settings(|settings| settings.waves);
        wanted && !self.has_drawing_under_way() && self.arm.wave()
    }

    /// Waves before the first client after power-on is greeted, and is home again.
    async fn greet_first_client(&self) {
        // Workers share one executor: nobody comes in between.
        let greeted = self.greeted.load(Ordering::Relaxed);
        self.greeted.store(true, Ordering::Relaxed);
        if !greeted && self.wave() {
            // By its end and not by its time: frames may be late, and whoever has heard the greeting takes
            // the arm to be at home.
            while self.arm.with(|machine| machine.is_waving()) {
                Timer::after_millis(1).await;
            }
        }
    }

    /// Forgets everything: factory reset.
    ///
    /// # Errors
    /// When the memory does not take it: nothing has changed then, or drawings are left.
    async fn forget_everything(&self) -> Result<(), StoreError> {
        let forget = |settings: &mut Settings| *settings = Settings::default();
        self.change(Client::HOUSE, forget).await?;
        self.drawer.set_replay(None);
        self.drawer.stop();
        let mut outcome = Ok(());
        for (slot, _) in self.drawings.contents().iter() {
            let deleted = self.drawings.delete(slot, Client::HOUSE, &self.arm).await;
            outcome = outcome.and(deleted.map_err(|_| StoreError));
        }
        self.wifi.restart();
        outcome
    }

    /// Which drawing a short press of the button draws now.
    fn drawing_for_button(&self) -> Option<Slot> {
        let choice = self.settings(|settings| settings.button);
        // When somebody presses a button is as good as any dice.
        let random = Instant::now().as_micros() as u32;
        choice.choose(&self.drawings.contents(), self.drawer.last(), random)
    }

    /// Draws the drawing of the button, unless the arm has something else to do.
    fn draw_by_button(&self) {
        let idle = self.arm.with(|machine| machine.is_idle());
        if let Some(slot) = self.drawing_for_button()
            && idle
        {
            // Of two presses at once one is enough.
            let _ = self.drawer.draw(slot);
        }
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

    /// Makes the place where the arm rests the calibration point, or removes the calibration.
    async fn calibrate(&self, here: bool, client: Client) -> Result<(), StoreError> {
        let calibrate = |settings: &mut Settings| {
            settings.calibration = match here {
                true => self.arm.with(|machine| machine.calibration_here()),
                false => Calibration::default(),
            };
        };
        self.change(client, calibrate).await
    }

    fn put_in_force(&self, new: Settings) {
        let (calibration, directions) = (new.calibration, new.directions);
        let (map, shift, compensation) = (new.map, new.shift, new.compensation());
        let old = self.settings.lock(|settings| settings.replace(new));
        if self.settings(|new| old.name != new.name) {
            self.discovery.renamed();
        }
        if self.settings(|new| old.networks != new.networks) {
            self.wifi.changed();
        }
        self.arm.with(|machine| {
            if old.calibration != calibration {
                machine.set_calibration(calibration);
            }
            if (old.map, old.shift) != (map, shift) {
                machine.set_compensation(compensation);
            }
            if old.directions != directions {
                machine.set_directions(directions);
            }
        });
    }
}
