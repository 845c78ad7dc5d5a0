//! The page of the arm: its functions under Node, and the page itself in Chromium against the desktop arm.

use anyhow::Result;
use std::process::Command;
use xtask::board::{own_cargo, root, run, target_dir};
use xtask::toolchain::require;

/// Programs, and Debian's packages that have them.
const NEEDS: [(&str, &str); 3] = [("node", "nodejs"), ("npm", "npm"), ("chromium", "chromium")];

/// Makes sure that what the tests of the page need is there; the npm client's test needs a part of it.
pub fn require_programs(setup: bool) -> Result<()> {
    NEEDS
        .into_iter()
        .try_for_each(|(program, package)| require(program, package, setup))
}

/// Runs all tests of the page.
pub fn test(setup: bool) -> Result<()> {
    require_programs(setup)?;
    let tests = root().join("host-tests/browser");
    run(own_cargo()
        .current_dir(root())
        .args(["build", "--locked", "--package", "firmware"])
        .args(["--bin", "desktop"]))?;
    // Playwright without a browser of its own, as the lock file has it.
    run(Command::new("npm").current_dir(&tests).args([
        "ci",
        "--no-audit",
        "--no-fund",
        "--silent",
    ]))?;
    run(Command::new("node")
        .current_dir(root().join("firmware/web"))
        .arg("--test"))?;
    run(Command::new("node")
        .current_dir(&tests)
        .args(["--test", "--test-concurrency=1"])
        .env("QUILL_DESKTOP", target_dir().join("debug/desktop")))
}
