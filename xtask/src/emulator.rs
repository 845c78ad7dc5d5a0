//! The arm in QEMU, with everything that surrounds it within reach: its port, its console, its flash,
//! its button and light, and every pulse of its servos.

use crate::records::{self, Record};
use crate::slots;
use anyhow::{Context, Result, bail};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener};
use std::os::unix::net::{UnixListener, UnixStream};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The emulator's program, and Debian's package that has it.
pub const QEMU: (&str, &str) = ("qemu-system-riscv32", "qemu-system-misc");
/// Bytes of the flash.
pub const FLASH_SIZE: u64 = 4 << 20;

// Files and sockets in the machine's folder.
const RECORDS: &str = "records";
const CONSOLE: &str = "console";
const MONITOR: &str = "monitor";
const IMAGE: &str = "image";

/// Exit status of a machine that wants to be started again.
pub const RESTART: i32 = 102;

/// How to start the machine.
#[derive(Clone, Debug)]
pub struct Options {
    /// Where this computer's clients connect.
    pub line_us: SocketAddr,
    /// Where this computer's browsers connect, if they are to.
    pub web: Option<SocketAddr>,
    /// The flash's file; made, erased, if it does not exist.
    pub flash: PathBuf,
    /// What the machine takes for time.
    pub time: Time,
    /// What is at the other end of its serial line, as QEMU's `-serial` takes it; nothing if `None`.
    pub serial: Option<String>,
}

/// What an emulated machine takes for time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Time {
    /// The wall's.
    Wall,
    /// Its own instructions, one a nanosecond, and the wall's while it sleeps.
    Instructions,
    /// Its own instructions alone: where it would sleep, time jumps to what it waits for. Exact and
    /// repeatable, and much faster than the wall's while there is little to do.
    Virtual,
}

/// A running machine; dropped, its power is cut.
#[derive(Debug)]
pub struct Emulator {
    qemu: Child,
    /// Holds sockets and recordings.
    folder: TempDir,
    console: UnixStream,
    lines: Receiver<String>,
    seen: Vec<String>,
    recorded: File,
    bytes: Vec<u8>,
}

