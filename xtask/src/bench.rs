//! What the work of the firmware costs on the chip's instruction set, beside what else one could take.

use crate::board::Board;
use crate::emulator::{Emulator, Options, Time, free_address, machine};
use anyhow::{Context, Result, bail, ensure};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

/// One line of the table: instructions of a piece of work, here and elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What is done.
    pub work: &'static str,
    /// At most this many instructions.
    pub goal: Goal,
    /// Instructions here.
    pub measured: u64,
    /// What else one could take, and its instructions.
    pub peers: Vec<(&'static str, u64)>,
}

/// How much a piece of work may cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// So many instructions.
    Instructions(u64),
    /// So many times what the first peer takes.
    Times(f64),
}

impl Row {
    /// The goal in instructions.
    pub fn most(&self) -> u64 {
        match self.goal {
            Goal::Instructions(most) => most,
            Goal::Times(factor) => {
                let peer = self.peers.first().map_or(0, |(_, peer)| *peer);
                (peer as f64 * factor) as u64
            }
        }
    }

    /// Whether it is reached.
    pub fn is_met(&self) -> bool {
        self.measured <= self.most()
    }
}

/// Measures everything, in one run.
pub fn measure(setup: bool) -> Result<Vec<Row>> {
    let programs = run_bench(&Board::Virt.build("bench", &["bench"], setup)?)?;
    let of = |name: &str| -> Result<u64> {
        let found = programs.iter().find(|(known, _)| known == name);
        found
            .map(|(_, count)| *count)
            .with_context(|| format!("the bench did not measure '{name}'"))
    };
    let firmware = Board::Virt.build("virt", &[], setup)?;
    let echo = Board::Virt.build("echo", &[], setup)?;
    Ok(vec![
        Row {
            work: "parse a move",
            goal: Goal::Instructions(400),
            measured: of("parse")?,
            peers: vec![
                ("gcode 0.7", of("parse, gcode 0.7")?),
                ("async-gcode 0.3", of("parse, async-gcode 0.3")?),
            ],
        },
        Row {
            work: "inverse kinematics",
            goal: Goal::Instructions(200),
            measured: of("inverse kinematics")?,
            peers: vec![
                ("f32 with libm", of("inverse kinematics, f32 with libm")?),
                (
                    "f32 with micromath",
                    of("inverse kinematics, f32 with micromath")?,
                ),
            ],
        },
        Row {
            work: "set-point",
            goal: Goal::Instructions(450),
            measured: of("set-point")?,
            peers: vec![("f32 with libm", of("set-point, f32 with libm")?)],
        },
        Row {
            work: "set-point with map and shift",
            goal: Goal::Instructions(550),
            measured: of("set-point, map and shift")?,
            peers: vec![],
        },
        Row {
            work: "set-point of a plan",
            goal: Goal::Instructions(450),
            measured: of("set-point of a plan")?,
            peers: vec![],
        },
        Row {
            work: "plan a segment",
            goal: Goal::Instructions(8_000),
            measured: of("plan a segment")?,
            peers: vec![],
        },
        Row {
            work: "begin a segment",
            goal: Goal::Instructions(5_000),
            measured: of("set-point that begins a segment")?,
            peers: vec![],
        },
        Row {
            work: "G01 over TCP",
            goal: Goal::Times(1.25),
            measured: round_trip(&firmware)?,
            peers: vec![("TCP echo", round_trip(&echo)?)],
        },
    ])
}

/// Runs a program that prints `name,instructions` lines on the serial port.
fn run_bench(program: &Path) -> Result<Vec<(String, u64)>> {
    let output = machine(program, Time::Instructions)
        .args(["-serial", "stdio", "-monitor", "none"])
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    ensure!(
        output.status.success(),
        "the bench ended with {}:\n{text}",
        output.status
    );
    let mut measured = Vec::new();
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let Some((name, count)) = line.rsplit_once(';') else {
            bail!("the bench printed '{line}'");
        };
        measured.push((name.to_owned(), count.parse()?));
    }
    Ok(measured)
}

/// Instructions from one command's packet to its reply's, everything included: the mean of many, each
/// from rest, less what the machine does meanwhile without a command.
fn round_trip(program: &Path) -> Result<u64> {
    const WARM_UP: u32 = 10;
    const COUNT: u32 = 100;
    let folder = tempfile::tempdir()?;
    let options = Options {
        line_us: free_address()?,
        web: None,
        flash: folder.path().join("flash.img"),
        time: Time::Instructions,
        serial: None,
    };
    let mut emulator = Emulator::boot(program, &options)?;
    emulator.wait_ready()?;
    let mut client = TcpStream::connect(options.line_us)?;
    client.set_nodelay(true)?;
    client.set_read_timeout(Some(Duration::from_secs(20)))?;
    let mut exchange = |number: u32| -> Result<()> {
        // Two places in turn, a step apart, so that there is always a way to go.
        let x = 1234 + (number % 2);
        client.write_all(format!("G01 X{x} Y-567 Z1000\n").as_bytes())?;
        let mut reply = [0; 256];
        ensure!(
            client.read(&mut reply)? > 0,
            "the machine closed the connection"
        );
        Ok(())
    };
    let mut times = |count: u32, work: &mut dyn FnMut(u32) -> Result<()>| -> Result<u64> {
        let before = instructions(&mut emulator)?;
        for number in 0..count {
            work(number)?;
            // A step takes 10 ms and begins at a frame.
            std::thread::sleep(Duration::from_millis(25));
        }
        let after = instructions(&mut emulator)?;
        Ok(u64::from(after.wrapping_sub(before)))
    };
    times(WARM_UP, &mut exchange)?;
    let busy = times(COUNT, &mut exchange)?;
    let idle = times(COUNT, &mut |_| Ok(()))?;
    Ok(busy.saturating_sub(idle) / u64::from(COUNT))
}

/// Asks the machine how many instructions it has executed, sleep not counted, modulo 2^32.
fn instructions(emulator: &mut Emulator) -> Result<u32> {
    emulator.say("instructions")?;
    let line = emulator.wait_for_line("instructions ", Duration::from_secs(20))?;
    let (_, count) = line.rsplit_once(' ').context("no count")?;
    Ok(count.parse()?)
}
