//! What the arm does not take, and where it does not start.

use super::{Bench, READY, ask, field, told};
use crate::release::Release;
use host_tests::desktop::{Desktop, binary};
use host_tests::manifest::SigningKey;
use std::fs;
use std::process::Command;

/// What would end an arm later, with another error.
const UNABLE: [&str; 2] = ["--air", "/nowhere/at/all"];

#[test]
fn a_refusal_leaves_everything_as_it_is() {
    let bench = Bench::new();
    let arm = bench.start(&[]);
    let mut client = arm.client();
    let stranger = Release {
        key: SigningKey::from_bytes(&[7; 32]),
        ..Release::script("")
    };
    assert_eq!(
        ask(&mut client, stranger),
        "error INFO:\"the signature is wrong\""
    );
    let elsewhere = Release {
        board: "desktop-pdp11-v6".into(),
        ..Release::script("")
    };
    assert_eq!(
        ask(&mut client, elsewhere),
        "error INFO:\"it is for another board\""
    );
    assert_eq!(told(&mut client), "refused: it is for another board");
    assert_eq!(arm.count(READY), 1);
    assert!(!bench.slot("first").exists() && !bench.slot("second").exists());
    let choice = fs::read(bench.slot("choice")).expect("there is a choice");
    assert_eq!(choice, [0xff; 8192]);
}

#[test]
fn without_a_place_for_it_there_is_no_update() {
    let bench = Bench::new();
    let arm = Desktop::start(bench.path(), &[]);
    let mut client = arm.client();
    assert_eq!(
        ask(&mut client, Release::script("")),
        "error INFO:\"this board has no place for another firmware\""
    );
    assert_eq!(field(&mut client, "ResetReason"), "program start");
}

#[test]
fn whoever_is_elsewhere_does_not_reach_an_arm_that_believes_the_published_key() {
    for (option, rest) in [
        ("--line-us", &["--web", "none"][..]),
        ("--web", &["--line-us", "127.0.0.1:0"]),
        ("--serial-tcp", &["--line-us", "127.0.0.1:0"]),
    ] {
        for address in ["0.0.0.0:0", "[::]:0", "192.0.2.1:0"] {
            let bench = Bench::new();
            let run = Command::new(binary())
                .current_dir(bench.path())
                .args(["--firmware", "firmware", option, address])
                .args(rest)
                .args(UNABLE)
                .output()
                .expect("the desktop arm's program can be started");
            assert_eq!(run.status.code(), Some(1), "{option} {address}");
            let why = String::from_utf8_lossy(&run.stderr);
            let expected = format!("error: {option} {address} with --firmware: ");
            assert!(why.starts_with(&expected), "{why}");
            let made = fs::read_dir(bench.path()).expect("the folder is there");
            assert_eq!(made.count(), 0, "{option} {address} leaves something");
        }
    }
}

#[test]
fn a_place_that_is_something_else_stays_as_it_is() {
    let bench = Bench::new();
    fs::create_dir(bench.slot("")).expect("a folder can be made");
    fs::write(bench.slot("choice"), "of wines").expect("a file can be written");
    let run = Command::new(binary())
        .current_dir(bench.path())
        .args(["--firmware", "firmware", "--line-us", "127.0.0.1:0"])
        .args(UNABLE)
        .output()
        .expect("the desktop arm's program can be started");
    assert_eq!(run.status.code(), Some(1));
    let why = String::from_utf8_lossy(&run.stderr);
    assert!(why.contains("firmware/choice: "), "{why}");
    assert_eq!(
        fs::read(bench.slot("choice")).expect("it is there"),
        b"of wines"
    );
}
