//! Several clients, and how they leave.

use host_tests::desktop::{Client, Desktop};
use std::fmt::Write;

fn arm() -> (tempfile::TempDir, Desktop) {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let arm = Desktop::start(
        folder.path(),
        &["--speed", "max", "--lift-after", "1000000"],
    );
    (folder, arm)
}

#[test]
fn four_clients_are_served_and_the_fifth_is_told_why_not() {
    let (_folder, arm) = arm();
    let mut four: Vec<Client> = (0..4).map(|_| arm.client()).collect();
    for _ in 0..2 {
        let mut fifth = arm.connect();
        let farewell = fifth.reply();
        assert!(
            farewell.starts_with("error INFO:\"") && farewell.ends_with('"'),
            "{farewell:?}"
        );
        assert!(fifth.is_closed(), "the fifth client is kept");
    }
    for client in &mut four {
        assert_eq!(client.say("M114"), "ok X:1000 Y:1000 Z:1000");
    }
}

#[test]
fn a_place_that_becomes_free_is_taken_by_the_next() {
    let (_folder, arm) = arm();
    let mut four: Vec<Client> = (0..4).map(|_| arm.client()).collect();
    for gone in 1..=8 {
        drop(four.remove(0));
        arm.wait_for_leavers(gone);
        let mut next = arm.client();
        assert_eq!(next.say("M550"), "ok MACHINENAME:line-us");
        four.push(next);
    }
}

#[test]
fn a_fifth_client_that_sends_at_once_hears_why_as_well() {
    let (_folder, arm) = arm();
    let _four: Vec<Client> = (0..4).map(|_| arm.client()).collect();
    let mut fifth = arm.connect();
    fifth.send("G28\n".repeat(100));
    assert!(fifth.reply().starts_with("error INFO:\""));
}

#[test]
fn scale_and_origin_belong_to_the_connection() {
    let (_folder, arm) = arm();
    let (mut scaled, mut plain) = (arm.client(), arm.client());
    scaled.say("G54 X100 Y0 S2.5");
    assert_eq!(plain.say("G01 X900 Y100"), "ok X:900 Y:100 Z:1000");
    assert_eq!(scaled.say("G01 X200 Y100"), "ok X:600 Y:250 Z:1000");
    drop(scaled);
    arm.wait_for_leavers(1);
    // A new connection in the same place begins anew.
    let mut next = arm.client();
    assert_eq!(next.say("G01 X900 Y100"), "ok X:900 Y:100 Z:1000");
}

#[test]
fn speed_and_position_belong_to_all() {
    // Slow, so that the speed can be seen: the steps of G94 S30 take 0.14 s, those of S1 4 s.
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let trace = folder.path().join("trace.csv");
    let trace_argument = trace.to_string_lossy().into_owned();
    let arm = Desktop::start(
        folder.path(),
        &["--speed", "max", "--trace", &trace_argument],
    );
    let (mut one, mut other) = (arm.client(), arm.client());
    one.say("G01 Z0");
    one.wait_for_place("ok X:1000 Y:1000 Z:0");
    assert_eq!(other.say("M114"), "ok X:1000 Y:1000 Z:0");
    one.say("G94 S25");
    other.say("G01 X1400");
    one.wait_for_place("ok X:1400 Y:1000 Z:0");
    drop((one, other));
    arm.stop();
    let rows = std::fs::read_to_string(trace).expect("the trace is there");
    let on_the_way = rows
        .lines()
        .filter(|row| {
            row.split(',')
                .nth(1)
                .and_then(|x| x.parse().ok())
                .is_some_and(|x: f64| x > 1000.0 && x < 1400.0)
        })
        .count();
    assert_eq!(on_the_way, 15, "400 units in steps of 25 are 16 steps");
}

#[test]
fn moves_of_two_clients_take_turns() {
    let (_folder, arm) = arm();
    let (mut one, mut other) = (arm.client(), arm.client());
    for _ in 0..50 {
        one.send("G01 X1100\n");
        other.send("G01 X1200\n");
        assert_eq!(one.reply(), "ok X:1100 Y:1000 Z:1000");
        assert_eq!(other.reply(), "ok X:1200 Y:1000 Z:1000");
    }
}

/// 200 moves, the last of them to (1250, 700, 1000).
fn drawing() -> String {
    let mut text = String::from("G01 X1000 Y700 Z0\n");
    for step in 1..=198 {
        writeln!(text, "G01 X{}.5 Y{}", 1000 + step, 700 + step % 7).expect("memory is enough");
    }
    text + "G01 X1250 Y700 Z1000\n"
}

#[test]
fn what_was_received_before_a_client_closed_is_executed() {
    let (_folder, arm) = arm();
    let mut client = arm.connect();
    client.send(drawing());
    drop(client);
    arm.client().wait_for_place("ok X:1250 Y:700 Z:1000");
}

#[test]
fn what_was_received_before_a_client_finished_sending_is_answered() {
    let (_folder, arm) = arm();
    let mut client = arm.client();
    client.send(drawing());
    client.finish_sending();
    let last = (0..200).map(|_| client.reply()).last();
    assert_eq!(last.as_deref(), Some("ok X:1250 Y:700 Z:1000"));
    assert!(client.is_closed());
}

#[test]
fn clients_that_die_in_motion_leave_the_arm_usable() {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let arm = Desktop::start(folder.path(), &["--speed", "50"]);
    // More of them than the arm has places.
    for _ in 0..6 {
        let mut client = arm.client();
        client.say("G94 S1");
        client.say("G01 X1500 Y1000 Z0");
        client.send("G01 X1000\nG01 X1400\n");
        client.die();
    }
    // Whatever had been received of theirs is done by then.
    arm.wait_for_leavers(6);
    let mut next = arm.client();
    next.say("G94 S30");
    next.say("G28");
    next.wait_for_place("ok X:1000 Y:1000 Z:1000");
    assert_eq!(next.say("G01 X1100"), "ok X:1100 Y:1000 Z:1000");
}

#[test]
fn a_client_that_dies_in_the_middle_of_a_line_leaves_nothing_behind() {
    let (_folder, arm) = arm();
    for _ in 0..5 {
        let mut client = arm.client();
        client.send("G01 X1500 Y");
        client.die();
    }
    let mut next = arm.client();
    assert_eq!(next.say("M114"), "ok X:1000 Y:1000 Z:1000");
}
