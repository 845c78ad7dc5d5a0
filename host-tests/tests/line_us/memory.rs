//! What the arm remembers when it is started again.

use host_tests::desktop::Desktop;
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

#[test]
fn a_state_file_of_garbage_starts_with_defaults_and_can_be_used() {
    let mut noise: u32 = 1;
    let garbage: Vec<u8> = (0..40_000)
        .map(|_| {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (noise >> 24) as u8
        })
        .collect();
    for contents in [
        &garbage[..],
        &garbage[..10],
        &[0; 32 * 1024],
        &[0; 5000],
        b"not a flash at all\n",
        b"",
    ] {
        let folder = folder();
        fs::write(folder.path().join("state"), contents).expect("a file can be written");
        let arm = start(folder.path());
        assert_eq!(arm.client().say("M550"), "ok MACHINENAME:line-us");
        assert_eq!(calibration(&arm), "0.00,0.00,0.00");
        assert_eq!(arm.client().say("M550 Pafter"), "ok MACHINENAME:after");
        arm.cut_power();
        let arm = start(folder.path());
        assert_eq!(
            arm.client().say("M550"),
            "ok MACHINENAME:after",
            "over {} bytes of garbage",
            contents.len()
        );
    }
}

#[test]
fn a_torn_state_file_still_starts() {
    let folder = folder();
    let arm = start(folder.path());
    arm.client().say("M550 Pfirst");
    arm.cut_power();
    let state = folder.path().join("state");
    let whole = fs::read(&state).expect("the state is there");
    assert!(!whole.is_empty());
    // Each byte wrong, and the file cut there.
    for at in 0..whole.len() * 2 {
        let mut torn = whole.clone();
        match whole.len().checked_sub(at + 1) {
            Some(end) => torn[end] ^= 0x55,
            None => torn.truncate(at - whole.len()),
        }
        fs::write(&state, &torn).expect("a file can be written");
        let reply = start(folder.path()).client().say("M550");
        assert!(
            reply == "ok MACHINENAME:first" || reply == "ok MACHINENAME:line-us",
            "tear {at}: {reply:?}"
        );
    }
}
