//! A radio without air: which networks there are, and what becomes of them, is told by a script.

use crate::board::{Radio, RadioFault};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use heapless::Vec;
use protocol_core::wifi::{Heard, Joined, Network, Security, Ssid};

/// A network of the script.
#[derive(Clone, Copy, Debug)]
pub struct OnAir {
    /// Its name, as text.
    pub ssid: &'static str,
    /// Its password; none for an open network.
    pub password: Option<&'static str>,
    /// Its strength.
    pub signal_dbm: i8,
}

/// The radio.
pub struct ScriptedRadio {
    networks: &'static [OnAir],
    cut: &'static Signal<CriticalSectionRawMutex, ()>,
    joined: bool,
}

impl ScriptedRadio {
    /// Hears `networks`, strongest first; `cut` ends the joined one.
    pub const fn new(
        networks: &'static [OnAir],
        cut: &'static Signal<CriticalSectionRawMutex, ()>,
    ) -> Self {
        Self {
            networks,
            cut,
            joined: false,
        }
    }
}

impl Radio for ScriptedRadio {
    async fn scan<const N: usize>(&mut self, heard: &mut Vec<Heard, N>) -> Result<(), RadioFault> {
        heard.clear();
        for network in self.networks {
            let Some(ssid) = Ssid::new(network.ssid.as_bytes()) else {
                continue;
            };
            let security = match network.password {
                Some(_) => Security::Password,
                None => Security::Open,
            };
            let signal_dbm = network.signal_dbm;
            if heard
                .push(Heard {
                    ssid,
                    security,
                    signal_dbm,
                })
                .is_err()
            {
                break;
            }
        }
        Ok(())
    }

    async fn join(&mut self, network: &Network) -> Joined {
        let known = |on_air: &&OnAir| on_air.ssid.as_bytes() == network.ssid.as_bytes();
        let outcome = match self.networks.iter().find(known) {
            None => Joined::NotFound,
            Some(on_air) => {
                let given = network
                    .password
                    .as_ref()
                    .map(|password| password.as_bytes());
                match given == on_air.password.map(str::as_bytes) {
                    true => Joined::Yes,
                    false => Joined::WrongPassword,
                }
            }
        };
        self.joined = outcome == Joined::Yes;
        self.cut.reset();
        outcome
    }

    async fn leave(&mut self) {
        self.joined = false;
    }

    async fn open_access_point(&mut self, _: &Network) -> Result<(), RadioFault> {
        self.joined = false;
        Ok(())
    }

    async fn close_access_point(&mut self) -> Result<(), RadioFault> {
        Ok(())
    }

    fn is_joined(&self) -> bool {
        self.joined
    }

    async fn lost(&mut self) {
        self.cut.wait().await;
        self.joined = false;
    }
}
