//! What the machine says: one message for each command, built in place, ended as every message is.

use super::refusal::Refusal;
use crate::arm::{Angles, Calibration};
use crate::machine::{Limited, Report};
use crate::motion::{Microdegrees, Micros, Position};
use crate::settings::MachineName;
use crate::text::excerpt;
use core::fmt::{self, Write};
use heapless::Vec;

/// Ends every message to a client, the greeting included.
pub const TERMINATOR: &str = "\r\n\0";
/// Longest message, terminator included. Everyday replies stay below 256 bytes, because some clients
/// read one packet for each reply into a buffer of that size; diagnostics may be longer.
pub const MAX_REPLY: usize = 512;
/// Version in the greeting: the level of the original's protocol that is complete, then our own.
pub const VERSION: &str = concat!("1.0.4 Quill ", env!("CARGO_PKG_VERSION"));

/// Longest piece of a panic's text that diagnostics tell, in characters.
const MAX_PANIC: usize = 120;

/// Who this machine is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Hardware address of its network interface.
    pub mac: [u8; 6],
}

impl Identity {
    /// The low 24 bits of the hardware address (`reference/line-us.md`, section 3).
    pub const fn serial(&self) -> u32 {
        let [.., high, middle, low] = self.mac;
        (high as u32) << 16 | (middle as u32) << 8 | low as u32
    }
}

/// What M122 tells.
#[derive(Clone, Copy, Debug)]
pub struct Diagnostics<'a> {
    /// The machine's name.
    pub name: &'a MachineName,
    /// Who it is.
    pub identity: Identity,
    /// Time since it started.
    pub uptime: Micros,
    /// Where the nib is.
    pub position: Position,
    /// The servos' offsets.
    pub calibration: Calibration,
    /// Free memory in bytes.
    pub free_memory: u32,
    /// Why it started.
    pub reset_reason: &'a str,
    /// The last words of a firmware that panicked before, if there are any.
    pub last_panic: &'a str,
}

/// One message to a client.
#[derive(Debug, Default)]
pub struct Reply {
    text: Vec<u8, MAX_REPLY>,
    is_error: bool,
}

impl Reply {
    /// An empty message.
    pub const fn new() -> Self {
        Self {
            text: Vec::new(),
            is_error: false,
        }
    }

    /// The bytes to send, terminator included, in one write.
    pub fn as_bytes(&self) -> &[u8] {
        &self.text
    }

    /// The message without its terminator.
    pub fn message(&self) -> &str {
        let message = self.text.strip_suffix(TERMINATOR.as_bytes());
        core::str::from_utf8(message.unwrap_or(&self.text)).unwrap_or_default()
    }

    /// Whether it says that something was refused.
    pub const fn is_error(&self) -> bool {
        self.is_error
    }

    /// The greeting.
    pub fn hello(&mut self, name: &MachineName, identity: Identity) {
        let serial = identity.serial();
        self.compose(format_args!(
            "hello VERSION:\"{VERSION}\" NAME:{} SERIAL:{serial}",
            name.as_str()
        ));
    }

    /// `ok ` and nothing more: with the blank, for which several clients look.
    pub fn ok(&mut self) {
        self.compose(format_args!("ok "));
    }

    /// What was wrong with a line.
    pub fn refuse(&mut self, refusal: &Refusal<'_>) {
        self.error(format_args!("{refusal}"));
    }

    /// What went wrong.
    pub fn error(&mut self, reason: fmt::Arguments<'_>) {
        self.compose(format_args!("error INFO:\"{reason}\""));
        self.is_error = true;
    }

    /// A move has begun.
    pub fn report(&mut self, report: &Report) {
        match report {
            Report::Resting => self.ok(),
            Report::Stopped => self.error(format_args!("{STOPPED}")),
            Report::Moving { end, limited } => self.place(*end, limited.map(tell)),
        }
    }

    /// Where the nib is.
    pub fn position(&mut self, position: Position) {
        self.place(position, None);
    }

    /// Where the servos are.
    pub fn angles(&mut self, angles: Angles) {
        let [s, e, p] = angles.to_array().map(Degrees);
        self.compose(format_args!("ok S:{s} E:{e} P:{p}"));
    }

