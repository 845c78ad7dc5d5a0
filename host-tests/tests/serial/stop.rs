//! Stops: by `!`, at the edge of the table, and what others are told.

use host_tests::desktop::serial::{SerialPort, with_serial_tcp};
use host_tests::desktop::{Desktop, wait_until};
use protocol_core::motion::PLAN_SEGMENTS;
use std::fmt::Write;
use std::time::Duration;

/// Moves that take hours: more than the plan holds, and fewer than the receive buffer.
const MOVES: usize = 50;

fn a_long_job() -> String {
    let mut job = String::from("S255\nG1F6\n");
    for round in 0..MOVES {
        let _ = writeln!(job, "G1X{}", 1 + round % 2);
    }
    job
}

#[test]
fn a_stop_is_done_at_once_while_a_line_waits() {
    let folder = tempfile::tempdir().unwrap();
    let (arm, _, mut port) = with_serial_tcp(folder.path(), &["--speed", "20"]);
    let mut client = arm.client();
    assert_eq!(port.say("G30"), "");
    port.send(a_long_job());
    // So many moves wait, the next one does not fit.
    for line in 0..2 + PLAN_SEGMENTS {
        assert_eq!(port.line(), "", "{line}");
    }
    port.send("!");
    let mut replies: Vec<String> = (PLAN_SEGMENTS..MOVES).map(|_| port.line()).collect();
    // One or two are under way, or on the way to it.
    replies.retain(|reply| !reply.is_empty());
    assert!(replies.len() > MOVES - PLAN_SEGMENTS - 3, "{replies:?}");
    assert!(replies.iter().all(|reply| reply == "!R"), "{replies:?}");
    // Frames pass meanwhile, and the arm stands.
    let places: Vec<String> = (0..50).map(|_| client.say("M114")).collect();
    let place = |text: &str| text.split(" Z").next().map(str::to_owned);
    assert!(
        places.iter().all(|there| place(there) == place(&places[0])),
        "{places:?}"
    );
    // And it goes on from there.
    port.send("~");
    assert_eq!(port.say("G0X3Y3F8000"), "");
    port.wait_for_place("X8.000Y8.000V");
    assert!(client.say("G01 X1000 Y0").starts_with("ok "));
}

#[test]
fn a_stop_is_done_while_the_host_does_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tty");
    let arm = Desktop::start(folder.path(), &["--serial", path.to_str().unwrap()]);
    let mut port = SerialPort::open(&path);
    assert!(port.line().starts_with("# LasaurGrbl "));
    // More than the terminal keeps, and the outbox.
    port.send("?\n".repeat(400));
    port.send("!");
    let mut client = arm.client();
    wait_until("the stop", || client.say("G01 X1200").starts_with("error "));
    // Each line had its reply, up to those for which the buffer had no room.
    let mut replies = Vec::new();
    while !port.hears_nothing_for(Duration::from_millis(100)) {
        replies.push(port.line());
    }
    let statuses = replies
        .iter()
        .take_while(|reply| reply.starts_with('X'))
        .count();
    assert!(statuses > 100, "{replies:?}");
    assert!(
        replies[statuses..]
            .iter()
            .all(|reply| matches!(&**reply, "!B" | "!R")),
        "{replies:?}"
    );
    port.send("\n~");
    assert_eq!(port.say("G90"), "");
}

#[test]
fn line_us_clients_are_told_that_the_machine_is_stopped() {
    let folder = tempfile::tempdir().unwrap();
    let (arm, _, mut port) = with_serial_tcp(folder.path(), &[]);
    let mut client = arm.client();
    assert!(client.say("G01 X1200 Y500").starts_with("ok "));
    // The second one waits for the first: it is answered when the machine stops.
    client.send("G01 X1300 Y500\n");
    port.send("!");
    let waiting = client.reply();
    assert!(
        waiting.starts_with("error INFO:\"") && waiting.contains("stopped"),
        "{waiting}"
    );
    assert_eq!(client.say("G28"), waiting);
    assert!(client.say("M114").starts_with("ok "));
    assert_eq!(port.say("G90"), "!R");
    port.send("~");
    assert_eq!(port.say("G90"), "");
    assert!(client.say("G28").starts_with("ok "));
}

#[test]
fn the_edge_of_the_table_is_a_limit() {
    for (line, flag, place) in [
        ("G1X-10Y30F6000", "L1", "X0.000Y"),
        ("G1X60Y30F6000", "L2", "X50.000Y"),
        ("G1X20Y-10F6000", "L3", "Y0.000V"),
        ("G1X20Y100F6000", "L4", "Y90.000V"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let (_arm, _, mut port) = with_serial_tcp(folder.path(), &["--speed", "20"]);
        assert_eq!(port.say("G30"), "");
        assert_eq!(port.say("G1X20Y30F6000"), "");
        assert_eq!(port.say(line), "");
        let stopped = loop {
            let reply = port.say("?");
            if !reply.starts_with('X') {
                break reply;
            }
        };
        assert_eq!(stopped, format!("!L{flag}"), "{line}");
        port.send("~");
        let status = port.say("?");
        assert!(status.contains(place), "{line}: {status}");
        assert_eq!(port.say("G0X10Y10"), "");
        port.wait_for_place("X15.000Y15.000V");
    }
}
