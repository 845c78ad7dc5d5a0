//! The developer's commands.

mod browser;
mod emulate;
mod image;
mod table;
mod test;

use anyhow::{Context, Result, bail};
use clap::{Parser, Subcommand};
use protocol_core::update::Version;
use std::fs;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{Command, ExitCode};
use xtask::bench;
use xtask::board::{Board, root, run};
use xtask::emulator::QEMU;
use xtask::ready::Owner;
use xtask::release;
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
    /// Make what is served to arms for M997: keys, images, manifests
    Release(Release),
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
#[command(args_conflicts_with_subcommands = true, arg_required_else_help = true)]
struct Release {
    #[command(subcommand)]
    command: Option<Signing>,
    /// The board to build for; image, manifest and checksums are made for a web server
    board: Option<Board>,
    /// The key; the published development key where none is given
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Where to put them
    #[arg(long, value_name = "FOLDER", default_value = "release")]
    to: PathBuf,
}

#[derive(Subcommand)]
enum Signing {
    /// Make a key of your own: FILE, which stays with you, and FILE.pub, which is built into the firmware
    Keygen {
        /// The file; never overwritten
        file: PathBuf,
    },
    /// Sign an image, and print its manifest
    Sign {
        /// The image, as it goes into a firmware slot
        image: PathBuf,
        /// The board it is for
        #[arg(long)]
        board: Board,
        /// Its version
        #[arg(long)]
        version: String,
        /// The key; the published development key where none is given
        #[arg(long, value_name = "FILE")]
        key: Option<PathBuf>,
    },
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
        Task::Release(what) => make_release(what, setup),
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

fn make_release(what: Release, setup: bool) -> Result<()> {
    let key_of = |file: Option<PathBuf>| {
        let file = file.unwrap_or_else(|| root().join(release::DEVELOPMENT_KEY));
        release::read_key(&file)
    };
    match what.command {
        Some(Signing::Keygen { file }) => {
            let public = release::keygen(&file)?;
            println!("keep {} to yourself; build with", file.display());
            println!("QUILL_UPDATE_KEY={public}");
        }
        Some(Signing::Sign {
            image,
            board,
            version,
            key,
        }) => {
            let version = Version::parse(&version).context("a version is three numbers")?;
            let content = fs::read(&image).with_context(|| image.display().to_string())?;
            let name = image.file_name().and_then(|name| name.to_str());
            let name = name.unwrap_or_default();
            let key = key_of(key)?;
            let text = release::manifest(board.manifest_name(), version, name, &content, &key)?;
            print!("{text}");
        }
        None => {
            let board = what.board.context("which board?")?;
            let key = key_of(what.key)?;
            release::ensure_built_in(&key, root())?;
            let version = match std::env::var("QUILL_VERSION") {
                Ok(version) => Version::parse(&version).context("QUILL_VERSION is no version")?,
                Err(_) => Version::FIRMWARE,
            };
            let image = image::slot_image(board, setup)?;
            let place = release::release(board.manifest_name(), version, &image, &key, &what.to)?;
            println!("{}", place.display());
        }
    }
    Ok(())
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
