//! Whatever bytes arrive, in whatever pieces, while the arm moves: one reply for each line, no
//! set-point outside the drawing area, and the arm comes to rest.
//!
//! The input is what a client sends, except for two bytes: 0x01 ends a piece and lets one servo frame
//! pass, 0x02 ends a piece and lets the arm come to rest. So the corpus can be read and written by hand.
//!
//! ```text
//! cargo +nightly fuzz run session -- -max_total_time=60        (in host-tests/)
//! ```

#![no_main]

use host_tests::bench::{Bench, Frame};
use host_tests::model;
use libfuzzer_sys::fuzz_target;
use protocol_core::arm::Calibration;
use protocol_core::motion::Micros;

/// Two frames a step, so that there are set-points between the steps.
const FRAME_US: u64 = 5_000;
/// A set-point may lie this far outside, in drawing units: rounding.
const EDGE_TOLERANCE: f64 = 0.001;
/// Longer inputs draw for hours and find nothing that shorter ones do not.
const MOST_BYTES: usize = 2048;

fuzz_target!(|input: &[u8]| {
    let input = &input[..input.len().min(MOST_BYTES)];
    let mut bench = Bench::new(FRAME_US, Calibration::default());
    bench.longest_dwell = Micros::from_millis(100);
    let mut sent = Vec::new();
    let mut answers = 0;
    for piece in input.split_inclusive(|byte| matches!(byte, 1 | 2)) {
        let (bytes, pause) = match piece {
            [bytes @ .., pause @ (1 | 2)] => (bytes, *pause),
            bytes => (bytes, 0),
        };
        sent.extend_from_slice(bytes);
        for answer in bench.send(0, bytes) {
            answers += 1;
            check_message(&answer.bytes, answer.is_error);
        }
        match pause {
            1 => drop(bench.tick()),
            2 => drop(bench.rest()),
            _ => {}
        }
    }
    assert_eq!(answers, lines(&sent), "replies to {}", sent.escape_ascii());
    bench.rest();
    bench.frames.iter().for_each(check_frame);
});

/// Lines that have ended and are not blank.
fn lines(sent: &[u8]) -> usize {
    let mut pieces: Vec<&[u8]> = sent
        .split(|byte| matches!(byte, 0 | b'\r' | b'\n'))
        .collect();
    pieces.pop();
    let blank = |line: &&[u8]| line.iter().all(|byte| matches!(byte, b' ' | b'\t'));
    pieces.len() - pieces.iter().filter(|line| blank(line)).count()
}

fn check_message(message: &str, is_error: bool) {
    let start = if is_error { "error INFO:\"" } else { "ok " };
    assert!(message.starts_with(start), "{message:?}");
    let text = message.strip_suffix("\r\n\0");
    let text = text.unwrap_or_else(|| panic!("{message:?} ends wrongly"));
    assert!(!text.contains(['\r', '\n', '\0']), "{message:?}");
    assert!(text.matches('"').count() % 2 == 0, "{message:?}");
    assert!(
        message.len() < 256 || text.starts_with("ok name:"),
        "{message:?}"
    );
}

fn check_frame(frame: &Frame) {
    let position = frame.set_point.position;
    let [x, y, z] = [position.x, position.y, position.z].map(|coordinate| coordinate.to_f64());
    if !model::inside(x, y) {
        let (near_x, near_y) = model::closest(x, y);
        let outside = (near_x - x).hypot(near_y - y);
        assert!(outside <= EDGE_TOLERANCE, "outside by {outside}: {frame:?}");
    }
    assert!((0.0..=1000.0).contains(&z), "Z: {frame:?}");
    for pulse in frame.set_point.pulses {
        assert!(
            (500.0..=2500.0).contains(&pulse.to_f64()),
            "pulse: {frame:?}"
        );
    }
}
