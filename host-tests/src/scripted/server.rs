//! A web server in a script's hands, and the way to it, where there is one.

use edge_nal::{AddrType, Close, Dns, Readable, TcpConnect, TcpShutdown, TcpSplit};
use embassy_time::{Duration, Timer};
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::fmt;
use std::future::pending;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::rc::Rc;

/// Whether there is a way again, this is looked for so often.
const LOOK: Duration = Duration::from_millis(100);
/// The server's name.
pub const HOST: &str = "updates.example";
/// Its port.
pub const PORT: u16 = 8000;
/// Its address.
const ADDRESS: IpAddr = IpAddr::V4(Ipv4Addr::new(192, 0, 2, 7));

/// What comes after all of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The connection is closed.
    Close,
    /// It breaks.
    Break,
    /// Nothing, without an end.
    Silence,
    /// More and more of the same.
    Endless,
}

/// What the server says when it is asked for a file.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Head and body.
    pub bytes: Vec<u8>,
    /// Bytes at a time.
    pub piece: usize,
    /// Time between two pieces.
    pub every: Duration,
    /// What comes then.
    pub end: End,
}

impl Answer {
    /// As a web server gives a file.
    pub fn file(content: &[u8]) -> Self {
        let length = content.len().to_string();
        Self::with("200 OK", &[("Content-Length", &length)], content)
    }

    /// A head with these headers, and what follows it.
    pub fn with(status: &str, headers: &[(&str, &str)], content: &[u8]) -> Self {
        let mut bytes = format!("HTTP/1.1 {status}\r\nServer: script\r\n").into_bytes();
        for (name, value) in headers {
            bytes.extend(format!("{name}: {value}\r\n").bytes());
        }
        bytes.extend(b"\r\n");
        bytes.extend(content);
        Self::raw(&bytes)
    }

    /// These bytes, HTTP or not.
    pub fn raw(bytes: &[u8]) -> Self {
        Self {
            bytes: bytes.to_vec(),
            piece: 600,
            every: Duration::MIN,
            end: End::Close,
        }
    }

    /// Ends after so many bytes.
    pub fn cut(mut self, length: usize, end: End) -> Self {
        self.bytes.truncate(length);
        self.end = end;
        self
    }

    /// Not all at once.
    pub fn paced(self, piece: usize, every: Duration) -> Self {
        Self {
            piece,
            every,
            ..self
        }
    }
}

/// The server.
#[derive(Clone, Default)]
pub struct Server(Rc<State>);

#[derive(Default)]
struct State {
    files: RefCell<HashMap<String, Answer>>,
    asked: RefCell<Vec<String>>,
    gone: Cell<bool>,
    way: RefCell<Option<Way>>,
}

/// Says whether the machine's network leads to the server.
type Way = Box<dyn Fn() -> bool>;

impl Server {
    /// A file, or another answer in its place.
    pub fn put(&self, path: &str, answer: Answer) {
        self.0.files.borrow_mut().insert(path.into(), answer);
    }

    /// Changes what is answered at a path, if there is anything.
    pub fn change(&self, path: &str, change: impl FnOnce(Answer) -> Answer) {
        if let Some(answer) = self.0.files.borrow_mut().get_mut(path) {
            *answer = change(answer.clone());
        }
    }

    /// Nobody answers any more.
    pub fn vanish(&self) {
        self.0.gone.set(true);
    }

    /// It answers again, if it had vanished.
    pub fn come_back(&self) {
        self.0.gone.set(false);
    }

    /// It is reached only while `way` says so.
    pub fn behind(&self, way: impl Fn() -> bool + 'static) {
        self.0.way.replace(Some(Box::new(way)));
    }

    fn is_reachable(&self) -> bool {
        let way = self.0.way.borrow();
        !self.0.gone.get() && way.as_ref().is_none_or(|way| way())
    }

    /// As long as there is no way to it, nothing comes and nothing is lost.
    async fn reach(&self) {
        while !self.is_reachable() {
            Timer::after(LOOK).await;
        }
    }

    /// Requests so far.
    pub fn asked(&self) -> Vec<String> {
        self.0.asked.borrow().clone()
    }
}

