//! A compiler for the chips: rustup's target where it is installed, else the distribution's compiler
//! with its library sources, else word of what to install.

use crate::board::{own_cargo, run};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Debian's packages with a compiler and its library sources (security pocket of Debian 12).
const COMPILER_PACKAGES: [&str; 6] = [
    "rustc-web",
    "cargo-web",
    "rust-web-src",
    "rust-web-llvm",
    "rust-web-clippy",
    "lld-22",
];
/// The distribution's compiler, whatever `PATH` says.
const SYSTEM_RUSTC: &str = "/usr/bin/rustc";
const SYSTEM_CARGO: &str = "/usr/bin/cargo";

/// A compiler for bare metal.
#[derive(Debug)]
pub enum Toolchain {
    /// rustup has the target.
    Rustup,
    /// The distribution's, which builds `core` from source, with this linker.
    System {
        /// The linker's program.
        linker: PathBuf,
    },
    /// Espressif's, for Xtensa.
    Espressif,
}

impl Toolchain {
    /// The one to use for `target`; with `setup`, installs what is missing.
    pub fn find(target: &str, setup: bool) -> Result<Self> {
        if target.starts_with("xtensa") {
            let mut probe = Command::new("cargo");
            leave_own_cargo(&mut probe);
            let found = probe.args(["+esp", "--version"]).output();
            if found.is_ok_and(|found| found.status.success()) {
                return Ok(Self::Espressif);
            }
            bail!(
                "{target} needs Espressif's compiler: cargo install espup --locked && espup install"
            );
        }
        if rustup_has(target) {
            return Ok(Self::Rustup);
        }
        if let Some(found) = system() {
            return Ok(found);
        }
        if setup {
            install(&COMPILER_PACKAGES)?;
            return system().context(
                "the packages are installed, but there is still no compiler with library sources",
            );
        }
        bail!(
            "no compiler for {target}. Either\n    rustup target add {target}\nor, on Debian,\n    apt-get install {}\nor let this command install it, as root, with --setup.",
            COMPILER_PACKAGES.join(" ")
        )
    }

    /// Its cargo, ready for arguments; the verb must come first.
    pub fn cargo(&self, target: &str) -> Command {
        match self {
            Self::Rustup => own_cargo(),
            Self::Espressif => {
                let mut cargo = Command::new("cargo");
                cargo
                    .arg("+esp")
                    .env("CARGO_UNSTABLE_BUILD_STD", "core,alloc");
                leave_own_cargo(&mut cargo);
                cargo
            }
            Self::System { linker } => {
                let mut cargo = Command::new(SYSTEM_CARGO);
                leave_own_cargo(&mut cargo);
                let path = std::env::var("PATH").unwrap_or_default();
                let variable = target.to_uppercase().replace('-', "_");
                cargo
                    .env("PATH", format!("/usr/bin:{path}"))
                    .env("RUSTC", SYSTEM_RUSTC)
                    // Building the library from source is a nightly feature with a stable result.
                    .env("RUSTC_BOOTSTRAP", "1")
                    .env("CARGO_UNSTABLE_BUILD_STD", "core,alloc")
                    .env(format!("CARGO_TARGET_{variable}_LINKER"), linker);
                cargo
            }
        }
    }
}

/// This program was started by a cargo, whose choices are not the other one's.
fn leave_own_cargo(command: &mut Command) {
    for variable in [
        "RUSTUP_TOOLCHAIN",
        "CARGO",
        "RUSTC",
        "RUSTC_WRAPPER",
        "RUSTFLAGS",
    ] {
        command.env_remove(variable);
    }
}

fn rustup_has(target: &str) -> bool {
    let output = Command::new("rustc")
        .args(["--print", "target-libdir", "--target", target])
        .output();
    output.is_ok_and(|output| {
        let folder = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        output.status.success() && Path::new(&folder).is_dir()
    })
}

fn system() -> Option<Toolchain> {
    let output = Command::new(SYSTEM_RUSTC)
        .args(["--print", "sysroot"])
        .env_remove("RUSTUP_TOOLCHAIN")
        .output()
        .ok()?;
    let sysroot = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    let sources = sysroot.join("lib/rustlib/src/rust/library/core");
    let complete = [SYSTEM_CARGO, "/usr/bin/cargo-clippy"]
        .into_iter()
        .all(|tool| Path::new(tool).exists());
    if !complete || !sources.exists() {
        return None;
    }
    let linker = ["/usr/bin/rust-lld", "/usr/bin/lld-22"]
        .into_iter()
        .map(PathBuf::from)
        .find(|path| path.exists())?;
    Some(Toolchain::System { linker })
}

/// Makes sure that a program of a Debian package is there.
pub fn require(program: &str, package: &str, setup: bool) -> Result<()> {
    if Command::new(program).arg("--version").output().is_ok() {
        return Ok(());
    }
    if !setup {
        bail!(
            "{program} is missing: apt-get install {package}, or let this command install it, as root, with --setup"
        );
    }
    install(&[package])
}

fn install(packages: &[&str]) -> Result<()> {
    eprintln!("installing {}", packages.join(" "));
    let quiet = |arguments: &[&str]| {
        let mut apt = Command::new("apt-get");
        apt.env("DEBIAN_FRONTEND", "noninteractive")
            .args(["-qq", "-y"])
            .args(arguments);
        // Another program may hold the package system's lock for a while.
        apt.args(["-o", "DPkg::Lock::Timeout=300"]);
        run(&mut apt)
    };
    quiet(&["update"])?;
    let mut arguments = vec!["install", "--no-install-recommends"];
    arguments.extend(packages);
    quiet(&arguments)
}
