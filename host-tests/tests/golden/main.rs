//! Set-points of the core, step by step, against the independent model: every example, and the edges
//! of everything.

mod cases;
mod compare;

use cases::{BARE_MOVES, DECIMAL_STEPS, EDGE_CASES};
use compare::{against_model, fitted_against_model};
use host_tests::model::Fitting;
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
            let fitting = Fitting {
                offsets_deg: offsets,
                ..Fitting::NONE
            };
            fitted_against_model(name, text, 10_000, fitting)
                .unwrap_or_else(|off| panic!("offsets {offsets:?}: {off}"));
        }
    }
}

/// Paper and lift of arms that are not exact.
const FITTINGS: [Fitting; 5] = [
    Fitting {
        map: [0.0, 100.0, 300.0, 200.0],
        ..Fitting::NONE
    },
    Fitting {
        map: [-500.0, 500.0, -500.0, 500.0],
        ..Fitting::NONE
    },
    Fitting {
        shift_mm: 0.85,
        ..Fitting::NONE
    },
    Fitting {
        map: [120.0, -40.0, 0.0, 333.0],
        shift_mm: -2.0,
        ..Fitting::NONE
    },
    Fitting {
        offsets_deg: [3.5, -2.25, 1.5],
        map: [0.0, 100.0, 300.0, 200.0],
        shift_mm: 2.0,
    },
];

#[test]
fn paper_and_lift_are_compensated_as_the_model_says() {
    let mut off = Vec::new();
    for fitting in FITTINGS {
        for (name, text) in EDGE_CASES {
            if let Err(why) = fitted_against_model(name, text, ODD_FRAME_US, fitting) {
                off.push(format!("{fitting:?}: {why}"));
            }
        }
    }
    assert!(off.is_empty(), "{} cases:\n{}", off.len(), off.join("\n"));
}

#[test]
fn examples_on_uneven_paper_with_a_crooked_lift() {
    for (path, text) in examples() {
        let name = path.to_string_lossy();
        for fitting in FITTINGS {
            fitted_against_model(&name, &text, 10_000, fitting)
                .unwrap_or_else(|off| panic!("{fitting:?}: {off}"));
        }
    }
}

#[test]
fn bare_moves_go_where_the_model_says() {
    for fitting in FITTINGS.into_iter().chain([Fitting::NONE]) {
        for (name, text) in BARE_MOVES {
            fitted_against_model(name, text, 10_000, fitting)
                .unwrap_or_else(|off| panic!("{fitting:?}: {off}"));
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
        let off = compare("base", other, base, 10_000, Fitting::NONE).expect_err(other);
        assert!(off.contains(what), "{other}: {off}");
    }
    for (fitting, what) in [
        (
            Fitting {
                offsets_deg: [0.02, 0.0, 0.0],
                ..Fitting::NONE
            },
            "shoulder",
        ),
        (
            Fitting {
                map: [1.0; 4],
                ..Fitting::NONE
            },
            "pen",
        ),
        (
            Fitting {
                shift_mm: 0.05,
                ..Fitting::NONE
            },
            "shoulder",
        ),
    ] {
        let off = compare("base", base, base, 10_000, fitting).expect_err(what);
        assert!(off.contains(what), "{fitting:?}: {off}");
    }
}
