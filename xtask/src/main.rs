//! The developer's commands.

mod browser;
mod emulate;
mod image;
mod table;
mod test;

use anyhow::{Result, bail};
use clap::{Parser, Subcommand};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{Command, ExitCode};
use xtask::bench;
use xtask::board::{Board, run};
use xtask::emulator::QEMU;
use xtask::ready::Owner;
use xtask::toolchain::require;

/// Build, emulate, flash, measure and test the firmware.
#[derive(Parser)]
#[command(name = "cargo xtask", version)]
struct Cli {
    /// Install what is missing with apt, as root, instead of saying what to install
    #[arg(long, global = true)]
    setup: bool,
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Build the firmware for a board
    Build {
        /// The board
        board: Board,
    },
    /// Run the firmware in QEMU: connect to it as to the desktop arm, stop it with Ctrl-C
    ///
    /// What you type goes to the machine's surroundings: `button down`, `button up`.
    Emulate(Emulate),
    /// Build, and write the firmware onto a chip that is connected, with espflash
    Flash {
        /// The board
        board: Board,
        /// The serial port; found by itself where there is only one
        #[arg(long)]
        port: Option<String>,
        #[command(flatten)]
        owner: Owner,
    },
    /// Build, and make one file to write at the beginning of a chip's flash
    ///
    /// With a network or a name, the arm has these when it first starts, and what it remembered before is
    /// gone. For virt it makes a file for `emulate --flash`.
    Image {
        /// The board
        board: Board,
        #[command(flatten)]
        owner: Owner,
    },
    /// Tell how much flash and memory the firmware takes on each chip, and how much of that a bare
    /// program takes that joins WiFi and echoes TCP
    Size,
    /// Tell what the firmware's work costs in instructions of the chip, beside what else one could take
    Bench {
        /// Print `work,goal,measured,peer,peer_measured`
        #[arg(long)]
        csv: bool,
    },
    /// Run the tests of the page that the arm serves, in a browser too
    Page,
    /// Run everything that must pass: format, lints, documentation, tests, emulator, images
    Test,
}

#[derive(clap::Args)]
struct Emulate {
    /// Where Line-us clients connect
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:1337")]
    line_us: SocketAddr,
    /// Where laser software connects to the serial line, over TCP
    #[arg(long, value_name = "ADDR")]
    serial_tcp: Option<SocketAddr>,
    /// Where browsers on this computer connect
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:8080")]
    web: SocketAddr,
    /// The machine's flash, kept between runs; made if it does not exist
    #[arg(long, value_name = "FILE", default_value = "quill.flash")]
    flash: PathBuf,
    /// The picture, SVG or PNG, rewritten whenever the arm comes to rest
    #[arg(long, value_name = "FILE", default_value = "drawing.svg")]
    picture: PathBuf,
    /// A row for each servo frame of the moving arm
    #[arg(long, value_name = "FILE.csv")]
    trace: Option<PathBuf>,
}

fn main() -> ExitCode {
    match perform(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn perform(cli: Cli) -> Result<()> {
    let setup = cli.setup;
    match cli.task {
        Task::Build { board } => {
            println!("{}", board.build(board.binary(), &[], setup)?.display());
            Ok(())
        }
        Task::Emulate(options) => {
            require(QEMU.0, QEMU.1, setup)?;
            emulate::emulate(options, setup)
        }
        Task::Flash { board, port, owner } => flash(board, port.as_deref(), &owner, setup),
        Task::Image { board, owner } => {
            println!("{}", image::image(board, &owner, setup)?.display());
            Ok(())
        }
        Task::Size => table::sizes(setup),
        Task::Bench { csv } => {
            require(QEMU.0, QEMU.1, setup)?;
            table::bench(&bench::measure(setup)?, csv);
            Ok(())
        }
        Task::Page => browser::test(setup),
        Task::Test => test::everything(setup),
    }
}

fn flash(board: Board, port: Option<&str>, owner: &Owner, setup: bool) -> Result<()> {
    if !board.is_chip() {
        bail!("{} is not a chip", board.name());
    }
    if Command::new("espflash").arg("--version").output().is_err() {
        if !setup {
            bail!(
                "espflash is missing: cargo install espflash --locked, or let this command do it with --setup"
            );
        }
        run(Command::new("cargo").args(["install", "espflash", "--locked"]))?;
    }
    let image = image::image(board, owner, setup)?;
    let mut espflash = Command::new("espflash");
    espflash.args(["write-bin", "--chip", board.name()]);
    if let Some(port) = port {
        espflash.args(["--port", port]);
    }
    run(espflash.arg("0x0").arg(image))
}
