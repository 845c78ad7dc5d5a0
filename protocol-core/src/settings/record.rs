//! The form of the settings in memory: one record that holds all of them.
//!
//! A record is a version and then fields, each a tag, the length of its value, and the value:
//!
//! | tag | value |
//! |---|---|
//! | 1 | the machine's name |
//! | 2 | calibration: three little-endian counts of microdegrees |
//! | 3 | a network: length of its name, name, password; a field for each network |
//! | 4 | what it is after power-on: 1 to 4, as `M552 S` |
//! | 5 | how its own network is called: 1 or 2, as `M552 P` |
//! | 6 | waves: 0 or 1 |
//! | 7 | password of its own network; no field where that is open |
//! | 16 | what the button draws: 0 to 3, as `M23 S`, then the slot, as `K`, or 0 |
//! | 24 | map of heights: top left, top right, bottom right, bottom left, little-endian units of Z |
//! | 25 | how far the nib moves as it comes down: little-endian hundredths of a millimetre |
//! | 26 | servos that turn the other way: a bit for shoulder, elbow and pen |
//! | 8 | whose pages may drive the arm: empty, `*`, or an origin |
//! | 32 | where updates are asked for; no field, nowhere |
//!
//! How it may change: a new setting gets a new tag. Firmware that does not know the tag skips it, and
//! where a field is missing, because the record is older than the setting, the setting has its default.
//! A tag's meaning never changes, and a tag is never used again. The version is raised only by what
//! older firmware would misunderstand: it takes no record of a later version than its own, and every
//! firmware takes those of all earlier ones. Version 1 was not a record yet: `parts.rs` reads it.

use super::{
    AccessPointName, AllowedOrigin, MAX_NAME, MAX_ORIGIN, MachineName, Settings, StartMode,
};
use crate::arm::{Calibration, Directions, NibShift, ZMap};
use crate::drawings::ButtonDraws;
use crate::update::{MAX_ADDRESS, ManifestAddress};
use crate::wifi::{MAX_NETWORK, MAX_NETWORKS, MAX_PASSWORD, Network, Password};
use heapless::Vec;

/// Version of the record.
const VERSION: u8 = 2;

const NAME: u8 = 1;
const CALIBRATION: u8 = 2;
const NETWORK: u8 = 3;
const START: u8 = 4;
const ACCESS_POINT: u8 = 5;
const WAVES: u8 = 6;
const OWN_PASSWORD: u8 = 7;
const BUTTON: u8 = 16;
const MAP: u8 = 24;
const SHIFT: u8 = 25;
const DIRECTIONS: u8 = 26;
const ALLOWED_ORIGIN: u8 = 8;
const UPDATE_ADDRESS: u8 = 32;

/// Tag and length.
const HEAD: usize = 2;
/// Longest record, in bytes.
pub const MAX_RECORD: usize = 1
    + (HEAD + MAX_NAME)
    + (HEAD + Calibration::BYTES)
    + MAX_NETWORKS * (HEAD + MAX_NETWORK)
    + 3 * (HEAD + 1)
    + (HEAD + ButtonDraws::BYTES)
    + (HEAD + MAX_PASSWORD)
    + (HEAD + ZMap::BYTES)
    + (HEAD + 2)
    + (HEAD + 1)
    + (HEAD + MAX_ORIGIN)
    + (HEAD + MAX_ADDRESS);

// Lengths are one byte.
const _: () =
    assert!(MAX_NAME <= 255 && MAX_NETWORK <= 255 && MAX_ORIGIN <= 255 && MAX_ADDRESS <= 255);