    /// What the machine is: a guest in somebody's network, or on its own.
    pub fn capabilities(&mut self, name: &MachineName, own_network: bool) {
        let mode = if own_network { "AP" } else { "ST" };
        self.compose(format_args!(
            "ok CONNECTMODE:{mode} MACHINENAME:{}",
            name.as_str()
        ));
    }

    /// How the machine is called.
    pub fn name(&mut self, name: &MachineName) {
        self.compose(format_args!("ok MACHINENAME:{}", name.as_str()));
    }

    /// How the machine is.
    pub fn diagnostics(&mut self, state: &Diagnostics<'_>) {
        let [a, b, c, d, e, f] = state.identity.mac;
        let Position { x, y, z } = state.position;
        let [shoulder, elbow, pen] = state.calibration.offsets.to_array().map(Degrees);
        self.compose(format_args!(
            "ok name:{} mac:{a:02X}:{b:02X}:{c:02X}:{d:02X}:{e:02X}:{f:02X} Serial:{} \
             Version:\"{VERSION}\" Uptime:{} Position:{},{},{} Cal:{shoulder},{elbow},{pen} \
             FreeHeap:{} ResetReason:\"{}\"{}",
            state.name.as_str(),
            state.identity.serial(),
            Uptime(state.uptime),
            x.rounded(),
            y.rounded(),
            z.rounded(),
            state.free_memory,
            state.reset_reason,
            LastPanic(state.last_panic),
        ));
    }

    fn place(&mut self, position: Position, info: Option<&str>) {
        self.restart();
        for (label, coordinate) in [
            ("ok X:", position.x),
            (" Y:", position.y),
            (" Z:", position.z),
        ] {
            self.push(label);
            self.push_integer(coordinate.rounded());
        }
        if let Some(info) = info {
            self.push(" INFO:\"");
            self.push(info);
            self.push("\"");
        }
        self.push(TERMINATOR);
    }

    fn compose(&mut self, message: fmt::Arguments<'_>) {
        self.restart();
        // A message is far shorter than its buffer; were it not, it is cut, and ended nevertheless.
        if self.text.write_fmt(message).is_err() {
            let most = MAX_REPLY - TERMINATOR.len() - 1;
            let whole = match core::str::from_utf8(self.text.get(..most).unwrap_or(&self.text)) {
                Ok(text) => text.len(),
                Err(cut) => cut.valid_up_to(),
            };
            self.text.truncate(whole);
        }
        self.push(TERMINATOR);
    }

    fn restart(&mut self) {
        self.text.clear();
        self.is_error = false;
    }

    fn push(&mut self, text: &str) {
        let _ = self.text.extend_from_slice(text.as_bytes());
    }

    /// A whole number, without the machinery of `fmt`: replies to moves are the busiest ones.
    fn push_integer(&mut self, value: i32) {
        if value < 0 {
            self.push("-");
        }
        let mut digits = [0u8; 10];
        let mut rest = value.unsigned_abs();
        let mut first = digits.len();
        for (index, digit) in digits.iter_mut().enumerate().rev() {
            *digit = b'0' + (rest % 10) as u8;
            first = index;
            rest /= 10;
            if rest == 0 {
                break;
            }
        }
        for digit in digits.iter().skip(first) {
            let _ = self.text.push(*digit);
        }
    }
}

/// Why there is no move.
const STOPPED: &str = "the machine is stopped: send ~ on the serial line or press the button";

fn tell(limited: Limited) -> &'static str {
    match limited {
        Limited::Target { lifted: true } => "out of reach: going to the closest point, pen lifted",
        Limited::Target { lifted: false } => "out of reach: going to the closest point",
        Limited::Way => "the way leaves the drawing area: held at its edge",
    }
}

/// An angle with two decimals.
struct Degrees(Microdegrees);

impl fmt::Display for Degrees {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hundredths = self.0.centidegrees();
        let sign = if hundredths < 0 { "-" } else { "" };
        let magnitude = hundredths.unsigned_abs();
        write!(out, "{sign}{}.{:02}", magnitude / 100, magnitude % 100)
    }
}

/// A token of its own, or nothing where nothing has panicked.
struct LastPanic<'a>(&'a str);

impl fmt::Display for LastPanic<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return Ok(());
        }
        write!(out, " LastPanic:\"{}\"", excerpt(self.0, MAX_PANIC))
    }
}

/// `1d2h3m4s`.
struct Uptime(Micros);

