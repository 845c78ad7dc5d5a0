//! One module a service; [`House`] is what they share.

pub mod arm;
pub mod dhcp;
pub mod line_us;
pub mod network;
pub mod panel;
pub mod serial;
pub mod storage;

use crate::board::Vitals;
use arm::Arm;
use core::cell::RefCell;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use network::Wifi;
use panel::Panel;
use protocol_core::lineus::Identity;
use protocol_core::machine::{ArmData, Machine};
use protocol_core::settings::{MachineName, Settings};
use storage::Store;

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
    /// Who this machine is.
    pub identity: Identity,
    /// How it is.
    pub vitals: Vitals,
    name: Mutex<CriticalSectionRawMutex, RefCell<MachineName>>,
}

impl House {
    /// An arm at home, with the settings it remembers.
    pub fn new(data: ArmData, settings: Settings, identity: Identity, vitals: Vitals) -> Self {
        Self {
            arm: Arm::new(Machine::new(data, settings.calibration)),
            store: Store::new(),
            wifi: Wifi::new(settings.networks.iter().next().cloned()),
            panel: Panel::new(),
            identity,
            vitals,
            name: Mutex::new(RefCell::new(settings.name)),
        }
    }

    /// The machine's name.
    pub fn name(&self) -> MachineName {
        self.name.lock(|name| name.borrow().clone())
    }

    fn rename(&self, new: MachineName) {
        self.name.lock(|name| *name.borrow_mut() = new);
    }
}
