//! One connection: its bytes become requests, one reply each, in order.

use super::command::{Command, parse};
use super::recording;
use super::refusal::Refusal;
use super::reply::Reply;
use super::request::Request;
use crate::machine::{Errand, Target};
use crate::motion::{Transform, WideCoordinate};
use crate::text::{LineBuffer, MAX_LINE, Words};
use heapless::Vec;

/// What belongs to one connection: the line being received, scale and origin, and whether what comes is
/// recorded instead of drawn.
#[derive(Clone, Debug)]
pub struct Session {
    lines: LineBuffer,
    transform: Transform,
    recording: bool,
    recorded: Vec<u8, MAX_LINE>,
    /// It is a WebSocket, which is refused some commands.
    web_socket: bool,
}

/// What WebSockets are refused (`reference/line-us.md`, section 1).
const NOT_OVER_WEB_SOCKETS: [u32; 5] = [170, 171, 587, 588, 589];

impl Default for Session {
    fn default() -> Self {
        Self::new()
    }
}

impl Session {
    /// A new connection: X0 Y0 S1.
    pub const fn new() -> Self {
        Self {
            lines: LineBuffer::new(),
            transform: Transform::IDENTITY,
            recording: false,
            recorded: Vec::new(),
            web_socket: false,
        }
    }

    /// A new WebSocket: the commands that such clients are refused, are refused.
    pub const fn web_socket() -> Self {
        Self {
            lines: LineBuffer::new(),
            transform: Transform::IDENTITY,
            recording: false,
            recorded: Vec::new(),
            web_socket: true,
        }
    }

    /// From now on, lines are recorded, or no longer.
    pub const fn record(&mut self, on: bool) {
        self.recording = on;
    }

    /// Whether lines are recorded.
    pub const fn is_recording(&self) -> bool {
        self.recording
    }

    /// The line of the last [`Request::RecordLine`], as it was sent, without its terminator.
    pub fn recorded_line(&self) -> &[u8] {
        &self.recorded
    }

    /// Takes bytes off the front of `input` up to the end of the next line, and gives what it asks
    /// for; `None` when `input` is used up first. Where the session can answer by itself, the reply is
    /// in `reply`.
    pub fn next_request(&mut self, input: &mut &[u8], reply: &mut Reply) -> Option<Request> {
        let line = self.lines.next_line(input)?;
        let web_socket = self.web_socket;
        let line = line.map_err(Refusal::from).and_then(|line| {
            if web_socket {
                allowed(line)?;
            }
            Ok(line)
        });
        if self.recording {
            return Some(recording::request(line, &mut self.recorded, reply));
        }
        let command = line.and_then(|line| {
            parse(line).map_err(|refusal| match is_http(line) {
                true => Refusal::Http,
                false => refusal,
            })
        });
        Some(match command {
            // By reference: commands are large, and copying one costs as much as reading it.
            Ok(command) => request(&mut self.transform, &command, reply),
            Err(refusal) => {
                reply.refuse(&refusal);
                match refusal {
                    Refusal::Http => Request::HangUp,
                    _ => Request::Answered,
                }
            }
        })
    }
}

/// Whether a line that is no command is the request line or a header of HTTP. Browsers send some headers whose
/// length no page has in its hands, so one of them is seen before the body, whatever else is too long for a
/// line.
fn is_http(line: &[u8]) -> bool {
    let is_name = |byte: &u8| byte.is_ascii_alphabetic() || *byte == b'-';
    let colon = line.iter().position(|byte| !is_name(byte));
    let is_header = colon.is_some_and(|at| at > 1 && line.get(at..at + 2) == Some(b": "));
    is_header || line.ends_with(b" HTTP/1.1") || line.ends_with(b" HTTP/1.0")
}

fn allowed(line: &[u8]) -> Result<(), Refusal<'_>> {
    match Words::new(line).code() {
        Ok(Some((b'M', code))) if NOT_OVER_WEB_SOCKETS.contains(&code) => {
            Err(Refusal::NotHere(code))
        }
        // What is wrong with it is found when it is parsed.
        _ => Ok(()),
    }
}

