//! What a line of a scenario says.

use super::server::ServerAction;
use crate::scripted::flash::Wear;
use crate::scripted::light::{Hue, Pattern};
use embassy_time::Duration;
use protocol_core::settings::{AccessPointName, MachineName, StartMode};
use protocol_core::update::ManifestAddress;
use protocol_core::wifi::{self, Password, Ssid};

/// What a line says.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// The script does something.
    Do(Action),
    /// The machine is to do something, within a time if one is given.
    Expect(Expectation, Option<Duration>),
}

/// What the script does.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    PowerOn {
        held: bool,
    },
    CutThePower,
    PowerFailsAfter(u32),
    Memory(Memory),
    /// Something is remembered already.
    Remember(Kept),
    Press,
    Hold(Duration),
    Button(bool),
    Network(Ssid, Network),
    LoseTheLink,
    RadioWorks(bool),
    ScanTakes(Duration),
    JoinTakes(Duration),
    ComputerLeaves,
    Client(char, ClientAction),
    Server(ServerAction),
    /// There is no second place for firmware.
    OneSlot,
    /// The firmware hangs, until the watchdog bites.
    Hang,
    Wait(Duration),
}

/// What a machine may remember that was told it before the scenario begins.
#[derive(Clone, Debug, PartialEq)]
pub enum Kept {
    /// A network.
    Network(wifi::Network),
    /// M550.
    Name(MachineName),
    /// M552 S.
    Start(StartMode),
    /// M552 P.
    AccessPoint(AccessPointName),
    /// M291.
    Waves(bool),
    /// M997 S.
    UpdateAddress(ManifestAddress),
}

/// What becomes of the memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Memory {
    Empty,
    Garbage,
    Wear(Wear),
}

/// What changes about a network; what is not said stays as it was.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Network {
    pub up: Option<bool>,
    pub password: Option<Option<Password>>,
    pub signal_dbm: Option<i8>,
}

/// What a client does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ClientAction {
    Send(Vec<u8>),
    StopSending,
    Close,
    Reset,
    Die,
    Read(bool),
    Ignore,
}

/// What is expected.
#[derive(Clone, Debug, PartialEq)]
pub enum Expectation {
    ComputerJoins(Ssid),
    Client(char, ClientExpectation),
    Light(Pattern),
    LightStays(Pattern, Duration),
    LightWasNever(Hue),
    Opens(Ssid, Option<Password>),
    ClosesItsNetwork,
    Tries(Ssid, Outcome),
    MayTry(Ssid),
    TriesNothing(Duration),
    /// By this name, without `.local`; by none.
    IsFound(Option<String>),
    Remembers(Remembered),
    PowerIsOff,
    StartsAgain,
    /// As often as it likes, until a line expects it or power comes.
    MayStartAgain,
    /// The firmware of one of these names.
    Runs(Vec<String>),
    ArmWaves,
    ArmRests(Option<[i32; 3]>),
    ArmStays(Duration),
    Pen {
        down: bool,
    },
    PenStays {
        down: bool,
        time: Duration,
    },
    NibPasses(f64, f64, Option<f64>),
}

/// How an attempt to join is to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Joined,
    NotFound,
    Refused,
    Failed,
}

/// What is to be in the memory.
#[derive(Clone, Debug, PartialEq)]
pub enum Remembered {
    Nothing,
    Networks(usize),
    Network(Ssid, Option<Password>),
    Names(Vec<String>),
}

/// What a client is to find.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ClientExpectation {
    Connects,
    CannotConnect,
    /// One message like one of these.
    Hears(Vec<String>),
    /// At least one message, and all that have come by then like this.
    HearsSeveral(String),
    HearsNothing(Duration),
    IsDisconnected,
}
