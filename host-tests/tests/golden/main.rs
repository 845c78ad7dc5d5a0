//! Set-points of the core, step by step, against the independent model: every example, and the edges
//! of everything.

mod cases;
mod compare;

use cases::{DECIMAL_STEPS, EDGE_CASES};
use compare::{against_model, calibrated_against_model};
use std::path::{Path, PathBuf};

/// A frame that no step is a multiple of.
const ODD_FRAME_US: u64 = 3_003;

/// The drawings of `examples/`.
fn examples() -> Vec<(PathBuf, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let mut found: Vec<_> = std::fs::read_dir(&folder)
        .expect("examples/ is there")
        .map(|entry| entry.expect("examples/ can be listed").path())
        .filter(|path| path.extension().is_some_and(|end| end == "gcode"))
        .map(|path| {
            let text = std::fs::read_to_string(&path).expect("an example can be read");
            (path, text)
        })
        .collect();
    found.sort();
    assert!(
        found.len() >= 4,
        "only {} examples in {}",
        found.len(),
        folder.display()
    );
    found
}

fn examples_at(frame_us: u64) {
    for (path, text) in examples() {
        let name = path
            .file_name()
            .expect("a file has a name")
            .to_string_lossy();
        let count = against_model(&name, &text, frame_us).unwrap_or_else(|off| panic!("{off}"));
        println!("{name}: {count} set-points, {frame_us} us apart, agree");
        assert!(count > 1000, "{name} has {count} set-points only");
    }
}

#[test]
fn every_example_is_drawn_as_the_model_says() {
    examples_at(10_000);
}

#[test]
fn every_example_is_the_same_drawing_at_an_odd_frame() {
    examples_at(ODD_FRAME_US);
}

fn edge_cases_at(frame_us: u64) {
    let off: Vec<String> = EDGE_CASES
        .iter()
        .filter_map(|(name, text)| against_model(name, text, frame_us).err())
        .collect();
    assert!(
        off.is_empty(),
        "{} of {} cases:\n{}",
        off.len(),
        EDGE_CASES.len(),
        off.join("\n")
    );
}

#[test]
fn edge_cases_are_drawn_as_the_model_says() {
    edge_cases_at(10_000);
}

#[test]
fn edge_cases_are_the_same_at_an_odd_frame() {
    edge_cases_at(ODD_FRAME_US);
}

#[test]
fn edge_cases_are_the_same_at_the_frame_of_a_chip() {
    edge_cases_at(20_000);
}

#[test]
fn steps_are_counted_in_the_numbers_as_typed() {
    for program in DECIMAL_STEPS {
        against_model("decimal steps", program, 10_000).unwrap_or_else(|off| panic!("{off}"));
    }
}

#[test]
fn a_calibration_is_added_to_the_angles() {
    for offsets in [
        [3.5, -2.25, 10.0],
        [-40.0, 40.0, -90.0],
        [100.0, -100.0, 60.0],
    ] {
        for (name, text) in EDGE_CASES {
            calibrated_against_model(name, text, 10_000, offsets)
                .unwrap_or_else(|off| panic!("offsets {offsets:?}: {off}"));
        }
    }
}

#[test]
fn the_comparison_notices_what_is_wrong() {
    // The core is asked for another drawing than the model: each difference is found and named.
    let compare = compare::programs;
    let base = "G01 X1100 Z0\nG01 X1200";
    for (other, what) in [
        ("G01 X1100 Z0\nG01 X1205", "steps"),
        ("G01 X1100 Z0\nG01 X1200 Y1000.02", "Y"),
        ("G01 X1100 Z0.02\nG01 X1200", "Z"),
        ("G01 X1100 Z0\nG94 S6\nG01 X1200", "replies"),
    ] {
        let off = compare("base", other, base, 10_000, [0.0; 3]).expect_err(other);
        assert!(off.contains(what), "{other}: {off}");
    }
    let off = compare("base", base, base, 10_000, [0.02, 0.0, 0.0]).expect_err("offset");
    assert!(off.contains("shoulder"), "{off}");
}
