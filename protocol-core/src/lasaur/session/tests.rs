//! Sessions as hosts meet them: bytes in, replies out. The machine here does every step at once, or is full.

extern crate std;
use super::super::units::place;
use super::super::{MAX_LINE, RECEIVE_BUFFER, VERSION};
use super::*;
use crate::lasaur::{READY, Step, checksum};
use crate::motion::{Assist, Feed, Intensity, Segment};
use std::string::{String, ToString};
use std::vec;
use std::vec::Vec;

/// A session with a machine that is always where it was sent.
#[derive(Default)]
struct Rig {
    session: Session,
    facts: Facts,
    /// Steps done.
    done: Vec<Step>,
    /// Everything sent to the host.
    sent: Vec<u8>,
    /// The plan has no room for a move.
    full: bool,
    /// Steps of the line that waits for room, the last first.
    waiting: Option<Vec<Step>>,
}

impl Rig {
    fn effect(&mut self, effect: Effect) {
        self.facts.stop = match effect {
            Effect::Stop(reason) => Some(reason),
            Effect::Resume => None,
        };
    }

    fn receive(&mut self, bytes: &[u8]) {
        let mut input = bytes;
        loop {
            match self.session.next_event(&mut input) {
                None => break,
                Some(Event::Ready) => self.sent.push(READY),
                Some(Event::Effect(effect)) => {
                    self.effect(effect);
                    self.go_on();
                }
                Some(Event::Line) => {
                    let line = self.session.begin_line(&self.facts);
                    if let Some(reason) = line.stop {
                        self.effect(Effect::Stop(reason));
                    }
                    self.waiting = Some(line.steps.into_iter().rev().collect());
                    self.go_on();
                }
            }
        }
    }

    fn go_on(&mut self) {
        while let Some(step) = self.waiting.as_mut().and_then(Vec::pop) {
            if self.session.is_void() {
                break;
            }
            match step {
                Step::Move(_) if self.full => {
                    self.waiting.as_mut().unwrap().push(step);
                    return;
                }
                Step::Move(segment) => self.facts.planned = segment.to,
                Step::Home => self.facts.planned = TablePoint::HOME,
                Step::Dwell { .. } | Step::Output(..) => {}
            }
            self.done.push(step);
        }
        if self.waiting.take().is_some() {
            self.facts.position = self.facts.planned;
            let mut reply = Reply::new();
            let effect = self.session.reply(&self.facts, &mut reply);
            self.sent.extend_from_slice(reply.as_bytes());
            if let Some(effect) = effect {
                self.effect(effect);
            }
        }
    }

    fn room(&mut self) {
        self.full = false;
        self.go_on();
        self.receive(b"");
    }

    /// What is sent back for these bytes.
    fn say(&mut self, bytes: &[u8]) -> String {
        self.sent.clear();
        self.receive(bytes);
        self.sent.escape_ascii().to_string()
    }

    fn targets(&self) -> Vec<TablePoint> {
        let target = |step: &Step| match step {
            Step::Move(segment) => Some(segment.to),
            _ => None,
        };
        self.done.iter().filter_map(target).collect()
    }
}

fn said(bytes: &[u8]) -> String {
    Rig::default().say(bytes)
}

#[test]
fn one_reply_for_each_line_that_is_not_empty() {
    let status = std::format!("X0.000Y0.000V{VERSION}\\n");
    for (bytes, replies) in [
        (&b"G90\n"[..], "\\n"),
        (b"G90\nM80\n", "\\n\\n"),
        (b"\n \n\t\r\n\n", ""),
        (b" G 9 0 \r\n", "\\n"),
        (b"G90\r", ""),
        (b"G90", ""),
        (b"?\n", &status),
        (b"?whatever 5\n", &status),
        (b"M115\n", "U\\n"),
        (b"version\n", "E\\n"),
        (b"$fb\n", "E\\n"),
        (b"G1X\n", "N\\n"),
        (b"G0X120 (over there)\n", "E\\n"),
        (b"%\n;\n(x)\ng90\n", "E\\nE\\nE\\nE\\n"),
        (b"G9\x000\x01\x7f\n", "E\\n"),
        (b"!\n", ""),
        (b"~\n", ""),
    ] {
        assert_eq!(said(bytes), replies, "{}", bytes.escape_ascii());
    }
}

