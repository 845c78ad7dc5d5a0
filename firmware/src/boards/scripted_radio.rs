//! A radio without air: which networks there are, and what becomes of them, is told by a script.
//!
//! It behaves as the chips' radio does: the machine's own network may stay open while another is joined,
//! opening it drops the joined one, and a joined network that goes away or changes its password is lost.

use crate::board::{Radio, RadioFault};
use core::cell::RefCell;
use core::ops::Deref;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer};
use heapless::Vec;
use protocol_core::wifi::{Heard, Joined, Network, Password, Security, Ssid};

/// Networks that can be in the air at once; more are not heard.
pub const MAX_ON_AIR: usize = 16;

/// A network of the script.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OnAir {
    /// Its name.
    pub ssid: Ssid,
    /// Its password; none for an open network.
    pub password: Option<Password>,
    /// Its strength.
    pub signal_dbm: i8,
}

impl OnAir {
    /// A network; `None` if name or password have a length that cannot be.
    pub fn new(ssid: &[u8], password: Option<&[u8]>, signal_dbm: i8) -> Option<Self> {
        let password = match password {
            Some(phrase) => Some(Password::new(phrase)?),
            None => None,
        };
        Some(Self {
            ssid: Ssid::new(ssid)?,
            password,
            signal_dbm,
        })
    }
}

/// How long the radio takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    /// For listening on all channels.
    pub scan: Duration,
    /// For joining a network, or failing to.
    pub join: Duration,
}

impl Pace {
    /// No time at all.
    pub const INSTANT: Self = Self {
        scan: Duration::MIN,
        join: Duration::MIN,
    };
    /// About as long as a chip's.
    pub const LIFELIKE: Self = Self {
        scan: Duration::from_millis(1500),
        join: Duration::from_secs(2),
    };
}

/// What is in the air around the machine, shared by script and radio.
pub struct Air {
    state: Mutex<CriticalSectionRawMutex, RefCell<State>>,
    /// The joined network may be lost.
    changed: Signal<CriticalSectionRawMutex, ()>,
}

struct State {
    networks: Vec<OnAir, MAX_ON_AIR>,
    pace: Pace,
    faulty: bool,
    joined: Option<Ssid>,
    own: Option<Ssid>,
}

impl Air {
    /// Air without networks.
    pub const fn new(pace: Pace) -> Self {
        Self {
            state: Mutex::new(RefCell::new(State {
                networks: Vec::new(),
                pace,
                faulty: false,
                joined: None,
                own: None,
            })),
            changed: Signal::new(),
        }
    }

    fn with<T>(&self, f: impl FnOnce(&mut State) -> T) -> T {
        self.state.lock(|state| f(&mut state.borrow_mut()))
    }

    /// Puts a network into the air, in the place of one of the same name if there is one.
    pub fn put(&self, network: OnAir) {
        let old = self.find(&network.ssid);
        if old.is_some_and(|old| old.password != network.password) {
            self.remove(&network.ssid);
        }
        self.with(|state| {
            state.networks.retain(|old| old.ssid != network.ssid);
            // Strongest first, as a scan gives them. One that does not fit is not heard.
            let weaker = |other: &OnAir| other.signal_dbm < network.signal_dbm;
            let place = state.networks.iter().position(weaker);
            let place = place.unwrap_or(state.networks.len());
            let _ = state.networks.insert(place, network);
        });
    }

    /// Takes a network out of the air; who had joined it loses it.
    pub fn remove(&self, ssid: &Ssid) {
        self.with(|state| {
            state.networks.retain(|network| network.ssid != *ssid);
            if state.joined.as_ref() == Some(ssid) {
                state.joined = None;
            }
        });
        self.changed.signal(());
    }

    /// The network of that name.
    pub fn find(&self, ssid: &Ssid) -> Option<OnAir> {
        self.with(|state| {
            let mut networks = state.networks.iter();
            networks.find(|network| network.ssid == *ssid).cloned()
        })
    }

    /// Breaks the link to the joined network, which stays in the air.
    pub fn cut(&self) {
        self.with(|state| state.joined = None);
        self.changed.signal(());
    }

    /// Lets the radio fail from now on, or work again.
    pub fn set_fault(&self, faulty: bool) {
        self.with(|state| state.faulty = faulty);
    }

    /// Lets the radio take longer or shorter from now on.
    pub fn set_pace(&self, pace: Pace) {
        self.with(|state| state.pace = pace);
    }

    /// How long the radio takes now.
    pub fn pace(&self) -> Pace {
        self.with(|state| state.pace)
    }

    /// The network that the machine has joined.
    pub fn joined(&self) -> Option<Ssid> {
        self.with(|state| state.joined.clone())
    }

    /// The machine's own network, if it is open.
    pub fn own(&self) -> Option<Ssid> {
        self.with(|state| state.own.clone())
    }
}

/// The radio in the air of `A`; one at a time.
pub struct ScriptedRadio<A: Deref<Target = Air>> {
    air: A,
}

impl<A: Deref<Target = Air>> ScriptedRadio<A> {
    /// A radio that has joined nothing.
    pub const fn new(air: A) -> Self {
        Self { air }
    }
}

impl<A: Deref<Target = Air>> Drop for ScriptedRadio<A> {
    /// A radio without power.
    fn drop(&mut self) {
        self.air.with(|state| {
            state.joined = None;
            state.own = None;
        });
    }
}

