//! Why a request is refused: a status, a word for programs, a sentence for people.

use crate::services::job::{MAX_REASON, NotNow, RefusedLine};
use core::fmt::{self, Write};
use heapless::String;
use serde::Serialize;

/// Why a request is refused; nothing has changed then.
#[derive(Clone, Debug, Serialize)]
pub struct Failure {
    #[serde(skip)]
    pub status: Status,
    pub error: &'static str,
    pub message: String<MAX_REASON>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub free: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub received: Option<usize>,
}

/// A status of HTTP, with its reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status(pub u16, pub &'static str);

impl Status {
    pub const OK: Self = Self(200, "OK");
    pub const NO_CONTENT: Self = Self(204, "No Content");
    pub const FOUND: Self = Self(302, "Found");
    pub const NOT_MODIFIED: Self = Self(304, "Not Modified");
    pub const BAD_REQUEST: Self = Self(400, "Bad Request");
    pub const FORBIDDEN: Self = Self(403, "Forbidden");
    pub const NOT_FOUND: Self = Self(404, "Not Found");
    pub const BAD_METHOD: Self = Self(405, "Method Not Allowed");
    pub const TIMEOUT: Self = Self(408, "Request Timeout");
    pub const CONFLICT: Self = Self(409, "Conflict");
    pub const LENGTH_REQUIRED: Self = Self(411, "Length Required");
    pub const TOO_LARGE: Self = Self(413, "Content Too Large");
    pub const MISDIRECTED: Self = Self(421, "Misdirected Request");
    pub const UNPROCESSABLE: Self = Self(422, "Unprocessable Content");
    pub const UPGRADE_REQUIRED: Self = Self(426, "Upgrade Required");
    pub const HEAD_TOO_LARGE: Self = Self(431, "Request Header Fields Too Large");
    pub const SERVER_ERROR: Self = Self(500, "Internal Server Error");
    pub const UNAVAILABLE: Self = Self(503, "Service Unavailable");
}

impl Failure {
    /// A refusal; what does not fit of the message is cut.
    pub fn new(status: Status, error: &'static str, message: fmt::Arguments<'_>) -> Self {
        let mut text = String::new();
        // Cut where it is too long.
        let _ = text.write_fmt(message);
        Self {
            status,
            error,
            message: text,
            line: None,
            limit: None,
            free: None,
            received: None,
        }
    }

    pub fn bad_request(why: &str) -> Self {
        Self::new(Status::BAD_REQUEST, "bad_request", format_args!("{why}"))
    }

    pub fn bad_value(why: fmt::Arguments<'_>) -> Self {
        Self::new(Status::BAD_REQUEST, "bad_value", why)
    }

    pub fn busy(why: &str) -> Self {
        Self::new(Status::CONFLICT, "busy", format_args!("{why}"))
    }

    pub fn not_stored(why: &dyn fmt::Display) -> Self {
        let message = format_args!("nothing is stored, everything stays as it was: {why}");
        Self::new(Status::SERVER_ERROR, "not_stored", message)
    }

    pub fn too_slow() -> Self {
        let message = format_args!("the request did not arrive in time");
        Self::new(Status::TIMEOUT, "too_slow", message)
    }

    pub fn too_large(limit: usize) -> Self {
        let message = format_args!("the body may have {limit} bytes");
        Self {
            limit: Some(limit),
            ..Self::new(Status::TOO_LARGE, "too_large", message)
        }
    }

    pub fn full() -> Self {
        let message = format_args!("all connections are in use: try again in a second");
        Self::new(Status::UNAVAILABLE, "busy", message)
    }
}

impl From<NotNow> for Failure {
    fn from(why: NotNow) -> Self {
        match why {
            NotNow::Busy => Self::busy("a drawing is under way: stop it first, or wait"),
            NotNow::NoJob => {
                let message = format_args!("there is no such drawing under way");
                Self::new(Status::CONFLICT, "no_job", message)
            }
            NotNow::TooLarge(limit) => {
                let message = format_args!(
                    "the machine holds {limit} bytes: send a larger drawing in pieces"
                );
                Self {
                    limit: Some(limit),
                    ..Self::new(Status::TOO_LARGE, "too_large", message)
                }
            }
            NotNow::NoRoom(free) => {
                let message = format_args!("{free} bytes fit now: wait until more is drawn");
                Self {
                    free: Some(free),
                    ..Self::new(Status::CONFLICT, "no_room", message)
                }
            }
            NotNow::WrongPlace(received) => {
                let message = format_args!("{received} bytes have been received");
                Self {
                    received: Some(received),
                    ..Self::new(Status::CONFLICT, "wrong_place", message)
                }
            }
        }
    }
}

impl From<RefusedLine> for Failure {
    fn from(refused: RefusedLine) -> Self {
        let RefusedLine { line, reason } = refused;
        Self {
            line: Some(line),
            ..Self::new(
                Status::UNPROCESSABLE,
                "refused_line",
                format_args!("line {line}: {reason}"),
            )
        }
    }
}