impl Settings {
    /// The record of all settings.
    pub fn to_bytes(&self) -> Vec<u8, MAX_RECORD> {
        let mut record = Vec::new();
        // Everything fits: MAX_RECORD is the sum of it.
        let _ = record.push(VERSION);
        put(&mut record, NAME, self.name.as_str().as_bytes());
        put(&mut record, CALIBRATION, &self.calibration.to_bytes());
        for network in self.networks.iter() {
            put(&mut record, NETWORK, &network.to_bytes());
        }
        put(&mut record, START, &[self.start.number()]);
        put(&mut record, ACCESS_POINT, &[self.access_point.number()]);
        put(&mut record, WAVES, &[self.waves.into()]);
        if let Some(password) = &self.own_password {
            put(&mut record, OWN_PASSWORD, password.as_bytes());
        }
        put(&mut record, BUTTON, &self.button.to_bytes());
        put(&mut record, MAP, &self.map.to_bytes());
        put(&mut record, SHIFT, &self.shift.hundredths().to_le_bytes());
        put(&mut record, DIRECTIONS, &[self.directions.to_byte()]);
        // Absent, it is the default.
        if self.allowed_origin != AllowedOrigin::None {
            let origin = self.allowed_origin.as_str();
            put(&mut record, ALLOWED_ORIGIN, origin.as_bytes());
        }
        if let Some(address) = &self.update_address {
            put(&mut record, UPDATE_ADDRESS, address.as_str().as_bytes());
        }
        record
    }

    /// Reads a record; `None` for bytes that are none, or one of a later version.
    ///
    /// A value that cannot be, or that only later firmware understands, is as good as absent: it has its
    /// default, and the other settings are kept. So are networks beyond [`MAX_NETWORKS`].
    pub fn from_bytes(record: &[u8]) -> Option<Self> {
        let (&VERSION, mut rest) = record.split_first()? else {
            return None;
        };
        let mut settings = Self::default();
        while let [tag, length, values @ ..] = rest {
            let (value, next) = values.split_at_checked(usize::from(*length))?;
            // What is not understood stays as it is.
            let _ = settings.take(*tag, value);
            rest = next;
        }
        rest.is_empty().then_some(settings)
    }

    /// Takes over one field; `None` if it is not understood.
    pub(super) fn take(&mut self, tag: u8, value: &[u8]) -> Option<()> {
        match (tag, value) {
            (NAME, text) => self.name = MachineName::new(core::str::from_utf8(text).ok()?)?,
            (CALIBRATION, bytes) => {
                self.calibration = Calibration::from_bytes(bytes.try_into().ok()?);
            }
            (NETWORK, bytes) => self.networks.put(Network::from_bytes(bytes)?).ok()?,
            (START, &[number]) => self.start = StartMode::from_number(number)?,
            (ACCESS_POINT, &[number]) => self.access_point = AccessPointName::from_number(number)?,
            (WAVES, &[flag @ (0 | 1)]) => self.waves = flag == 1,
            (BUTTON, &[number, slot]) => self.button = ButtonDraws::from_bytes([number, slot])?,
            (OWN_PASSWORD, phrase) => self.own_password = Some(Password::new(phrase)?),
            (MAP, bytes) => self.map = ZMap::from_bytes(bytes.try_into().ok()?)?,
            (SHIFT, bytes) => {
                let hundredths = i16::from_le_bytes(bytes.try_into().ok()?);
                self.shift = NibShift::from_hundredths(hundredths)?;
            }
            (DIRECTIONS, &[bits]) => self.directions = Directions::from_byte(bits)?,
            (ALLOWED_ORIGIN, text) => {
                self.allowed_origin = AllowedOrigin::new(core::str::from_utf8(text).ok()?)?;
            }
            (UPDATE_ADDRESS, text) => {
                let address = ManifestAddress::new(core::str::from_utf8(text).ok()?)?;
                self.update_address = Some(address);
            }
            _ => return None,
        }
        Some(())
    }
}

fn put(record: &mut Vec<u8, MAX_RECORD>, tag: u8, value: &[u8]) {
    let _ = record.extend_from_slice(&[tag, value.len() as u8]);
    let _ = record.extend_from_slice(value);
}

#[cfg(test)]
mod tests;
