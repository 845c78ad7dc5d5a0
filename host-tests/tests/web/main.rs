//! The desktop arm met over HTTP and WebSocket: the contract in `docs/api.md`, and clients that break every
//! rule.

mod api;
mod drawings;
mod hostile;
mod web_socket;

use host_tests::desktop::Desktop;
use tempfile::TempDir;

/// An arm in a folder of its own.
fn arm(arguments: &[&str]) -> (Desktop, TempDir) {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let arm = Desktop::start(folder.path(), arguments);
    (arm, folder)
}
