//! Why a line is refused, and the one place where that becomes text.

use crate::arm::MAX_HEIGHT;
use crate::drawings::Slot;
use crate::settings::MAX_NAME;
use crate::text::{MAX_EXCERPT, MAX_LINE, TooLong, WordError, excerpt, excerpt_of_bytes};
use crate::update::MAX_ADDRESS;
use crate::wifi::{MAX_NETWORKS, MAX_PASSWORD, MIN_PASSWORD};
use core::fmt;

/// Why a line is refused; nothing has changed then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal<'a> {
    /// The line is too long.
    TooLong,
    /// The line is part of a web browser's request.
    Http,
    /// The line is no words.
    Words(WordError<'a>),
    /// An M code of the original's that no document tells the meaning of.
    Reserved(u32),
    /// A code that is for other connections than WebSockets.
    NotHere(u32),
    /// A letter that the command does not have.
    UnknownParameter(char),
    /// A letter that the command needs.
    Missing(char),
    /// A letter that came twice; F and S of G94 are the same.
    Repeated(char),
    /// A number that the parameter cannot have.
    OutOfRange {
        /// The parameter's letter.
        letter: char,
        /// Least value.
        least: i32,
        /// Largest value.
        most: i32,
    },
    /// A scale of zero, or so near to it that it would be.
    ZeroScale,
    /// Not one of the whole numbers from 1 to this one.
    NoChoice(char, u8),
    /// Not one of the whole numbers from the first to the second.
    NotWhole {
        /// The parameter's letter.
        letter: char,
        /// Least value.
        least: u16,
        /// Largest value.
        most: u16,
    },
    /// A letter that goes with another parameter only.
    OnlyWith(char, &'static str),
    /// A command that has no place in a drawing that is recorded.
    NotRecorded(&'a str),
    /// No drawing is in this slot.
    NoSuchDrawing(Slot),
    /// A text that the parameter cannot have, and what it may be.
    BadText(char, &'a [u8], &'static str),
    /// No map of heights.
    BadMap(&'a [u8]),
    /// A password of a length that none has; what it is stays a secret.
    BadPassword,
    /// No machine name.
    BadName(&'a [u8]),
    /// No address of a manifest.
    BadAddress(&'a [u8]),
    /// More networks than can be remembered.
    TooManyNetworks,
    /// No network of this name is remembered.
    NoSuchNetwork(&'a [u8]),
}

impl<'a> From<WordError<'a>> for Refusal<'a> {
    fn from(error: WordError<'a>) -> Self {
        Self::Words(error)
    }
}

impl From<TooLong> for Refusal<'_> {
    fn from(_: TooLong) -> Self {
        Self::TooLong
    }
}

impl fmt::Display for Refusal<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::TooLong => write!(out, "line longer than {MAX_LINE} bytes"),
            Self::Http => out.write_str("this is HTTP: the arm's page is at another port"),
            Self::Words(error) => words(error, out),
            Self::Reserved(number) => write!(out, "M{number} is reserved and does nothing here"),
            Self::NotHere(code) => write!(out, "M{code} is refused over the WebSocket"),
            Self::Missing(letter) => write!(out, "parameter {letter} is missing"),
            Self::UnknownParameter(letter) => write!(out, "unknown parameter {letter}"),
            Self::Repeated(letter) => write!(out, "parameter {letter} is repeated"),
            Self::OutOfRange {
                letter,
                least,
                most,
            } => {
                write!(out, "{letter} is out of range, {least} to {most}")
            }
            Self::NoChoice(letter, most) => {
                write!(out, "{letter} must be a whole number, 1 to {most}")
            }
            Self::NotWhole {
                letter,
                least,
                most,
            } => write!(out, "{letter} must be a whole number, {least} to {most}"),
            Self::OnlyWith(letter, other) => write!(out, "{letter} goes with {other} only"),
            Self::NotRecorded(code) => {
                write!(out, "{} cannot be part of a drawing", short(code))
            }
            Self::NoSuchDrawing(slot) => write!(out, "no drawing {} is stored", slot.number()),
            Self::ZeroScale => out.write_str("S must not be zero"),
            Self::BadText(letter, text, expected) => {
                write!(
                    out,
                    "{letter} is '{}', it may be {expected}",
                    excerpt_of_bytes(text, MAX_EXCERPT)
                )
            }
            Self::BadMap(text) => write!(
                out,
                "S is '{}', it may be 'clear' or four whole numbers, -{MAX_HEIGHT} to {MAX_HEIGHT}, as in 0;100;300;200",
                excerpt_of_bytes(text, MAX_EXCERPT)
            ),
            Self::BadPassword => write!(out, "P must be {MIN_PASSWORD} to {MAX_PASSWORD} bytes"),
            Self::BadName(text) => write!(
                out,
                "P is '{}', a name is 1 to {MAX_NAME} letters, digits and inner hyphens",
                excerpt_of_bytes(text, MAX_EXCERPT)
            ),
            Self::BadAddress(text) => write!(
                out,
                "S is '{}', an address is http://HOST[:PORT]/PATH, no more than {MAX_ADDRESS} bytes",
                excerpt_of_bytes(text, MAX_EXCERPT)
            ),
            Self::TooManyNetworks => write!(
                out,
                "{MAX_NETWORKS} networks are remembered, no more fit: forget one with M588"
            ),
            Self::NoSuchNetwork(name) => write!(
                out,
                "no network '{}' is remembered",
                excerpt_of_bytes(name, MAX_EXCERPT)
            ),
        }
    }
}

fn words(error: WordError<'_>, out: &mut fmt::Formatter<'_>) -> fmt::Result {
    match error {
        WordError::NotUtf8 => out.write_str("line is not UTF-8 text"),
        WordError::NoCode(text) => write!(out, "unknown command '{}'", short(text)),
        WordError::OpenComment => out.write_str("comment without closing bracket"),
        WordError::OpenQuote(letter) => write!(out, "{letter} has no closing quote"),
        WordError::NoLetter(found) => {
            let mut utf8 = [0; 4];
            write!(
                out,
                "'{}' where a parameter letter should be",
                short(found.encode_utf8(&mut utf8))
            )
        }
        WordError::NoNumber(letter) => write!(out, "{letter} has no number"),
        WordError::NotANumber(letter, text) => {
            write!(out, "{letter} is '{}', not a decimal number", short(text))
        }
        WordError::NoValue(letter) => write!(out, "{letter} has no value"),
        WordError::Value(letter, text) => {
            write!(out, "{letter} takes no value, but has '{}'", short(text))
        }
    }
}

fn short(text: &str) -> impl fmt::Display + '_ {
    excerpt(text, MAX_EXCERPT)
}
