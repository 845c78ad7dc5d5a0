//! What the machine says: one line for each line (`spec lasaurgrbl, Return Format`).
//!
//! The order is that of the original, which hosts rely on in part: stop mode or the answer to the
//! checksum or the fault, then sensors, then the status with the version last.

use super::command::Fault;
use super::receive::MAX_LINE;
use super::stop::Letter;
use crate::machine::StopReason;
use crate::motion::{Millimetres, TablePoint};
use core::fmt::{self, Write};
use heapless::Vec;

/// Hosts look for `X`, `Y`, `V` and flags wherever they are in a line, so that there is no capital
/// letter in it.
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "-quill");

const _: () = {
    let mut bytes = VERSION.as_bytes();
    while let Some((byte, rest)) = bytes.split_first() {
        assert!(
            !byte.is_ascii_uppercase(),
            "a capital letter is taken for a flag"
        );
        bytes = rest;
    }
};

/// Said on every connection and after every reset: hosts know the machine by it.
pub const BANNER: &str = concat!("# LasaurGrbl ", env!("CARGO_PKG_VERSION"), "-quill\n");

/// Follows the line whose checksum is none.
const NO_CHECKSUM: &str = " -> checksum outside [128,255]";
/// Longest reply: a whole line, why its checksum is none, all sensors, newline.
pub const MAX_REPLY: usize = MAX_LINE + NO_CHECKSUM.len() + 3 + 4 * 2 + 1;

/// What the board can sense; an input that is not there is never set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sensors {
    /// `D`.
    pub door_open: bool,
    /// `C`.
    pub chiller_off: bool,
    /// `P`.
    pub power_off: bool,
    /// `L1` to `L4`: x1 (left), x2 (right), y1 (near), y2 (far).
    pub limits: [bool; 4],
}

/// What a reply says before the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// Executed, or skipped: nothing.
    Bare,
    /// In stop mode: discarded.
    Stopped(StopReason),
    /// A redundant line was wrong.
    Wrong,
    /// A final line was wrong: the line itself.
    Failed,
    /// What was no checksum: the line itself, and why.
    NoChecksum,
    /// The body was refused.
    Refused(Fault),
    /// Where the arm is, after the sensors.
    Status(TablePoint),
}

/// A coordinate with three decimals, rounded to the nearest, without a minus before zero.
struct Thousandths(Millimetres);

impl fmt::Display for Thousandths {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounded = self.0.micrometres();
        let sign = if rounded < 0 { "-" } else { "" };
        let (whole, part) = (rounded.abs() / 1000, rounded.abs() % 1000);
        write!(out, "{sign}{whole}.{part:03}")
    }
}

/// One reply.
#[derive(Debug, Default)]
pub struct Reply {
    bytes: Vec<u8, MAX_REPLY>,
}

impl Reply {
    /// Nothing said yet.
    pub const fn new() -> Self {
        Self { bytes: Vec::new() }
    }

