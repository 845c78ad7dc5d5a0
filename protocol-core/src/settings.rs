//! What the arm remembers, and its form in memory.

mod origin;
mod parts;
mod record;

pub use origin::{AllowedOrigin, MAX_ORIGIN, Origin};
pub use record::MAX_RECORD;

use crate::arm::{Calibration, Compensation, Directions, NibShift, ZMap};
use crate::drawings::ButtonDraws;
use crate::update::ManifestAddress;
use crate::wifi::{Networks, Password};
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

impl StartMode {
    /// Behind the S of M552, and in memory.
    pub const fn number(self) -> u8 {
        match self {
            Self::Station => 1,
            Self::AccessPoint => 2,
            Self::AccessPointLocked => 3,
            Self::StationLongPress => 4,
        }
    }

    /// The mode of that number.
    pub const fn from_number(number: u8) -> Option<Self> {
        match number {
            1 => Some(Self::Station),
            2 => Some(Self::AccessPoint),
            3 => Some(Self::AccessPointLocked),
            4 => Some(Self::StationLongPress),
            _ => None,
        }
    }
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

impl AccessPointName {
    /// Behind the P of M552, and in memory.
    pub const fn number(self) -> u8 {
        match self {
            Self::Setup => 1,
            Self::Machine => 2,
        }
    }

    /// The naming of that number.
    pub const fn from_number(number: u8) -> Option<Self> {
        match number {
            1 => Some(Self::Setup),
            2 => Some(Self::Machine),
            _ => None,
        }
    }
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
    /// Password of its own network, which is open without one (M589). Never shown.
    pub own_password: Option<Password>,
    /// Whether it makes its little waves (M291).
    pub waves: bool,
    /// What a short press of its button draws (M23).
    pub button: ButtonDraws,
    /// How high the paper lies (G31).
    pub map: ZMap,
    /// How the nib moves as it comes down (G31).
    pub shift: NibShift,
    /// Which servos turn the other way (M280).
    pub directions: Directions,
    /// Whose pages may drive the arm through its web interface, beside its own.
    pub allowed_origin: AllowedOrigin,
    /// Where updates are asked for (M997).
    pub update_address: Option<ManifestAddress>,
}

impl Settings {
    /// Map and shift, ready for use.
    pub fn compensation(&self) -> Compensation {
        Compensation::new(self.map, self.shift)
    }
}

impl Default for Settings {
    /// `line-us`, no calibration, no network, its own one open, a station that waves, on flat paper, pages
    /// from elsewhere kept out, and a button that draws the next drawing.
    fn default() -> Self {
        Self {
            name: MachineName::default(),
            calibration: Calibration::default(),
            networks: Networks::new(),
            start: StartMode::default(),
            access_point: AccessPointName::default(),
            own_password: None,
            waves: true,
            update_address: None,
            button: ButtonDraws::default(),
            map: ZMap::FLAT,
            shift: NibShift::NONE,
            directions: Directions::default(),
            allowed_origin: AllowedOrigin::None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
