//! The desktop arm updates itself from a web server, stays there if that works, and is back if it does not
//! (`docs/update.md`): the real program, with real sockets, files and restarts.

mod back;
mod drawing;
mod refused;
mod release;

use host_tests::desktop::{Client, Desktop, binary, wait_until};
use release::{NEW, Release};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// What an arm says last when it has started.
const READY: &str = "stop with Ctrl-C";

/// A folder of an arm that has place for another firmware.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("there is room for a folder");
        Self { folder }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// A file of the two firmwares.
    fn slot(&self, name: &str) -> PathBuf {
        self.path().join("firmware").join(name)
    }

    /// At rest its time is the wall's.
    fn start(&self, arguments: &[&str]) -> Desktop {
        let place = self.slot("").display().to_string();
        let arguments = [&["--speed", "max", "--firmware", &place], arguments].concat();
        Desktop::start(self.path(), &arguments)
    }

    /// Starts an arm, which runs the firmware that was built, and has it take a release.
    fn update(&self, release: Release) -> Desktop {
        let arm = self.start(&[]);
        assert!(arm.said("firmware first of "));
        let mut client = arm.client();
        assert_eq!(told(&mut client), "none");
        assert_eq!(
            ask(&mut client, release),
            "ok INFO:\"9.0.0 is in place and starts now\""
        );
        arm
    }
}

/// Tells an arm where a release is, has it ask, and gives the reply.
fn ask(client: &mut Client, release: Release) -> String {
    let address = release.serve();
    assert_eq!(client.say(&format!("M997 S\"{address}\"")), "ok ");
    client.say("M997")
}

/// What stands in quotation marks behind a word of M122.
fn field(client: &mut Client, name: &str) -> String {
    let reply = client.say("M122");
    let found = reply.split_once(&format!(" {name}:\""));
    let (_, value) = found.unwrap_or_else(|| panic!("no {name} in {reply:?}"));
    value.split('"').next().unwrap_or_default().to_owned()
}

/// What M122 says of updates.
fn told(client: &mut Client) -> String {
    field(client, "Update")
}

#[test]
fn a_new_firmware_that_works_stays() {
    let bench = Bench::new();
    let trace = bench.path().join("trace.csv");
    let port = bench.path().join("port");
    let arguments = [
        "--trace",
        &trace.display().to_string(),
        "--serial",
        &port.display().to_string(),
    ];
    let arm = bench.start(&arguments);
    assert_eq!(arm.program(), binary());
    let mut client = arm.client();
    assert_eq!(field(&mut client, "ResetReason"), "program start");
    // Something that is on paper before the update.
    for line in ["G01 X1200 Y0 Z0", "G01 X1400 Y0 Z0", "G01 X1400 Y0 Z1000"] {
        assert!(client.say(line).starts_with("ok"), "{line}");
    }
    client.wait_for_place("ok X:1400 Y:0 Z:1000");
    let terminal = fs::read_link(&port).expect("there is a serial port");
    assert_eq!(
        ask(&mut client, Release::program()),
        "ok INFO:\"9.0.0 is in place and starts now\""
    );
    arm.wait_to_say(READY, 2);
    assert_eq!(arm.program(), bench.slot("second"));
    let before = fs::read_to_string(&trace).expect("there is a trace");
    assert!(before.contains(",1400.000,0.000,1000.000,"), "{before}");
    let picture = fs::read_to_string(arm.picture()).expect("there is a picture");
    assert!(
        picture.contains("polyline"),
        "the drawing is gone:\n{picture}"
    );
    assert!(
        fs::symlink_metadata(&port).is_ok() && terminal.is_absolute(),
        "the serial port is gone"
    );

    let mut client = arm.client();
    assert_eq!(told(&mut client), "on trial, start 1 of 3");
    assert_eq!(field(&mut client, "ResetReason"), "firmware");
    assert_eq!(
        client.say("M997"),
        "error INFO:\"the firmware is on trial, try again in a minute\""
    );
    // While the arm moves, ten seconds of its time take no time.
    wait_until("the confirmation", || {
        for x in [1000, 1800] {
            assert!(client.say(&format!("G01 X{x} Y0 Z1000")).starts_with("ok"));
        }
        told(&mut client) == "none"
    });
    drop(client);
    arm.stop();
    let whole = fs::read_to_string(&trace).expect("there is a trace");
    assert!(whole.starts_with(&before), "the trace of before is gone");
    assert_eq!(whole.matches("time_us").count(), 1);
    assert!(whole.len() > before.len());

    for _ in 0..4 {
        let arm = bench.start(&arguments);
        assert_eq!(arm.program(), bench.slot("second"));
        let mut client = arm.client();
        assert_eq!(told(&mut client), "none");
        assert_eq!(field(&mut client, "ResetReason"), "program start");
        drop(client);
        arm.stop();
    }
    // Started by hand, a trace begins anew.
    let trace = fs::read_to_string(&trace).expect("there is a trace");
    assert!(trace.len() < whole.len());
}

#[test]
fn the_firmware_after_the_next_takes_the_first_place() {
    let bench = Bench::new();
    let arm = bench.update(Release::script(""));
    arm.wait_to_say(READY, 2);
    assert!(arm.said("firmware second of "));
    let mut client = arm.client();
    wait_until("the confirmation", || {
        for x in [1000, 1800] {
            assert!(client.say(&format!("G01 X{x} Y0 Z1000")).starts_with("ok"));
        }
        told(&mut client) == "none"
    });
    let second = fs::read(bench.slot("second")).expect("there is an image");
    let answer = ask(&mut client, Release::script("--lift-after 7"));
    assert_eq!(
        answer,
        format!("ok INFO:\"{NEW} is in place and starts now\"")
    );
    arm.wait_to_say(READY, 3);
    assert_eq!(arm.count("firmware first of "), 2);
    assert_eq!(told(&mut arm.client()), "on trial, start 1 of 3");
    let first = fs::read(bench.slot("first")).expect("there is an image");
    assert!(first.starts_with(b"#!/bin/sh\n") && first != second);
    assert_eq!(fs::read(bench.slot("second")).ok(), Some(second));
}
