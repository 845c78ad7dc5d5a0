//! What the arm remembers when it is started again.

use host_tests::desktop::{Desktop, binary};
use std::fs;
use std::path::Path;

fn start(folder: &Path) -> Desktop {
    Desktop::start(folder, &["--speed", "max"])
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("there is room for a folder")
}

fn calibration(arm: &Desktop) -> String {
    let reply = arm.client().say("M122");
    let found = reply
        .split(' ')
        .find_map(|token| token.strip_prefix("Cal:"));
    found.unwrap_or_else(|| panic!("{reply:?}")).into()
}

#[test]
fn name_and_calibration_survive_a_restart() {
    let folder = folder();
    let arm = start(folder.path());
    let mut client = arm.client();
    assert_eq!(
        client.say("M550 P\"robs-lineus\""),
        "ok MACHINENAME:robs-lineus"
    );
    client.say("G01 X1040 Y990 Z950");
    // Sent in motion: the place where the arm comes to rest counts.
    assert_eq!(client.say("M374"), "ok ");
    assert_eq!(client.say("M114"), "ok X:1000 Y:1000 Z:1000");
    let before = calibration(&arm);
    assert_ne!(before, "0.00,0.00,0.00");
    drop(client);
    arm.stop();

    let arm = start(folder.path());
    let mut client = arm.connect();
    assert!(client.reply().contains(" NAME:robs-lineus "));
    assert_eq!(client.say("M550"), "ok MACHINENAME:robs-lineus");
    assert_eq!(calibration(&arm), before);
    assert_eq!(client.say("M374 Sclear"), "ok ");
    drop(client);
    arm.stop();

    let arm = start(folder.path());
    assert_eq!(calibration(&arm), "0.00,0.00,0.00");
    assert_eq!(arm.client().say("M550"), "ok MACHINENAME:robs-lineus");
}

#[test]
fn what_was_answered_survives_a_power_cut() {
    let folder = folder();
    for round in 0..5 {
        let arm = start(folder.path());
        let mut client = arm.client();
        if round > 0 {
            let expected = format!("ok MACHINENAME:name-{}", round - 1);
            assert_eq!(client.say("M550"), expected);
            assert_ne!(calibration(&arm), "0.00,0.00,0.00");
        }
        client.say(&format!("G01 X{} Y1000 Z1000", 1020 + round));
        client.say("M374");
        client.say(&format!("M550 Pname-{round}"));
        arm.cut_power();
    }
}

#[test]
fn a_name_can_be_changed_hundreds_of_times() {
    let folder = folder();
    let arm = start(folder.path());
    let mut client = arm.client();
    for round in 0..700 {
        let name = format!("a-rather-long-name-{round}");
        assert_eq!(
            client.say(&format!("M550 P{name}")),
            format!("ok MACHINENAME:{name}"),
            "round {round}"
        );
    }
    arm.cut_power();
    let reply = start(folder.path()).client().say("M550");
    assert_eq!(reply, "ok MACHINENAME:a-rather-long-name-699");
}

/// Noise of a length.
fn garbage(length: usize) -> Vec<u8> {
    let mut noise: u32 = 1;
    (0..length)
        .map(|_| {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (noise >> 24) as u8
        })
        .collect()
}

const STATE_SIZE: usize = 32 * 1024;

#[test]
fn a_state_file_of_garbage_starts_with_defaults_and_can_be_used() {
    for contents in [
        garbage(STATE_SIZE),
        vec![0; STATE_SIZE],
        vec![0x55; STATE_SIZE],
    ] {
        let folder = folder();
        fs::write(folder.path().join("state"), contents).expect("a file can be written");
        let arm = start(folder.path());
        assert_eq!(arm.client().say("M550"), "ok MACHINENAME:line-us");
        assert_eq!(calibration(&arm), "0.00,0.00,0.00");
        assert_eq!(arm.client().say("M550 Pafter"), "ok MACHINENAME:after");
        arm.cut_power();
        let arm = start(folder.path());
        assert_eq!(arm.client().say("M550"), "ok MACHINENAME:after");
    }
}

#[test]
fn a_file_that_is_no_state_stays_as_it_is() {
    for contents in [&b"not a flash at all\n"[..], b"", &garbage(STATE_SIZE + 1)] {
        let folder = folder();
        let file = folder.path().join("state");
        fs::write(&file, contents).expect("a file can be written");
        let run = std::process::Command::new(binary())
            .args(["--line-us", "127.0.0.1:0", "--picture"])
            .arg(folder.path().join("picture.svg"))
            .arg("--state")
            .arg(&file)
            .output()
            .expect("the desktop arm's program can be started");
        assert_eq!(run.status.code(), Some(1));
        let why = String::from_utf8_lossy(&run.stderr);
        assert!(why.contains("is not the state of an arm"), "{why}");
        assert_eq!(fs::read(&file).expect("it is still there"), contents);
    }
}

#[test]
fn a_state_file_with_a_wrong_byte_still_starts() {
    let folder = folder();
    let arm = start(folder.path());
    arm.client().say("M550 Pfirst");
    arm.cut_power();
    let state = folder.path().join("state");
    let whole = fs::read(&state).expect("the state is there");
    // Where the settings are, and here and there.
    for at in (0..80).chain((80..whole.len()).step_by(4001)) {
        let mut torn = whole.clone();
        torn[at] ^= 0x55;
        fs::write(&state, &torn).expect("a file can be written");
        let reply = start(folder.path()).client().say("M550");
        assert!(
            reply == "ok MACHINENAME:first" || reply == "ok MACHINENAME:line-us",
            "byte {at}: {reply:?}"
        );
    }
}