impl fmt::Display for Uptime {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = self.0.get() / 1_000_000;
        let (minutes, hours, days) = (seconds / 60, seconds / 3600, seconds / 86_400);
        write!(
            out,
            "{days}d{}h{}m{}s",
            hours % 24,
            minutes % 60,
            seconds % 60
        )
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::arm::HOME_ANGLES;
    use crate::motion::Coordinate;
    use std::string::{String as StdString, ToString};

    fn said(compose: impl FnOnce(&mut Reply)) -> StdString {
        let mut reply = Reply::new();
        compose(&mut reply);
        assert!(reply.as_bytes().ends_with(b"\r\n\0"));
        reply.message().to_string()
    }

    const IDENTITY: Identity = Identity {
        mac: [0x02, 0, 0, 0x01, 0xe2, 0x40],
    };

    #[test]
    fn the_greeting() {
        let hello = said(|reply| reply.hello(&MachineName::default(), IDENTITY));
        assert_eq!(
            hello,
            std::format!("hello VERSION:\"{VERSION}\" NAME:line-us SERIAL:123456")
        );
    }

    #[test]
    fn places_in_whole_units() {
        let place = |x, y, z| Position {
            x: Coordinate::from_bits(x),
            y: Coordinate::from_bits(y),
            z: Coordinate::from_bits(z),
        };
        let half = 1 << 15;
        let position = place((1199 << 16) + half, -(7 << 16) - half, 0);
        assert_eq!(said(|reply| reply.position(position)), "ok X:1200 Y:-8 Z:0");
        assert_eq!(
            said(|reply| reply.position(place(-half + 1, 0, 1000 << 16))),
            "ok X:0 Y:0 Z:1000"
        );
    }

    #[test]
    fn angles_as_a_real_machine_writes_them() {
        assert_eq!(
            said(|reply| reply.angles(HOME_ANGLES)),
            "ok S:135.00 E:45.00 P:135.00"
        );
    }

    #[test]
    fn ok_has_its_blank() {
        assert_eq!(said(Reply::ok), "ok ");
    }

    #[test]
    fn limits_are_told() {
        let report = Report::Moving {
            end: Position::from_units(1950, 0, 1000),
            limited: Some(Limited::Target { lifted: true }),
        };
        assert_eq!(
            said(|reply| reply.report(&report)),
            "ok X:1950 Y:0 Z:1000 INFO:\"out of reach: going to the closest point, pen lifted\""
        );
    }

    #[test]
    fn a_stopped_machine_says_how_to_go_on() {
        assert_eq!(
            said(|reply| reply.report(&Report::Stopped)),
            "error INFO:\"the machine is stopped: send ~ on the serial line or press the button\""
        );
    }

    #[test]
    fn every_token_of_the_diagnostics_has_a_colon() {
        let longest = MachineName::new("abcdefghijklmnopqrstuvwxyz012345").unwrap();
        let text = said(|reply| {
            reply.diagnostics(&Diagnostics {
                name: &longest,
                identity: Identity { mac: [0xff; 6] },
                uptime: Micros::new(u64::MAX),
                position: Position::from_units(-1950, -1950, 1000),
                calibration: Calibration {
                    offsets: Angles::from_array([i32::MIN; 3].map(Microdegrees::new)),
                },
                free_memory: u32::MAX,
                reset_reason: "the watchdog bit after a long silence",
                last_panic: &"panicked at \"somewhere\"\n".repeat(9),
            });
        });
        assert!(
            text.contains("silence\" LastPanic:\"panicked at 'somewhere'?")
                && text.ends_with("...\""),
            "{text}"
        );
        // Outside quotes, blanks separate tokens.
        let unquoted: StdString = text.split('"').step_by(2).collect();
        let mut tokens = unquoted.split_whitespace();
        assert_eq!(tokens.next(), Some("ok"));
        assert!(tokens.clone().count() >= 9);
        assert!(tokens.all(|token| token.contains(':')), "{text}");
    }

    #[test]
    fn uptime_counts_days() {
        assert_eq!(
            Uptime(Micros::from_secs(86_400 + 7_200 + 180 + 4)).to_string(),
            "1d2h3m4s"
        );
    }

    #[test]
    fn a_message_too_long_is_cut_and_ended() {
        let long = "\u{e9}".repeat(400);
        let text = said(|reply| reply.error(format_args!("{long}")));
        assert!(text.starts_with("error INFO:\""));
    }
}
