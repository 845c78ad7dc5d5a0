//! The official Python client, unmodified, draws with the desktop arm.

use host_tests::desktop::{Desktop, target_folder};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The client as it is on PyPI.
const PACKAGE: &str = "lineus==1.0.3";
/// What has to be on the computer, and cannot be had from cargo.
const NEEDS: &str = "This test needs Python 3 with venv, a C compiler and Python's headers (for netifaces), and \
                     PyPI; on Debian: apt install python3-venv python3-dev gcc";

/// A virtual environment with the client, made once and kept in the target folder.
fn python() -> PathBuf {
    let environment = target_folder().join("lineus-client");
    let python = environment.join("bin/python");
    // Written last: an environment without it was not finished.
    let finished = environment.join("finished");
    if fs::read_to_string(&finished).is_ok_and(|package| package == PACKAGE) {
        return python;
    }
    // A half-made one is in the way.
    let _ = fs::remove_dir_all(&environment);
    run(Command::new("python3")
        .args(["-m", "venv"])
        .arg(&environment));
    run(Command::new(&python).args(["-m", "pip", "install", "--quiet", PACKAGE]));
    fs::write(finished, PACKAGE).expect("the target folder can be written");
    python
}

/// Runs a step of the preparation.
fn run(command: &mut Command) {
    let Output {
        status,
        stdout,
        stderr,
    } = command
        .output()
        .unwrap_or_else(|error| panic!("{command:?} cannot be started: {error}.\n{NEEDS}"));
    assert!(
        status.success(),
        "{command:?} failed:\n{}{}\n{NEEDS}",
        String::from_utf8_lossy(&stdout),
        String::from_utf8_lossy(&stderr)
    );
}

#[test]
fn the_official_python_client_draws_with_the_desktop_arm() {
    let python = python();
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let arm = Desktop::start(folder.path(), &["--speed", "max"]);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("clients/lineus_client.py");
    let Output {
        status,
        stdout,
        stderr,
    } = Command::new(python)
        .arg(script)
        .arg(arm.address().ip().to_string())
        .output()
        .expect("the virtual environment's Python can be started");
    let said = String::from_utf8_lossy(&stdout);
    println!("{said}");
    assert!(
        status.success(),
        "the client is not content:\n{said}{}",
        String::from_utf8_lossy(&stderr)
    );
}
