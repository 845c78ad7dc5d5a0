//! When moves are answered, and what becomes of the pen.

use host_tests::desktop::Desktop;
use std::thread;
use std::time::{Duration, Instant};

fn arm(arguments: &[&str]) -> (tempfile::TempDir, Desktop) {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let arm = Desktop::start(folder.path(), arguments);
    (folder, arm)
}

/// A hundred times slower than life, and without a wave before the greeting, which would take more than a
/// minute.
fn slow_arm() -> (tempfile::TempDir, Desktop) {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let fast = Desktop::start(folder.path(), &["--speed", "max"]);
    assert_eq!(fast.client().say("M291 S2"), "ok ");
    fast.stop();
    let arm = Desktop::start(folder.path(), &["--speed", "0.01"]);
    (folder, arm)
}

/// X, Y, Z of a reply.
fn place(reply: &str) -> [i32; 3] {
    let numbers: Vec<i32> = reply
        .split(['X', 'Y', 'Z', ':', ' '])
        .filter_map(|word| word.parse().ok())
        .collect();
    numbers
        .try_into()
        .unwrap_or_else(|_| panic!("{reply:?} is no place"))
}

#[test]
fn a_move_from_rest_is_answered_while_the_arm_still_has_its_way_to_go() {
    // 670 ms become more than a minute.
    let (_folder, arm) = slow_arm();
    let (mut drawer, mut watcher) = (arm.client(), arm.client());
    assert_eq!(drawer.say("G01 Z0"), "ok X:1000 Y:1000 Z:0");
    let [_, _, z] = place(&watcher.say("M114"));
    assert!(z > 500, "answered when the arm was at Z {z} already");
}

#[test]
fn a_move_in_motion_is_answered_when_the_prior_move_has_completed() {
    let (_folder, arm) = arm(&["--speed", "4"]);
    let (mut drawer, mut watcher) = (arm.client(), arm.client());
    // 67 steps of 10 ms, then 400 of them at the smallest step.
    drawer.say("G94 S1");
    drawer.say("G01 Z0");
    assert_eq!(drawer.say("G01 X1400"), "ok X:1400 Y:1000 Z:0");
    let [x, _, z] = place(&watcher.say("M114"));
    assert!(z <= 15, "answered when the prior move was at Z {z} only");
    assert!(x < 1400, "answered when the move itself had ended");
}

#[test]
fn a_second_move_in_motion_is_not_answered_before_the_first_has_completed() {
    let (_folder, arm) = slow_arm();
    let (mut drawer, mut watcher) = (arm.client(), arm.client());
    drawer.say("G01 Z0");
    drawer.send("G01 X1400\n");
    assert!(drawer.hears_nothing_for(Duration::from_millis(300)));
    let [x, _, z] = place(&watcher.say("M114"));
    assert!((x, z > 0) == (1000, true), "X {x} Z {z}");
}

#[test]
fn questions_are_answered_in_motion() {
    let (_folder, arm) = slow_arm();
    let mut client = arm.client();
    client.say("G01 Z0");
    for (question, answer) in [
        ("M114", "ok X:1000 Y:1000 Z:"),
        ("M114 S", "ok S:135.00 E:45.00 P:"),
        ("M115", "ok CONNECTMODE:"),
        ("M122", "ok name:"),
        ("M550", "ok MACHINENAME:"),
        ("G94 S4", "ok "),
        ("G54 X5", "ok "),
    ] {
        let reply = client.say(question);
        assert!(reply.starts_with(answer), "{question}: {reply:?}");
    }
}

#[test]
fn a_drawing_takes_the_time_of_its_steps() {
    // 67 + 500 + 67 + 34 steps: 6.68 s, in a tenth of that.
    let (_folder, arm) = arm(&["--speed", "10"]);
    let mut client = arm.client();
    let begun = Instant::now();
    for line in ["G94 S1", "G01 Z0", "G01 X1500", "G01 Z1000", "G28"] {
        client.say(line);
    }
    client.wait_for_place("ok X:1000 Y:1000 Z:1000");
    // Never faster; how much slower is up to the computer that runs this.
    let took = begun.elapsed();
    assert!(took >= Duration::from_millis(650), "done in {took:?}");
}

#[test]
fn out_of_reach_goes_to_the_closest_point_lifts_the_pen_and_says_so() {
    let (_folder, arm) = arm(&["--speed", "max"]);
    let mut client = arm.client();
    client.say("G01 X1800 Y0 Z0");
    let reply = client.say("G01 X2500 Y0 Z0");
    assert!(
        reply.starts_with("ok X:1950 Y:0 Z:1000 INFO:\""),
        "{reply:?}"
    );
    client.wait_for_place("ok X:1950 Y:0 Z:1000");
    let reply = client.say("G01 X0 Y0 Z1000");
    assert!(
        reply.starts_with("ok X:500 Y:0 Z:1000 INFO:\""),
        "{reply:?}"
    );
    client.say("G01 X510 Y300 Z0");
    let reply = client.say("G01 X720 Y-300");
    assert!(
        reply.starts_with("ok X:720 Y:-300 Z:0 INFO:\""),
        "{reply:?}"
    );
}

#[test]
fn the_pen_is_lifted_some_time_after_its_client_has_gone() {
    let (_folder, arm) = arm(&["--speed", "5", "--lift-after", "1"]);
    let mut drawer = arm.client();
    drawer.say("G01 X1200 Z0");
    let mut watcher = arm.client();
    watcher.wait_for_place("ok X:1200 Y:1000 Z:0");
    drop(drawer);
    watcher.wait_for_place("ok X:1200 Y:1000 Z:1000");
}

#[test]
fn the_pen_is_not_lifted_before_its_time() {
    let (_folder, arm) = arm(&["--speed", "10", "--lift-after", "100000"]);
    let mut drawer = arm.client();
    drawer.say("G01 Z0");
    let mut watcher = arm.client();
    watcher.wait_for_place("ok X:1000 Y:1000 Z:0");
    drop(drawer);
    arm.wait_for_leavers(1);
    thread::sleep(Duration::from_millis(200));
    assert_eq!(watcher.say("M114"), "ok X:1000 Y:1000 Z:0");
}

#[test]
fn the_pen_stays_down_when_another_client_draws_on() {
    // The pen would be lifted 20 s after the first client has gone, in 2 s here.
    let (_folder, arm) = arm(&["--speed", "10", "--lift-after", "20"]);
    let mut first = arm.client();
    let mut second = arm.client();
    first.say("G01 Z0");
    second.wait_for_place("ok X:1000 Y:1000 Z:0");
    drop(first);
    arm.wait_for_leavers(1);
    second.say("G01 X1100");
    thread::sleep(Duration::from_millis(2500));
    assert_eq!(second.say("M114"), "ok X:1100 Y:1000 Z:0");
}

#[test]
fn a_client_that_only_listened_does_not_lift_the_drawers_pen() {
    let (_folder, arm) = arm(&["--speed", "10", "--lift-after", "1"]);
    let (mut drawer, listener) = (arm.client(), arm.client());
    drawer.say("G01 Z0");
    drawer.wait_for_place("ok X:1000 Y:1000 Z:0");
    drop(listener);
    arm.wait_for_leavers(1);
    thread::sleep(Duration::from_millis(300));
    assert_eq!(drawer.say("M114"), "ok X:1000 Y:1000 Z:0");
}