impl Emulator {
    /// Switches the machine on, with the firmware of the chosen slot. As long as that is the first one, and
    /// no update has been written there, it is `firmware`.
    pub fn boot(firmware: &Path, options: &Options) -> Result<Self> {
        if !options.flash.exists() {
            let erased = vec![0xff; FLASH_SIZE as usize];
            std::fs::write(&options.flash, erased)
                .with_context(|| options.flash.display().to_string())?;
        }
        let folder = tempfile::tempdir()?;
        let records = folder.path().join(RECORDS);
        File::create(&records)?;
        let listener = UnixListener::bind(folder.path().join(CONSOLE))?;
        let image = folder.path().join(IMAGE);
        let firmware = match slots::image(&options.flash)? {
            Some(bytes) => {
                std::fs::write(&image, bytes)?;
                &image
            }
            None => firmware,
        };
        let qemu = command(firmware, options, folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            // Ctrl-C is for whoever drives the machine, not for the machine.
            .process_group(0)
            .spawn()
            .with_context(|| format!("cannot start {}", QEMU.0))?;
        let mut emulator = Self {
            recorded: File::open(&records)?,
            console: accept(&listener, &qemu)?,
            qemu,
            folder,
            lines: channel().1,
            seen: Vec::new(),
            bytes: Vec::new(),
        };
        emulator.lines = read_lines(emulator.console.try_clone()?);
        Ok(emulator)
    }

    /// Waits until clients can connect.
    pub fn wait_ready(&mut self) -> Result<()> {
        self.wait_for_line("Line-us clients", Duration::from_secs(60))
            .map(drop)
    }

    /// Waits for a line of the console that has `text` in it, and gives it.
    pub fn wait_for_line(&mut self, text: &str, patience: Duration) -> Result<String> {
        let end = Instant::now() + patience;
        loop {
            let Some(line) = self.next_line(end.saturating_duration_since(Instant::now()))? else {
                bail!(
                    "no '{text}' on the console within {patience:?}; it said:\n{}",
                    self.seen.join("\n")
                );
            };
            if line.contains(text) {
                return Ok(line);
            }
        }
    }

    /// The next line of the console, `None` if there is none in time.
    pub fn next_line(&mut self, patience: Duration) -> Result<Option<String>> {
        match self.lines.recv_timeout(patience) {
            Ok(line) => {
                self.seen.push(line.clone());
                Ok(Some(line))
            }
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => {
                bail!(
                    "the machine is off; its console said:\n{}",
                    self.seen.join("\n")
                )
            }
        }
    }

    /// Everything the console has said so far.
    pub fn said(&self) -> &[String] {
        &self.seen
    }

    /// Says something to the machine's surroundings: `button down`, `button up`, `panic`,
    /// `hang`.
    pub fn say(&mut self, line: &str) -> Result<()> {
        Ok(writeln!(self.console, "{line}")?)
    }

    /// Cuts the network cable, or plugs it in again: packets vanish, and nobody is told.
    pub fn connect_cable(&mut self, connected: bool) -> Result<()> {
        let mut monitor = UnixStream::connect(self.folder.path().join(MONITOR))?;
        let state = if connected { "on" } else { "off" };
        writeln!(monitor, "set_link n0 {state}")?;
        // The prompt after the command's echo says that it is done.
        let mut heard = Vec::new();
        let mut byte = [0];
        while heard.windows(7).filter(|text| text == b"(qemu) ").count() < 2 {
            if monitor.read(&mut byte)? == 0 {
                bail!("the monitor is gone");
            }
            heard.extend_from_slice(&byte);
        }
        Ok(())
    }

    /// What has been recorded since the last call.
    pub fn records(&mut self) -> Result<Vec<Record>> {
        self.recorded.read_to_end(&mut self.bytes)?;
        records::take(&mut self.bytes)
    }

    /// Waits until the machine switches itself off.
    pub fn wait_off(&mut self, patience: Duration) -> Result<ExitStatus> {
        let end = Instant::now() + patience;
        loop {
            if let Some(status) = self.qemu.try_wait()? {
                return Ok(status);
            }
            if Instant::now() > end {
                bail!("the machine is still on after {patience:?}");
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // Gone already, if it switched itself off.
        let _ = self.qemu.kill();
        let _ = self.qemu.wait();
    }
}

/// An address of this computer that nobody listens on.
pub fn free_address() -> Result<SocketAddr> {
    Ok(TcpListener::bind("127.0.0.1:0")?.local_addr()?)
}

fn command(firmware: &Path, options: &Options, folder: &Path) -> Command {
    let [records, console, monitor] = [RECORDS, CONSOLE, MONITOR].map(|name| folder.join(name));
    let mut qemu = machine(firmware, options.time);
    qemu.args(["-serial", options.serial.as_deref().unwrap_or("none")])
        .arg("-monitor")
        .arg(format!("unix:{},server=on,wait=off", monitor.display()))
        .arg("-chardev")
        // A file keeps everything; a socket would lose what is not read at once.
        .arg(format!("file,id=records,path={}", records.display()))
        .arg("-chardev")
        .arg(format!("socket,id=console,path={}", console.display()))
        .args([
            "-device",
            "virtio-serial-device,bus=virtio-mmio-bus.0,id=c0",
        ])
        .args(["-device", "virtconsole,bus=c0.0,chardev=records"])
        .args([
            "-device",
            "virtio-serial-device,bus=virtio-mmio-bus.1,id=c1",
        ])
        .args(["-device", "virtconsole,bus=c1.0,chardev=console"])
        .arg("-netdev")
        .arg(forwards(options))
        .args(["-device", "virtio-net-device,netdev=n0"])
        .arg("-drive")
        .arg(format!(
            "file={},if=none,format=raw,id=d0",
            options.flash.display()
        ))
        .args(["-device", "virtio-blk-device,drive=d0"]);
    qemu
}

/// Which of this computer's ports lead to the machine's.
fn forwards(options: &Options) -> String {
    let address = options.line_us;
    // Its name service is asked at the same number, which is another port with UDP.
    let line_us = format!("hostfwd=tcp:{address}-:1337,hostfwd=udp:{address}-:5353");
    let web = options.web.map(|web| format!(",hostfwd=tcp:{web}-:80"));
    format!("user,id=n0,{line_us}{}", web.unwrap_or_default())
}

/// The bare machine, for a program that needs nothing around it.
pub fn machine(program: &Path, time: Time) -> Command {
    let mut qemu = Command::new(QEMU.0);
    qemu.args(["-M", "virt", "-cpu", "rv32", "-m", "16", "-bios", "none"])
        .args(["-display", "none"])
        .args(["-global", "virtio-mmio.force-legacy=false"])
        .arg("-kernel")
        .arg(program);
    match time {
        Time::Wall => {}
        Time::Instructions => {
            qemu.args(["-icount", "shift=0"]);
        }
        Time::Virtual => {
            qemu.args(["-icount", "shift=0,sleep=off"]);
        }
    }
    qemu
}

/// QEMU connects to the console's socket when it starts, or ends with a reason.
fn accept(listener: &UnixListener, qemu: &Child) -> Result<UnixStream> {
    listener.set_nonblocking(true)?;
    let end = Instant::now() + Duration::from_secs(20);
    while Instant::now() < end {
        match listener.accept() {
            Ok((socket, _)) => {
                socket.set_nonblocking(false)?;
                return Ok(socket);
            }
            Err(_) => std::thread::sleep(Duration::from_millis(5)),
        }
    }
    bail!(
        "{} (process {}) does not open its console",
        QEMU.0,
        qemu.id()
    )
}

fn read_lines(console: UnixStream) -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let mut reader = BufReader::new(console);
        let mut line = Vec::new();
        // At the end of the machine the console ends as well.
        while reader
            .read_until(b'\n', &mut line)
            .is_ok_and(|length| length > 0)
        {
            let text = String::from_utf8_lossy(&line).trim_end().to_owned();
            line.clear();
            if sender.send(text).is_err() {
                return;
            }
        }
    });
    receiver
}
