//! The desktop arm: the firmware of the drawing arm with sockets, files and a picture.

mod file;
mod home;
mod options;
mod place;
mod serve;

use clap::{Parser, Subcommand};
use firmware::boards::desktop::bootloader::{self, Reset};
use firmware::boards::desktop::trial;
use options::{Draw, Serve};
use place::Firmware;
use std::io::{self, Write};
use std::process::ExitCode;

/// A drawing arm without the arm: the real firmware on this computer.
///
/// Point any Line-us program at the address it prints, and watch the picture appear.
#[derive(Parser)]
#[command(name = "quill", version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    serve: Serve,
}

#[derive(Subcommand)]
enum Command {
    /// Draw a G-code file as fast as possible, and tell what the arm did
    ///
    /// The file goes through the same session and the same arm as a client's commands. The exit status
    /// is 1 when a line was refused.
    Draw(Draw),
}

fn main() -> ExitCode {
    env_logger::Builder::new()
        .filter_level(log::LevelFilter::Info)
        // Of WiFi there is only news when somebody asks for a network that is not there.
        .filter_module("firmware::services::network", log::LevelFilter::Warn)
        .format(|out, record| writeln!(out, "{}", record.args()))
        .target(env_logger::Target::Stdout)
        .init();
    perform().unwrap_or_else(|error| {
        eprintln!("error: {error}");
        ExitCode::FAILURE
    })
}

fn perform() -> io::Result<ExitCode> {
    // Before anything that may fail, like options that this firmware does not know.
    let firmware = bootloader::running().map(Firmware::start).transpose()?;
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => match firmware.filter(|_| trial::lasts()) {
            Some(firmware) => {
                error.print()?;
                return Err(firmware.running.restart(Reset::Failure));
            }
            None => error.exit(),
        },
    };
    match cli.command {
        Some(Command::Draw(options)) => file::draw(options),
        None => place::run(cli.serve, firmware),
    }
}

/// The same error, with what it is about.
fn named(what: &dyn std::fmt::Display, error: io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{what}: {error}"))
}
