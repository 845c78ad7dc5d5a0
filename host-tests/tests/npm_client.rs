//! The npm client, unmodified, draws with the desktop arm over its WebSocket.

use host_tests::desktop::{Desktop, target_folder};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The client as it is on npm.
const PACKAGE: &str = "@beardicus/line-us@2.1.0";
/// What has to be on the computer, and cannot be had from cargo.
const NEEDS: &str =
    "This test needs Node.js, npm, and the npm registry; on Debian: apt install nodejs npm";

/// A folder with the client, made once and kept in the target folder.
fn modules() -> PathBuf {
    let folder = target_folder().join("line-us-client");
    // Written last: a folder without it was not finished.
    let finished = folder.join("finished");
    if fs::read_to_string(&finished).is_ok_and(|package| package == PACKAGE) {
        return folder.join("node_modules");
    }
    // A half-made one is in the way.
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the target folder can be written");
    let mut install = Command::new("npm");
    install
        .args(["install", "--silent", "--no-audit", "--no-fund", "--prefix"])
        .arg(&folder)
        .arg(PACKAGE);
    let Output { status, stderr, .. } = install
        .output()
        .unwrap_or_else(|error| panic!("npm cannot be started: {error}.\n{NEEDS}"));
    let said = String::from_utf8_lossy(&stderr);
    assert!(status.success(), "npm failed:\n{said}\n{NEEDS}");
    fs::write(finished, PACKAGE).expect("the target folder can be written");
    folder.join("node_modules")
}

#[test]
fn the_npm_client_draws_with_the_desktop_arm() {
    let modules = modules();
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let arm = Desktop::start(folder.path(), &["--speed", "max"]);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("clients/line_us_client.js");
    let Output {
        status,
        stdout,
        stderr,
    } = Command::new("node")
        .env("NODE_PATH", modules)
        .arg(script)
        .arg(format!("ws://{}", arm.web().address()))
        .output()
        .unwrap_or_else(|error| panic!("node cannot be started: {error}.\n{NEEDS}"));
    assert!(
        status.success(),
        "the client is not content:\n{}{}",
        String::from_utf8_lossy(&stdout),
        String::from_utf8_lossy(&stderr)
    );
}