/// There is nobody, or nobody any more.
#[derive(Clone, Copy, Debug)]
pub struct Broken;

impl fmt::Display for Broken {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("broken")
    }
}

impl std::error::Error for Broken {}

impl embedded_io_async::Error for Broken {
    fn kind(&self) -> ErrorKind {
        ErrorKind::ConnectionReset
    }
}

impl Dns for Server {
    type Error = Broken;

    /// Who knows the names is not in the server's house.
    async fn get_host_by_name(&self, host: &str, _: AddrType) -> Result<IpAddr, Broken> {
        while self.0.way.borrow().as_ref().is_some_and(|way| !way()) {
            Timer::after(LOOK).await;
        }
        match host {
            HOST => Ok(ADDRESS),
            "slow.example" => pending().await,
            _ => Err(Broken),
        }
    }

    async fn get_host_by_address(&self, _: IpAddr, _: &mut [u8]) -> Result<usize, Broken> {
        Err(Broken)
    }
}

impl TcpConnect for Server {
    type Error = Broken;
    type Socket<'a> = Socket;

    async fn connect(&self, remote: SocketAddr) -> Result<Socket, Broken> {
        self.reach().await;
        match remote {
            SocketAddr::V4(v4) if (IpAddr::V4(*v4.ip()), v4.port()) == (ADDRESS, PORT) => {
                Ok(Socket {
                    server: self.clone(),
                    request: Vec::new(),
                    answer: None,
                    sent: 0,
                })
            }
            _ => Err(Broken),
        }
    }
}

/// A connection to it.
pub struct Socket {
    server: Server,
    request: Vec<u8>,
    answer: Option<Answer>,
    sent: usize,
}

impl ErrorType for Socket {
    type Error = Broken;
}

impl Read for Socket {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Broken> {
        if self.answer.is_none() {
            self.answer = Some(self.asked());
        }
        let answer = self.answer.as_ref().ok_or(Broken)?;
        self.server.reach().await;
        let rest = &answer.bytes[self.sent..];
        if rest.is_empty() {
            return match answer.end {
                End::Close => Ok(0),
                End::Break => Err(Broken),
                End::Silence => pending().await,
                End::Endless => {
                    Timer::after(answer.every).await;
                    buffer.fill(b'x');
                    Ok(buffer.len())
                }
            };
        }
        // Pieces begin where they would if nobody read less than one.
        if self.sent.is_multiple_of(answer.piece) && answer.every > Duration::MIN {
            Timer::after(answer.every).await;
        }
        let piece = answer.piece - self.sent % answer.piece;
        let count = piece.min(rest.len()).min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        self.sent += count;
        Ok(count)
    }
}

impl Socket {
    fn asked(&self) -> Answer {
        let text = String::from_utf8(self.request.clone()).expect("a request is text");
        assert!(text.ends_with("\r\n\r\n"), "{text:?}");
        let path = text.split(' ').nth(1).expect("a path").to_owned();
        self.server.0.asked.borrow_mut().push(text);
        let answer = self.server.0.files.borrow().get(&path).cloned();
        let nothing = || Answer::with("404 Not Found", &[("Content-Length", "0")], b"");
        answer.unwrap_or_else(nothing)
    }
}

impl Write for Socket {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Broken> {
        self.request.extend(bytes);
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Broken> {
        Ok(())
    }
}

impl Readable for Socket {
    async fn readable(&mut self) -> Result<(), Broken> {
        Ok(())
    }
}

impl TcpShutdown for Socket {
    async fn close(&mut self, _: Close) -> Result<(), Broken> {
        Ok(())
    }

    async fn abort(&mut self) -> Result<(), Broken> {
        Ok(())
    }
}

impl TcpSplit for Socket {
    type Read<'a> = &'a mut Self;
    type Write<'a> = Half;

    fn split(&mut self) -> (&mut Self, Half) {
        (self, Half)
    }
}

/// Nobody asks for two halves.
pub struct Half;

impl ErrorType for Half {
    type Error = Broken;
}

impl Write for Half {
    async fn write(&mut self, _: &[u8]) -> Result<usize, Broken> {
        Err(Broken)
    }

    async fn flush(&mut self) -> Result<(), Broken> {
        Err(Broken)
    }
}
