//! Which network the machine is in: what happens goes in, what to do next comes out.
//!
//! There are two modes (`reference/line-us.md`, section 6): a *station* looks for the networks that are
//! remembered and stays in one; in *setup* the machine runs a network of its own. The policy is a value
//! that is told events and the time. [`Policy::job`] says what the radio is to do now; whoever does it
//! tells the outcome as the next event. Everything else, a press or a command, is an event that may come
//! at any time, and a job that is not the same any more is then given up. `docs/wifi.md` has the table
//! of all transitions.

use super::{Heard, Joined, MAX_NETWORKS, Network, Networks, SETUP_SSID, Ssid};
use crate::motion::Micros;
use crate::panel::{Gesture, Lamp};
use crate::settings::{AccessPointName, Settings, StartMode};
use core::fmt::Write;
use heapless::{String, Vec};

/// Pauses between one search and the next, growing up to the last one.
pub const PAUSES: [Micros; 5] = [
    Micros::from_secs(5),
    Micros::from_secs(10),
    Micros::from_secs(20),
    Micros::from_secs(40),
    Micros::from_secs(60),
];

/// What happens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event<'a> {
    /// [`Job::Scan`] is done: what was heard, `None` if the radio could not listen.
    Scanned(Option<&'a [Heard]>),
    /// [`Job::Join`] is done.
    Joined(Joined),
    /// [`Job::Stay`] is done: the network is lost.
    Lost,
    /// [`Job::Open`] is done: whether the machine's own network is open.
    Opened(bool),
    /// [`Job::Pause`] is done.
    Elapsed,
    /// The button.
    Press(Gesture),
    /// A short press of the button, and there is a drawing for it to draw.
    PressToDraw,
    /// A client of the own network wants this network to be tried (`spec 1.0.4a, M587`).
    Try(Network),
    /// The remembered networks have changed (M587, M588).
    Changed,
    /// Everything has been forgotten: start anew.
    Restart,
}

/// What the radio is to do now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Job<'a> {
    /// Listen on all channels.
    Scan,
    /// Try to join.
    Join(&'a Network),
    /// Stay in the network until it is lost.
    Stay,
    /// Nothing until then.
    Pause(Micros),
    /// Open the machine's own network.
    Open(&'a Network),
    /// Keep it open.
    Host,
}

/// What is to be done beside the radio's job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Remember this network: it was joined.
    Remember(Network),
    /// Confirm the press of the button.
    Confirm,
    /// The press was for the drawing: the network stays as it is.
    Draw,
}

/// What a person or a program is told about the network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Status {
    /// The machine is on its own network, or means to come back to it.
    pub setup: bool,
    /// What the machine is doing.
    pub phase: Phase,
    /// The network that was refused last, and why, until another one is joined.
    pub refused: Option<(Ssid, Joined)>,
}

/// What the machine is doing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Phase {
    /// A station that looks for its networks.
    Searching,
    /// A station in this network.
    Connected(Ssid),
    /// On its own network.
    Setup,
    /// Leaving its own network for this one, which has yet to show that it can be joined.
    Trying(Ssid),
    /// The radio does not work.
    Fault,
}

#[derive(Debug)]
enum State {
    /// A station: listening for the networks that are remembered.
    Listening,
    /// A station: trying one; those of `round` follow.
    Joining(Network),
    /// A station, after a round without success.
    Waiting(Micros),
    /// A station in its network.
    Connected(Ssid),
    /// Setup: listening for others who are in setup.
    LookingAround,
    /// Setup: opening the own network.
    Opening(Network),
    /// Setup: the own network is open.
    Hosting,
    /// Setup: the own network could not be opened; once more later.
    Failed(Micros),
    /// Setup: trying a network that is not remembered.
    Trying(Network),
}

/// The policy.
#[derive(Debug)]
pub struct Policy {
    state: State,
    /// Names of remembered networks that are to be tried before the next pause, in order.
    round: Vec<Ssid, MAX_NETWORKS>,
    /// Rounds without success, as far as [`PAUSES`] goes.
    failures: usize,
    refused: Option<(Ssid, Joined)>,
    radio_faulty: bool,
    serial: u32,
}

impl Policy {
    /// After power-on, with the machine's serial number.
    pub fn new(settings: &Settings, serial: u32) -> Self {
        let mut policy = Self {
            state: State::Listening,
            round: Vec::new(),
            failures: 0,
            refused: None,
            radio_faulty: false,
            serial,
        };
        policy.start(settings);
        policy
    }

    fn start(&mut self, settings: &Settings) {
        match settings.start {
            StartMode::Station | StartMode::StationLongPress => self.search(&settings.networks),
            StartMode::AccessPoint | StartMode::AccessPointLocked => self.set_up(),
        }
    }

