//! Version 1 of the form in memory: each setting by itself, under a key, behind a version byte.
//!
//! Written by firmware before 0.1.0, and read still, so that nothing is lost by an update.

use super::Settings;

/// The version byte.
const VERSION: u8 = 1;

impl Settings {
    /// Keys of the settings that were stored by themselves.
    pub const PART_KEYS: [u8; 3] = [1, 2, 3];

    /// Takes over a setting that was stored by itself: name, calibration, network.
    ///
    /// `None` for anything else; nothing has changed then.
    pub fn take_part(&mut self, key: u8, bytes: &[u8]) -> Option<()> {
        let (&VERSION, value) = bytes.split_first()? else {
            return None;
        };
        if !Self::PART_KEYS.contains(&key) {
            return None;
        }
        // The keys have become the tags of the record's fields, and the values are the same.
        self.take(key, value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::MachineName;

    #[test]
    fn parts_are_taken_over() {
        let mut settings = Settings::default();
        let network = b"\x01\x04homecorrect horse";
        let calibration = [1, 1, 0, 0, 0, 0xfe, 0xff, 0xff, 0xff, 3, 0, 0, 0];
        for (key, bytes) in [
            (1, &b"\x01robs-lineus"[..]),
            (2, &calibration),
            (3, network),
        ] {
            assert_eq!(settings.take_part(key, bytes), Some(()), "{key}");
        }
        assert_eq!(settings.name.as_str(), "robs-lineus");
        let offsets = settings.calibration.offsets.to_array();
        assert_eq!(offsets.map(|angle| angle.get()), [1, -2, 3]);
        let network = settings.networks.iter().next().unwrap();
        assert_eq!(network.ssid.as_bytes(), b"home");
        let password = network.password.as_ref().unwrap();
        assert_eq!(password.as_bytes(), b"correct horse");
    }

    #[test]
    fn foreign_bytes_are_no_part() {
        let mut settings = Settings::default();
        for key in 0..=7 {
            for bytes in [
                &[][..],
                &[0],
                &[1],
                &[1, 0xff],
                &[2, b'a'],
                &[1; 200],
                b"\x01-",
            ] {
                assert_eq!(settings.take_part(key, bytes), None, "{key} {bytes:?}");
            }
        }
        assert_eq!(settings, Settings::default());
        assert_eq!(settings.name, MachineName::default());
    }
}
