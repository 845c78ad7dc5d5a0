//! The emulated arm for a person: console, picture and trace, until Ctrl-C.

use crate::Emulate;
use anyhow::{Result, bail};
use firmware::board::Servos;
use firmware::boards::desktop::recorder::{Outputs, RecordedServos, Recorder};
use protocol_core::machine::ArmData;
use std::io::BufRead;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::Duration;
use xtask::board::Board;
use xtask::emulator::{Emulator, Options, RESTART, Time};
use xtask::records::Record;

static STOP: AtomicBool = AtomicBool::new(false);

pub fn emulate(options: Emulate, setup: bool) -> Result<()> {
    let firmware = Board::Virt.build(Board::Virt.binary(), &[], setup)?;
    let machine = Options {
        line_us: options.line_us,
        web: Some(options.web),
        flash: options.flash,
        time: Time::Wall,
        serial: options
            .serial_tcp
            .map(|address| format!("tcp:{address},server=on,wait=off,nodelay=on")),
    };
    let outputs = Outputs {
        trace: options.trace,
        picture: Some(options.picture.clone()),
        go_on: false,
    };
    let (recorder, mut servos) = Recorder::start(outputs, ArmData::default(), false)?;
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))?;
    println!("picture: {}; stop with Ctrl-C", options.picture.display());
    let typed = read_keyboard();
    let addresses = (options.line_us, options.web);
    let outcome = loop {
        let mut emulator = Emulator::boot(&firmware, &machine)?;
        match follow(&mut emulator, &mut servos, addresses, &typed) {
            Ok(Ended::Restart) => println!("the machine starts again"),
            Ok(Ended::Stopped) => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    recorder.finish()?;
    outcome
}

/// How a run of the machine ended.
enum Ended {
    /// By the person.
    Stopped,
    /// By the firmware, which wants to be started again.
    Restart,
}

fn follow(
    emulator: &mut Emulator,
    servos: &mut RecordedServos,
    (line_us, web): (SocketAddr, SocketAddr),
    typed: &std::sync::mpsc::Receiver<String>,
) -> Result<Ended> {
    let mut shown = [[0; 3]; 2];
    while !STOP.load(Ordering::Relaxed) {
        let Ok(next) = emulator.next_line(Duration::from_millis(50)) else {
            let status = emulator.wait_off(Duration::from_secs(1))?;
            if status.code() == Some(RESTART) {
                return Ok(Ended::Restart);
            }
            bail!("the machine has switched itself off: {status}");
        };
        if let Some(line) = next {
            println!("{line}");
            if line.contains("Line-us clients") {
                println!("  on this computer: {line_us}, and the page: http://{web}/");
            }
        }
        while let Ok(line) = typed.try_recv() {
            emulator.say(&line)?;
        }
        for record in emulator.records()? {
            match record {
                Record::Frame(frame) => servos.write(frame.time, &frame.set_point),
                // A flashing light changes between two colours: only a third one is news.
                Record::Light { colour, .. } if !shown.contains(&colour) => {
                    let [red, green, blue] = colour;
                    println!("light: #{red:02x}{green:02x}{blue:02x}");
                    let [_, before] = shown;
                    shown = [before, colour];
                }
                Record::Light { .. } => {}
                Record::Lost(count) => println!("{count} records were lost: the picture has gaps"),
            }
        }
    }
    Ok(Ended::Stopped)
}

/// Lines that are typed; at the end of the input there are no more.
fn read_keyboard() -> std::sync::mpsc::Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}