#[inline]
fn request(scale_and_origin: &mut Transform, command: &Command, reply: &mut Reply) -> Request {
    match command {
        Command::Move(manner, axes) => {
            let [x, y, z] = axes.to_array();
            let target = Target {
                x: x.map(|x| scale_and_origin.x(x)),
                y: y.map(|y| scale_and_origin.y(y)),
                z: z.map(WideCoordinate::from_bits),
            };
            Request::Errand(Errand::Move(*manner, target))
        }
        Command::Transform { x, y, scale } => {
            match scale_and_origin.with(*x, *y, *scale) {
                Some(transform) => {
                    *scale_and_origin = transform;
                    reply.ok();
                }
                None => reply.refuse(&Refusal::ZeroScale),
            }
            Request::Answered
        }
        Command::Nothing => {
            reply.ok();
            Request::Answered
        }
        Command::Uncalibrated(axes, bare) => {
            let [x, y, z] = axes.to_array();
            let here = match bare.xy {
                true => Transform::IDENTITY,
                false => *scale_and_origin,
            };
            let target = Target {
                x: x.map(|x| here.x(x)),
                y: y.map(|y| here.y(y)),
                z: z.map(WideCoordinate::from_bits),
            };
            Request::Errand(Errand::Uncalibrated(target, *bare))
        }
        Command::Ask(request) => request.clone(),
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::arm::{NibShift, ZMap};
    use crate::drawings::{ButtonDraws, Replay, Slot};
    use crate::machine::{Bare, Manner};
    use crate::motion::{Micros, StepSize};
    use crate::settings::{AccessPointName, MachineName, StartMode};
    use crate::update::ManifestAddress;
    use crate::wifi::{Password, Ssid};
    use proptest::prelude::*;
    use std::string::{String, ToString};
    use std::vec::Vec;

    /// Every request of a stream with the reply the session wrote itself.
    fn requests(session: &mut Session, stream: &[u8]) -> Vec<(Request, String)> {
        let (mut input, mut reply, mut found) = (stream, Reply::new(), Vec::new());
        while let Some(request) = session.next_request(&mut input, &mut reply) {
            let answer = match request {
                Request::Answered => reply.message().to_string(),
                _ => String::new(),
            };
            found.push((request, answer));
        }
        found
    }

    fn only(line: &str) -> (Request, String) {
        let stream = std::format!("{line}\n");
        let mut found = requests(&mut Session::new(), stream.as_bytes());
        assert_eq!(found.len(), 1, "{line:?}: {found:?}");
        found.remove(0)
    }

    fn target(x: Option<f64>, y: Option<f64>, z: Option<f64>) -> Target {
        let wide = |value: f64| WideCoordinate::from_bits((value * 65536.0).round() as i64);
        Target {
            x: x.map(wide),
            y: y.map(wide),
            z: z.map(wide),
        }
    }

    fn straight(x: f64, y: f64, z: f64) -> Request {
        Request::Errand(Errand::Move(
            Manner::Straight,
            target(Some(x), Some(y), Some(z)),
        ))
    }

    #[test]
    fn moves_as_clients_write_them() {
        for line in [
            "G01 X900 Y300 Z1",
            "g01 x900 y300 z1",
            "G1 X900 Y300 Z1",
            "G01  X900 Y300  Z1 ",
            "G01 X900.0000 Y3e2 Z1.0",
            "G01 Z1 Y300 X900",
            "G1X900Y300Z1",
            "G01 X\"900\" Y\"300\" Z\"1\"",
            "G01 X900 (to the right) Y300 Z1 ; done",
            "G01 X900 Y300 Z1 F5000",
            "\tG01\tX900\tY300\tZ1",
        ] {
            assert_eq!(only(line).0, straight(900.0, 300.0, 1.0), "{line}");
        }
        let rapid = Errand::Move(Manner::Rapid, target(Some(5.0), None, None));
        assert_eq!(only("G0 X5").0, Request::Errand(rapid));
        assert_eq!(only("G00 X5").0, Request::Errand(rapid));
    }

    #[test]
    fn a_browser_is_hung_up_on_before_its_body() {
        let long = "a".repeat(300);
        for head in [
            "POST / HTTP/1.1".into(),
            "GET /?G01 HTTP/1.0".into(),
            std::format!("PUT /{long} HTTP/1.1\r\nHost: {long}\r\nConnection: keep-alive"),
            std::format!("POST /{long} HTTP/1.1\r\nHost: {long}\r\nsec-ch-ua-mobile: ?0"),
        ] {
            let stream = std::format!("{head}\r\n\r\nM171 SCONFIRM\n");
            let found = requests(&mut Session::new(), stream.as_bytes());
            let hung_up = found
                .iter()
                .position(|(request, _)| *request == Request::HangUp);
            let hung_up = hung_up.unwrap_or_else(|| panic!("{head}: {found:?}"));
            for (request, reply) in &found[..hung_up] {
                assert!(
                    *request == Request::Answered && reply.contains("longer"),
                    "{head}"
                );
            }
        }
        for line in [
            "G01 X1: 2",
            "a b: c",
            ": ",
            "x: ",
            "HTTP/1.1",
            "G01 X100 HTTP/1.1Z",
        ] {
            assert_eq!(only(line).0, Request::Answered, "{line}");
        }
    }

    #[test]
    fn numbers_are_exact_decimals() {
        let request = only("G01 X12.345 Y999.9999999 Z1.5e-07").0;
        assert_eq!(request, straight(12.345, 999.9999999, 0.0));
    }

    #[test]
    fn refusals_name_the_letter_and_the_reason() {
        for (line, reason) in [
            ("undefined", "unknown command 'undefined'"),
            ("G02 X5", "unknown command 'G02'"),
            ("(a) g2 X5", "unknown command 'g2'"),
            ("G01.5 X5", "unknown command 'G01.5'"),
            ("M9999", "unknown command 'M9999'"),
            ("G01 Q5", "unknown parameter Q"),
            ("M114 S P", "unknown parameter P"),
            ("M589 P12345678 S1", "unknown parameter S"),
            ("G01 X5 X6", "parameter X is repeated"),
            ("G01 X5 F1 F2", "parameter F is repeated"),
            ("G01 X", "X has no number"),
            ("G01 X Y5", "X has no number"),
            ("G01 Xnan", "X is 'nan', not a decimal number"),
            ("G01 Yinf", "Y is 'inf', not a decimal number"),
            ("G01 Y-inf", "Y is '-inf', not a decimal number"),
            ("G01 X0x10", "X is '0x10', not a decimal number"),
            ("G01 X1.2.3", "X is '1.2.3', not a decimal number"),
            ("G01 Fx", "F is 'x', not a decimal number"),
            ("G01 X1e30", "X is out of range, -1000000 to 1000000"),
            ("G01 X100 200", "'2' where a parameter letter should be"),
            ("G01 X5 (open", "comment without closing bracket"),
            ("G28 X5", "unknown parameter X"),
            ("G54 S0", "S must not be zero"),
            ("G54 S1e-40", "S must not be zero"),
            ("G54 Snan", "S is 'nan', not a decimal number"),
            ("G54 S1e9", "S is out of range, -1000 to 1000"),
            ("G54 Z5", "unknown parameter Z"),
            ("G94 S0", "S is out of range, 1 to 30"),
            ("G94 S31", "S is out of range, 1 to 30"),
            ("G94 F30.1", "F is out of range, 1 to 30"),
            ("G94 S-5", "S is out of range, 1 to 30"),
            ("G94 P101", "P is out of range, 1 to 100"),
            ("G94 S5 F5", "parameter F is repeated"),
            ("M114 X", "unknown parameter X"),
            ("M114 S5", "S takes no value, but has '5'"),
            ("M115 S", "unknown parameter S"),
            ("M122 S", "unknown parameter S"),
            ("M374 S", "S has no value"),
            ("M374 Sclean", "S is 'clean', it may be 'clear'"),
            ("M374 Sclear Sclear", "parameter S is repeated"),
            ("M550 P", "P has no value"),
            (
                "M550 P-x",
                "P is '-x', a name is 1 to 32 letters, digits and inner hyphens",
            ),
            (
                "M550 P\"a b\"",
                "P is 'a b', a name is 1 to 32 letters, digits and inner hyphens",
            ),
            ("M550 P\"open", "P has no closing quote"),
            ("M587 Pcorrect-horse", "parameter S is missing"),
            ("M587 S\"\"", "S is '', it may be 1 to 32 bytes"),
            ("M587 Shome Pshort", "P must be 8 to 63 bytes"),
            ("M587 Shome Qx", "unknown parameter Q"),
            ("M588", "parameter S is missing"),
            ("M588 Pword", "unknown parameter P"),
            ("M588 Sa Sb", "parameter S is repeated"),
            ("M552 S5", "S must be a whole number, 1 to 4"),
            ("M552 S0", "S must be a whole number, 1 to 4"),
            ("M552 S1.5", "S must be a whole number, 1 to 4"),
            ("M552 P3", "P must be a whole number, 1 to 2"),
            ("M552 S1 S2", "parameter S is repeated"),
            ("M552 X1", "unknown parameter X"),
            ("M589 S1", "unknown parameter S"),
            ("M589 Pseven..", "P must be 8 to 63 bytes"),
            ("M589 P", "P has no value"),
            ("M589 P\"\" P\"\"", "parameter P is repeated"),
            ("M291 S3", "S must be a whole number, 1 to 2"),
            ("M291 S", "S has no number"),
            ("M291 S1 S1", "parameter S is repeated"),
            ("G4", "parameter P is missing"),
            ("G4 P-1", "P is out of range, 0 to 3600"),
            ("G4 S3600.1", "S is out of range, 0 to 3600"),
            ("G04 P1 S1", "parameter S is repeated"),
            ("G4 P1 P1", "parameter P is repeated"),
            ("G4 X1", "unknown parameter X"),
            ("G4 P", "P has no number"),
            ("G31 S", "S has no value"),
            ("G31 S ;0;0;0;0", "S has no value"),
            (
                "G31 S0;100;300",
                "S is '0;100;300', it may be 'clear' or four whole numbers, -500 to 500, as in 0;100;300;200",
            ),
            (
                "G31 S0;100;300;501",
                "S is '0;100;300;501', it may be 'clear' or four whole numbers, -500 to 500, as in 0;100;300;200",
            ),
            (
                "G31 S0; 100; 300; 200",
                "S is '0;', it may be 'clear' or four whole numbers, -500 to 500, as in 0;100;300;200",
            ),
            ("G31 S\"0;1", "S has no closing quote"),
            ("G31 P2.01", "P is out of range, -2 to 2"),
            ("G31 P-3", "P is out of range, -2 to 2"),
            ("G31 P0.5mm", "unknown parameter M"),
            ("G31 Sclear Sclear", "parameter S is repeated"),
            ("G31 X0", "unknown parameter X"),
            ("G40 Kx", "K is 'x', it may be 'xy' or 'z'"),
            ("G40 K", "K has no value"),
            ("G40 X1 Kxy Kz", "parameter K is repeated"),
            ("G40 X1 X2", "parameter X is repeated"),
            ("G40 F5", "unknown parameter F"),
            ("G40 X1e9", "X is out of range, -1000000 to 1000000"),
            ("M170", "M170 is reserved and does nothing here"),
            ("m172 S1 ;x", "M172 is reserved and does nothing here"),
            ("M171", "parameter S is missing"),
            ("M171 Sconform", "S is 'conform', it may be 'confirm'"),
            ("M171 Sconfirm S", "parameter S is repeated"),
            ("M171 Pconfirm", "unknown parameter P"),
            ("M280 S3", "S must be a whole number, 1 to 2"),
            ("M280 E0", "E must be a whole number, 1 to 2"),
            ("M280 P-1", "P must be a whole number, 1 to 2"),
            ("M280 S1 S2", "parameter S is repeated"),
            ("M280 Z1", "unknown parameter Z"),
            (
                "M997 S\"https://a/b\"",
                "S is 'https://a/b', an address is http://HOST[:PORT]/PATH, no more than 96 bytes",
            ),
            ("M997 S", "S has no value"),
            ("M997 S\"\" S\"\"", "parameter S is repeated"),
            ("M997 P1", "unknown parameter P"),
        ] {
            assert_eq!(
                only(line),
                (Request::Answered, std::format!("error INFO:\"{reason}\"")),
                "{line}"
            );
        }
    }

    #[test]
    fn the_other_commands() {
        for (line, request) in [
            (
                "G28",
                Request::Errand(Errand::Move(Manner::Straight, Target::HOME)),
            ),
            (
                "G28 ",
                Request::Errand(Errand::Move(Manner::Straight, Target::HOME)),
            ),
            ("M997", Request::Update),
            ("M997 S\"\"", Request::SetUpdateAddress(None)),
            (
                "M997 S\"http://192.168.1.7:8000/quill.txt\"",
                Request::SetUpdateAddress(ManifestAddress::new(
                    "http://192.168.1.7:8000/quill.txt",
                )),
            ),
            ("M114", Request::Position),
            ("m114 s", Request::Angles),
            ("M115", Request::Capabilities),
            ("M122 ", Request::Diagnostics),
            ("M374", Request::Calibrate),
            ("M374 Sclear", Request::ClearCalibration),
            ("m374 sCLEAR", Request::ClearCalibration),
            ("M374 S\"clear\"", Request::ClearCalibration),
            ("M550", Request::Name),
        ] {
            assert_eq!(only(line).0, request, "{line}");
        }
        let step = StepSize::from_units;
        let speed = |pen_down, pen_up| Request::SetSpeed { pen_down, pen_up };
        assert_eq!(only("G94 S3").0, speed(Some(step(3)), None));
        assert_eq!(only("G94 F3").0, speed(Some(step(3)), None));
        assert_eq!(only("G94 S1 P50").0, speed(Some(step(1)), Some(step(50))));
        let name = MachineName::new("robs-lineus");
        for line in ["M550 Probs-lineus", "M550 P\"robs-lineus\""] {
            assert_eq!(
                only(line).0,
                name.clone().map_or(Request::Answered, Request::Rename),
                "{line}"
            );
        }
    }

    #[test]
    fn networks_quoted_and_plain() {
        for (line, ssid, password) in [
            ("M587 Smy-ssid Pmypassword", "my-ssid", "mypassword"),
            (
                "M587 Smy-ssid P\"password with spaces\"",
                "my-ssid",
                "password with spaces",
            ),
            (
                "m587 p\"say \"\"hi\"\" twice\" s\"caf\u{e9} ;(x)\"",
                "caf\u{e9} ;(x)",
                "say \"hi\" twice",
            ),
            ("M587 Sopen", "open", ""),
        ] {
            let request = Request::Remember {
                ssid: Ssid::new(ssid.as_bytes()).unwrap(),
                password: Password::new(password.as_bytes()),
            };
            assert_eq!(only(line).0, request, "{line}");
        }
        assert_eq!(only("M587").0, Request::Networks);
        for (line, ssid) in [
            ("M588 Smy-ssid", "my-ssid"),
            ("m588 s\"two words\"", "two words"),
            ("M588 S**", "**"),
            ("M588 S\"a \"\"b\"\"\"", "a \"b\""),
        ] {
            let request = Request::Forget(Ssid::new(ssid.as_bytes()).unwrap());
            assert_eq!(only(line).0, request, "{line}");
        }
        for line in ["M588 S*", "M588 S\"*\"", "m588 s* "] {
            assert_eq!(only(line).0, Request::ForgetAll, "{line}");
        }
    }

    #[test]
    fn names_of_networks_are_bytes() {
        // Everything but what ends a line.
        let name = b"\xff\x01\xc3(\"; \t\x7f\xfe";
        let quoted = b"M587 S\"\xff\x01\xc3(\"\"; \t\x7f\xfe\" P\"12345678\"\n";
        let found = requests(&mut Session::new(), quoted);
        let request = Request::Remember {
            ssid: Ssid::new(name).unwrap(),
            password: Password::new(b"12345678"),
        };
        assert_eq!(found, [(request, String::new())]);
    }

    #[test]
    fn choices_of_start_and_waves() {
        let set = |mode, name| Request::SetStart { mode, name };
        for (line, request) in [
            ("M552", Request::Start),
            ("M552 S1", set(Some(StartMode::Station), None)),
            (
                "M552 S2 P2",
                set(Some(StartMode::AccessPoint), Some(AccessPointName::Machine)),
            ),
            ("M552 S3", set(Some(StartMode::AccessPointLocked), None)),
            ("M552 S4.0", set(Some(StartMode::StationLongPress), None)),
            ("M552 P1", set(None, Some(AccessPointName::Setup))),
            ("M589", Request::OwnNetwork),
            (
                "M589 P\"correct horse\"",
                Request::ProtectOwnNetwork(Password::new(b"correct horse")),
            ),
            ("M589 P\"\"", Request::ProtectOwnNetwork(None)),
            ("M291", Request::Waves),
            ("M291 S1", Request::SetWaves(true)),
            ("M291 S2", Request::SetWaves(false)),
        ] {
            assert_eq!(only(line).0, request, "{line}");
        }
    }

    #[test]
    fn stored_drawings() {
        let slot = |number| Slot::new(number).unwrap();
        let replay = |seconds, every, number| {
            Request::SetReplay(Some(Replay {
                slot: slot(number),
                seconds,
                every,
            }))
        };
        for (line, request) in [
            ("M20", Request::Drawings),
            ("M39 ", Request::Space),
            ("M23", Request::Button),
            ("M23 S0", Request::SetButton(ButtonDraws::Nothing)),
            ("M23 S1", Request::SetButton(ButtonDraws::Next)),
            (
                "m23 k7 s2",
                Request::SetButton(ButtonDraws::Always(slot(7))),
            ),
            ("M23 S3", Request::SetButton(ButtonDraws::Any)),
            ("M23 K7", Request::Draw(slot(7))),
            ("M23 K0", Request::StopDrawing),
            ("M28 S1", Request::BeginRecording(slot(1))),
            ("M28 S32", Request::BeginRecording(slot(32))),
            ("M29", Request::EndRecording),
            ("M30 S5", Request::Delete(slot(5))),
            ("M85", Request::Replaying),
            ("M85 S0", Request::SetReplay(None)),
            ("M85 S20 P600 K3", replay(20, 600, 3)),
            ("M85 S20", replay(20, Replay::DEFAULT_EVERY, 1)),
            ("M85 K2", replay(30, Replay::DEFAULT_EVERY, 2)),
        ] {
            assert_eq!(only(line).0, request, "{line}");
        }
        for (line, reason) in [
            ("M20 S1", "unknown parameter S"),
            ("M23 S4", "S must be a whole number, 0 to 3"),
            ("M23 S2", "parameter K is missing"),
            ("M23 S2 K0", "K must be a whole number, 1 to 32"),
            ("M23 K33", "K must be a whole number, 0 to 32"),
            ("M23 S1 K3", "K goes with S2 only"),
            ("M23 S1 S1", "parameter S is repeated"),
            ("M28", "parameter S is missing"),
            ("M28 S0", "S must be a whole number, 1 to 32"),
            ("M28 S33", "S must be a whole number, 1 to 32"),
            ("M28 S-1", "S must be a whole number, 1 to 32"),
            ("M28 S1.5", "S must be a whole number, 1 to 32"),
            ("M28 S", "S has no number"),
            ("M28 K1", "unknown parameter K"),
            ("M28 S1 S2", "parameter S is repeated"),
            ("M30 S1e9", "S must be a whole number, 1 to 32"),
            ("M30 S1 P1", "unknown parameter P"),
            ("M85 S3601", "S must be a whole number, 0 to 3600"),
            ("M85 S5 P0", "P must be a whole number, 1 to 3600"),
            ("M85 S5 K0", "K must be a whole number, 1 to 32"),
        ] {
            let refused = std::format!("error INFO:\"{reason}\"");
            assert_eq!(only(line), (Request::Answered, refused), "{line}");
        }
    }

    #[test]
    fn dwells_in_seconds() {
        for (line, micros) in [
            ("G4 P0.5", 500_000),
            ("G4 S2", 2_000_000),
            ("g04 p1e-3", 1_000),
            ("G4 P0", 0),
            ("G4 P3600", 3_600_000_000),
            ("G4 P0.123456", 123_456),
        ] {
            let dwell = Errand::Dwell(Micros::new(micros));
            assert_eq!(only(line).0, Request::Errand(dwell), "{line}");
        }
    }

    #[test]
    fn maps_and_shifts() {
        let set = |map: Option<[i16; 4]>, hundredths: Option<i16>| Request::SetCompensation {
            map: map.map(|corners| ZMap::new(corners).unwrap()),
            shift: hundredths.map(|shift| NibShift::from_hundredths(shift).unwrap()),
        };
        for (line, request) in [
            ("G31", Request::Compensation),
            ("G31 ; how is it", Request::Compensation),
            ("G31 S0;100;300;200", set(Some([0, 100, 300, 200]), None)),
            ("g31 s-5;0;7;500 ; here", set(Some([-5, 0, 7, 500]), None)),
            ("G31 S1;2;3;4(four)", set(Some([1, 2, 3, 4]), None)),
            (
                "G31 S\"0; 100; 300; 200\"",
                set(Some([0, 100, 300, 200]), None),
            ),
            ("G31 Sclear", set(Some([0; 4]), None)),
            ("G31 SCLEAR P0", set(Some([0; 4]), Some(0))),
            ("G31 P0.85", set(None, Some(85))),
            ("G31 P-1.234 S1;1;1;1", set(Some([1; 4]), Some(-123))),
            ("G31 P2", set(None, Some(200))),
        ] {
            assert_eq!(only(line).0, request, "{line}");
        }
    }

    #[test]
    fn bare_moves_know_no_scale_and_origin() {
        let mut session = Session::new();
        let stream = b"G54 X100 Y0 S2\nG40 X900 Y300 Z5\nG40 X400 Y150 Kxy\nG40 Z7 Kz\nG40\n";
        let found = requests(&mut session, stream);
        let bare = |target, xy, z| Request::Errand(Errand::Uncalibrated(target, Bare { xy, z }));
        for (found, expected) in found.iter().skip(1).zip([
            bare(target(Some(900.0), Some(300.0), Some(5.0)), true, true),
            bare(target(Some(900.0), Some(300.0), None), false, true),
            bare(target(None, None, Some(7.0)), true, false),
            bare(Target::default(), true, true),
        ]) {
            assert_eq!(found.0, expected);
        }
        assert_eq!(found.len(), 5);
    }

    #[test]
    fn directions_and_the_factory_reset() {
        let set = |servos| Request::SetDirections(servos);
        for (line, request) in [
            ("M280", Request::Directions),
            ("M280 S2", set([Some(true), None, None])),
            ("m280 p1 e2", set([None, Some(true), Some(false)])),
            ("M171 Sconfirm", Request::FactoryReset),
            ("M171 SCONFIRM", Request::FactoryReset),
            ("m171 s\"Confirm\"", Request::FactoryReset),
        ] {
            assert_eq!(only(line).0, request, "{line}");
        }
    }

    #[test]
    fn a_line_of_comments_is_answered_ok() {
        for line in ["; G28", "(G28)", " (a) (b) ; c"] {
            assert_eq!(only(line), (Request::Answered, "ok ".to_string()), "{line}");
        }
    }

    #[test]
    fn bytes_that_are_not_utf8_spoil_their_line_alone() {
        for line in [
            &b"\xff\xfe"[..],
            b"G01 X\xff",
            b"G28 \xc3",
            b"G28 ; \xff",
            b"G01 (\xff) X5",
        ] {
            let stream = [line, b"\nM114\n"].concat();
            let found = requests(&mut Session::new(), &stream);
            let refused = (
                Request::Answered,
                "error INFO:\"line is not UTF-8 text\"".to_string(),
            );
            assert_eq!(
                found,
                [refused, (Request::Position, String::new())],
                "{line:?}"
            );
        }
        for line in [&b"M550 P\xff\n"[..], b"M550 P\"\xff\"\n"] {
            let found = requests(&mut Session::new(), line);
            let reason = "P is '?', a name is 1 to 32 letters, digits and inner hyphens";
            let refused = std::format!("error INFO:\"{reason}\"");
            assert_eq!(found, [(Request::Answered, refused)], "{line:?}");
        }
    }

    #[test]
    fn g54_belongs_to_the_session_and_not_to_z_nor_home() {
        let mut session = Session::new();
        let stream = b"G54 X100 Y0 S2.5\nG01 X200 Y100 Z300\nG54 Y7\nG01 X2 Y2\nG28\n";
        let found = requests(&mut session, stream);
        assert_eq!(found[0], (Request::Answered, "ok ".to_string()));
        assert_eq!(found[1].0, straight(600.0, 250.0, 300.0));
        let second = Errand::Move(Manner::Straight, target(Some(105.0), Some(12.0), None));
        assert_eq!(found[3].0, Request::Errand(second));
        assert_eq!(
            found[4].0,
            Request::Errand(Errand::Move(Manner::Straight, Target::HOME))
        );
    }

    #[test]
    fn a_refused_g54_changes_nothing() {
        let mut session = Session::new();
        let found = requests(
            &mut session,
            b"G54 X100 S0\nG54 X50 Q1\nG54 X7 X8\nG01 X1 Y1 Z1\n",
        );
        assert_eq!(found[3].0, straight(1.0, 1.0, 1.0));
    }

    #[test]
    fn the_longest_wifi_command_fits_a_line() {
        let quotes = "\"\"";
        let line = std::format!("M587 S\"{}\" P\"{}\"", quotes.repeat(32), quotes.repeat(63));
        assert!(line.len() <= crate::text::MAX_LINE);
        let request = Request::Remember {
            ssid: Ssid::new(&[b'"'; 32]).unwrap(),
            password: Password::new(&[b'"'; 63]),
        };
        assert_eq!(only(&line).0, request);
    }

    #[test]
    fn websockets_are_refused_some_commands_by_name() {
        for (line, code) in [
            ("M170", 170),
            ("m171 SCONFIRM", 171),
            ("M587", 587),
            ("M587 Shome P\"correct horse\"", 587),
            ("(a) M0588 S*", 588),
            ("M588 Q", 588),
        ] {
            let stream = std::format!("{line}\n");
            let found = requests(&mut Session::web_socket(), stream.as_bytes());
            let reason = std::format!("error INFO:\"M{code} is refused over the WebSocket\"");
            assert_eq!(found, [(Request::Answered, reason)], "{line}");
        }
        let moves = requests(&mut Session::web_socket(), b"G01 X900 Y300 Z1\nM552\n");
        assert_eq!(moves[0].0, straight(900.0, 300.0, 1.0));
        assert_eq!(moves[1].0, Request::Start);
    }

    /// Lines that are nearly right, where the mistakes hide.
    fn nearly() -> impl Strategy<Value = String> {
        let word = "[GMgmXYZSFPxyz][0-9.eE+\\-\"]{0,6}";
        proptest::collection::vec(word, 0..6).prop_map(|words| words.join(" "))
    }

    proptest! {
        #[test]
        fn any_bytes_get_one_reply_per_line_and_no_panic(stream: Vec<u8>) {
            let lines = stream
                .split(|byte| matches!(byte, b'\r' | b'\n' | 0))
                .filter(|line| line.iter().any(|byte| !matches!(byte, b' ' | b'\t')));
            let ended = stream.iter().rposition(|byte| matches!(byte, b'\r' | b'\n' | 0)).map_or(0, |at| at + 1);
            let unfinished = stream[ended..].iter().any(|byte| !matches!(byte, b' ' | b'\t'));
            let found = requests(&mut Session::new(), &stream);
            prop_assert_eq!(found.len(), lines.count() - usize::from(unfinished));
        }

        #[test]
        fn refused_lines_change_nothing(line in nearly()) {
            let mut session = Session::new();
            let before = session.transform;
            let stream = std::format!("{line}\n");
            for (_, answer) in requests(&mut session, stream.as_bytes()) {
                if answer.starts_with("error") {
                    prop_assert_eq!(session.transform, before, "{}", line);
                }
            }
        }

        #[test]
        fn errors_are_one_quoted_text_below_256_bytes(text in "\\PC{0,300}") {
            for line in [text.clone(), std::format!("G01 X{text}"), std::format!("M374 S{text}")] {
                let stream = std::format!("{line}\n");
                for (_, answer) in requests(&mut Session::new(), stream.as_bytes()) {
                    if answer.starts_with("error") {
                        prop_assert!(answer.len() < 253, "{}", answer);
                        prop_assert_eq!(answer.matches('"').count(), 2, "{}", answer);
                        prop_assert!(answer.starts_with("error INFO:\"") && answer.ends_with('"'));
                    }
                }
            }
        }
    }
}