    /// The bytes to send, newline included.
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes
    }

    pub(super) fn compose(&mut self, answer: Answer, line: &[u8], sensors: Sensors) {
        self.bytes.clear();
        match answer {
            Answer::Bare | Answer::Status(_) => {}
            Answer::Stopped(reason) => self.write(format_args!("!{}", Letter(reason))),
            Answer::Wrong => self.push(b"^"),
            Answer::Failed => self.push(line),
            Answer::NoChecksum => {
                self.push(line);
                self.push(NO_CHECKSUM.as_bytes());
            }
            Answer::Refused(fault) => self.push(match fault {
                Fault::BadNumber => b"N",
                Fault::ExpectedLetter => b"E",
                Fault::Unsupported => b"U",
            }),
        }
        let [x1, x2, y1, y2] = sensors.limits;
        for (set, flag) in [
            (sensors.door_open, &b"D"[..]),
            (sensors.chiller_off, b"C"),
            (sensors.power_off, b"P"),
            (x1, b"L1"),
            (x2, b"L2"),
            (y1, b"L3"),
            (y2, b"L4"),
        ] {
            if set {
                self.push(flag);
            }
        }
        if let Answer::Status(TablePoint { x, y }) = answer {
            let (x, y) = (Thousandths(x), Thousandths(y));
            self.write(format_args!("X{x}Y{y}V{VERSION}"));
        }
        self.push(b"\n");
    }

    /// [`MAX_REPLY`] holds the longest there is.
    fn push(&mut self, part: &[u8]) {
        let _ = self.bytes.extend_from_slice(part);
    }

    fn write(&mut self, part: fmt::Arguments<'_>) {
        let _ = self.bytes.write_fmt(part);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::units::place;
    use super::*;
    use crate::motion::Side;
    use std::string::{String, ToString};

    const ALL: Sensors = Sensors {
        door_open: true,
        chiller_off: true,
        power_off: true,
        limits: [true; 4],
    };

    fn said(answer: Answer, sensors: Sensors) -> String {
        let mut reply = Reply::new();
        reply.compose(answer, b"*\xffline", sensors);
        reply.as_bytes().escape_ascii().to_string()
    }

    #[test]
    fn the_order_within_a_reply() {
        let some = Sensors {
            door_open: true,
            chiller_off: true,
            limits: [false, true, false, false],
            ..Sensors::default()
        };
        let none = Sensors::default();
        let there = Answer::Status(place(6, -5));
        let status = std::format!("X6.000Y-5.000V{VERSION}\\n");
        for (answer, sensors, expected) in [
            (Answer::Bare, none, "\\n"),
            (Answer::Bare, ALL, "DCPL1L2L3L4\\n"),
            (Answer::Stopped(StopReason::Requested), none, "!R\\n"),
            (
                Answer::Stopped(StopReason::Limit(Side::X2)),
                some,
                "!LDCL2\\n",
            ),
            (
                Answer::Stopped(StopReason::Other(250)),
                some,
                "!O250DCL2\\n",
            ),
            (Answer::Refused(Fault::BadNumber), some, "NDCL2\\n"),
            (Answer::Refused(Fault::ExpectedLetter), none, "E\\n"),
            (Answer::Refused(Fault::Unsupported), ALL, "UDCPL1L2L3L4\\n"),
            (Answer::Wrong, none, "^\\n"),
            (Answer::Wrong, some, "^DCL2\\n"),
            (Answer::Failed, none, "*\\xffline\\n"),
            (
                Answer::NoChecksum,
                some,
                "*\\xffline -> checksum outside [128,255]DCL2\\n",
            ),
            (there, none, &status),
            (there, ALL, &("DCPL1L2L3L4".to_string() + &status)),
        ] {
            assert_eq!(said(answer, sensors), expected, "{answer:?}");
        }
    }

    #[test]
    fn each_sensor_has_its_flag() {
        let none = Sensors::default();
        let limit = |at| {
            let mut limits = [false; 4];
            limits[at] = true;
            Sensors { limits, ..none }
        };
        for (sensors, flag) in [
            (
                Sensors {
                    door_open: true,
                    ..none
                },
                "D",
            ),
            (
                Sensors {
                    chiller_off: true,
                    ..none
                },
                "C",
            ),
            (
                Sensors {
                    power_off: true,
                    ..none
                },
                "P",
            ),
            (limit(0), "L1"),
            (limit(1), "L2"),
            (limit(2), "L3"),
            (limit(3), "L4"),
        ] {
            assert_eq!(said(Answer::Bare, sensors), flag.to_string() + "\\n");
        }
    }

    #[test]
    fn the_longest_replies_fit() {
        let line = [b'*'; MAX_LINE];
        let mut reply = Reply::new();
        reply.compose(Answer::NoChecksum, &line, ALL);
        assert!(reply.as_bytes().ends_with(b"[128,255]DCPL1L2L3L4\n"));
        let far = Millimetres::from_bits(i32::MIN);
        reply.compose(Answer::Status(TablePoint { x: far, y: far }), &line, ALL);
        assert!(reply.as_bytes().ends_with(b"-quill\n"));
    }

    #[test]
    fn the_banner_is_what_hosts_look_for() {
        assert_eq!(BANNER, std::format!("# LasaurGrbl {VERSION}\n"));
        assert!(!VERSION.contains(|letter: char| letter.is_uppercase()));
    }

    #[test]
    fn three_decimals_rounded_to_the_nearest() {
        for (bits, text) in [
            (0, "0.000"),
            (1 << 16, "1.000"),
            (-(1 << 16), "-1.000"),
            (32, "0.000"),
            (-32, "0.000"),
            (33, "0.001"),
            (-33, "-0.001"),
            (i32::MAX, "32768.000"),
            (i32::MIN, "-32768.000"),
        ] {
            let shown = Thousandths(Millimetres::from_bits(bits)).to_string();
            assert_eq!(shown, text, "{bits}");
        }
    }
}
