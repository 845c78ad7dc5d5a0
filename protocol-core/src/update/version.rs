//! Versions of firmware, and which of two is newer.

use core::fmt;

/// `MAJOR.MINOR.PATCH`, three whole numbers below 65536, compared in this order. There are no pre-releases:
/// what may be installed over the network is a release.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    // The derived order is that of the fields.
    major: u16,
    minor: u16,
    patch: u16,
}

impl Version {
    /// In memory, in bytes.
    pub const BYTES: usize = 6;

    /// From three numbers.
    pub const fn new(major: u16, minor: u16, patch: u16) -> Self {
        Self {
            major,
            minor,
            patch,
        }
    }

    /// The version of this firmware: the package's, unless the build was told another one (`build.rs`).
    ///
    /// # Panics
    /// Never: what is no version does not compile.
    pub const FIRMWARE: Self = match Self::parse(env!("QUILL_VERSION")) {
        Some(version) => version,
        None => panic!("QUILL_VERSION is not three numbers with points between them"),
    };

    /// Three numbers with points between them, without signs, blanks or leading zeros; `None` for anything
    /// else.
    pub const fn parse(text: &str) -> Option<Self> {
        let (Some(major), rest) = number(text.as_bytes()) else {
            return None;
        };
        let [b'.', rest @ ..] = rest else {
            return None;
        };
        let (Some(minor), rest) = number(rest) else {
            return None;
        };
        let [b'.', rest @ ..] = rest else {
            return None;
        };
        match number(rest) {
            (Some(patch), []) => Some(Self::new(major, minor, patch)),
            _ => None,
        }
    }

    /// Its form in memory: three little-endian numbers.
    pub const fn to_bytes(self) -> [u8; Self::BYTES] {
        let [a, b] = self.major.to_le_bytes();
        let [c, d] = self.minor.to_le_bytes();
        let [e, f] = self.patch.to_le_bytes();
        [a, b, c, d, e, f]
    }

    /// From its form in memory.
    pub const fn from_bytes([a, b, c, d, e, f]: [u8; Self::BYTES]) -> Self {
        Self::new(
            u16::from_le_bytes([a, b]),
            u16::from_le_bytes([c, d]),
            u16::from_le_bytes([e, f]),
        )
    }
}

/// The digits in front, if they are a number, and what follows them.
const fn number(text: &[u8]) -> (Option<u16>, &[u8]) {
    let mut rest = text;
    let mut number = 0_u32;
    let mut digits = 0;
    while let [digit @ b'0'..=b'9', more @ ..] = rest {
        number = number
            .saturating_mul(10)
            .saturating_add((*digit - b'0') as u32);
        digits += 1;
        rest = more;
    }
    let has_leading_zero = digits > 1 && matches!(text, [b'0', ..]);
    if digits == 0 || has_leading_zero || number > u16::MAX as u32 {
        return (None, rest);
    }
    (Some(number as u16), rest)
}

impl fmt::Display for Version {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    #[test]
    fn the_first_number_that_differs_decides() {
        let ascending = [
            "0.0.0",
            "0.0.9",
            "0.0.10",
            "0.1.0",
            "0.9.65535",
            "0.10.0",
            "1.0.0",
            "2.0.0",
            "10.0.0",
            "65535.65535.65535",
        ];
        let versions = ascending.map(|text| Version::parse(text).unwrap());
        assert!(versions.is_sorted_by(|older, newer| older < newer));
    }

    #[test]
    fn nothing_else_is_a_version() {
        for text in [
            "",
            "1",
            "1.2",
            "1.2.3.4",
            "1.2.",
            ".1.2",
            "1..2",
            "1.2.x",
            "1.2.3-rc1",
            "v1.2.3",
            "+1.2.3",
            "-1.2.3",
            "01.2.3",
            "1.2.00",
            "1.2.65536",
            " 1.2.3",
            "1.2.3 ",
            "1,2,3",
            "\u{661}.2.3",
        ] {
            assert_eq!(Version::parse(text), None, "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn versions_survive_text_and_bytes(numbers in any::<[u16; 3]>()) {
            let [major, minor, patch] = numbers;
            let version = Version::new(major, minor, patch);
            prop_assert_eq!(Version::parse(&version.to_string()), Some(version));
            prop_assert_eq!(Version::from_bytes(version.to_bytes()), version);
        }

        #[test]
        fn the_order_is_that_of_the_numbers(one in any::<[u16; 3]>(), other in any::<[u16; 3]>()) {
            let version = |[major, minor, patch]: [u16; 3]| Version::new(major, minor, patch);
            prop_assert_eq!(version(one).cmp(&version(other)), one.cmp(&other));
        }
    }
}
