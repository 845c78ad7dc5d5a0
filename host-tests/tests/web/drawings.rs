//! Drawings that the machine holds.

use super::arm;
use host_tests::desktop::{Desktop, Motion, Web, wait_until};
use serde_json::json;
use std::fmt::Write;
use std::fs;

/// Zigzags with the pen down, larger than what the machine holds.
fn long_drawing() -> String {
    let mut text = String::from("G01 X800 Y0\nG01 Z0\n");
    for row in 0..3000 {
        let (x, y) = (800 + row % 7 * 100, row % 11 * 20 - 100);
        writeln!(text, "G01 X{x} Y{y}.{row:04} (row)").unwrap();
    }
    text + "G01 Z1000\n"
}

fn wait_for(web: Web, state: &str) {
    wait_until(&format!("a drawing that is {state}"), || {
        web.job_state() == state
    });
}

#[test]
fn the_machine_draws_by_itself_what_a_client_would() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("trace.csv");
    let arm = Desktop::start(
        folder.path(),
        &["--speed", "max", "--trace", &trace.to_string_lossy()],
    );
    let web = arm.web();
    let text = fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../examples/hello.gcode"
    ))
    .unwrap();
    let job = web.done("/api/job?name=hello%20world", &text);
    assert_eq!(
        (&job["name"], &job["id"]),
        (&json!("hello world"), &json!(1))
    );
    assert_eq!(job["lines"]["total"], text.lines().count());
    // Nobody is connected meanwhile, but whoever asks how it is.
    wait_for(web, "done");
    let job = &web.state()["job"];
    assert_eq!(job["lines"]["done"], job["lines"]["total"]);
    assert_eq!(job["bytes"]["drawn"], text.len());
    assert_eq!(job["seconds"]["left"], 0);
    assert_eq!(web.get("/api/job/drawing").body, text.as_bytes());
    arm.stop();
    Motion::of(&trace).assert_is(&Motion::of_a_client(&text));
}

#[test]
fn time_and_reach_are_known_before_anything_is_drawn() {
    let (arm, _folder) = arm(&[]);
    // 34 steps, 67, 60, 67: 2.28 s; the last one goes too far.
    let job = arm.web().done(
        "/api/job",
        "G01 X1500\nG01 Z0\nG01 X1200\nG01 Z1000\n\n(far)\nG01 X9000 Y0 Z0",
    );
    let left = job["seconds"]["left"].as_u64().unwrap();
    assert!((2..=4).contains(&left), "{left} s");
    assert_eq!(
        job["out_of_reach"],
        json!({"count": 1, "line": 7, "note": "out of reach: going to the closest point, pen lifted"})
    );
}

#[test]
fn a_drawing_with_a_wrong_line_is_refused_whole() {
    let (arm, _folder) = arm(&[]);
    let web = arm.web();
    for (text, line) in [
        ("G01 X1200\nG5 P1\n", 2),
        ("G01 X1200\nM550 Px\n", 2),
        ("G01 X1200 X1\n", 1),
        ("G01 X1200\n\nG01 Y", 3),
    ] {
        let answer = web.post("/api/job", text);
        assert_eq!(answer.error(), (422, "refused_line".into()), "{text}");
        assert_eq!(answer.json()["line"], line, "{text}");
    }
    assert_eq!(web.state()["job"], json!(null));
    assert_eq!(web.state()["position"]["x"], 1000);
}

