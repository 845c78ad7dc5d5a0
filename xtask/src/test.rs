//! Everything that must pass.

use anyhow::Result;
use std::path::Path;
use std::process::Command;
use std::time::Instant;
use xtask::board::{Board, own_cargo, root, run};
use xtask::emulator::QEMU;
use xtask::ready::Owner;
use xtask::toolchain::require;

/// Runs all checks, the quick ones first, up to the first that fails.
pub fn everything(setup: bool) -> Result<()> {
    require(QEMU.0, QEMU.1, setup)?;
    crate::browser::require_programs(setup)?;
    step("format", || run(cargo().args(["fmt", "--all", "--check"])))?;
    step("lints", || {
        run(cargo().args([
            "clippy",
            "--workspace",
            "--all-targets",
            "--locked",
            "--",
            "-D",
            "warnings",
        ]))
    })?;
    step("documentation", || {
        run(cargo()
            .args([
                "doc",
                "--workspace",
                "--no-deps",
                "--document-private-items",
            ])
            .env("RUSTDOCFLAGS", "-D warnings"))
    })?;
    step("tests", || {
        run(cargo().args(["test", "--workspace", "--locked"]))
    })?;
    step("page", || crate::browser::test(setup))?;
    step("fuzzing", fuzz)?;
    step("lints for the chips", || {
        Board::Virt.lint(&["virt", "echo", "bench"], &["bench"], setup)?;
        Board::CHIPS
            .into_iter()
            .try_for_each(|board| board.lint(&["esp", "bare"], &[], setup))
    })?;
    step("emulator", || {
        let newer = Board::Virt.build_version("9.0.0", setup)?;
        let firmware = Board::Virt.build(Board::Virt.binary(), &[], setup)?;
        run(cargo()
            .args([
                "test",
                "--package",
                "host-tests",
                "--features",
                "emulator",
                "--test",
                "emulator",
                "--test",
                "emulator_update",
                "--",
                "--test-threads=2",
            ])
            .env("QUILL_VIRT_FIRMWARE", firmware)
            .env("QUILL_VIRT_UPDATE", newer))
    })?;
    for board in Board::CHIPS {
        step(&format!("image for {}", board.name()), || {
            println!(
                "{}",
                crate::image::image(board, &Owner::default(), setup)?.display()
            );
            Ok(())
        })?;
    }
    step("sizes", || crate::table::sizes(setup))?;
    step("instructions", || {
        crate::table::bench(&xtask::bench::measure(setup)?, false);
        Ok(())
    })
}

/// Fuzzes for a short while, where there is a nightly compiler to do it with.
fn fuzz() -> Result<()> {
    let nightly = Command::new("cargo")
        .args(["+nightly", "--version"])
        .env_remove("CARGO")
        .output();
    let fuzzer = Command::new("cargo").args(["fuzz", "--version"]).output();
    if !nightly.is_ok_and(|output| output.status.success()) {
        println!("skipped: there is no nightly compiler");
        return Ok(());
    }
    if !fuzzer.is_ok_and(|output| output.status.success()) {
        println!("skipped: cargo install cargo-fuzz --locked");
        return Ok(());
    }
    for target in ["session", "lasaur"] {
        let mut fuzz = Command::new("cargo");
        for variable in ["CARGO", "RUSTUP_TOOLCHAIN"] {
            fuzz.env_remove(variable);
        }
        fuzz.current_dir(root().join("host-tests")).args([
            "+nightly",
            "fuzz",
            "run",
            target,
            "--",
            "-max_total_time=20",
        ]);
        run(&mut fuzz)?;
    }
    Ok(())
}

fn step(name: &str, work: impl FnOnce() -> Result<()>) -> Result<()> {
    println!("\n== {name}");
    let start = Instant::now();
    work()?;
    println!("== {name}: {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

fn cargo() -> Command {
    let mut cargo = own_cargo();
    cargo.current_dir(root() as &Path);
    cargo
}
