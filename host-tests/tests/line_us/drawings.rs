//! Drawings that the arm keeps, over TCP and across restarts.

use host_tests::desktop::{Client, Desktop};
use std::fs;
use std::path::Path;

fn start(folder: &Path) -> Desktop {
    Desktop::start(folder, &["--speed", "max"])
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("there is room for a folder")
}

fn feather() -> String {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/feather.gcode");
    fs::read_to_string(file).expect("the example is there")
}

/// Records a text, all of it sent before the first reply is read.
fn record(client: &mut Client, slot: u8, text: &str) {
    assert_eq!(client.say(&format!("M28 S{slot}")), "ok ");
    client.send(text);
    for line in text.lines() {
        assert_eq!(client.reply(), "ok ", "{line}");
    }
}

#[test]
fn a_drawing_is_recorded_kept_and_drawn() {
    let text = feather();
    let folder = folder();
    let arm = start(folder.path());
    let mut client = arm.client();
    record(&mut client, 32, &text);
    assert_eq!(client.say("M114"), "ok X:1000 Y:1000 Z:1000");
    assert_eq!(client.say("M29"), "ok ");
    arm.cut_power();

    let arm = start(folder.path());
    let mut client = arm.client();
    let length = "G54 X0 Y0 S1\n".len() + text.len();
    assert_eq!(
        client.say("M20"),
        format!("ok FS:\"/0000032.txt-{length};\"")
    );
    // It ends at home, where the arm is not now.
    assert_eq!(client.say("G01 X1100 Y500 Z1000"), "ok X:1100 Y:500 Z:1000");
    assert_eq!(client.say("M23 K32"), "ok ");
    client.wait_for_place("ok X:1000 Y:1000 Z:1000");
    arm.stop();
    // The settings' file is what it was.
    let size = |name: &str| fs::metadata(folder.path().join(name)).map(|file| file.len());
    assert_eq!(size("state").ok(), Some(32 * 1024));
    assert_eq!(size("state.drawings").ok(), Some(1440 * 1024));
}

#[test]
fn what_is_not_ended_is_not_there() {
    let folder = folder();
    let arm = start(folder.path());
    let mut client = arm.client();
    record(&mut client, 1, "G01 X1100 Y500 Z0\n");
    assert_eq!(client.say("M29"), "ok ");
    let list = client.say("M20");
    // Replaced, but the client is gone before the end.
    record(&mut client, 1, &feather());
    drop(client);
    arm.wait_for_leavers(1);
    assert_eq!(arm.client().say("M20"), list);
    // And again, but the power is.
    let mut client = arm.client();
    record(&mut client, 1, &feather());
    arm.cut_power();
    let arm = start(folder.path());
    let mut client = arm.client();
    assert_eq!(client.say("M20"), list);
    assert_eq!(
        client.say("M39"),
        "ok FSUsed:4064 FSTotal:1463040 FSFree:1458976 FSPercent:0"
    );
}

#[test]
fn a_file_of_garbage_holds_no_drawing_and_can_be_used() {
    let folder = folder();
    let mut noise: u32 = 1;
    let garbage: Vec<u8> = (0..1440 * 1024)
        .map(|_| {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (noise >> 24) as u8
        })
        .collect();
    fs::write(folder.path().join("state.drawings"), garbage).expect("a file can be written");
    let arm = start(folder.path());
    let mut client = arm.client();
    assert_eq!(client.say("M20"), "ok FS:\"\"");
    record(&mut client, 4, "G28\n");
    assert_eq!(client.say("M29"), "ok ");
    assert_eq!(client.say("M20"), "ok FS:\"/0000004.txt-17;\"");
}
