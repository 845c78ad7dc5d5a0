//! What the machine says: one message for each command, built in place, ended as every message is.

use super::refusal::Refusal;
use crate::arm::{Angles, Calibration, Compensation, Directions, NibShift, ZMap};
use crate::drawings::{ButtonDraws, Contents, MAX_DRAWINGS, Replay, Space};
use crate::machine::{Limited, Report};
use crate::motion::{Microdegrees, Micros, Position};
use crate::settings::{MachineName, Settings};
use crate::text::{MAX_EXCERPT, excerpt, excerpt_of_bytes};
use crate::update::{self, KeyName, Version};
use crate::wifi::{Heard, Joined, MAX_NETWORKS, MAX_SSID, Networks, Phase, Ssid, Status};
use core::fmt::{self, Write};
use heapless::Vec;

/// Ends every message to a client, the greeting included.
pub const TERMINATOR: &str = "\r\n\0";
/// Longest message, terminator included. Everyday replies stay below 256 bytes, because some clients
/// read one packet for each reply into a buffer of that size; diagnostics, lists of networks and lists
/// of drawings may be longer. Every network that is remembered fits into such a list, whatever its name.
pub const MAX_REPLY: usize = 896;
const _: () = assert!(
    "ok ".len() + MAX_NETWORKS * (" \"\":1".len() + 2 * MAX_SSID) + TERMINATOR.len() <= MAX_REPLY
);
// A list of drawings fits as well: `/0000001.txt-` and at most ten digits for each.
const _: () = assert!(
    "ok FS:\"\"".len() + MAX_DRAWINGS as usize * "/0000001.txt-1474560;".len() + TERMINATOR.len()
        <= MAX_REPLY
);
/// Version in the greeting: the level of the original's protocol that is complete, then our own.
pub const VERSION: &str = concat!("3.2.0 Quill ", env!("QUILL_VERSION"));

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
    /// The name under which it is found, without `.local`; `None` where it is not.
    pub host: Option<&'a str>,
    /// Who it is.
    pub identity: Identity,
    /// Time since it started.
    pub uptime: Micros,
    /// Where the nib is.
    pub position: Position,
    /// The servos' offsets.
    pub calibration: Calibration,
    /// Paper and lift.
    pub compensation: &'a Compensation,
    /// Which servos turn the other way.
    pub directions: Directions,
    /// What the network is doing.
    pub wifi: &'a Status,
    /// How many networks are remembered.
    pub networks: usize,
    /// Free memory in bytes.
    pub free_memory: u32,
    /// Why it started.
    pub reset_reason: &'a str,
    /// How the memory for the settings is.
    pub memory: &'a str,
    /// How updates stand.
    pub update: &'a update::Status,
    /// Whose signature is believed.
    pub update_key: KeyName,
    /// Room for drawings.
    pub space: Space,
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

    /// Why something was refused, if it says so.
    pub fn reason(&self) -> Option<&str> {
        self.message()
            .strip_prefix("error INFO:\"")?
            .strip_suffix('"')
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
            Report::Moving { end, limited } => self.place(*end, limited.map(Limited::text)),
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
        self.compose(format_args!(
            "ok CONNECTMODE:{} MACHINENAME:{}",
            mode(own_network),
            name.as_str()
        ));
    }

    /// How the machine is called.
    pub fn name(&mut self, name: &MachineName) {
        self.compose(format_args!("ok MACHINENAME:{}", name.as_str()));
    }

    /// What the machine is after power-on.
    pub fn start(&mut self, settings: &Settings) {
        self.compose(format_args!(
            "ok S:{} P:{}",
            settings.start.number(),
            settings.access_point.number()
        ));
    }

    /// Whether its own network takes a password, which is not told.
    pub fn own_network(&mut self, settings: &Settings) {
        let password = match settings.own_password {
            Some(_) => "set",
            None => "none",
        };
        self.compose(format_args!("ok PASSWORD:{password}"));
    }

    /// Whether the machine waves.
    pub fn waves(&mut self, on: bool) {
        self.compose(format_args!("ok S:{}", if on { 1 } else { 2 }));
    }

    /// How high the paper lies, and how far the nib moves as it comes down.
    pub fn compensation(&mut self, map: ZMap, shift: NibShift) {
        self.compose(format_args!("ok S:{map} P:{shift}"));
    }

    /// Which servos turn the other way.
    pub fn directions(&mut self, directions: Directions) {
        let [shoulder, elbow, pen] = numbers(directions);
        self.compose(format_args!("ok S:{shoulder} E:{elbow} P:{pen}"));
    }

    /// Networks: those that are heard, in the order given, which is by strength, each with 1 where it is
    /// remembered and 2 where it is not; then those that are remembered and not heard, with 3
    /// (`spec 1.0.4a, M587`). Where not all fit, the last ones that are not remembered are left out.
    ///
    /// In quotes, a quote is written twice, as in a command. A name with a byte that ends a line cannot be
    /// written and is left out.
    pub fn networks(&mut self, heard: &[Heard], known: &Networks) {
        self.restart();
        self.push("ok ");
        let unheard = known
            .iter()
            .map(|network| &network.ssid)
            .filter(|ssid| heard.iter().all(|other| other.ssid != **ssid));
        let visible = heard.iter().enumerate().filter_map(|(place, network)| {
            let ssid = &network.ssid;
            let again = heard.iter().take(place).any(|other| other.ssid == *ssid);
            let known = known.find(ssid).is_some();
            (!again).then_some((ssid, if known { '1' } else { '2' }))
        });
        let entries = visible.chain(unheard.map(|ssid| (ssid, '3')));
        let mut entries = entries.filter(|(ssid, _)| can_be_written(ssid));
        // Room for those that are remembered and come later.
        let mut reserved: usize = entries
            .clone()
            .filter(|(_, state)| *state != '2')
            .map(|(ssid, _)| entry_length(ssid))
            .sum();
        entries.by_ref().for_each(|(ssid, state)| {
            let length = entry_length(ssid);
            if state != '2' {
                reserved -= length;
            }
            if self.text.len() + length + reserved + TERMINATOR.len() <= MAX_REPLY {
                self.push_entry(ssid, state);
            }
        });
        self.push(TERMINATOR);
    }

    /// Drawings, as files: name and bytes (`reference/line-us.md`, section 5, M20).
    pub fn drawings(&mut self, contents: &Contents) {
        self.compose(format_args!("ok FS:\"{}\"", Files(contents)));
    }

    /// Room for drawings (`reference/line-us.md`, section 5, M39).
    pub fn space(&mut self, space: Space) {
        self.compose(format_args!(
            "ok FSUsed:{} FSTotal:{} FSFree:{} FSPercent:{}",
            space.used,
            space.total,
            space.free(),
            space.percent()
        ));
    }

    /// What the button draws.
    pub fn button(&mut self, choice: ButtonDraws) {
        let number = choice.number();
        match choice.slot() {
            Some(slot) => self.compose(format_args!("ok S:{number} K:{}", slot.number())),
            None => self.compose(format_args!("ok S:{number}")),
        }
    }

    /// What is replayed.
    pub fn replay(&mut self, replay: Option<Replay>) {
        match replay {
            Some(Replay {
                slot,
                seconds,
                every,
            }) => self.compose(format_args!("ok S:{seconds} P:{every} K:{}", slot.number())),
            None => self.compose(format_args!("ok S:0")),
        }
    }

    /// Done, and something to know about it.
    pub fn ok_with(&mut self, info: fmt::Arguments<'_>) {
        self.compose(format_args!("ok INFO:\"{info}\""));
    }

    fn push_entry(&mut self, ssid: &Ssid, state: char) {
        if !self.text.ends_with(b" ") {
            self.push(" ");
        }
        self.push("\"");
        for byte in ssid.as_bytes() {
            let quote = *byte == b'"';
            for _ in 0..1 + usize::from(quote) {
                let _ = self.text.push(*byte);
            }
        }
        let _ = write!(self.text, "\":{state}");
    }

    /// How the machine is.
    pub fn diagnostics(&mut self, state: &Diagnostics<'_>) {
        let [a, b, c, d, e, f] = state.identity.mac;
        let Position { x, y, z } = state.position;
        let [shoulder, elbow, pen] = state.calibration.offsets.to_array().map(Degrees);
        let [turn_s, turn_e, turn_p] = numbers(state.directions);
        let (map, shift) = (state.compensation.map(), state.compensation.shift());
        self.compose(format_args!(
            "ok name:{}{} mac:{a:02X}:{b:02X}:{c:02X}:{d:02X}:{e:02X}:{f:02X} Serial:{} \
             Version:\"{VERSION}\" Uptime:{} Position:{},{},{} Cal:{shoulder},{elbow},{pen} \
             ZMap:{map} NibShift:{shift} Servos:{turn_s},{turn_e},{turn_p} WifiMode:{} WifisConfigured:{} Wifi:\"{}\" FreeHeap:{} ResetReason:\"{}\" \
             FSUsed:{} FSTotal:{} FSFree:{} Memory:\"{}\" UpdateKey:{} Update:\"{}\"{}",
            state.name.as_str(),
            Host(state.host),
            state.identity.serial(),
            Uptime(state.uptime),
            x.rounded(),
            y.rounded(),
            z.rounded(),
            mode(state.wifi.setup),
            state.networks,
            InWords(state.wifi),
            state.free_memory,
            state.reset_reason,
            state.space.used,
            state.space.total,
            state.space.free(),
            state.memory,
            state.update_key,
            state.update,
            LastPanic(state.last_panic),
        ));
    }

    /// A new firmware is in place.
    pub fn updated(&mut self, version: Version) {
        self.compose(format_args!(
            "ok INFO:\"{version} is in place and starts now\""
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

/// Why there is no move: the machine is stopped.
pub const STOPPED: &str = "the machine is stopped: send ~ on the serial line or press the button";

/// As behind the letters of M280.
fn numbers(directions: Directions) -> [u8; 3] {
    directions.reversed.map(|reversed| 1 + u8::from(reversed))
}

const fn mode(own_network: bool) -> &'static str {
    if own_network { "AP" } else { "ST" }
}

fn can_be_written(ssid: &Ssid) -> bool {
    !ssid
        .as_bytes()
        .iter()
        .any(|byte| matches!(byte, b'\r' | b'\n' | 0))
}

/// Longest form of an entry in a list of networks: ` "name":1`.
fn entry_length(ssid: &Ssid) -> usize {
    let name = ssid.as_bytes();
    let quotes = name.iter().filter(|&&byte| byte == b'"').count();
    name.len() + quotes + " \"\":1".len()
}

/// What the network is doing, without double quotes.
#[derive(Clone, Copy, Debug)]
pub struct InWords<'a>(pub &'a Status);

impl fmt::Display for InWords<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Status { phase, refused, .. } = self.0;
        let name = |ssid| excerpt_of_bytes(Ssid::as_bytes(ssid), MAX_EXCERPT);
        match phase {
            Phase::Searching => out.write_str("searching")?,
            Phase::Connected(ssid) => write!(out, "connected to {}", name(ssid))?,
            Phase::Setup => out.write_str("setup")?,
            Phase::Trying(ssid) => write!(out, "trying {}", name(ssid))?,
            Phase::Fault => out.write_str("the radio does not work")?,
        }
        let Some((ssid, outcome)) = refused else {
            return Ok(());
        };
        write!(out, "; {}: ", name(ssid))?;
        match outcome {
            Joined::Yes => Ok(()),
            Joined::NotFound => out.write_str("not found"),
            Joined::WrongPassword => out.write_str("wrong password"),
            Joined::Unfit => out.write_str("WPA3 only, or no password"),
            Joined::Failed(reason) => write!(out, "not joined, reason {reason}"),
        }
    }
}

