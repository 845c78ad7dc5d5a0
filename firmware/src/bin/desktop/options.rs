//! What can be said on the command line.

use clap::{Args, ValueEnum};
use core::net::{AddrParseError, SocketAddr};
use core::str::FromStr;
use embassy_time::Duration;
use firmware::boards::desktop::clock::Speed;
use std::path::PathBuf;

#[derive(Args)]
pub struct Serve {
    /// Where Line-us clients connect
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:1337")]
    pub line_us: SocketAddr,
    /// A serial port for laser software, made there and removed in the end
    #[arg(long, value_name = "PATH", conflicts_with = "serial_tcp")]
    pub serial: Option<PathBuf>,
    /// The serial port over TCP instead
    #[arg(long, value_name = "ADDR")]
    pub serial_tcp: Option<SocketAddr>,
    /// Announce the arm by name, so that clients find it without an address
    ///
    /// On the network of the address where clients connect: on this computer alone, unless that is another
    /// one.
    #[arg(long)]
    pub mdns: bool,
    /// Where browsers find the arm's page: an address, or 'none' [default: 127.0.0.1:8080, where it is free]
    #[arg(long, value_name = "ADDR")]
    pub web: Option<Web>,
    /// Where the arm keeps its name, calibration and network, made if it does not exist
    #[arg(long, value_name = "FILE", default_value = "quill.state")]
    pub state: PathBuf,
    /// Where the arm keeps drawings, made if it does not exist; beside the state if nothing is said
    #[arg(long, value_name = "FILE")]
    pub drawings: Option<PathBuf>,
    /// How fast the arm's time runs: a factor, or 'max' for as fast as possible
    #[arg(long, value_name = "FACTOR", default_value = "1")]
    pub speed: Speed,
    /// How long the pen stays down after its client has gone, in seconds
    #[arg(long, value_name = "SECONDS", default_value = "5")]
    pub lift_after: u32,
    /// The picture, SVG or PNG, rewritten whenever the arm comes to rest
    #[arg(long, value_name = "FILE", default_value = "drawing.svg")]
    pub picture: PathBuf,
    /// Networks that can be joined, a line each: name, password, strength in dBm, separated by tabs
    ///
    /// The file is read again when it changes. Without it, the arm is in the computer's own network.
    #[arg(long, value_name = "FILE")]
    pub air: Option<PathBuf>,
    /// Where there is place for other firmware: M997 updates the arm
    ///
    /// Two programs, and which of them starts. Made if it does not exist. Firmware that believes the published
    /// development key takes clients of this computer alone then.
    #[arg(long, value_name = "FOLDER")]
    pub firmware: Option<PathBuf>,
    #[command(flatten)]
    pub common: Common,
}

/// Where the web interface is.
#[derive(Clone, Copy)]
pub enum Web {
    Nowhere,
    At(SocketAddr),
}

impl FromStr for Web {
    type Err = AddrParseError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "none" => Ok(Self::Nowhere),
            address => address.parse().map(Self::At),
        }
    }
}

#[derive(Args)]
pub struct Draw {
    /// G-code, a command a line
    pub file: PathBuf,
    /// What language the file is in
    #[arg(long, value_enum, default_value_t = Dialect::LineUs)]
    pub dialect: Dialect,
    /// A picture of what the servos did, SVG or PNG
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
    #[command(flatten)]
    pub common: Common,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Dialect {
    /// Line-us G-code, in drawing units
    LineUs,
    /// LasaurGrbl's, in millimetres on the table
    Lasaur,
}

#[derive(Args)]
pub struct Common {
    /// A row for each servo frame of the moving arm: time, position, pulses
    #[arg(long, value_name = "FILE.csv")]
    pub trace: Option<PathBuf>,
    /// Time between two set-points of the servos, in microseconds
    #[arg(long, value_name = "N", default_value = "10000", value_parser = clap::value_parser!(u32).range(100..=1_000_000))]
    pub frame_us: u32,
}

impl Common {
    /// Time between two set-points.
    pub fn frame(&self) -> Duration {
        Duration::from_micros(self.frame_us.into())
    }
}