#[test]
fn rows_of_the_checksum_table() {
    for (bytes, replies) in [
        (&b"*\x98G90\n"[..], "\\n"),
        (b"* \x98 G 90\n", "\\n"),
        (b"*\xa8G0 X120 Y150\n", "\\n"),
        (b"*\x80G10 L2 P1 X220 Y140\n", "\\n"),
        (b"*\x80\n", "\\n"),
        (b"^\x98G90\n*\x98G90\n", "\\n\\n"),
        (b"^\xb6M115\n*\xb6M115\n", "^\\n*\\xb6M115\\n"),
        (b"^\x99G90\n*\x98G90\n", "^\\n\\n"),
        (b"^\x99G90\n^\x98G90\n*\x99G90\n", "^\\n\\n\\n"),
        (b"*\x99G90\nG90\n", "*\\x99G90\\n!T\\n"),
        (b"*\xa4?\n?\n", "*\\xa4?\\n!T\\n"),
        (b"*G90\n?\n", "*G90 -> checksum outside [128,255]\\n!T\\n"),
        (b"^G90\n?\n", "^G90 -> checksum outside [128,255]\\n!T\\n"),
        (b"*\n", "* -> checksum outside [128,255]\\n"),
        (b"^\x98G90\nM115\n*\x98G90\n", "\\nU\\n\\n"),
    ] {
        assert_eq!(said(bytes), replies, "{}", bytes.escape_ascii());
    }
}

#[test]
fn a_right_redundant_line_is_executed_at_once_and_once() {
    let mut rig = Rig::default();
    let body = b"G91G0X1Y0";
    let sum = checksum(body) as u8;
    let line = |prefix: u8| [&[prefix, sum][..], body, b"\n"].concat();
    rig.receive(&line(b'^'));
    assert_eq!(rig.targets(), [place(1, 0)]);
    rig.receive(&line(b'^'));
    rig.receive(&line(b'*'));
    assert_eq!(rig.targets(), [place(1, 0)]);
    rig.receive(&line(b'*'));
    assert_eq!(rig.targets(), [place(1, 0), place(2, 0)]);
}

#[test]
fn the_body_of_a_wrong_line_is_not_parsed() {
    let mut rig = Rig::default();
    assert_eq!(rig.say(b"*\x80G0X5M99F0\n"), "*\\x80G0X5M99F0\\n");
    assert_eq!(rig.done, []);
    rig.say(b"~*\xa1S99\n~G1X0Y0\n");
    let step = Step::Move(Segment {
        to: place(5, 5),
        feed: Feed::DEFAULT,
        intensity: Intensity::OFF,
    });
    assert_eq!(rig.done, [step], "neither moved nor kept");
}

#[test]
fn stop_and_resume_are_in_no_line_and_get_no_reply() {
    let mut rig = Rig::default();
    assert_eq!(rig.say(b"!"), "");
    assert_eq!(rig.facts.stop, Some(StopReason::Requested));
    assert_eq!(
        rig.say(b"G90\n?\nG30\nM80\nxyz\n^\x98G90\n*\x99G90\n"),
        "!R\\n".repeat(7)
    );
    assert_eq!(rig.done, []);
    assert_eq!(rig.say(b"~"), "");
    assert_eq!(rig.say(b"G9~0\n"), "\\n");
    assert_eq!(rig.say(b"G9!0\n"), "!R\\n");
}

#[test]
fn resuming_as_hosts_do_it() {
    for resume in [&b"~\n"[..], b"^\x80~\n*\x80~\n"] {
        let mut rig = Rig::default();
        assert_eq!(rig.say(b"^\x80!\n*\x80!\n"), "!R\\n!R\\n");
        let replies = if resume.len() > 2 { "\\n\\n" } else { "" };
        assert_eq!(rig.say(resume), replies);
        assert_eq!(rig.say(b"^\x98G90\n*\x98G90\n"), "\\n\\n");
        assert_eq!(rig.facts.stop, None);
    }
}

#[test]
fn every_reason_is_told_and_the_last_cause_wins() {
    for (reason, reply) in [
        (StopReason::Power, "!PDL2\\n"),
        (StopReason::Limit(Side::X2), "!LDL2\\n"),
        (StopReason::Requested, "!RDL2\\n"),
        (StopReason::ReceiveOverflow, "!BDL2\\n"),
        (StopReason::LineOverflow, "!IDL2\\n"),
        (StopReason::Transmission, "!TDL2\\n"),
        (StopReason::Other(4), "!O4DL2\\n"),
    ] {
        let mut rig = Rig::default();
        rig.facts.sensors.door_open = true;
        rig.facts.sensors.limits[1] = true;
        rig.receive(b"!");
        rig.facts.stop = Some(reason);
        assert_eq!(rig.say(b"G90\n"), reply);
        assert_eq!(rig.say(b"!G90\n"), "!RDL2\\n");
    }
}

