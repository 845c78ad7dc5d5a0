//! What hosts do when they connect, home, stop, move and run a job, byte by byte and in any pieces.

use host_tests::lasaur::host::{LasaurApp, LaserWeb};
use host_tests::lasaur::rig::Rig;
use protocol_core::lasaur::{BANNER, Step, VERSION};
use protocol_core::machine::StopReason;
use protocol_core::motion::{Assist, Feed, Intensity, Millimetres, Segment, TablePoint};

/// Pieces as they may be cut on the way, bytes at a time.
const CUTS: [usize; 6] = [1, 2, 3, 7, 16, 300];

/// Lets host and machine talk until neither has anything to say; the machine does a move each round.
fn talk(host: &mut LasaurApp, rig: &mut Rig, cut: usize) {
    let mut seen = rig.sent.len();
    let mut quiet = 0;
    while quiet < 50 {
        let bytes = host.send();
        bytes.chunks(cut).for_each(|piece| rig.receive(piece));
        if bytes.is_empty() {
            rig.work();
        }
        let answer = rig.sent[seen..].to_vec();
        seen = rig.sent.len();
        answer.chunks(cut).for_each(|piece| host.receive(piece));
        quiet = if bytes.is_empty() && answer.is_empty() {
            quiet + 1
        } else {
            0
        };
    }
}

fn connected(rig: &mut Rig) -> LasaurApp {
    let mut host = LasaurApp::default();
    host.receive(BANNER.as_bytes());
    assert_eq!(host.lines, [BANNER.trim_end()]);
    assert!(rig.sent.is_empty(), "{:?}", rig.sent);
    host
}

fn all(host: &mut LasaurApp, rig: &mut Rig, cut: usize, bodies: &[&str]) -> Vec<String> {
    host.lines.clear();
    bodies.iter().for_each(|body| host.queue(body));
    talk(host, rig, cut);
    assert!(host.is_idle());
    assert_eq!(host.unanswered, 0);
    host.lines.clone()
}

/// From the default offset.
fn place(x: i16, y: i16) -> TablePoint {
    TablePoint {
        x: Millimetres::new(x + 5),
        y: Millimetres::new(y + 5),
    }
}

fn seek(x: i16, y: i16) -> Step {
    Step::Move(Segment {
        to: place(x, y),
        feed: Feed::DEFAULT,
        intensity: Intensity::OFF,
    })
}

#[test]
fn lasaurapp_connects_and_asks_for_the_status() {
    for cut in CUTS {
        let mut rig = Rig::new(16);
        let mut host = connected(&mut rig);
        let status = format!("X0.000Y0.000V{VERSION}");
        assert_eq!(
            all(&mut host, &mut rig, cut, &["?"]),
            [status, String::new()]
        );
        // It sends nothing until it was told that it may.
        assert_eq!(rig.sent[0], 0x12);
    }
}

#[test]
fn lasaurapp_stops() {
    for cut in CUTS {
        let mut rig = Rig::new(2);
        let mut host = connected(&mut rig);
        all(&mut host, &mut rig, cut, &["G90", "G0X10Y0", "G0X20Y0"]);
        let stopped = all(&mut host, &mut rig, cut, &["!"]);
        assert_eq!(stopped, ["!R", "!R"], "{cut}");
        assert_eq!(rig.facts.stop, Some(StopReason::Requested));
        let replies = all(
            &mut host,
            &mut rig,
            cut,
            &["~", "G90", "M81", "G0X0Y0F8000"],
        );
        assert_eq!(replies, [""; 8], "{cut}");
        assert_eq!(
            rig.taken[2..],
            [Step::Output(Assist::Air, false), seek(0, 0)]
        );
    }
}

#[test]
fn lasaurapp_stops_in_the_middle_of_a_job() {
    for cut in CUTS {
        let mut rig = Rig::new(2);
        let mut host = connected(&mut rig);
        (0..20).for_each(|x| host.queue(&format!("G1X{x}Y1")));
        // Until the plan is full and the buffer too, so that it waits for 0x12.
        for _ in 0..200 {
            let bytes = host.send();
            let seen = rig.sent.len();
            bytes.chunks(cut).for_each(|piece| rig.receive(piece));
            host.receive(&rig.sent[seen..]);
        }
        assert!(!host.is_idle());
        let before = rig.taken.len();
        // Its button sends the byte at once; the queue is thrown away.
        rig.receive(b"!");
        assert_eq!(rig.facts.stop, Some(StopReason::Requested));
        assert_eq!(rig.taken.len(), before);
        assert!(rig.replies.iter().filter(|reply| *reply == b"!R\n").count() > 5);
        let mut host = LasaurApp::default();
        rig.receive(b"~\n");
        let replies = all(
            &mut host,
            &mut rig,
            cut,
            &["~", "G90", "M81", "G0X0Y0F8000"],
        );
        // The first line ends what was cut off by the stop, whatever that was.
        assert_eq!(replies, [""; 8], "{cut}");
        assert_eq!(
            rig.taken[before..],
            [Step::Output(Assist::Air, false), seek(0, 0)]
        );
    }
}

