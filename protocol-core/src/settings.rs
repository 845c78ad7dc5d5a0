//! What the arm remembers, and its form in memory.

use crate::arm::Calibration;
use crate::wifi::{MAX_NETWORK, Network, Networks};
use heapless::String;

/// Longest machine name, in bytes.
pub const MAX_NAME: usize = 32;

/// The machine's name on the network: letters, digits and hyphens, no hyphen at either end, 1 to
/// [`MAX_NAME`] of them (`spec 1.0.4a, M550`).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MachineName(String<MAX_NAME>);

impl MachineName {
    /// A name, if `text` is one.
    pub fn new(text: &str) -> Option<Self> {
        let allowed = text
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || byte == b'-');
        let ends = text.starts_with('-') || text.ends_with('-');
        if text.is_empty() || !allowed || ends {
            return None;
        }
        String::try_from(text).ok().map(Self)
    }

    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Default for MachineName {
    /// `line-us`, which is what clients look for.
    fn default() -> Self {
        Self(String::try_from("line-us").unwrap_or_default())
    }
}

/// What the machine is after power-on, and what a long press of its button does
/// (`reference/line-us.md`, section 5, M552).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StartMode {
    /// `S1`: a station; a long press changes to setup.
    #[default]
    Station,
    /// `S2`: its own network; a long press changes to station.
    AccessPoint,
    /// `S3`: its own network, and the button does not change that.
    AccessPointLocked,
    /// `S4`: a station; only a press of 7 s changes to setup.
    StationLongPress,
}

/// How the machine's own network is called (`reference/line-us.md`, section 5, M552).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AccessPointName {
    /// `P1`: `Line-us-Setup`.
    #[default]
    Setup,
    /// `P2`: as the machine.
    Machine,
}

/// Everything that is kept across restarts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The machine's name (M550).
    pub name: MachineName,
    /// The servos' offsets (M374).
    pub calibration: Calibration,
    /// The networks to join (M587, M588).
    pub networks: Networks,
    /// What it is after power-on (M552).
    pub start: StartMode,
    /// How its own network is called (M552).
    pub access_point: AccessPointName,
    /// Whether it makes its little waves (M291).
    pub waves: bool,
}

impl Default for Settings {
    /// `line-us`, no calibration, no network, a station that waves.
    fn default() -> Self {
        Self {
            name: MachineName::default(),
            calibration: Calibration::default(),
            networks: Networks::new(),
            start: StartMode::default(),
            access_point: AccessPointName::default(),
            waves: true,
        }
    }
}

/// One setting as it is stored: under its key, behind a version byte.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Setting {
    /// Under key 1.
    Name(MachineName),
    /// Under key 2.
    Calibration(Calibration),
    /// Under key 3.
    Network(Network),
}

/// Longest stored form of a setting, in bytes.
pub const MAX_SETTING: usize = 1 + if MAX_NETWORK > MAX_NAME {
    MAX_NETWORK
} else {
    MAX_NAME
};

/// Version of the stored forms; a setting of another version reads as absent.
const VERSION: u8 = 1;

impl Setting {
    /// Keys of all settings.
    pub const KEYS: [u8; 3] = [1, 2, 3];

    /// The key it is stored under.
    pub const fn key(&self) -> u8 {
        match self {
            Self::Name(_) => 1,
            Self::Calibration(_) => 2,
            Self::Network(_) => 3,
        }
    }

    /// Its stored form.
    pub fn to_bytes(&self) -> heapless::Vec<u8, MAX_SETTING> {
        let mut bytes = heapless::Vec::new();
        // Both fit: MAX_SETTING is the version and the longest of them.
        let _ = bytes.push(VERSION);
        let _ = match self {
            Self::Name(name) => bytes.extend_from_slice(name.as_str().as_bytes()),
            Self::Calibration(calibration) => bytes.extend_from_slice(&calibration.to_bytes()),
            Self::Network(network) => bytes.extend_from_slice(&network.to_bytes()),
        };
        bytes
    }

    /// What [`Self::to_bytes`] made; `None` for anything else.
    pub fn from_bytes(key: u8, bytes: &[u8]) -> Option<Self> {
        let (&VERSION, value) = bytes.split_first()? else {
            return None;
        };
        match key {
            1 => MachineName::new(core::str::from_utf8(value).ok()?).map(Self::Name),
            2 => {
                let value = value.try_into().ok()?;
                Some(Self::Calibration(Calibration::from_bytes(value)))
            }
            3 => Network::from_bytes(value).map(Self::Network),
            _ => None,
        }
    }
}

impl Settings {
    /// Takes over one setting.
    pub fn set(&mut self, setting: Setting) {
        match setting {
            Setting::Name(name) => self.name = name,
            Setting::Calibration(calibration) => self.calibration = calibration,
            // The first one always fits.
            Setting::Network(network) => drop(self.networks.put(network)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::Angles;
    use crate::motion::Microdegrees;

    #[test]
    fn names_are_letters_digits_and_inner_hyphens() {
        for good in [
            "line-us",
            "robs-lineus",
            "A",
            "7",
            "x--y",
            "abcdefghijklmnopqrstuvwxyz012345",
        ] {
            assert_eq!(MachineName::new(good).unwrap().as_str(), good);
        }
        for bad in [
            "",
            "-a",
            "a-",
            "-",
            "a b",
            "a.b",
            "a_b",
            "\u{e9}",
            "abcdefghijklmnopqrstuvwxyz0123456",
        ] {
            assert_eq!(MachineName::new(bad), None, "{bad:?}");
        }
    }

    #[test]
    fn settings_survive_their_bytes() {
        let angles = Angles::from_array([1, -2, 3].map(Microdegrees::new));
        for setting in [
            Setting::Name(MachineName::new("robs-lineus").unwrap()),
            Setting::Calibration(Calibration { offsets: angles }),
        ] {
            let bytes = setting.to_bytes();
            assert_eq!(Setting::from_bytes(setting.key(), &bytes), Some(setting));
        }
    }

    #[test]
    fn foreign_bytes_are_no_setting() {
        for key in 0..4 {
            for bytes in [
                &[][..],
                &[0],
                &[VERSION],
                &[VERSION, 0xff],
                &[2, b'a'],
                &[VERSION; 200],
            ] {
                assert_eq!(Setting::from_bytes(key, bytes), None, "{key} {bytes:?}");
            }
        }
    }
}