#[test]
fn a_drawing_pauses_between_two_lines_and_goes_back_when_it_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("trace.csv");
    let arm = Desktop::start(
        folder.path(),
        &["--speed", "20", "--trace", &trace.to_string_lossy()],
    );
    let web = arm.web();
    let strokes = "G01 X1200 Y0\nG01 Z0\nG01 Y400\nG01 Y-400\nG01 Y400\nG01 Y-400\nG01 Z1000\nG01 X1500\nG01 Z0\nG01 Y400\nG01 Z1000\n";
    web.done("/api/job", strokes);
    wait_until("the pen on the paper", || web.state()["pen"] == "down");
    assert_eq!(web.post("/api/job", "G28").error(), (409, "busy".into()));
    assert_eq!(
        web.post("/api/jog", r#"{"x":1}"#).error(),
        (409, "busy".into())
    );
    assert_eq!(web.done("/api/job/pause", "")["state"], "pausing");
    wait_for(web, "paused");
    let state = web.state();
    assert_eq!(state["position"], json!({"x": 1200, "y": -400, "z": 1000}));
    assert_eq!(state["job"]["lines"]["done"], 7);
    // Somebody has a look at the drawing.
    web.done("/api/move", r#"{"x":1000,"y":1000}"#);
    assert_eq!(
        web.post("/api/calibration", "").error(),
        (409, "busy".into())
    );
    web.done("/api/job/resume", "");
    wait_for(web, "done");
    arm.stop();
    let interrupted = strokes.replace(
        "G01 Z1000\nG01 X1500\n",
        "G01 Z1000\nG01 X1000 Y1000\nG01 X1200 Y-400\nG01 X1500\n",
    );
    Motion::of(&trace).assert_is(&Motion::of_a_client(&interrupted));
}

#[test]
fn a_drawing_pauses_at_once_where_that_is_wanted() {
    let (arm, _folder) = arm(&["--speed", "5"]);
    let web = arm.web();
    let mut text = String::from("G01 X1200 Y0\nG01 Z0\n");
    for row in 0..100 {
        writeln!(text, "G01 Y{}", row % 2 * 50).unwrap();
    }
    web.done("/api/job", &text);
    wait_until("the pen on the paper", || web.state()["pen"] == "down");
    web.done("/api/job/pause", r#"{"now":true}"#);
    wait_for(web, "paused");
    let state = web.state();
    assert_eq!(
        (&state["pen"], &state["position"]["z"]),
        (&json!("up"), &json!(1000))
    );
    let lines = state["job"]["lines"]["done"].as_u64().unwrap();
    assert!((2..102).contains(&lines), "{lines} lines");
    web.done("/api/job/resume", "");
    wait_until("the pen on the paper", || web.state()["pen"] == "down");
    web.done("/api/job/stop", "");
    wait_for(web, "stopped");
    assert_eq!(web.state()["pen"], "up");
    assert_eq!(
        web.post("/api/job/resume", "").error(),
        (409, "no_job".into())
    );
    // What is held can be had, and the next drawing begins.
    assert_eq!(web.get("/api/job/drawing").body, text.as_bytes());
    assert_eq!(web.done("/api/job", "G28")["id"], 2);
}

#[test]
fn a_drawing_larger_than_the_machine_holds_comes_in_pieces() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("trace.csv");
    let arm = Desktop::start(
        folder.path(),
        &["--speed", "max", "--trace", &trace.to_string_lossy()],
    );
    let web = arm.web();
    let text = long_drawing();
    let whole = web.post("/api/job", &text);
    assert_eq!(whole.error(), (413, "too_large".into()));
    assert_eq!(whole.json()["limit"], 65535);

    let piece = |from: usize, most: usize| {
        let end = (from + most).min(text.len());
        let end = text[..end].rfind('\n').map_or(0, |at| at + 1);
        &text[from..end.max(from)]
    };
    let lines = text.lines().count();
    let first = piece(0, 60_000);
    let job = web.done(
        &format!("/api/job?name=long&more=1&lines={lines}&seconds=99999"),
        first,
    );
    assert_eq!(
        (&job["lines"]["total"], &job["whole"]),
        (&json!(lines), &json!(false))
    );
    let mut sent = first.len();
    // A piece in the wrong place, a piece that is not whole, one with a wrong line.
    let more = |at: usize, body: &str, last: u8| {
        web.post(&format!("/api/job/more?id=1&at={at}&last={last}"), body)
    };
    let wrong = more(sent + 1, "G28\n", 0);
    assert_eq!(wrong.error(), (409, "wrong_place".into()));
    assert_eq!(wrong.json()["received"], sent);
    assert_eq!(more(sent, "G01 X1", 0).error(), (400, "bad_value".into()));
    let refused = more(sent, "G01 Y5\nG01 X1 X2\n", 0);
    assert_eq!(refused.error(), (422, "refused_line".into()));
    assert_eq!(refused.json()["line"], first.lines().count() + 2);
    while sent < text.len() {
        let piece = piece(sent, 20_000);
        let last = u8::from(sent + piece.len() == text.len());
        let answer = more(sent, piece, last);
        match answer.status {
            200 => sent += piece.len(),
            409 => assert_eq!(answer.error().1, "no_room"),
            other => panic!("{other}: {:?}", String::from_utf8_lossy(&answer.body)),
        }
    }
    wait_for(web, "done");
    let job = web.state()["job"].clone();
    assert_eq!(
        (&job["lines"]["done"], &job["whole"]),
        (&json!(lines), &json!(false))
    );
    assert_eq!(web.get("/api/job/drawing").status, 404);
    arm.stop();
    Motion::of(&trace).assert_is(&Motion::of_a_client(&text));
}

#[test]
fn the_pen_waits_in_the_air_for_the_next_piece() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("trace.csv");
    let arm = Desktop::start(folder.path(), &["--trace", &trace.to_string_lossy()]);
    let web = arm.web();
    let first = "G94 S30 P100\nG01 X1200 Y900\nG01 Z0\nG01 X1300\n";
    web.done("/api/job?more=1", first);
    wait_for(web, "waiting");
    wait_until("the pen in the air", || web.state()["moving"] == false);
    assert_eq!(
        web.state()["position"],
        json!({"x": 1300, "y": 900, "z": 1000})
    );
    web.done(
        &format!("/api/job/more?id=1&at={}&last=1", first.len()),
        "G01 X1400",
    );
    wait_for(web, "done");
    arm.stop();
    let expected = format!("{first}G01 Z1000\nG01 Z0\nG01 X1400\nG01 Z1000\n");
    Motion::of(&trace).assert_is(&Motion::of_a_client(&expected));
}

#[test]
fn line_us_clients_are_served_meanwhile() {
    let (arm, _folder) = arm(&["--speed", "20"]);
    let web = arm.web();
    let text = "G01 X1200 Y0\nG01 Y100\n".repeat(50);
    web.done("/api/job", &text);
    let mut client = arm.client();
    assert_eq!(client.say("G01 X1000 Y500"), "ok X:1000 Y:500 Z:1000");
    assert_eq!(
        client.say("M550 Probs-lineus"),
        "ok MACHINENAME:robs-lineus"
    );
    wait_for(web, "done");
    assert_eq!(web.state()["job"]["lines"]["done"], 100);
}
