//! A client that speaks Line-us byte by byte.

use socket2::SockRef;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

/// Ends every message of the machine.
pub const TERMINATOR: &[u8] = b"\r\n\0";
/// For what takes milliseconds on an idle computer.
const PATIENCE: Duration = Duration::from_secs(30);

/// One connection.
pub struct Client {
    stream: TcpStream,
    /// Bytes received and not yet read as replies.
    received: Vec<u8>,
}

impl Client {
    /// Connects, and reads nothing.
    ///
    /// # Panics
    /// When there is nobody.
    pub fn connect(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).expect("the arm takes connections");
        stream
            .set_nodelay(true)
            .and_then(|()| stream.set_read_timeout(Some(PATIENCE)))
            .expect("a connection has options");
        Self {
            stream,
            received: Vec::new(),
        }
    }

    /// The connection itself.
    pub fn stream(&self) -> &TcpStream {
        &self.stream
    }

    /// Sends bytes as they are.
    ///
    /// # Panics
    /// When the arm has closed.
    pub fn send(&mut self, bytes: impl AsRef<[u8]>) {
        self.stream
            .write_all(bytes.as_ref())
            .expect("the arm takes bytes");
    }

    /// The next message, without its terminator.
    ///
    /// # Panics
    /// When there is none for a long time, or the arm closes.
    pub fn reply(&mut self) -> String {
        loop {
            if let Some(end) = self.received.iter().position(|&byte| byte == 0) {
                let message: Vec<u8> = self.received.drain(..=end).collect();
                let text = message.strip_suffix(TERMINATOR).unwrap_or_else(|| {
                    panic!("{:?} ends wrongly", String::from_utf8_lossy(&message))
                });
                return String::from_utf8(text.to_vec()).expect("replies are UTF-8");
            }
            let mut chunk = [0; 4096];
            match self.stream.read(&mut chunk) {
                Ok(0) => panic!("the arm has closed the connection"),
                Ok(length) => self.received.extend_from_slice(&chunk[..length]),
                Err(error) => panic!("no reply: {error}"),
            }
        }
    }

    /// A line and its reply.
    pub fn say(&mut self, line: &str) -> String {
        self.send(format!("{line}\n"));
        self.reply()
    }

    /// What one `recv` gives, as the simplest clients read.
    ///
    /// # Panics
    /// When nothing comes.
    pub fn receive_once(&mut self, most: usize) -> Vec<u8> {
        assert!(self.received.is_empty(), "something is received already");
        let mut chunk = vec![0; most];
        let length = self.stream.read(&mut chunk).expect("something comes");
        chunk.truncate(length);
        chunk
    }

    /// What comes first, as it comes; empty if the connection is closed instead.
    pub fn first_words(mut self) -> Vec<u8> {
        let mut chunk = vec![0; 256];
        let length = self.stream.read(&mut chunk).unwrap_or(0);
        chunk.truncate(length);
        chunk
    }

    /// Whether nothing arrives for a while.
    ///
    /// # Panics
    /// When the connection has no options.
    pub fn hears_nothing_for(&mut self, time: Duration) -> bool {
        if !self.received.is_empty() {
            return false;
        }
        self.set_patience(time);
        let heard = self.stream.peek(&mut [0]);
        self.set_patience(PATIENCE);
        heard
            .is_err_and(|error| matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut))
    }

    /// Whether the next message has arrived to its end, or does so in time.
    ///
    /// # Panics
    /// When the connection has no options.
    pub fn has_whole_reply_within(&mut self, time: Duration) -> bool {
        let deadline = Instant::now() + time;
        let mut chunk = [0; 4096];
        self.set_patience(time);
        while !self.received.contains(&0) && Instant::now() < deadline {
            match self.stream.read(&mut chunk) {
                Ok(length @ 1..) => self.received.extend_from_slice(&chunk[..length]),
                _ => break,
            }
        }
        self.set_patience(PATIENCE);
        self.received.contains(&0)
    }

    fn set_patience(&self, time: Duration) {
        let options = self.stream.set_read_timeout(Some(time));
        options.expect("a connection has options");
    }

    /// Waits until the arm stands at a place, as M114 says it.
    ///
    /// # Panics
    /// When it never does.
    pub fn wait_for_place(&mut self, place: &str) {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let now = self.say("M114");
            if now == place {
                return;
            }
            assert!(
                Instant::now() < deadline,
                "the arm is at {now:?}, not {place:?}"
            );
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// Whether the arm has closed the connection, after everything that was to be read.
    pub fn is_closed(&mut self) -> bool {
        self.received.is_empty() && matches!(self.stream.read(&mut [0; 16]), Ok(0))
    }

    /// Says that nothing more will be sent.
    ///
    /// # Panics
    /// When the connection is broken.
    pub fn finish_sending(&mut self) {
        self.stream
            .shutdown(Shutdown::Write)
            .expect("the arm is there");
    }

    /// Dies: the connection is reset.
    ///
    /// # Panics
    /// When the connection has no options.
    pub fn die(self) {
        SockRef::from(&self.stream)
            .set_linger(Some(Duration::ZERO))
            .expect("a connection has options");
    }
}
