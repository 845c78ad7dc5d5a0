//! The official Python client, unmodified, draws with the desktop arm.

use host_tests::desktop::Desktop;
use host_tests::python::{client, python, run};
use std::process::Command;

#[test]
fn the_official_python_client_draws_with_the_desktop_arm() {
    let python = python("lineus-client", &["lineus==1.0.3"]);
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let arm = Desktop::start(folder.path(), &["--speed", "max"]);
    run(Command::new(python)
        .arg(client("lineus_client.py"))
        .arg(arm.address().ip().to_string()));
}
