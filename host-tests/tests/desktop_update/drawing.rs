//! Updates and drawings of the page: neither costs the other anything.

use super::{Bench, READY};
use crate::release::Release;
use host_tests::desktop::{Desktop, Web, wait_until};
use std::thread;

const DRAWING: &str = "G01 X1200 Y0\nG01 Z0\nG01 X1500\nG01 X1200\nG01 Z1000\n";

fn start(bench: &Bench, speed: &str) -> Desktop {
    let place = bench.slot("").display().to_string();
    let arguments = [
        "--speed",
        speed,
        "--firmware",
        &place,
        "--lift-after",
        "3600",
    ];
    Desktop::start(bench.path(), &arguments)
}

/// Hands over a file, and gives status and message.
fn hand_over(web: Web, file: &[u8]) -> (u16, String) {
    let answer = web.request("POST", "/api/update", "", file);
    let told = answer.json();
    let message = told["message"].as_str().unwrap_or_default();
    (answer.status, message.to_owned())
}

#[test]
fn a_drawing_that_pauses_is_not_lost() {
    let bench = Bench::new();
    // A minute, which is how long an update waits for the arm, takes two seconds.
    let arm = start(&bench, "30");
    let web = arm.web();
    web.done("/api/job", DRAWING);
    web.done("/api/job/pause", "{\"now\":true}");
    wait_until("the pause", || web.job_state() == "paused");
    let file = Release::script("").file();
    let busy = "a drawing is under way, or the pen is down";
    assert_eq!(hand_over(web, &file), (409, busy.into()));
    assert_eq!(web.job_state(), "paused");
    web.done("/api/job/resume", "");
    wait_until("the end", || web.job_state() == "done");
    assert_eq!(hand_over(web, &file), (200, String::new()));
    arm.wait_to_say(READY, 2);
    assert!(arm.said("firmware second of "));
}

#[test]
fn no_drawing_begins_that_a_restart_would_end() {
    let bench = Bench::new();
    let arm = start(&bench, "1");
    let web = arm.web();
    let mut client = arm.client();
    assert_eq!(client.say("G01 X1000 Y500 Z0"), "ok X:1000 Y:500 Z:0");
    let file = Release::script("").file();
    let update = thread::spawn(move || hand_over(web, &file));
    wait_until("the update", || web.state()["update"]["phase"] == "waiting");
    let answer = web.post("/api/job", DRAWING);
    assert_eq!(answer.error(), (409, "busy".into()));
    assert_eq!(answer.json()["message"], "an update is under way");
    assert_eq!(client.say("G01 Z1000"), "ok X:1000 Y:500 Z:1000");
    let outcome = update.join().expect("the update is answered");
    assert_eq!(outcome, (200, String::new()));
    arm.wait_to_say(READY, 2);
}
