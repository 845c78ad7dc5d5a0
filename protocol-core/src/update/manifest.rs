//! The manifest: what a signed image is.
//!
//! Seven lines of text, each ended by a line feed, in this order and in no other form (`docs/update.md`):
//!
//! ```text
//! Quill update 1
//! board: esp32c3
//! version: 0.2.0
//! size: 651264
//! sha256: 64 lower-case hexadecimal digits
//! image: quill-0.2.0-esp32c3.bin
//! signature: 128 lower-case hexadecimal digits
//! ```
//!
//! The signature is ed25519 over all bytes before the line that it is on. There is exactly one form for what
//! is said, so that nothing can be added that a signature does not cover.

use super::{ImageName, Rejection, Version};
use core::str;

/// Longest manifest, in bytes.
pub const MAX_MANIFEST: usize = 512;
/// Longest name of a board, in bytes.
pub const MAX_BOARD: usize = 32;
/// The first line: what it is, and the version of its form.
const TITLE: &str = "Quill update 1";
/// How many lines there are.
const LINES: u8 = 7;

/// A signature of ed25519.
pub type Signature = [u8; 64];
/// A hash of SHA-256.
pub type Hash = [u8; 32];

/// A manifest that nobody has looked at the signature of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unverified<'a> {
    manifest: Manifest<'a>,
    signed: &'a [u8],
    signature: Signature,
}

/// What a signed image is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Manifest<'a> {
    /// The board it is for.
    pub board: &'a str,
    /// Its version.
    pub version: Version,
    /// Its size in bytes.
    pub size: u32,
    /// Its hash.
    pub sha256: Hash,
    /// The file beside the manifest that it is in.
    pub image: ImageName,
}

/// What runs, and where another one would go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Running<'a> {
    /// The board's name.
    pub board: &'a str,
    /// The version that runs.
    pub version: Version,
    /// Bytes of the other slot.
    pub slot: u32,
}

impl<'a> Unverified<'a> {
    /// Reads a manifest.
    ///
    /// # Errors
    /// [`Rejection::BadManifest`] with the number of the line that is not what it should be.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Rejection> {
        let mut lines = Lines {
            rest: bytes,
            number: 0,
        };
        lines.next(|line| (line == TITLE).then_some(()))?;
        let board = lines.value("board: ", |text| is_board(text).then_some(text))?;
        let version = lines.value("version: ", Version::parse)?;
        let size = lines.value("size: ", size)?;
        let sha256 = lines.value("sha256: ", |text| hexadecimal(text.as_bytes()))?;
        let image = lines.value("image: ", ImageName::new)?;
        let signed = bytes.len() - lines.rest.len();
        let signature = lines.value("signature: ", |text| hexadecimal(text.as_bytes()))?;
        if !lines.rest.is_empty() {
            return Err(Rejection::BadManifest(LINES + 1));
        }
        Ok(Self {
            manifest: Manifest {
                board,
                version,
                size,
                sha256,
                image,
            },
            signed: bytes.get(..signed).unwrap_or_default(),
            signature,
        })
    }

    /// The manifest, if `is_signature_of` says that the signature is one of these bytes.
    ///
    /// # Errors
    /// [`Rejection::WrongSignature`].
    pub fn verify(
        self,
        is_signature_of: impl FnOnce(&Signature, &[u8]) -> bool,
    ) -> Result<Manifest<'a>, Rejection> {
        match is_signature_of(&self.signature, self.signed) {
            true => Ok(self.manifest),
            false => Err(Rejection::WrongSignature),
        }
    }
}

impl Manifest<'_> {
    /// Whether it is an update for what runs.
    ///
    /// # Errors
    /// A [`Rejection`]: for another board, older or the same, larger than the slot or empty.
    pub fn check(&self, running: &Running<'_>) -> Result<(), Rejection> {
        if self.board != running.board {
            return Err(Rejection::OtherBoard);
        }
        if self.version < running.version {
            return Err(Rejection::Older(self.version));
        }
        if self.version == running.version {
            return Err(Rejection::Same(self.version));
        }
        if self.size == 0 || self.size > running.slot {
            return Err(Rejection::WrongSize {
                image: self.size,
                slot: running.slot,
            });
        }
        Ok(())
    }
}

