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
//! | 32 | where updates are asked for; no field, nowhere |
//!
//! How it may change: a new setting gets a new tag. Firmware that does not know the tag skips it, and
//! where a field is missing, because the record is older than the setting, the setting has its default.
//! A tag's meaning never changes, and a tag is never used again. The version is raised only by what
//! older firmware would misunderstand: it takes no record of a later version than its own, and every
//! firmware takes those of all earlier ones. Version 1 was not a record yet: `parts.rs` reads it.

use super::{AccessPointName, MAX_NAME, MachineName, Settings, StartMode};
use crate::arm::Calibration;
use crate::update::{MAX_ADDRESS, ManifestAddress};
use crate::wifi::{MAX_NETWORK, MAX_NETWORKS, Network};
use heapless::Vec;

/// Version of the record.
const VERSION: u8 = 2;

const NAME: u8 = 1;
const CALIBRATION: u8 = 2;
const NETWORK: u8 = 3;
const START: u8 = 4;
const ACCESS_POINT: u8 = 5;
const WAVES: u8 = 6;
const UPDATE_ADDRESS: u8 = 32;

/// Tag and length.
const HEAD: usize = 2;
/// Longest record, in bytes.
pub const MAX_RECORD: usize = 1
    + (HEAD + MAX_NAME)
    + (HEAD + Calibration::BYTES)
    + MAX_NETWORKS * (HEAD + MAX_NETWORK)
    + 3 * (HEAD + 1)
    + (HEAD + MAX_ADDRESS);

// Lengths are one byte.
const _: () = assert!(MAX_NAME <= 255 && MAX_NETWORK <= 255 && MAX_ADDRESS <= 255);

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
