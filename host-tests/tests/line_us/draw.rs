//! `desktop draw`: a file instead of a client.

use host_tests::desktop::{Run, draw};
use host_tests::model;
use std::fmt::Write;
use std::fs;
use std::path::Path;

fn draw_text(text: &str, arguments: &[&str]) -> Run {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let script = folder.path().join("script.gcode");
    fs::write(&script, text).expect("a file can be written");
    draw(&script, arguments)
}

#[test]
fn the_summary_tells_what_was_drawn() {
    // 67 steps down, 40 of 5 units (10 mm), 67 up, 20 of 15 units (15 mm), 67 down, 40 along y, 67 up.
    let run = draw_text(
        "G01 Z0\nG01 X1200\nG01 Z1000\nG01 X900\nG01 Z0\n\n; a comment\nG01 Y800\nG01 Z1000\n",
        &[],
    );
    assert_eq!(run.status, 0, "{}", run.stderr);
    for (field, value) in [
        ("commands", "8"),
        ("errors", "0"),
        ("strokes", "2"),
        ("pen down", "20.0 mm"),
        ("pen up", "15.0 mm"),
        ("points limited", "0"),
        ("time of the arm", "0 min 3.7 s"),
    ] {
        assert_eq!(run.field(field), value, "{field}, in:\n{}", run.stdout);
    }
}

#[test]
fn the_picture_knows_paper_and_lift() {
    // The arm goes to and fro below the nib, which stays over its place: the lengths are those of a vertical lift.
    let run = draw_text(
        "G31 S0;100;300;200 P1.2\nG01 Z0\nG01 X1200\nG01 Z1000\nG01 X900\nG01 Z0\nG01 Y800\nG01 Z1000\n",
        &[],
    );
    assert_eq!(run.status, 0, "{}", run.stderr);
    for (field, value) in [
        ("strokes", "2"),
        ("pen down", "20.0 mm"),
        ("pen up", "15.0 mm"),
        ("time of the arm", "0 min 3.7 s"),
    ] {
        assert_eq!(run.field(field), value, "{field}, in:\n{}", run.stdout);
    }
}

#[test]
fn a_refused_line_is_named_and_the_exit_status_is_1() {
    let run = draw_text(
        "G01 Z0\nG01 X1100\n\nG02 X5 Y5\nG01 X1200\r\n; comment\nG01 Q7",
        &[],
    );
    assert_eq!(run.status, 1);
    assert_eq!(run.field("errors"), "2");
    assert_eq!(run.field("commands"), "6");
    for refused in [
        "line 4: unknown command 'G02'",
        "line 7: unknown parameter Q",
    ] {
        assert!(
            run.stderr.contains(refused),
            "{refused:?} is not in:\n{}",
            run.stderr
        );
    }
}

#[test]
fn long_lines_are_counted_as_one() {
    let long = "x".repeat(100_000);
    let run = draw_text(&format!("G28\n{long}\nG28\nundefined\n"), &[]);
    assert_eq!(run.status, 1);
    assert_eq!(run.field("commands"), "4");
    for refused in ["line 2: ", "line 4: "] {
        assert!(
            run.stderr.contains(refused),
            "{refused:?} is not in:\n{}",
            run.stderr
        );
    }
}

#[test]
fn an_empty_file_is_drawn_at_once() {
    let run = draw_text("", &[]);
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert_eq!(run.field("commands"), "0");
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let run = draw(Path::new("/no/such/file.gcode"), &[]);
    assert_ne!(run.status, 0);
    assert!(run.stderr.contains("/no/such/file.gcode"), "{}", run.stderr);
}

/// A row of the trace: time, then x, y, z and the three pulses.
fn rows(text: &str) -> Vec<(u64, [f64; 6])> {
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some("time_us,x,y,z,shoulder_us,elbow_us,pen_us")
    );
    lines
        .map(|line| {
            let (time, rest) = line.split_once(',').expect("a row has fields");
            let fields: Vec<f64> = rest
                .split(',')
                .zip([3, 3, 3, 4, 4, 4])
                .map(|(field, decimals)| {
                    let part = field.split_once('.').map_or("", |(_, part)| part);
                    assert_eq!(part.len(), decimals, "decimals of {field:?} in {line:?}");
                    field.parse().expect("a field is a number")
                })
                .collect();
            let fields = fields.try_into().expect("a row has seven fields");
            (time.parse().expect("a time is a number"), fields)
        })
        .collect()
}

/// The trace of the built program against the model, for an example and a frame.
fn traced_as_the_model_says(example: &str, frame_us: u64) {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../examples")
        .join(example);
    let trace = folder.path().join("trace.csv");
    let run = draw(
        &file,
        &[
            "--frame-us",
            &frame_us.to_string(),
            "--trace",
            &trace.to_string_lossy(),
        ],
    );
    assert_eq!(run.status, 0, "{}", run.stderr);
    let rows = rows(&fs::read_to_string(&trace).expect("the trace is there"));
    let program = fs::read_to_string(&file).expect("the example is there");
    let steps: Vec<model::Step> = model::frames(&program, frame_us).collect();
    for (row, step) in rows.iter().zip(&steps) {
        let at = format!("{example}, line {}, at {} us", step.line, step.time_us);
        assert_eq!(row.0, step.time_us, "{at}: the time");
        let expected = step.position.into_iter().chain(step.pulses_us);
        let names = ["x", "y", "z", "shoulder", "elbow", "pen"];
        for ((name, expected), got) in names.iter().zip(expected).zip(row.1) {
            let tolerance = if name.len() == 1 { 0.01 } else { 0.1 };
            assert!(
                (got - expected).abs() <= tolerance,
                "{at}: {name} is {got}, expected {expected}"
            );
        }
    }
    assert_eq!(rows.len(), steps.len(), "rows of the trace of {example}");
}

#[test]
fn the_trace_of_an_example_is_what_the_model_says() {
    traced_as_the_model_says("rose.gcode", 10_000);
}

#[test]
fn the_trace_at_an_odd_frame_is_what_the_model_says() {
    traced_as_the_model_says("hello.gcode", 3_003);
}

#[test]
fn a_hundred_thousand_moves_need_little_memory() {
    let mut text = String::from("G94 S30\nG01 Z0\n");
    for step in 0..100_000_u32 {
        let angle = f64::from(step) * 0.37;
        let (x, y) = (1200.0 + 300.0 * angle.cos(), 300.0 * angle.sin());
        writeln!(text, "G01 X{x:.3} Y{y:.3}").expect("memory is enough");
    }
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let picture = folder.path().join("picture.svg");
    let trace = folder.path().join("trace.csv");
    let run = draw_text(
        &text,
        &[
            "--picture",
            &picture.to_string_lossy(),
            "--trace",
            &trace.to_string_lossy(),
        ],
    );
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert_eq!(run.field("commands"), "100002");
    println!(
        "at most {} kB; {} of the arm",
        run.peak_kb,
        run.field("time of the arm")
    );
    assert!(run.peak_kb > 1000, "the memory was not seen at all");
    assert!(run.peak_kb < 64 * 1024, "{} kB", run.peak_kb);
}