/// Where a manifest ends that is at the beginning of something: behind its last line. `None` if that is not there.
pub fn manifest_end(bytes: &[u8]) -> Option<usize> {
    let mut ends = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
    ends.nth(usize::from(LINES) - 1).map(|(last, _)| last + 1)
}

/// Takes line after line.
struct Lines<'a> {
    rest: &'a [u8],
    number: u8,
}

impl<'a> Lines<'a> {
    fn next<T>(&mut self, read: impl FnOnce(&'a str) -> Option<T>) -> Result<T, Rejection> {
        self.number += 1;
        let line = self.rest.iter().position(|byte| *byte == b'\n');
        let line = line.and_then(|end| {
            let (line, rest) = self.rest.split_at_checked(end)?;
            self.rest = rest.get(1..)?;
            str::from_utf8(line).ok()
        });
        line.and_then(read)
            .ok_or(Rejection::BadManifest(self.number))
    }

    fn value<T>(
        &mut self,
        label: &str,
        read: impl FnOnce(&'a str) -> Option<T>,
    ) -> Result<T, Rejection> {
        self.next(|line| read(line.strip_prefix(label)?))
    }
}

/// Whether it may be a board's name: 1 to [`MAX_BOARD`] lower-case letters, digits and hyphens.
fn is_board(text: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
    (1..=MAX_BOARD).contains(&text.len()) && text.bytes().all(allowed)
}

fn size(text: &str) -> Option<u32> {
    let is_plain = text.bytes().all(|byte| byte.is_ascii_digit());
    let is_short = text == "0" || !text.starts_with('0');
    (is_plain && is_short).then(|| text.parse().ok()).flatten()
}

/// Exactly `N` bytes in lower-case hexadecimal digits.
pub const fn hexadecimal<const N: usize>(text: &[u8]) -> Option<[u8; N]> {
    let mut digits = text;
    let mut bytes = [0; N];
    let mut free: &mut [u8] = &mut bytes;
    while let [high, low, more @ ..] = digits {
        let (Some(high), Some(low)) = (nibble(*high), nibble(*low)) else {
            return None;
        };
        let Some((byte, others)) = free.split_first_mut() else {
            return None;
        };
        *byte = high << 4 | low;
        free = others;
        digits = more;
    }
    if digits.is_empty() && free.is_empty() {
        Some(bytes)
    } else {
        None
    }
}

const fn nibble(digit: u8) -> Option<u8> {
    match digit {
        b'0'..=b'9' => Some(digit - b'0'),
        b'a'..=b'f' => Some(digit - b'a' + 10),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::format;
    use std::string::String;

    const HASH: &str = "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1dfeff";

    fn text() -> String {
        format!(
            "Quill update 1\nboard: esp32c3\nversion: 0.2.0\nsize: 651264\nsha256: {HASH}\n\
             image: quill-0.2.0-esp32c3.bin\nsignature: {}\n",
            "a5".repeat(64)
        )
    }

    const RUNNING: Running<'_> = Running {
        board: "esp32c3",
        version: Version::new(0, 1, 0),
        slot: 1_310_720,
    };

    fn read(text: &str) -> Manifest<'_> {
        Unverified::parse(text.as_bytes())
            .unwrap()
            .verify(|_, _| true)
            .unwrap()
    }

    #[test]
    fn a_manifest_says_what_an_image_is() {
        let text = text();
        let manifest = read(&text);
        assert_eq!(manifest.board, "esp32c3");
        assert_eq!(manifest.version, Version::new(0, 2, 0));
        assert_eq!(manifest.size, 651_264);
        assert_eq!((manifest.sha256[0], manifest.sha256[31]), (0, 0xff));
        assert_eq!(manifest.image.as_str(), "quill-0.2.0-esp32c3.bin");
        assert_eq!(manifest.check(&RUNNING), Ok(()));
    }

    #[test]
    fn the_signature_is_over_everything_before_it() {
        let text = text();
        let unverified = Unverified::parse(text.as_bytes()).unwrap();
        let (before, _) = text.split_once("signature").unwrap();
        let result = unverified.clone().verify(|signature, signed| {
            assert_eq!(*signature, [0xa5; 64]);
            assert_eq!(signed, before.as_bytes());
            false
        });
        assert_eq!(result, Err(Rejection::WrongSignature));
    }

    #[test]
    fn a_line_that_is_not_what_it_should_be_is_named() {
        let good = text();
        for (from, to, line) in [
            ("update 1", "update 2", 1),
            ("board: esp32c3", "board:esp32c3", 2),
            ("board: esp32c3", "board: ESP32", 2),
            ("board: esp32c3", "board: ", 2),
            ("board: esp32c3\n", "", 2),
            ("0.2.0\n", "0.2\n", 3),
            ("size: 6", "size: -6", 4),
            ("size: 6", "size: 06", 4),
            ("size: 651264", "size: 4294967296", 4),
            ("1dfeff", "1dfef", 5),
            ("1dfeff", "1dFEFF", 5),
            ("1dfeff", "1dfeff00", 5),
            ("image: quill", "image: ../quill", 6),
            (".bin\n", ".bin\r\n", 6),
            ("a5\n", "a5", 7),
            ("a5\n", "\n", 7),
            ("a5\n", "a5\n\n", 8),
            ("a5\n", "a5\nnote: more\n", 8),
        ] {
            let bad = good.replacen(from, to, 1);
            assert_ne!(bad, good);
            let found = Unverified::parse(bad.as_bytes());
            assert_eq!(found, Err(Rejection::BadManifest(line)), "{to:?}");
        }
        assert_eq!(Unverified::parse(b""), Err(Rejection::BadManifest(1)));
    }

    #[test]
    fn only_a_newer_firmware_for_this_board_that_fits_is_an_update() {
        for (from, to, outcome) in [
            ("esp32c3", "esp32c6", Err(Rejection::OtherBoard)),
            (
                "0.2.0",
                "0.1.0",
                Err(Rejection::Same(Version::new(0, 1, 0))),
            ),
            (
                "0.2.0",
                "0.0.9",
                Err(Rejection::Older(Version::new(0, 0, 9))),
            ),
            ("0.2.0", "0.1.1", Ok(())),
            ("651264", "1310720", Ok(())),
            (
                "651264",
                "0",
                Err(Rejection::WrongSize {
                    image: 0,
                    slot: 1_310_720,
                }),
            ),
            (
                "651264",
                "1310721",
                Err(Rejection::WrongSize {
                    image: 1_310_721,
                    slot: 1_310_720,
                }),
            ),
        ] {
            let text = text().replacen(from, to, 1);
            assert_eq!(read(&text).check(&RUNNING), outcome, "{to}");
        }
    }

    #[test]
    fn the_longest_manifest_fits() {
        let long = format!(
            "{TITLE}\nboard: {}\nversion: 65535.65535.65535\nsize: 4294967295\nsha256: {HASH}\nimage: {}\nsignature: {}\n",
            "x".repeat(MAX_BOARD),
            "x".repeat(super::super::MAX_IMAGE_NAME),
            "00".repeat(64)
        );
        assert!(Unverified::parse(long.as_bytes()).is_ok());
        assert!(long.len() <= MAX_MANIFEST, "{}", long.len());
    }

    #[test]
    fn an_image_behind_a_manifest() {
        let text = text();
        let end = text.len();
        for image in ["", "\n", "image\n\n"] {
            let file = format!("{text}{image}");
            assert_eq!(manifest_end(file.as_bytes()), Some(end), "{image:?}");
        }
        assert_eq!(manifest_end(&text.as_bytes()[..end - 1]), None);
        assert_eq!(manifest_end(b""), None);
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
            let _ = Unverified::parse(&bytes);
        }

        #[test]
        fn a_changed_byte_is_never_overlooked(at in 0..400usize, byte in any::<u8>()) {
            // Whatever is still a manifest has the change in what is signed, or in the signature.
            let good = text();
            let mut bad = good.clone().into_bytes();
            prop_assume!(at < bad.len() && bad[at] != byte);
            bad[at] = byte;
            if let Ok(unverified) = Unverified::parse(&bad) {
                let original = Unverified::parse(good.as_bytes()).unwrap();
                let differs = unverified.signed != original.signed
                    || unverified.signature != original.signature;
                prop_assert!(differs);
            }
        }
    }
}
