//! A connection that records a drawing: what is drawn is kept instead, questions are answered, and the
//! rest is refused.

use super::command::{Command, parse};
use super::refusal::Refusal;
use super::reply::Reply;
use super::request::Request;
use crate::text::{MAX_LINE, WordError, Words};
use heapless::Vec;

/// What becomes of a command while the connection that sends it records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    /// It is part of the drawing.
    Kept,
    /// It asks something and changes nothing, or ends the recording: it is done as ever.
    Done,
    /// It has no place in a drawing: another recording, what is remembered, what is drawn from memory, new
    /// firmware.
    Refused,
}

const fn fate(request: &Request) -> Fate {
    match request {
        Request::Errand(_) | Request::SetSpeed { .. } => Fate::Kept,
        Request::Position
        | Request::Angles
        | Request::Capabilities
        | Request::Diagnostics
        | Request::Name
        | Request::Start
        | Request::Waves
        | Request::Networks
        | Request::Drawings
        | Request::Space
        | Request::Button
        | Request::Compensation
        | Request::Directions
        | Request::OwnNetwork
        | Request::Replaying
        | Request::EndRecording => Fate::Done,
        Request::Calibrate
        | Request::ClearCalibration
        | Request::Rename(_)
        | Request::SetStart { .. }
        | Request::SetWaves(_)
        | Request::Remember { .. }
        | Request::Forget(_)
        | Request::ForgetAll
        | Request::SetButton(_)
        | Request::Draw(_)
        | Request::StopDrawing
        | Request::BeginRecording(_)
        | Request::Delete(_)
        | Request::SetCompensation { .. }
        | Request::SetDirections(_)
        | Request::FactoryReset
        | Request::ProtectOwnNetwork(_)
        | Request::Update
        | Request::SetUpdateAddress(_)
        | Request::SetReplay(_)
        // Nothing that a line asks for.
        | Request::Answered
        | Request::HangUp
        | Request::RecordLine => Fate::Refused,
    }
}

/// What a line asks for; one that is to be kept is put into `recorded`.
pub(super) fn request(
    line: Result<&[u8], Refusal<'_>>,
    recorded: &mut Vec<u8, MAX_LINE>,
    reply: &mut Reply,
) -> Request {
    let parsed = line.and_then(|line| Ok((parse(line)?, line)));
    let (command, line) = match parsed {
        Ok(parsed) => parsed,
        Err(refusal) => {
            reply.refuse(&refusal);
            return Request::Answered;
        }
    };
    let request = match command {
        Command::Ask(request) => request,
        Command::Nothing
        | Command::Move(..)
        | Command::Transform { .. }
        | Command::Uncalibrated(..) => return keep(line, recorded),
    };
    match fate(&request) {
        Fate::Kept => keep(line, recorded),
        Fate::Done => request,
        Fate::Refused => {
            let code = match Words::new(line).unknown() {
                WordError::NoCode(code) => code,
                _ => "this",
            };
            reply.refuse(&Refusal::NotRecorded(code));
            Request::Answered
        }
    }
}

fn keep(line: &[u8], recorded: &mut Vec<u8, MAX_LINE>) -> Request {
    recorded.clear();
    // A line is never longer.
    let _ = recorded.extend_from_slice(line);
    Request::RecordLine
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::Session;
    use super::*;
    use std::string::{String, ToString};
    use std::vec::Vec as StdVec;

    /// Every request of lines that a recording connection sends, with what is kept of it or answered to
    /// it.
    fn recorded(lines: &[&str]) -> StdVec<(Request, String)> {
        let mut session = Session::new();
        session.record(true);
        let mut reply = Reply::new();
        let mut found = StdVec::new();
        for line in lines {
            let stream = std::format!("{line}\n");
            let mut input = stream.as_bytes();
            while let Some(request) = session.next_request(&mut input, &mut reply) {
                let text = match request {
                    Request::RecordLine => String::from_utf8_lossy(session.recorded_line()).into(),
                    Request::Answered => reply.message().to_string(),
                    _ => String::new(),
                };
                found.push((request, text));
            }
        }
        found
    }

    #[test]
    fn what_is_drawn_is_kept_as_it_was_sent() {
        for line in [
            "G01 X1000 Y500 Z0",
            "g1 x1.5e2",
            " G01  X5 ; a note",
            "G00 X5",
            "G28 ",
            "G54 S2",
            "G94 S3",
            "; only a note",
        ] {
            assert_eq!(
                recorded(&[line]),
                [(Request::RecordLine, line.to_string())],
                "{line}"
            );
        }
    }

    #[test]
    fn bad_lines_are_refused_as_ever() {
        for (line, reason) in [
            ("G01 X", "X has no number"),
            ("G54 S0", "S must not be zero"),
            ("undefined", "unknown command 'undefined'"),
        ] {
            let refused = std::format!("error INFO:\"{reason}\"");
            assert_eq!(recorded(&[line]), [(Request::Answered, refused)], "{line}");
        }
        let long = "G01 ".repeat(100);
        let (request, answer) = recorded(&[&long]).remove(0);
        assert_eq!(request, Request::Answered);
        assert_eq!(answer, "error INFO:\"line longer than 256 bytes\"");
    }

    #[test]
    fn questions_are_answered_and_not_kept() {
        for (line, request) in [
            ("M114", Request::Position),
            ("M114 S", Request::Angles),
            ("M122", Request::Diagnostics),
            ("M550", Request::Name),
            ("M587", Request::Networks),
            ("M20", Request::Drawings),
            ("M39", Request::Space),
            ("M29", Request::EndRecording),
        ] {
            assert_eq!(recorded(&[line])[0].0, request, "{line}");
        }
    }

    #[test]
    fn what_has_no_place_in_a_drawing_is_refused_by_name() {
        for (line, code) in [
            ("M374", "M374"),
            ("M374 Sclear", "M374"),
            ("m0030 S5", "m0030"),
            ("M28 S2", "M28"),
            ("M550 Pnew", "M550"),
            ("M587 Shome P12345678", "M587"),
            ("(now) M588 S*", "M588"),
            ("M552 S1", "M552"),
            ("M291 S1", "M291"),
            ("M23 K2", "M23"),
            ("M23 S1", "M23"),
            ("M85 S5", "M85"),
            ("M997", "M997"),
            ("M997 S\"http://a/b\"", "M997"),
        ] {
            let refused = std::format!("error INFO:\"{code} cannot be part of a drawing\"");
            assert_eq!(recorded(&[line]), [(Request::Answered, refused)], "{line}");
        }
    }

    #[test]
    fn scale_and_origin_stay_as_they_were() {
        let mut session = Session::new();
        let mut reply = Reply::new();
        let mut next = |session: &mut Session, line: &str| {
            session.next_request(&mut line.as_bytes(), &mut reply)
        };
        session.record(true);
        assert_eq!(next(&mut session, "G54 S2\n"), Some(Request::RecordLine));
        session.record(false);
        let as_written = next(&mut Session::new(), "G01 X600 Y5\n");
        assert_eq!(next(&mut session, "G01 X600 Y5\n"), as_written);
    }
}
