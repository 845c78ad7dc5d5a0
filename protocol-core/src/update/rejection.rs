//! Why there is no update, and the one place where that becomes text.

use super::{MAX_MANIFEST, Version};
use crate::motion::Micros;
use core::fmt;

/// Why there is no update. The running firmware and what starts next are untouched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rejection {
    /// This board has no place for a second firmware.
    NoSlots,
    /// No address is kept.
    NoAddress,
    /// One is under way.
    UnderWay,
    /// The running firmware is new and has not confirmed itself: what would be overwritten is the one to
    /// come back to.
    OnTrial,
    /// Something is drawn, paused or recorded, or the pen is down, and that does not end.
    Drawing,
    /// The host's name is not known.
    UnknownHost,
    /// No connection to the server.
    NoServer,
    /// The server ends the connection without an answer.
    NoAnswer,
    /// The connection ended before everything had come.
    Truncated {
        /// Bytes that have come.
        received: u32,
        /// Bytes that should have.
        expected: u32,
    },
    /// Nothing has come for too long.
    Silent,
    /// It takes too long as a whole.
    Slow(Micros),
    /// The server points to somewhere else.
    Redirect(u16),
    /// The server answers with another status than 200.
    Status(u16),
    /// What the server says is not HTTP, or too long.
    NotHttp,
    /// The server does not say how long its answer is, or encodes it.
    NoLength,
    /// The manifest is longer than any.
    LongManifest(u32),
    /// This line of the manifest is not what it should be, counted from 1.
    BadManifest(u8),
    /// The signature is not that of the key.
    WrongSignature,
    /// For another board.
    OtherBoard,
    /// Older than what runs.
    Older(Version),
    /// What runs already.
    Same(Version),
    /// It does not fit the slot, or is nothing.
    WrongSize {
        /// Bytes of the image.
        image: u32,
        /// Bytes of the slot.
        slot: u32,
    },
    /// The image that is offered is not as long as the manifest says.
    WrongLength {
        /// Bytes that are offered.
        offered: u32,
        /// Bytes that the manifest says.
        expected: u32,
    },
    /// What came is not what was signed.
    WrongHash,
    /// The flash holds something else than what was written.
    FlashDiffers,
    /// The flash refuses.
    FlashFails,
}

impl fmt::Display for Rejection {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NoSlots => out.write_str("this board has no place for another firmware"),
            Self::NoAddress => out.write_str("no address is kept for updates, M997 S sets one"),
            Self::UnderWay => out.write_str("an update is under way"),
            Self::OnTrial => out.write_str("the firmware is on trial, try again in a minute"),
            Self::Drawing => out.write_str("a drawing is under way, or the pen is down"),
            Self::UnknownHost => out.write_str("the server's name is not known"),
            Self::NoServer => out.write_str("no connection to the server"),
            Self::NoAnswer => out.write_str("the server ends the connection without an answer"),
            Self::Truncated { received, expected } => {
                write!(
                    out,
                    "the download ended after {received} of {expected} bytes"
                )
            }
            Self::Silent => out.write_str("the sender has gone silent"),
            Self::Slow(limit) => {
                write!(out, "it took longer than {} s", limit.get() / 1_000_000)
            }
            Self::Redirect(status) => {
                write!(out, "the server points elsewhere, status {status}")
            }
            Self::Status(status) => write!(out, "the server answers with status {status}"),
            Self::NotHttp => out.write_str("the server's answer is not understood"),
            Self::NoLength => out.write_str("the server does not tell the length of the file"),
            Self::LongManifest(length) => write!(
                out,
                "the manifest has {length} bytes, no more than {MAX_MANIFEST} are allowed"
            ),
            Self::BadManifest(line) => write!(out, "line {line} of the manifest is wrong"),
            Self::WrongSignature => out.write_str("the signature is wrong"),
            Self::OtherBoard => out.write_str("it is for another board"),
            Self::Older(version) => write!(out, "{version} is older than this firmware"),
            Self::Same(version) => write!(out, "{version} is what runs already"),
            Self::WrongSize { image, slot } => {
                write!(out, "the image has {image} bytes, the slot {slot}")
            }
            Self::WrongLength { offered, expected } => write!(
                out,
                "the image has {offered} bytes, the signed one {expected}"
            ),
            Self::WrongHash => out.write_str("the image is not the signed one"),
            Self::FlashDiffers => out.write_str("the flash does not hold what was written"),
            Self::FlashFails => out.write_str("the flash does not take it"),
        }
    }
}
