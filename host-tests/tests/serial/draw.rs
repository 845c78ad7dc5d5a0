//! `desktop draw --dialect lasaur`: a file in millimetres.

use host_tests::desktop::{Run, draw};
use std::fs;

fn draw_text(text: &str) -> Run {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("job.lasaur");
    fs::write(&script, text).unwrap();
    draw(&script, &["--dialect", "lasaur"])
}

#[test]
fn a_job_is_drawn_and_told() {
    let run = draw_text(
        "G90\nM80\nG0F8000\nG1F1500S128\nG0X10Y10\nG1X40\nG1Y40\n\nG1X10\nG1Y10\nM81\nS0\nG0X0Y0F8000",
    );
    assert_eq!(run.status, 0, "{}", run.stderr);
    for (field, value) in [
        ("commands", "12"),
        ("errors", "0"),
        ("strokes", "1"),
        ("pen down", "120.0 mm"),
        ("points limited", "0"),
    ] {
        assert_eq!(run.field(field), value, "{field}, in:\n{}", run.stdout);
    }
    for output in ["air assist is on", "air assist is off"] {
        assert!(run.stdout.contains(output), "{}", run.stdout);
    }
}

#[test]
fn refused_lines_are_named() {
    let run = draw_text("G90\nG1X\n(comment)\n\nM99\n^\u{1}G90\n");
    assert_eq!(run.status, 1);
    assert_eq!(run.field("errors"), "4");
    for refused in [
        "line 2: ",
        "line 3: ",
        "line 5: ",
        "line 6: the checksum is wrong",
    ] {
        assert!(
            run.stderr.contains(refused),
            "{refused:?} is not in:\n{}",
            run.stderr
        );
    }
}

#[test]
fn a_stopped_arm_says_so_once_and_a_limit_in_the_end() {
    let run = draw_text("G0X5\n!\nG0X6\nG0X7\n~\nG0X8Y8\nG0X60\n");
    assert_eq!(run.status, 1);
    assert_eq!(run.field("errors"), "2");
    assert_eq!(
        run.stderr.matches("stopped by '!'").count(),
        1,
        "{}",
        run.stderr
    );
    assert!(
        run.stderr.contains("edge of the table, X2"),
        "{}",
        run.stderr
    );
}

#[test]
fn long_jobs_take_little_memory() {
    let mut job = String::from("S100\nG1F30000\n");
    for n in 0..20_000 {
        job += &format!("G1X{}.{}Y{}\n", n % 40, n % 10, n % 70);
    }
    let run = draw_text(&job);
    assert_eq!(run.status, 0, "{}", run.stderr);
    assert_eq!(run.field("commands"), "20002");
    assert!(run.peak_kb < 100_000, "{} kB", run.peak_kb);
}