#[test]
fn a_stop_between_redundant_and_final_line_drops_nothing_of_the_next_group() {
    for between in [&b"!~"[..], b"!*\x98G90\n~", b"!^\x98G9!*\x98G90\n~\n"] {
        let mut rig = Rig::default();
        rig.receive(b"^\x98G90\n");
        rig.receive(between);
        assert_eq!(rig.say(b"^\x9aM80\n*\x9aM80\n"), "\\n\\n");
        assert_eq!(rig.done, [Step::Output(Assist::Air, true)]);
    }
    // A limit, of which no byte tells.
    let mut rig = Rig::default();
    rig.receive(b"^\x98G90\n");
    rig.facts.stop = Some(StopReason::Limit(Side::X2));
    assert_eq!(rig.say(b"*\x98G90\n"), "!L\\n");
    rig.receive(b"~");
    assert_eq!(rig.say(b"^\x9aM80\n*\x9aM80\n"), "\\n\\n");
    assert_eq!(rig.done, [Step::Output(Assist::Air, true)]);
}

#[test]
fn door_and_chiller_stop_nothing() {
    let mut rig = Rig::default();
    (rig.facts.sensors.door_open, rig.facts.sensors.chiller_off) = (true, true);
    assert_eq!(rig.say(b"G0X1Y1\n"), "DC\\n");
    assert_eq!(rig.say(b"G0X\n"), "NDC\\n");
    assert_eq!(rig.say(b"^\x99G90\n"), "^DC\\n");
    assert_eq!(rig.done.len(), 1);
    assert_eq!(rig.say(b"?\n"), std::format!("DCX6.000Y6.000V{VERSION}\\n"));
}

#[test]
fn a_line_waits_for_room_and_its_reply_with_it() {
    let mut rig = Rig {
        full: true,
        ..Rig::default()
    };
    assert_eq!(rig.say(b"G90\nG0X1Y1\nG0X2\n?\n"), "\\n");
    rig.sent.clear();
    rig.room();
    let status = std::format!("X7.000Y6.000V{VERSION}");
    assert_eq!(
        rig.sent.escape_ascii().to_string(),
        std::format!("\\n\\n{status}\\n")
    );
    assert_eq!(rig.targets(), [place(6, 6), place(7, 6)]);
}

#[test]
fn a_stop_while_a_line_waits_discards_it_and_all_behind_it() {
    // However soon it is over.
    for stop in [&b"!"[..], b"!~"] {
        let mut rig = Rig {
            full: true,
            ..Rig::default()
        };
        assert_eq!(rig.say(b"S9G1F77X1Y1\nG0X2\n?\n"), "");
        assert_eq!(rig.say(stop), "!R\\n!R\\n!R\\n");
        rig.full = false;
        assert_eq!(rig.say(b"~G1X0Y0\n"), "\\n");
        let step = Step::Move(Segment {
            to: place(5, 5),
            feed: Feed::DEFAULT,
            intensity: Intensity::OFF,
        });
        assert_eq!(rig.done, [step], "nothing of the discarded lines is kept");
    }
}

#[test]
fn what_the_machine_does_not_take_is_answered_as_stopped() {
    let mut session = Session::new();
    let facts = Facts::default();
    assert_eq!(session.next_event(&mut &b"G0X5\n"[..]), Some(Event::Line));
    assert_eq!(session.begin_line(&facts).steps.len(), 1);
    // The limit that stopped it, and the button that ended that, were between two looks.
    session.discard();
    let mut reply = Reply::new();
    assert_eq!(session.reply(&facts, &mut reply), None);
    assert_eq!(reply.as_bytes(), b"!R\n");
}

#[test]
fn after_a_stop_omitted_axes_stay_where_the_arm_is() {
    let mut rig = Rig::default();
    rig.receive(b"G0X10Y20\nG0X40\n!");
    // On the way it was.
    rig.facts.planned = place(31, 25);
    rig.receive(b"~G1Y0\n");
    assert_eq!(rig.targets()[2], place(31, 5));
    rig.receive(b"G91\nG1X1\n");
    assert_eq!(rig.targets()[3], place(32, 5));
}

#[test]
fn offsets_are_part_of_what_the_status_tells() {
    let mut rig = Rig::default();
    rig.receive(b"G10 L2 P0 X7 Y8\nG0X1.5Y0.25\n");
    assert_eq!(rig.say(b"?\n"), std::format!("X8.500Y8.250V{VERSION}\\n"));
}

