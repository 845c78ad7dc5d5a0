//! The boards that can be built, and how.

use crate::toolchain::Toolchain;
use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// The program on this computer.
    Desktop,
    /// QEMU's `virt` machine.
    Virt,
    /// ESP32-C3.
    Esp32c3,
    /// ESP32-C6.
    Esp32c6,
    /// The first ESP32; needs Espressif's toolchain.
    Esp32,
    /// ESP32-S3; needs Espressif's toolchain.
    Esp32s3,
}

impl Board {
    /// The boards whose chip is on a module that can be bought.
    pub const CHIPS: [Self; 2] = [Self::Esp32c3, Self::Esp32c6];

    /// Its name, which is that of its feature.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Desktop => "desktop",
            Self::Virt => "virt",
            Self::Esp32c3 => "esp32c3",
            Self::Esp32c6 => "esp32c6",
            Self::Esp32 => "esp32",
            Self::Esp32s3 => "esp32s3",
        }
    }

    /// What manifests call it: a desktop's program is for one kind of processor and system, that of this
    /// computer.
    pub fn manifest_name(self) -> &'static str {
        match self {
            Self::Desktop => firmware::boards::desktop::slots::board(),
            other => other.name(),
        }
    }

    /// What the compiler calls it; `None` for this computer.
    pub const fn target(self) -> Option<&'static str> {
        match self {
            Self::Desktop => None,
            Self::Virt | Self::Esp32c3 => Some("riscv32imc-unknown-none-elf"),
            Self::Esp32c6 => Some("riscv32imac-unknown-none-elf"),
            Self::Esp32 => Some("xtensa-esp32-none-elf"),
            Self::Esp32s3 => Some("xtensa-esp32s3-none-elf"),
        }
    }

    /// The binary of the firmware for it.
    pub const fn binary(self) -> &'static str {
        match self {
            Self::Desktop => "desktop",
            Self::Virt => "virt",
            _ => "esp",
        }
    }

    /// Whether it is flashed onto something.
    pub const fn is_chip(self) -> bool {
        !matches!(self, Self::Desktop | Self::Virt)
    }

    /// Builds one of the firmware's binaries, and gives the file.
    pub fn build(self, binary: &str, extra_features: &[&str], setup: bool) -> Result<PathBuf> {
        self.built(binary, self.cargo("build", extra_features, setup)?)
    }

    fn built(self, binary: &str, mut cargo: Command) -> Result<PathBuf> {
        run(cargo.args(["--bin", binary]))?;
        let mut file = target_dir();
        file.extend(self.target());
        file.extend([self.profile(), binary]);
        if !file.exists() {
            bail!("{} is not where cargo should have put it", file.display());
        }
        Ok(file)
    }

    /// Builds the firmware as of another version, and gives a file that the next build does not overwrite.
    pub fn build_version(self, version: &str, setup: bool) -> Result<PathBuf> {
        let mut cargo = self.cargo("build", &[], setup)?;
        cargo.env("QUILL_VERSION", version);
        let file = self.built(self.binary(), cargo)?;
        let copy = file.with_file_name(format!("{}-{version}", self.binary()));
        std::fs::copy(&file, &copy).with_context(|| file.display().to_string())?;
        Ok(copy)
    }

    /// Looks for what clippy finds in the library and the given binaries.
    pub fn lint(self, binaries: &[&str], extra_features: &[&str], setup: bool) -> Result<()> {
        let mut cargo = self.cargo("clippy", extra_features, setup)?;
        cargo.arg("--lib");
        for binary in binaries {
            cargo.args(["--bin", binary]);
        }
        run(cargo.args(["--", "-D", "warnings"]))
    }

    const fn profile(self) -> &'static str {
        if matches!(self, Self::Desktop) {
            "release"
        } else {
            "chip"
        }
    }

    fn cargo(self, verb: &str, extra_features: &[&str], setup: bool) -> Result<Command> {
        let mut cargo = match self.target() {
            None => own_cargo(),
            Some(target) => Toolchain::find(target, setup)?.cargo(target),
        };
        let mut features = vec![self.name()];
        features.extend(extra_features);
        cargo
            .current_dir(root())
            .args([verb, "--locked", "--package", "firmware"])
            .args(["--profile", self.profile(), "--no-default-features"])
            .args(["--features", &features.join(",")]);
        if let Some(target) = self.target() {
            cargo.args(["--target", target]);
        }
        if extra_features.contains(&"bench") {
            // What is measured beside the core is compiled with the bench: for speed, to be fair to it.
            cargo.args(["--config", "profile.chip.package.firmware.opt-level=3"]);
        }
        Ok(cargo)
    }
}

/// The cargo that started this program.
pub fn own_cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or("cargo".into()))
}

/// The project's folder.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap_or(Path::new("."))
}

/// Where cargo builds.
pub fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// Runs a command to its good end.
pub fn run(command: &mut Command) -> Result<()> {
    let shown = format!("{command:?}");
    let status = command
        .status()
        .with_context(|| format!("cannot start {shown}"))?;
    if !status.success() {
        bail!("{shown} ended with {status}");
    }
    Ok(())
}
