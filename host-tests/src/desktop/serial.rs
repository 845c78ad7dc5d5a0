//! A host at the other end of a serial port, whether that is a terminal or a connection.

use super::process::Desktop;
use crate::lasaur::host::LasaurApp;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

/// For what takes milliseconds on an idle computer.
const PATIENCE: Duration = Duration::from_secs(60);
/// For bytes that may come or not, before something else is done.
const GLANCE: Duration = Duration::from_millis(5);

/// `O_NONBLOCK` of Linux.
const NON_BLOCKING: i32 = 0o4000;

trait Wire: Read + Write {}

impl<T: Read + Write> Wire for T {}

/// An open serial port; dropped, it is closed.
pub struct SerialPort {
    wire: Box<dyn Wire>,
    received: Vec<u8>,
}

impl SerialPort {
    /// Opens a terminal.
    ///
    /// # Panics
    /// When it is not there.
    pub fn open(path: &Path) -> Self {
        let mut options = OpenOptions::new();
        let options = options.read(true).write(true).custom_flags(NON_BLOCKING);
        Self::over(options.open(path).expect("the serial port can be opened"))
    }

    /// Connects over TCP.
    ///
    /// # Panics
    /// When nobody listens.
    pub fn connect(address: SocketAddr) -> Self {
        Self::over_tcp(TcpStream::connect(address).expect("the arm takes a connection"))
    }

    /// Over a connection that somebody made.
    ///
    /// # Panics
    /// When it has no options.
    pub fn over_tcp(wire: TcpStream) -> Self {
        let options = wire.set_nodelay(true);
        let options = options.and_then(|()| wire.set_nonblocking(true));
        options.expect("a connection has options");
        Self::over(wire)
    }

    fn over(wire: impl Wire + 'static) -> Self {
        Self {
            wire: Box::new(wire),
            received: Vec::new(),
        }
    }

    /// Sends bytes as they are.
    ///
    /// # Panics
    /// When the arm has closed, or takes nothing for a long time.
    pub fn send(&mut self, bytes: impl AsRef<[u8]>) {
        let deadline = Instant::now() + PATIENCE;
        let mut rest = bytes.as_ref();
        while !rest.is_empty() {
            match self.wire.write(rest) {
                Ok(sent) => rest = &rest[sent..],
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    assert!(Instant::now() < deadline, "the arm takes no bytes");
                    thread::sleep(GLANCE);
                }
                Err(error) => panic!("the arm takes no bytes: {error}"),
            }
        }
    }

    /// The next line, without its newline.
    ///
    /// # Panics
    /// When there is none for a long time.
    pub fn line(&mut self) -> String {
        let deadline = Instant::now() + PATIENCE;
        loop {
            if let Some(end) = self.received.iter().position(|&byte| byte == b'\n') {
                let line: Vec<u8> = self.received.drain(..=end).collect();
                return String::from_utf8_lossy(&line[..end]).into_owned();
            }
            assert!(Instant::now() < deadline, "no line from the arm");
            self.listen(PATIENCE);
        }
    }

    /// A line and its reply.
    pub fn say(&mut self, line: &str) -> String {
        self.send(format!("{line}\n"));
        self.line()
    }

    /// Whether nothing comes for a while.
    pub fn hears_nothing_for(&mut self, time: Duration) -> bool {
        self.received.is_empty() && !self.listen(time)
    }

    /// Everything that has come and was not yet read as lines.
    fn take(&mut self) -> Vec<u8> {
        self.listen(GLANCE);
        std::mem::take(&mut self.received)
    }

    /// Whether something came in time.
    fn listen(&mut self, patience: Duration) -> bool {
        let deadline = Instant::now() + patience;
        let mut chunk = [0; 4096];
        loop {
            match self.wire.read(&mut chunk) {
                Ok(length @ 1..) => {
                    self.received.extend_from_slice(&chunk[..length]);
                    return true;
                }
                Ok(0) => panic!("the arm has closed the port"),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) => panic!("the port cannot be read: {error}"),
            }
            if Instant::now() >= deadline {
                return false;
            }
            thread::sleep(Duration::from_millis(1));
        }
    }

    /// Lets a host speak over this port until everything it has queued is answered.
    ///
    /// # Panics
    /// When that takes too long.
    pub fn serve(&mut self, host: &mut LasaurApp) {
        let deadline = Instant::now() + PATIENCE;
        while !host.is_idle() || host.unanswered > 0 {
            assert!(
                Instant::now() < deadline,
                "the host is not served: {host:?}"
            );
            self.send(host.send());
            host.receive(&self.take());
        }
    }

    /// Waits until the arm stands at a place, as `?` tells it.
    ///
    /// # Panics
    /// When it never does.
    pub fn wait_for_place(&mut self, place: &str) {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let status = self.say("?");
            if status.starts_with(place) {
                return;
            }
            assert!(
                Instant::now() < deadline,
                "the arm is at {status:?}, not {place:?}"
            );
            thread::sleep(GLANCE);
        }
    }
}

/// An address of this computer that nobody listens at.
///
/// # Panics
/// When there is none.
pub fn free_address() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0");
    let address = listener.and_then(|listener| listener.local_addr());
    address.expect("there is a free port")
}

/// An arm with its serial port over TCP, and a host that has heard the banner.
///
/// # Panics
/// When it does not start.
pub fn with_serial_tcp(folder: &Path, arguments: &[&str]) -> (Desktop, SocketAddr, SerialPort) {
    let address = free_address();
    let text = address.to_string();
    let arm = Desktop::start(folder, &[&["--serial-tcp", &text], arguments].concat());
    let mut port = SerialPort::connect(address);
    let banner = port.line();
    assert!(banner.starts_with("# LasaurGrbl "), "{banner:?}");
    (arm, address, port)
}
