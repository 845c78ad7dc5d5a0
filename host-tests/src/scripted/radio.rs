//! The radio and what a network gives: each attempt is on record, and so is whether the machine has an
//! address.

use super::journal::note;
use super::power::Power;
use core::net::Ipv4Addr;
use firmware::board::{Address, Radio, RadioFault};
use firmware::boards::scripted_radio::{Air, ScriptedRadio};
use firmware::services::dhcp::OWN_ADDRESS;
use heapless::Vec;
use protocol_core::wifi::{Heard, Joined, Network, Ssid};
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::future::pending;
use std::rc::Rc;

/// What the radio was told to do, for the script to take out.
#[derive(Debug, Default)]
pub struct RadioRecord {
    /// Networks that were tried, and how that ended.
    pub tries: RefCell<VecDeque<(Ssid, Joined)>>,
    /// Access points that were opened.
    pub opened: RefCell<VecDeque<Network>>,
    /// The machine has asked the joined network for an address.
    pub asked: Cell<bool>,
    /// The machine gives its guests addresses.
    pub serving: Cell<bool>,
}

impl RadioRecord {
    /// Whether the machine has an address in a network that it has joined, from where it goes on to others.
    pub fn leads_on(&self, air: &Air) -> bool {
        self.asked.get() && air.joined().is_some()
    }

    /// The machine's address in this air.
    pub fn address(&self, air: &Air) -> Option<Ipv4Addr> {
        match self.serving.get() {
            true => Some(OWN_ADDRESS),
            false => self.leads_on(air).then_some(Ipv4Addr::new(10, 0, 0, 2)),
        }
    }
}

/// A network's name as a script writes it.
pub fn shown(ssid: &Ssid) -> String {
    format!("\"{}\"", ssid.as_bytes().escape_ascii())
}

/// A network that the machine offers as a script writes it.
pub fn offered(network: &Network) -> String {
    let name = shown(&network.ssid);
    match &network.password {
        None => name,
        Some(password) => {
            let password = password.as_bytes().escape_ascii();
            format!("{name}, password \"{password}\"")
        }
    }
}

/// The radio of the board.
pub struct RecordedRadio {
    inner: ScriptedRadio<Rc<Air>>,
    record: Rc<RadioRecord>,
    power: Power,
}

impl RecordedRadio {
    /// A radio in this air.
    pub fn new(air: Rc<Air>, record: Rc<RadioRecord>, power: Power) -> Self {
        let inner = ScriptedRadio::new(air);
        Self {
            inner,
            record,
            power,
        }
    }
}

impl Radio for RecordedRadio {
    async fn scan<const N: usize>(&mut self, heard: &mut Vec<Heard, N>) -> Result<(), RadioFault> {
        let outcome = self.inner.scan(heard).await;
        match outcome {
            Ok(()) => note(format_args!("    radio: hears {} networks", heard.len())),
            Err(RadioFault) => note("    radio: fails to listen"),
        }
        outcome
    }

    async fn join(&mut self, network: &Network) -> Joined {
        let name = shown(&network.ssid);
        note(format_args!("    radio: tries {name}"));
        self.record.asked.set(false);
        let outcome = self.inner.join(network).await;
        if self.power.is_on() {
            note(format_args!("    radio: {name}: {outcome:?}"));
            let mut tries = self.record.tries.borrow_mut();
            tries.push_back((network.ssid.clone(), outcome));
        }
        outcome
    }

    async fn leave(&mut self) {
        if self.inner.is_joined() {
            note("    radio: leaves the network");
        }
        self.inner.leave().await;
    }

    async fn open_access_point(&mut self, network: &Network) -> Result<(), RadioFault> {
        let name = shown(&network.ssid);
        let outcome = self.inner.open_access_point(network).await;
        match outcome {
            Ok(()) => {
                note(format_args!("    radio: opens {}", offered(network)));
                let mut opened = self.record.opened.borrow_mut();
                opened.push_back(network.clone());
            }
            Err(RadioFault) => note(format_args!("    radio: fails to open {name}")),
        }
        outcome
    }

    async fn close_access_point(&mut self) -> Result<(), RadioFault> {
        note("    radio: closes the access point");
        self.inner.close_access_point().await
    }

    fn is_joined(&self) -> bool {
        self.inner.is_joined()
    }

    async fn lost(&mut self) {
        self.inner.lost().await;
        note("    radio: the network is lost");
    }
}

/// The network stack's address, on record.
pub struct RecordedAddress(pub Rc<RadioRecord>);

struct Serving<'a>(&'a Cell<bool>);

impl Drop for Serving<'_> {
    fn drop(&mut self) {
        self.0.set(false);
    }
}

impl Address for RecordedAddress {
    fn ask(&self) {
        self.0.asked.set(true);
    }

    async fn serve_guests(&self) -> ! {
        self.0.serving.set(true);
        let _serving = Serving(&self.0.serving);
        pending().await
    }
}
