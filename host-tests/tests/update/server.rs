//! A web server in a script's hands, at the other end of a network without a wire.

use edge_nal::{AddrType, Close, Dns, Readable, TcpConnect, TcpShutdown, TcpSplit};
use embassy_time::{Duration, Timer};
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::fmt;
use std::future::pending;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::rc::Rc;

/// The server's name, port and address.
pub const HOST: &str = "updates.example";
pub const PORT: u16 = 8000;
const ADDRESS: IpAddr = IpAddr::V4(Ipv4Addr::new(192, 0, 2, 7));

/// What comes after all of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    Close,
    Break,
    Silence,
    /// More and more of the same.
    Endless,
}

/// What the server says when it is asked for a file.
#[derive(Clone, Debug)]
pub struct Answer {
    pub bytes: Vec<u8>,
    /// Bytes at a time, and the time between.
    pub piece: usize,
    pub every: Duration,
    pub end: End,
}

impl Answer {
    /// As a web server gives a file.
    pub fn file(content: &[u8]) -> Self {
        let length = content.len().to_string();
        Self::with("200 OK", &[("Content-Length", &length)], content)
    }

    pub fn with(status: &str, headers: &[(&str, &str)], content: &[u8]) -> Self {
        let mut bytes = format!("HTTP/1.1 {status}\r\nServer: script\r\n").into_bytes();
        for (name, value) in headers {
            bytes.extend(format!("{name}: {value}\r\n").bytes());
        }
        bytes.extend(b"\r\n");
        bytes.extend(content);
        Self::raw(&bytes)
    }

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

    pub fn paced(self, piece: usize, every: Duration) -> Self {
        Self {
            piece,
            every,
            ..self
        }
    }
}

/// The server, and the way to it.
#[derive(Clone, Default)]
pub struct Server(Rc<State>);

#[derive(Default)]
struct State {
    files: RefCell<HashMap<String, Answer>>,
    asked: RefCell<Vec<String>>,
    gone: Cell<bool>,
}

impl Server {
    pub fn put(&self, path: &str, answer: Answer) {
        self.0.files.borrow_mut().insert(path.into(), answer);
    }

    /// Nobody answers any more.
    pub fn vanish(&self) {
        self.0.gone.set(true);
    }

    /// Requests so far.
    pub fn asked(&self) -> Vec<String> {
        self.0.asked.borrow().clone()
    }
}

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

    async fn get_host_by_name(&self, host: &str, _: AddrType) -> Result<IpAddr, Broken> {
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
        match remote {
            _ if self.0.gone.get() => pending().await,
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
        if self.server.0.gone.get() {
            pending::<()>().await;
        }
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