#[test]
fn ready_when_more_than_sixteen_bytes_are_free() {
    // Nothing is waiting: at once, also in the middle of a line.
    assert_eq!(said(b"\x14"), "\\x12");
    assert_eq!(said(b"\x14\x14"), "\\x12\\x12");
    assert_eq!(said(b"G9\x140\n"), "\\x12\\n");
    assert_eq!(said(b"!\x14"), "\\x12");
    // A line waits, and behind it the buffer fills: 17 free, then 16.
    for (behind, answer) in [(RECEIVE_BUFFER - 17, "\\x12"), (RECEIVE_BUFFER - 16, "")] {
        let mut rig = Rig {
            full: true,
            ..Rig::default()
        };
        rig.receive(b"G0X1\n");
        rig.receive(&vec![b'\n'; behind]);
        assert_eq!(rig.say(b"\x14"), answer, "{behind} waiting");
        assert_eq!(rig.say(b"\x14\x14"), answer.repeat(2), "{behind} waiting");
        rig.sent.clear();
        rig.room();
        // Requests that had to wait are one answer.
        let late = if answer.is_empty() { "\\n\\x12" } else { "\\n" };
        assert_eq!(rig.sent.escape_ascii().to_string(), late);
    }
}

#[test]
fn one_byte_more_than_the_receive_buffer_holds() {
    let mut rig = Rig {
        full: true,
        ..Rig::default()
    };
    rig.receive(b"G0X1\n");
    let behind = [&b"G91\n"[..], &vec![b' '; RECEIVE_BUFFER - 8], b"G90M"].concat();
    assert_eq!(behind.len(), RECEIVE_BUFFER);
    assert_eq!(rig.say(&behind), "");
    assert_eq!(rig.facts.stop, None);
    // `8` is lost. The line it was in is not executed, even after `~`.
    assert_eq!(rig.say(b"8"), "!B\\n!B\\n");
    rig.full = false;
    assert_eq!(rig.say(b"~0\nM82\n"), "!B\\n\\n");
    assert_eq!(rig.done, [Step::Output(Assist::Aux1, true)]);
}

#[test]
fn a_byte_that_is_lost_before_it_gets_here() {
    let mut rig = Rig::default();
    rig.receive(b"G0X1");
    let effect = rig.session.lose_byte();
    rig.effect(effect);
    // `2` was lost: G0X13 is not where it should go.
    assert_eq!(rig.say(b"~3\nG90\n"), "!B\\n\\n");
    assert_eq!(rig.done, []);
}

#[test]
fn one_character_more_than_a_line_holds() {
    let longest = [&b"?"[..], &[b'x'; MAX_LINE - 1]].concat();
    let blanks = [&longest[..], &[b' '; 300], b"\n"].concat();
    assert!(said(&blanks).starts_with("X0.000"), "blanks do not count");
    // With a prefix, whose two characters count.
    let body = [&b"?"[..], &[b'x'; MAX_LINE - 3]].concat();
    let prefixed = [b"*", &[checksum(&body) as u8][..], &body, b"\n"].concat();
    assert!(said(&prefixed).starts_with("X0.000"));

    let mut rig = Rig::default();
    assert_eq!(rig.say(&longest), "");
    assert_eq!(rig.facts.stop, None);
    assert_eq!(rig.say(b"x"), "");
    assert_eq!(rig.facts.stop, Some(StopReason::LineOverflow));
    // It is answered once, and not executed even after `~`.
    assert_eq!(rig.say(b"xxxx~xxx\n"), "!I\\n");
    assert_eq!(
        rig.say(b"?\n").len(),
        std::format!("X0.000Y0.000V{VERSION}\\n").len()
    );
}

#[test]
fn a_long_line_behind_a_waiting_one_stops_when_its_turn_comes() {
    let mut rig = Rig {
        full: true,
        ..Rig::default()
    };
    let long = [b'x'; MAX_LINE + 1];
    rig.receive(&[b"G0X1\n", &long[..], b"\nG90\n"].concat());
    assert_eq!(rig.facts.stop, None);
    rig.sent.clear();
    rig.room();
    assert_eq!(rig.facts.stop, Some(StopReason::LineOverflow));
    assert_eq!(rig.sent.escape_ascii().to_string(), "\\n!I\\n!I\\n");
}

#[test]
fn home_answers_when_it_is_done() {
    let mut rig = Rig {
        full: true,
        ..Rig::default()
    };
    rig.receive(b"G10L2P0X9Y8\n");
    // The move to the offset has to wait: so does the reply.
    assert_eq!(rig.say(b"G30\n"), "");
    assert_eq!(rig.done, [Step::Home]);
    rig.sent.clear();
    rig.room();
    assert_eq!(rig.sent, b"\n");
    assert_eq!(rig.targets(), [place(9, 8)]);
}