impl<A: Deref<Target = Air>> Radio for ScriptedRadio<A> {
    async fn scan<const N: usize>(&mut self, heard: &mut Vec<Heard, N>) -> Result<(), RadioFault> {
        heard.clear();
        Timer::after(self.air.pace().scan).await;
        self.air.with(|state| {
            if state.faulty {
                return Err(RadioFault);
            }
            for network in &state.networks {
                let security = match network.password {
                    Some(_) => Security::Password,
                    None => Security::Open,
                };
                let entry = Heard {
                    ssid: network.ssid.clone(),
                    security,
                    signal_dbm: network.signal_dbm,
                };
                if heard.push(entry).is_err() {
                    break;
                }
            }
            Ok(())
        })
    }

    async fn join(&mut self, network: &Network) -> Joined {
        self.leave().await;
        Timer::after(self.air.pace().join).await;
        self.air.with(|state| {
            if state.faulty {
                return Joined::Failed(0);
            }
            let mut networks = state.networks.iter();
            match networks.find(|on_air| on_air.ssid == network.ssid) {
                None => Joined::NotFound,
                Some(on_air) if on_air.password != network.password => Joined::WrongPassword,
                Some(_) => {
                    state.joined = Some(network.ssid.clone());
                    Joined::Yes
                }
            }
        })
    }

    async fn leave(&mut self) {
        self.air.with(|state| state.joined = None);
    }

    async fn open_access_point(&mut self, network: &Network) -> Result<(), RadioFault> {
        self.air.with(|state| {
            state.joined = None;
            if state.faulty {
                return Err(RadioFault);
            }
            state.own = Some(network.ssid.clone());
            Ok(())
        })
    }

    async fn close_access_point(&mut self) -> Result<(), RadioFault> {
        self.air.with(|state| state.own = None);
        Ok(())
    }

    fn is_joined(&self) -> bool {
        self.air.joined().is_some()
    }

    async fn lost(&mut self) {
        while self.is_joined() {
            self.air.changed.wait().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_futures::{block_on, poll_once};

    fn on_air(name: &str, password: Option<&str>, signal_dbm: i8) -> OnAir {
        OnAir::new(name.as_bytes(), password.map(str::as_bytes), signal_dbm).unwrap()
    }

    fn network(name: &str, password: Option<&str>) -> Network {
        let OnAir { ssid, password, .. } = on_air(name, password, 0);
        Network { ssid, password }
    }

    #[test]
    fn networks_are_heard_strongest_first() {
        let air = Air::new(Pace::INSTANT);
        for (name, signal) in [("a", -60), ("b", -40), ("c", -80), ("a", -30)] {
            air.put(on_air(name, None, signal));
        }
        let mut radio = ScriptedRadio::new(&air);
        let mut heard = Vec::<Heard, 2>::new();
        block_on(radio.scan(&mut heard)).unwrap();
        let heard: std::vec::Vec<_> = heard
            .iter()
            .map(|heard| (heard.ssid.as_bytes(), heard.signal_dbm))
            .collect();
        assert_eq!(heard, [(&b"a"[..], -30), (b"b", -40)]);
    }

    #[test]
    fn joining_ends_in_one_of_four_ways() {
        let air = Air::new(Pace::INSTANT);
        air.put(on_air("home", Some("correct horse"), -50));
        let mut radio = ScriptedRadio::new(&air);
        let mut join = |network: &Network| block_on(radio.join(network));
        let home = network("home", Some("correct horse"));
        assert_eq!(join(&home), Joined::Yes);
        assert_eq!(air.joined(), Some(home.ssid.clone()));
        assert_eq!(join(&network("other", None)), Joined::NotFound);
        assert_eq!(air.joined(), None);
        for wrong in [None, Some("wrong horse")] {
            assert_eq!(join(&network("home", wrong)), Joined::WrongPassword);
        }
        air.set_fault(true);
        assert!(matches!(join(&home), Joined::Failed(_)));
        assert_eq!(air.joined(), None);
    }

    #[test]
    fn a_joined_network_is_lost_when_it_goes_or_changes() {
        let home = network("home", None);
        let losses: [fn(&Air, &mut ScriptedRadio<&Air>); 4] = [
            |air, _| air.cut(),
            |air, _| air.remove(&Ssid::new(b"home").unwrap()),
            |air, _| air.put(on_air("home", Some("correct horse"), -50)),
            |_, radio| block_on(radio.open_access_point(&network("own", None))).unwrap(),
        ];
        for lose in losses {
            let air = Air::new(Pace::INSTANT);
            air.put(on_air("home", None, -50));
            let mut radio = ScriptedRadio::new(&air);
            assert_eq!(block_on(radio.join(&home)), Joined::Yes);
            assert!(poll_once(radio.lost()).is_pending());
            air.put(on_air("home", None, -70));
            air.remove(&Ssid::new(b"other").unwrap());
            assert!(poll_once(radio.lost()).is_pending());
            lose(&air, &mut radio);
            assert!(poll_once(radio.lost()).is_ready());
            assert!(!radio.is_joined());
        }
    }

    #[test]
    fn its_own_network_goes_with_its_power() {
        let air = Air::new(Pace::INSTANT);
        let own = network("own", None);
        let mut radio = ScriptedRadio::new(&air);
        block_on(radio.open_access_point(&own)).unwrap();
        assert_eq!(air.own(), Some(own.ssid));
        drop(radio);
        assert_eq!(air.own(), None);
    }
}