/// Drawings as files in a list.
struct Files<'a>(&'a Contents);

impl fmt::Display for Files<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0
            .iter()
            .try_for_each(|(slot, bytes)| write!(out, "/{:07}.txt-{bytes};", slot.number()))
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

struct Host<'a>(Option<&'a str>);

impl fmt::Display for Host<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(host) => write!(out, " Host:{host}.local"),
            None => Ok(()),
        }
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
    fn paper_lift_and_directions() {
        let map = ZMap::new([0, 100, 300, -200]).unwrap();
        let shift = NibShift::from_hundredths(-85).unwrap();
        assert_eq!(
            said(|reply| reply.compensation(map, shift)),
            "ok S:0;100;300;-200 P:-0.85"
        );
        let directions = Directions {
            reversed: [false, true, false],
        };
        assert_eq!(said(|reply| reply.directions(directions)), "ok S:1 E:2 P:1");
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

    fn ssid(name: &[u8]) -> Ssid {
        Ssid::new(name).unwrap()
    }

    fn heard(name: &[u8], signal_dbm: i8) -> Heard {
        Heard {
            ssid: ssid(name),
            security: crate::wifi::Security::Password,
            signal_dbm,
        }
    }

    fn remembered(names: &[&[u8]]) -> Networks {
        let mut networks = Networks::new();
        for name in names {
            let network = crate::wifi::Network {
                ssid: ssid(name),
                password: crate::wifi::Password::new(b"correct horse"),
            };
            networks.put(network).unwrap();
        }
        networks
    }

    #[test]
    fn networks_as_the_specification_writes_them() {
        let around = [heard(b"my-ssid", -40), heard(b"another-ssid", -60)];
        let known = remembered(&[b"yet-another-one", b"my-ssid"]);
        assert_eq!(
            said(|reply| reply.networks(&around, &known)),
            "ok \"my-ssid\":1 \"another-ssid\":2 \"yet-another-one\":3"
        );
        assert_eq!(said(|reply| reply.networks(&[], &Networks::new())), "ok ");
    }

    #[test]
    fn names_with_quotes_and_names_that_come_twice_or_cannot_be_written() {
        let around = [
            heard(b"say \"hi\"", -40),
            heard(b"mesh", -50),
            heard(b"line\nfeed", -55),
            heard(b"mesh", -60),
        ];
        let known = remembered(&[b"mesh", b"nul\0"]);
        let list = said(|reply| reply.networks(&around, &known));
        assert_eq!(list, "ok \"say \"\"hi\"\"\":2 \"mesh\":1");
        // What is listed can be sent back as it is.
        let text = crate::text::Words::new(&list.as_bytes()[3..])
            .text('S')
            .unwrap();
        assert_eq!(&text.unescape::<32>().unwrap()[..], b"say \"hi\"");
    }

    #[test]
    fn a_list_is_bounded_and_holds_every_network_that_is_remembered() {
        let quotes = |index: usize| {
            let mut name = [b'"'; MAX_SSID];
            name[index] = b'x';
            name
        };
        let names: Vec<_, MAX_NETWORKS> = (0..MAX_NETWORKS).map(quotes).collect();
        let known: Vec<&[u8], MAX_NETWORKS> = names.iter().map(|name| &name[..]).collect();
        let around: std::vec::Vec<Heard> = (0..16)
            .map(|index| {
                heard(
                    std::format!("a-network-of-a-neighbour-{index}").as_bytes(),
                    -40,
                )
            })
            .collect();
        let mut reply = Reply::new();
        reply.networks(&around, &remembered(&known));
        assert!(reply.as_bytes().len() <= MAX_REPLY);
        let list = reply.message();
        assert_eq!(list.matches(":3").count(), MAX_NETWORKS, "{list}");
        assert!(list.matches(":2").count() >= 2, "{list}");
    }

    #[test]
    fn the_state_of_the_network_in_words() {
        for (phase, refused, words) in [
            (Phase::Searching, None, "searching"),
            (
                Phase::Searching,
                Some((ssid(b"my \"home\""), Joined::WrongPassword)),
                "searching; my 'home': wrong password",
            ),
            (
                Phase::Setup,
                Some((ssid(b"caf\xff"), Joined::NotFound)),
                "setup; caf?: not found",
            ),
            (Phase::Connected(ssid(b"home")), None, "connected to home"),
            (Phase::Trying(ssid(b"home")), None, "trying home"),
            (
                Phase::Fault,
                Some((ssid(b"home"), Joined::Failed(203))),
                "the radio does not work; home: not joined, reason 203",
            ),
        ] {
            let status = Status {
                setup: false,
                phase,
                refused,
            };
            assert_eq!(InWords(&status).to_string(), words);
        }
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
                host: Some("abcdefghijklmnopqrstuvwxyz012345-9999"),
                identity: Identity { mac: [0xff; 6] },
                uptime: Micros::new(u64::MAX),
                position: Position::from_units(-1950, -1950, 1000),
                calibration: Calibration {
                    offsets: Angles::from_array([i32::MIN; 3].map(Microdegrees::new)),
                },
                compensation: &Compensation::new(
                    ZMap::new([-500; 4]).unwrap(),
                    NibShift::from_hundredths(-200).unwrap(),
                ),
                directions: Directions {
                    reversed: [true; 3],
                },
                wifi: &Status {
                    setup: true,
                    phase: Phase::Trying(ssid(&[b'"'; MAX_SSID])),
                    refused: Some((ssid(&[b'"'; MAX_SSID]), Joined::Failed(u16::MAX))),
                },
                networks: MAX_NETWORKS,
                free_memory: u32::MAX,
                reset_reason: "the watchdog bit after a long silence",
                memory: "worn out, and what is worse, it does not take what is stored",
                update: &update::Status {
                    progress: update::Progress::Idle,
                    standing: update::Standing::Settled,
                    refused: Some(update::Rejection::WrongLength {
                        offered: u32::MAX,
                        expected: u32::MAX,
                    }),
                },
                update_key: KeyName::Own([0xff; 4]),
                space: Space {
                    total: u32::MAX,
                    used: 1_234_567_890,
                },
                last_panic: &"panicked at \"somewhere\"\n".repeat(9),
            });
        });
        assert!(
            text.contains(" FSTotal:4294967295 FSFree:3060399405 Memory:\"worn out,")
                && text.contains("stored\" UpdateKey:ffffffff Update:\"refused: ")
                && text.contains("one 4294967295\" LastPanic:\"panicked at 'somewhere'?")
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
    fn drawings_as_the_original_lists_them() {
        let mut contents = Contents::EMPTY;
        assert_eq!(said(|reply| reply.drawings(&contents)), "ok FS:\"\"");
        let slot = |number| crate::drawings::Slot::new(number).unwrap();
        contents.set(slot(1), Some(9496));
        contents.set(slot(2), Some(11323));
        assert_eq!(
            said(|reply| reply.drawings(&contents)),
            "ok FS:\"/0000001.txt-9496;/0000002.txt-11323;\""
        );
        // As many as there can be, each far longer than they can be together.
        for slot in crate::drawings::Slot::all() {
            contents.set(slot, Some(1_474_560));
        }
        let list = said(|reply| reply.drawings(&contents));
        assert!(list.ends_with("/0000032.txt-1474560;\""), "{list}");
        assert_eq!(list.matches(';').count(), 32);
    }

    #[test]
    fn room_as_the_original_tells_it() {
        let space = Space {
            total: 1_562_625,
            used: 356_922,
        };
        assert_eq!(
            said(|reply| reply.space(space)),
            "ok FSUsed:356922 FSTotal:1562625 FSFree:1205703 FSPercent:22"
        );
    }

    #[test]
    fn button_and_replay() {
        let slot = crate::drawings::Slot::new(5).unwrap();
        assert_eq!(said(|reply| reply.button(ButtonDraws::Next)), "ok S:1");
        assert_eq!(
            said(|reply| reply.button(ButtonDraws::Always(slot))),
            "ok S:2 K:5"
        );
        assert_eq!(said(|reply| reply.replay(None)), "ok S:0");
        let replay = Replay {
            slot,
            seconds: 20,
            every: 600,
        };
        assert_eq!(
            said(|reply| reply.replay(Some(replay))),
            "ok S:20 P:600 K:5"
        );
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
