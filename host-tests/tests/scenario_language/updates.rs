//! Updates and starts that are told.

use crate::{AT_HOME, CONNECTED, comes_true, fails, fails_after, leaves};

/// After [`CONNECTED`] and [`AT_HOME`].
const UPDATED: &str = r#"B hears hello ...
B sends M997 S"http://updates.example:8000/quill/scripted.txt"
B hears ok
the server offers 9.0.0
B sends M997
B hears ok INFO:"9.0.0 is in place and starts now"
"#;

#[test]
fn the_machine_runs_what_it_runs() {
    fails("the machine runs 9.0.0", "it runs the old firmware");
    fails(
        "cut the power\nthe machine runs the old firmware",
        "it runs nothing",
    );
    let updated = format!("{CONNECTED}{AT_HOME}{UPDATED}");
    let started = format!("{updated}the machine starts again\n");
    fails_after(
        &updated,
        "the machine runs 9.0.0",
        "it runs the old firmware",
    );
    fails_after(
        &started,
        "the machine runs the old firmware or 9.0.1",
        "it runs 9.0.0",
    );
    comes_true(&format!(
        "{started}the machine runs 9.0.1 or 9.0.0\nthe machine joins \"home\"\n"
    ));
}

#[test]
fn the_machine_starts_when_it_starts() {
    fails("the machine starts again", "it goes on");
    fails(
        "the firmware hangs\nthe machine starts again within 4 s",
        "it goes on",
    );
    leaves("the firmware hangs\nwait 6 s", "the machine starts again");
    let hung = format!("{CONNECTED}the firmware hangs\n");
    comes_true(&format!(
        "{hung}the machine starts again\nthe machine opens \"Line-us-Setup\"\n"
    ));
    comes_true(&format!(
        "{hung}the machine may start again\nwait 6 s\nthe machine opens \"Line-us-Setup\"\n"
    ));
    // It was one start.
    fails_after(
        &hung,
        "the machine starts again\nthe machine starts again",
        "it goes on",
    );
    // As long as it hangs it does nothing.
    fails_after(
        &hung,
        "A sends M114\nA hears ok ... within 4 s",
        "A hears nothing",
    );
}
