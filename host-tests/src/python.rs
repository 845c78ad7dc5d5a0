//! Programs in Python, with packages as they are on PyPI.

use crate::desktop::target_folder;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, PoisonError};

/// What has to be on the computer, and cannot be had from cargo.
const NEEDS: &str = "This test needs Python 3 with venv, a C compiler and Python's headers (for netifaces), and \
                     PyPI; on Debian: apt install python3-venv python3-dev gcc";

/// A program of `host-tests/clients`.
pub fn client(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("clients")
        .join(file)
}

/// Python with these packages, in an environment of this name that is made once and kept in the target folder.
///
/// # Panics
/// When it cannot be made.
pub fn python(name: &str, packages: &[&str]) -> PathBuf {
    // Tests side by side may want the same one, and it is made once.
    static TURN: Mutex<()> = Mutex::new(());
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let environment = target_folder().join(name);
    let python = environment.join("bin/python");
    // Written last: an environment without it was not finished.
    let finished = environment.join("finished");
    let content = packages.join(" ");
    if fs::read_to_string(&finished).is_ok_and(|packages| packages == content) {
        return python;
    }
    // A half-made one is in the way.
    let _ = fs::remove_dir_all(&environment);
    prepare(
        Command::new("python3")
            .args(["-m", "venv"])
            .arg(&environment),
    );
    prepare(
        Command::new(&python)
            .args(["-m", "pip", "install", "--quiet"])
            .args(packages),
    );
    fs::write(finished, content).expect("the target folder can be written");
    python
}

/// Runs a step of the preparation.
fn prepare(command: &mut Command) {
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

/// Runs a program that is to be content.
///
/// # Panics
/// When it is not, with what it said.
pub fn run(command: &mut Command) {
    let Output {
        status,
        stdout,
        stderr,
    } = command
        .output()
        .unwrap_or_else(|error| panic!("{command:?} cannot be started: {error}"));
    let said = String::from_utf8_lossy(&stdout);
    println!("{said}");
    assert!(
        status.success(),
        "the client is not content:\n{said}{}",
        String::from_utf8_lossy(&stderr)
    );
}
