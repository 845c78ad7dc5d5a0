//! What hosts do, from connecting to the end of a job.

use host_tests::desktop::Desktop;
use host_tests::desktop::serial::{SerialPort, with_serial_tcp};
use host_tests::lasaur::host::{LasaurApp, LaserWeb};
use protocol_core::lasaur::VERSION;

fn square(host: &mut LasaurApp) {
    for line in [
        "G90",
        "M80",
        "G0F8000",
        "G1F3000",
        "S255",
        "G00X10.000Y10.000",
        "G01X30.000Y10.000",
        "G01X30.000Y40.000",
        "G01X10.000Y40.000",
        "G01X10.000Y10.000",
        "M81",
        "S0",
        "G0X0Y0F8000",
    ] {
        host.queue(line);
    }
}

fn lasaurapp(arm: &Desktop, port: &mut SerialPort) {
    let mut host = LasaurApp::default();
    // Connected: what is it?
    host.queue("?");
    port.serve(&mut host);
    let [status, skipped] = &host.lines[..] else {
        panic!("{:?}", host.lines);
    };
    assert!(
        status.starts_with('X') && status.ends_with(VERSION),
        "{status}"
    );
    assert_eq!(skipped, "");
    // Home.
    for lines in [&["!"][..], &["~", "G30"]] {
        host.lines.clear();
        lines.iter().for_each(|line| host.queue(line));
        port.serve(&mut host);
        let reply = if lines.len() == 1 { "!R" } else { "" };
        assert_eq!(host.lines, vec![reply; 2 * lines.len()]);
    }
    // G30 has answered when the plan has come to its end, the last frame is on its way.
    let status = port.say("?");
    let (x, rest) = status[1..].split_once('Y').unwrap();
    let y = rest.split_once('V').unwrap().0;
    for coordinate in [x, y] {
        let aside = coordinate.parse::<f64>().unwrap() - 5.0;
        assert!(aside.abs() < 0.5, "{status}");
    }
    // A job.
    host.lines.clear();
    square(&mut host);
    port.serve(&mut host);
    assert_eq!(host.lines, [""; 26]);
    // Once more round, stopped in the middle, and back to the origin.
    host.lines.clear();
    square(&mut host);
    port.serve(&mut host);
    host.lines.clear();
    host.queue("!");
    port.serve(&mut host);
    assert_eq!(host.lines, ["!R"; 2]);
    assert!(arm.said("air assist is on"));
    host.lines.clear();
    for line in ["~", "G90", "M81", "G0X0Y0F8000"] {
        host.queue(line);
    }
    port.serve(&mut host);
    assert_eq!(host.lines, [""; 8]);
    port.wait_for_place("X5.000Y5.000V");
}

#[test]
fn lasaurapp_over_tcp() {
    let folder = tempfile::tempdir().unwrap();
    let (arm, _, mut port) = with_serial_tcp(folder.path(), &["--speed", "20"]);
    lasaurapp(&arm, &mut port);
}

#[test]
fn lasaurapp_over_a_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tty");
    let arguments = ["--serial", path.to_str().unwrap(), "--speed", "20"];
    let arm = Desktop::start(folder.path(), &arguments);
    let mut port = SerialPort::open(&path);
    assert!(port.line().starts_with("# LasaurGrbl "));
    lasaurapp(&arm, &mut port);
}

#[test]
fn laserweb_probes_and_draws() {
    let folder = tempfile::tempdir().unwrap();
    let (_arm, _, mut port) = with_serial_tcp(folder.path(), &["--speed", "50"]);
    let replies = LaserWeb::PROBES.map(|probe| port.say(probe));
    assert!(replies[0].ends_with(VERSION), "{replies:?}");
    assert_eq!(replies[1..], ["U", "E", "E"]);
    let mut host = LaserWeb::default();
    let mut bytes = host.queue(&[
        "G90",
        "G0 X10 Y10",
        "G1 X30 F3000 S100",
        "G1 Y30",
        "G0 X0 Y0",
    ]);
    while !bytes.is_empty() {
        port.send(&bytes);
        bytes = host.receive(format!("{}\n", port.line()).as_bytes());
    }
    assert!(host.is_idle());
    port.wait_for_place("X5.000Y5.000V");
}
