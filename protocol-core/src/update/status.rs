//! What is told of updates.

use super::{Rejection, STARTS, Standing, Version};
use core::fmt;

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Nothing.
    Idle,
    /// The manifest is being fetched.
    Asking,
    /// Waits until the arm rests.
    Waiting(Version),
    /// The image is being fetched and written.
    Loading {
        /// Its version.
        version: Version,
        /// How much of it is written.
        percent: u8,
    },
    /// The image is being read back.
    Checking(Version),
    /// It starts in a moment.
    Restarting(Version),
}

/// How updates stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// What is being done.
    pub progress: Progress,
    /// How the running firmware stands.
    pub standing: Standing,
    /// Why the last update since the start was refused, if it was.
    pub refused: Option<Rejection>,
}

impl Status {
    /// Nothing is done, and nothing is to be told.
    pub const NONE: Self = Self {
        progress: Progress::Idle,
        standing: Standing::Settled,
        refused: None,
    };
}

/// In words, without a double quote.
impl fmt::Display for Status {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.progress {
            Progress::Idle => {}
            Progress::Asking => return out.write_str("asking"),
            Progress::Waiting(version) => return write!(out, "{version} waits for the arm"),
            Progress::Loading { version, percent } => {
                return write!(out, "loading {version}, {percent} %");
            }
            Progress::Checking(version) => return write!(out, "checking {version}"),
            Progress::Restarting(version) => return write!(out, "starting {version}"),
        }
        match (self.standing, self.refused) {
            (Standing::Trial { starts }, _) => write!(out, "on trial, start {starts} of {STARTS}"),
            (_, Some(rejection)) => write!(out, "refused: {rejection}"),
            (Standing::Back { from }, None) => {
                write!(out, "{from} did not confirm itself, back to this one")
            }
            (Standing::Settled, None) => out.write_str("none"),
        }
    }
}

/// Whose signature is believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyName {
    /// The key that is published on purpose: whoever has the sources can sign with it.
    Development,
    /// Another one, with its first bytes.
    Own([u8; 4]),
}

impl fmt::Display for KeyName {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Development => out.write_str("development"),
            Self::Own(bytes) => write!(out, "{:08x}", u32::from_be_bytes(*bytes)),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn in_words() {
        let version = Version::new(0, 2, 0);
        let idle = Status::NONE;
        let loading = Progress::Loading {
            version,
            percent: 43,
        };
        for (status, words) in [
            (idle, "none"),
            (
                Status {
                    progress: loading,
                    ..idle
                },
                "loading 0.2.0, 43 %",
            ),
            (
                Status {
                    standing: Standing::Trial { starts: 2 },
                    ..idle
                },
                "on trial, start 2 of 3",
            ),
            (
                Status {
                    standing: Standing::Back { from: version },
                    ..idle
                },
                "0.2.0 did not confirm itself, back to this one",
            ),
            (
                Status {
                    refused: Some(Rejection::Redirect(302)),
                    ..idle
                },
                "refused: the server points elsewhere, status 302",
            ),
        ] {
            assert_eq!(status.to_string(), words);
        }
        assert_eq!(KeyName::Development.to_string(), "development");
        assert_eq!(KeyName::Own([0, 1, 0xab, 0xff]).to_string(), "0001abff");
    }
}