    /// What the radio is to do now.
    pub const fn job(&self) -> Job<'_> {
        match &self.state {
            State::Listening | State::LookingAround => Job::Scan,
            State::Joining(network) | State::Trying(network) => Job::Join(network),
            State::Waiting(until) | State::Failed(until) => Job::Pause(*until),
            State::Connected(_) => Job::Stay,
            State::Opening(own) => Job::Open(own),
            State::Hosting => Job::Host,
        }
    }

    /// What the light is to say.
    pub const fn lamp(&self) -> Lamp {
        match &self.state {
            State::Listening | State::Joining(_) | State::Waiting(_) if self.radio_faulty => {
                Lamp::Error
            }
            State::Failed(_) => Lamp::Error,
            State::Listening | State::Joining(_) | State::Waiting(_) | State::Trying(_) => {
                Lamp::Searching
            }
            State::Connected(_) => Lamp::Connected,
            State::LookingAround | State::Opening(_) | State::Hosting => Lamp::Setup,
        }
    }

    /// What is told about it.
    pub fn status(&self) -> Status {
        Status {
            setup: self.is_setup(),
            phase: match &self.state {
                _ if self.lamp() == Lamp::Error => Phase::Fault,
                State::Listening | State::Joining(_) | State::Waiting(_) => Phase::Searching,
                State::Connected(ssid) => Phase::Connected(ssid.clone()),
                State::LookingAround | State::Opening(_) | State::Hosting | State::Failed(_) => {
                    Phase::Setup
                }
                State::Trying(network) => Phase::Trying(network.ssid.clone()),
            },
            refused: self.refused.clone(),
        }
    }

    /// Takes an event at `now`, with the settings in force.
    pub fn on(&mut self, event: Event<'_>, settings: &Settings, now: Micros) -> Option<Effect> {
        match event {
            Event::Scanned(heard) => self.scanned(heard, settings, now),
            Event::Joined(outcome) => return self.joined(outcome, settings, now),
            Event::Lost => {
                if matches!(self.state, State::Connected(_)) {
                    self.search(&settings.networks);
                }
            }
            Event::Opened(open) => {
                if matches!(self.state, State::Opening(_)) {
                    self.state = if open {
                        State::Hosting
                    } else {
                        State::Failed(now + self.pause())
                    };
                    if open {
                        self.failures = 0;
                    }
                }
            }
            Event::Elapsed => match self.state {
                State::Waiting(_) => self.state = State::Listening,
                State::Failed(_) => self.state = State::LookingAround,
                _ => {}
            },
            Event::Press(Gesture::Short) => return self.short_press(settings),
            Event::PressToDraw => return self.press_to_draw(settings),
            Event::Press(Gesture::Long) => return self.long_press(settings),
            Event::Press(_) => {}
            Event::Try(network) => {
                // Where the mode has changed meanwhile, the network is no longer asked for.
                if self.is_setup() {
                    self.refused = None;
                    self.state = State::Trying(network);
                }
            }
            Event::Changed => {
                self.refused = None;
                if matches!(
                    self.state,
                    State::Listening | State::Joining(_) | State::Waiting(_)
                ) {
                    self.search(&settings.networks);
                }
            }
            Event::Restart => {
                self.refused = None;
                self.start(settings);
            }
        }
        None
    }

    const fn is_setup(&self) -> bool {
        matches!(
            self.state,
            State::LookingAround
                | State::Opening(_)
                | State::Hosting
                | State::Failed(_)
                | State::Trying(_)
        )
    }

    /// Looks for the networks that are remembered; where there is none, it can only be set up.
    fn search(&mut self, networks: &Networks) {
        self.failures = 0;
        self.round.clear();
        if networks.is_empty() {
            self.set_up();
        } else {
            self.state = State::Listening;
        }
    }

    fn set_up(&mut self) {
        self.failures = 0;
        self.state = State::LookingAround;
    }

    fn scanned(&mut self, heard: Option<&[Heard]>, settings: &Settings, now: Micros) {
        match self.state {
            State::Listening => {
                self.radio_faulty = heard.is_none();
                if heard.is_none() {
                    self.state = State::Waiting(now + self.pause());
                    return;
                }
                self.round = order(heard.unwrap_or_default(), &settings.networks);
                self.try_next(settings, now);
            }
            State::LookingAround => {
                // A radio that cannot listen may yet be able to talk.
                self.state = State::Opening(Network {
                    ssid: self.own_name(settings, heard.unwrap_or_default()),
                    password: settings.own_password.clone(),
                });
            }
            _ => {}
        }
    }

    /// The next network of the round, or a pause.
    fn try_next(&mut self, settings: &Settings, now: Micros) {
        while !self.round.is_empty() {
            let ssid = self.round.remove(0);
            if let Some(network) = settings.networks.find(&ssid) {
                self.state = State::Joining(network.clone());
                return;
            }
        }
        self.state = State::Waiting(now + self.pause());
    }

    fn pause(&mut self) -> Micros {
        let pause = PAUSES.get(self.failures).or(PAUSES.last());
        self.failures = (self.failures + 1).min(PAUSES.len());
        pause.copied().unwrap_or_default()
    }

    fn joined(&mut self, outcome: Joined, settings: &Settings, now: Micros) -> Option<Effect> {
        match &self.state {
            State::Joining(network) => {
                let ssid = network.ssid.clone();
                if outcome == Joined::Yes {
                    self.connected(ssid);
                } else {
                    self.refuse(ssid, outcome);
                    self.try_next(settings, now);
                }
                None
            }
            State::Trying(network) => {
                let network = network.clone();
                if outcome == Joined::Yes {
                    self.connected(network.ssid.clone());
                    Some(Effect::Remember(network))
                } else {
                    self.refuse(network.ssid, outcome);
                    self.set_up();
                    None
                }
            }
            _ => None,
        }
    }

    /// A network that is absent is no news beside one that does not take its password.
    fn refuse(&mut self, ssid: Ssid, outcome: Joined) {
        let wrong = matches!(&self.refused, Some((other, Joined::WrongPassword)) if *other != ssid);
        if !(wrong && outcome == Joined::NotFound) {
            self.refused = Some((ssid, outcome));
        }
    }

    fn connected(&mut self, ssid: Ssid) {
        self.refused = None;
        self.radio_faulty = false;
        self.round.clear();
        self.state = State::Connected(ssid);
    }

    fn short_press(&mut self, settings: &Settings) -> Option<Effect> {
        match &self.state {
            State::Listening | State::Joining(_) | State::Waiting(_) => {
                self.next_by_hand(&settings.networks);
            }
            State::Connected(_) => {}
            // Back to where it came from: what was being tried is given up.
            State::Trying(_) => self.set_up(),
            State::LookingAround | State::Opening(_) | State::Hosting | State::Failed(_) => {
                if settings.networks.is_empty() {
                    return Some(Effect::Confirm);
                }
                self.search(&settings.networks);
            }
        }
        Some(Effect::Confirm)
    }

    /// Where the network waits for nothing, a press is for the drawing (`reference/line-us.md`, section 6).
    fn press_to_draw(&mut self, settings: &Settings) -> Option<Effect> {
        match &self.state {
            State::Connected(_)
            | State::LookingAround
            | State::Opening(_)
            | State::Hosting
            | State::Failed(_) => Some(Effect::Draw),
            State::Listening | State::Joining(_) | State::Waiting(_) | State::Trying(_) => {
                self.short_press(settings)
            }
        }
    }

    /// The networks as they are remembered, beginning after the one that is being tried.
    fn next_by_hand(&mut self, networks: &Networks) {
        let current = match &self.state {
            State::Joining(network) => networks
                .iter()
                .position(|other| other.ssid == network.ssid)
                .map_or(0, |at| at + 1),
            _ => 0,
        };
        self.round.clear();
        let all = networks.iter().cycle().skip(current).take(networks.len());
        for network in all {
            // There are as many places as networks.
            let _ = self.round.push(network.ssid.clone());
        }
        if !self.round.is_empty()
            && let Some(network) = networks.find(&self.round.remove(0))
        {
            self.state = State::Joining(network.clone());
        }
    }

    fn long_press(&mut self, settings: &Settings) -> Option<Effect> {
        if settings.start == StartMode::AccessPointLocked {
            return None;
        }
        match self.state {
            State::Trying(_) => self.set_up(),
            _ if self.is_setup() => self.search(&settings.networks),
            _ => self.set_up(),
        }
        Some(Effect::Confirm)
    }

    /// The name of the own network, with the serial number where somebody else has that name.
    fn own_name(&self, settings: &Settings, heard: &[Heard]) -> Ssid {
        let base = match settings.access_point {
            AccessPointName::Setup => SETUP_SSID,
            AccessPointName::Machine => settings.name.as_str(),
        };
        let taken = heard
            .iter()
            .any(|other| other.ssid.as_bytes() == base.as_bytes());
        let mut name = String::<{ super::MAX_SSID }>::new();
        let mut serial = String::<9>::new();
        if taken {
            // 24 bits are at most eight digits.
            let _ = write!(serial, "-{}", self.serial & 0xff_ffff);
        }
        let room = super::MAX_SSID - serial.len();
        // Names are ASCII, so that they may be cut anywhere.
        let _ = name.push_str(base.get(..room).unwrap_or(base));
        let _ = name.push_str(&serial);
        Ssid::new(name.as_bytes()).unwrap_or_else(Ssid::setup)
    }
}

/// In which order remembered networks are tried: those that are heard, strongest first, then the others,
/// which may be hidden, as they were remembered.
fn order(heard: &[Heard], networks: &Networks) -> Vec<Ssid, MAX_NETWORKS> {
    let strength = |network: &Network| {
        let same = heard.iter().filter(|other| other.ssid == network.ssid);
        same.map(|other| other.signal_dbm).max()
    };
    // Put in place one by one: eight are not worth the 10 kB of a library's sorting. Absent is less than
    // any strength, and there are as many places as networks.
    let mut order = Vec::<_, MAX_NETWORKS>::new();
    for network in networks.iter() {
        let strength = strength(network);
        let place = order.iter().position(|(other, _)| *other < strength);
        let _ = order.insert(place.unwrap_or(order.len()), (strength, &network.ssid));
    }
    order.iter().map(|(_, ssid)| (*ssid).clone()).collect()
}

#[cfg(test)]
mod tests;