#[test]
fn lasaurapp_homes() {
    for cut in CUTS {
        let mut rig = Rig::new(16);
        let mut host = connected(&mut rig);
        assert_eq!(all(&mut host, &mut rig, cut, &["!"]), ["!R", "!R"]);
        assert_eq!(all(&mut host, &mut rig, cut, &["~", "G30"]), [""; 4]);
        assert_eq!(rig.taken, [Step::Home, seek(0, 0)]);
        let status = format!("X5.000Y5.000V{VERSION}");
        assert_eq!(all(&mut host, &mut rig, cut, &["?"])[0], status);
    }
}

#[test]
fn lasaurapp_runs_a_job() {
    for cut in CUTS {
        let mut rig = Rig::new(16);
        let mut host = connected(&mut rig);
        let square = [(10, 10), (40, 10), (40, 40), (10, 40), (10, 10)];
        let mut job = vec!["G90".to_string(), "M80".into(), "G0F8000".into()];
        job.extend(["G1F1500".to_string(), "S128".into()]);
        let mut expected = vec![Step::Output(Assist::Air, true)];
        for round in 0..8i16 {
            for (corner, &(x, y)) in square.iter().enumerate() {
                let code = if corner == 0 { "G00" } else { "G01" };
                job.push(format!("{code}X{x}.{:03}Y{y}.000", 125 * round));
                let eighths = 8 * (x + 5) + i32::from(round);
                let to = TablePoint {
                    x: Millimetres::from_bits(eighths << (Millimetres::FRACTION_BITS - 3)),
                    ..place(0, y)
                };
                let (rate, intensity) = if corner == 0 { (8000, 0) } else { (1500, 128) };
                expected.push(Step::Move(Segment {
                    to,
                    feed: Feed::new(rate),
                    intensity: Intensity(intensity),
                }));
            }
        }
        job.extend(["M81".to_string(), "S0".into(), "G0X0Y0F8000".into()]);
        expected.extend([Step::Output(Assist::Air, false), seek(0, 0)]);
        let job: Vec<&str> = job.iter().map(String::as_str).collect();
        let replies = all(&mut host, &mut rig, cut, &job);
        assert_eq!(replies, vec![""; 2 * job.len()], "{cut}");
        assert_eq!(rig.taken, expected);
        assert_eq!(
            rig.lost, 0,
            "the handshake keeps the buffer from overflowing"
        );
    }
}

#[test]
fn the_python_3_port_stops_in_a_line_of_its_own() {
    for cut in CUTS {
        let mut rig = Rig::roomy();
        let mut say = |bytes: &[u8]| {
            rig.sent.clear();
            bytes.chunks(cut).for_each(|piece| rig.receive(piece));
            rig.sent.escape_ascii().to_string()
        };
        assert_eq!(say(b"^\x80!\n*\x80!\n"), "!R\\n!R\\n");
        assert_eq!(say(b"^\x80~\n*\x80~\n"), "\\n\\n");
        assert_eq!(say(b"^\x98G90\n*\x98G90\n"), "\\n\\n");
    }
}

#[test]
fn laserweb_probes_and_goes_on_after_each_empty_reply() {
    for cut in CUTS {
        let mut rig = Rig::new(1);
        let mut host = LaserWeb::default();
        host.receive(BANNER.as_bytes());
        for probe in LaserWeb::PROBES {
            format!("{probe}\n")
                .as_bytes()
                .chunks(cut)
                .for_each(|piece| rig.receive(piece));
        }
        host.receive(&rig.sent);
        assert!(host.knows_the_machine());
        let status = format!("X0.000Y0.000V{VERSION}");
        assert_eq!(host.lines[1..], [status.as_str(), "U", "E", "E"]);
        let mut bytes = host.queue(&[
            "G90",
            "G0 X10 Y10",
            "G1 X20 F1500 S100",
            "G1 Y20",
            "G0 X0 Y0",
        ]);
        for _ in 0..20 {
            let seen = rig.sent.len();
            bytes.chunks(cut).for_each(|piece| rig.receive(piece));
            rig.work();
            bytes = host.receive(&rig.sent[seen..]);
        }
        assert!(host.is_idle());
        assert_eq!(rig.taken.len(), 4);
        assert_eq!(rig.facts.position, place(0, 0));
    }
}
