//! What holds for any sequence of lines, right or wrong, through sessions and machine.

mod lines;
mod nib;

use host_tests::bench::{Answer, Bench};
use host_tests::model;
use lines::{Said, any_lines, sprinkled};
use proptest::prelude::*;
use protocol_core::machine::{MAX_CLIENTS, SetPoint};

/// A set-point may lie this far outside the drawing area, in drawing units: rounding.
const EDGE_TOLERANCE: f64 = 0.001;
/// Everyday replies fit the 256-byte buffers of simple clients; M122 may be longer.
const SHORT: usize = 256;

fn check_form(line: &str, answer: &Answer) -> Result<(), TestCaseError> {
    let bytes = &answer.bytes;
    prop_assert!(
        bytes.ends_with("\r\n\0"),
        "{line:?}: {bytes:?} is not ended as messages are"
    );
    let text = answer.text();
    prop_assert!(
        !text.contains(['\r', '\n', '\0']),
        "{line:?}: {text:?} is more than one message"
    );
    let (ok, error) = (text.starts_with("ok "), text.starts_with("error INFO:\""));
    prop_assert!(
        if answer.is_error { error } else { ok },
        "{line:?}: {text:?} starts wrongly"
    );
    prop_assert!(
        text.matches('"').count().is_multiple_of(2),
        "{line:?}: {text:?} leaves a quote open"
    );
    let diagnostics = text.starts_with("ok name:");
    prop_assert!(
        diagnostics || bytes.len() < SHORT,
        "{line:?}: {} bytes are too many",
        bytes.len()
    );
    Ok(())
}

fn check_set_point(set_point: &SetPoint) -> Result<(), TestCaseError> {
    let position = set_point.position;
    let [x, y, z] = [position.x, position.y, position.z].map(|coordinate| coordinate.to_f64());
    let (near_x, near_y) = model::closest(x, y);
    let outside = (near_x - x).hypot(near_y - y);
    prop_assert!(
        outside <= EDGE_TOLERANCE,
        "({x}, {y}) is {outside} units outside the drawing area"
    );
    prop_assert!((0.0..=1000.0).contains(&z), "Z is {z}");
    for pulse in set_point.pulses {
        let pulse = pulse.to_f64();
        prop_assert!(
            (500.0..=2500.0).contains(&pulse),
            "a servo is given {pulse} us at ({x}, {y}, {z})"
        );
    }
    Ok(())
}

/// Says lines, checks replies and set-points, and gives the answers.
fn say_all(bench: &mut Bench, lines: &[Said]) -> Result<Vec<Answer>, TestCaseError> {
    let mut answers = Vec::new();
    for Said { client, line } in lines {
        let answer = bench.say(*client, line);
        check_form(line, &answer)?;
        answers.push(answer);
    }
    bench.rest();
    for frame in &bench.frames {
        check_set_point(&frame.set_point)?;
    }
    Ok(answers)
}

/// Everything that can be seen of an arm, its scales and origins by a move of each client.
fn look(bench: &mut Bench) -> String {
    let mut seen = format!(
        "{:?} {:?} {:?} {:?} {:?} {}",
        bench.frames,
        bench.machine().steps(),
        bench.machine().calibration(),
        bench.machine().compensation(),
        bench.machine().directions(),
        bench.name()
    );
    for client in 0..MAX_CLIENTS as u8 {
        for line in ["G01 X1100 Y300 Z0", "G01 X1150", "M114", "M114 S"] {
            seen += bench.say(client, line).text();
        }
        seen += &format!("{:?}", bench.rest());
    }
    seen
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn each_line_has_one_reply_and_no_set_point_lies_outside(lines in any_lines(30)) {
        say_all(&mut Bench::default(), &lines)?;
    }

    #[test]
    fn refused_lines_change_nothing(lines in sprinkled(20)) {
        let mut arm = Bench::default();
        let answers = say_all(&mut arm, &lines)?;
        // The same arm without the refused lines.
        let accepted: Vec<Said> = lines
            .iter()
            .zip(&answers)
            .filter(|(_, answer)| !answer.is_error)
            .map(|(said, _)| said.clone())
            .collect();
        let mut other = Bench::default();
        for Said { client, line } in &accepted {
            other.say(*client, line);
        }
        other.rest();
        prop_assert!(look(&mut arm) == look(&mut other), "refused lines left a trace");
    }

    #[test]
    fn pieces_and_terminators_do_not_matter(
        lines in any_lines(8),
        ends in prop::collection::vec(prop::sample::select(&["\n", "\r", "\0", "\r\n", "\0\n", "\r\n\0", "\n\n \n"]), 8),
        cuts in prop::collection::vec(any::<prop::sample::Index>(), 0..12),
    ) {
        let (mut whole, mut pieces) = (Bench::default(), Bench::default());
        let mut stream = Vec::new();
        let mut expected = Vec::new();
        for (Said { line, .. }, end) in lines.iter().zip(&ends) {
            expected.push(whole.say(0, line).bytes);
            stream.extend_from_slice(line.as_bytes());
            stream.extend_from_slice(end.as_bytes());
        }
        let mut at: Vec<usize> = cuts.iter().map(|cut| cut.index(stream.len() + 1)).collect();
        at.extend([0, stream.len()]);
        at.sort_unstable();
        let answers: Vec<String> = at
            .windows(2)
            .flat_map(|cut| pieces.send(0, &stream[cut[0]..cut[1]]))
            .map(|answer| answer.bytes)
            .collect();
        prop_assert_eq!(answers, expected);
    }

    #[test]
    fn any_bytes_get_one_reply_for_each_line_that_is_not_blank(stream: Vec<u8>) {
        let ended = stream
            .iter()
            .rposition(|byte| matches!(byte, b'\r' | b'\n' | 0))
            .map_or(&[][..], |end| &stream[..end]);
        let lines = ended
            .split(|byte| matches!(byte, b'\r' | b'\n' | 0))
            .filter(|line| line.iter().any(|byte| !matches!(byte, b' ' | b'\t')));
        let answers = Bench::default().send(0, &stream);
        for answer in &answers {
            check_form("", answer)?;
        }
        prop_assert_eq!(answers.len(), lines.count());
    }

    #[test]
    fn moves_end_exactly_where_they_say_whoever_moves(lines in any_lines(12)) {
        let mut arm = Bench::default();
        for Said { client, line } in &lines {
            let answer = arm.say(*client, line);
            if let Some(protocol_core::machine::Report::Moving { end, .. }) = answer.report {
                prop_assert_eq!(arm.rest().position, end, "{}", line);
            }
        }
    }
}
