//! A client of the web interface: requests byte by byte, so that wrong ones can be made as well.

use serde_json::Value;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::thread;
use std::time::{Duration, Instant};
use tungstenite::Message;
use tungstenite::client::IntoClientRequest;

/// For what takes milliseconds on an idle computer.
const PATIENCE: Duration = Duration::from_secs(30);

/// Where a web interface is.
#[derive(Clone, Copy, Debug)]
pub struct Web(SocketAddr);

/// What a request was answered with.
#[derive(Debug)]
pub struct Answer {
    /// 200 where all is well.
    pub status: u16,
    /// Request line and headers.
    pub head: String,
    /// The rest.
    pub body: Vec<u8>,
}

impl Answer {
    fn read(bytes: &[u8]) -> Option<Self> {
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n")? + 4;
        let head = String::from_utf8(bytes[..end].to_vec()).ok()?;
        let status = head.strip_prefix("HTTP/1.1 ")?.get(..3)?.parse().ok()?;
        Some(Self {
            status,
            head,
            body: bytes[end..].to_vec(),
        })
    }

    /// The value of a header.
    pub fn header(&self, name: &str) -> Option<&str> {
        self.head.lines().find_map(|line| {
            let (key, value) = line.split_once(':')?;
            key.eq_ignore_ascii_case(name).then_some(value.trim())
        })
    }

    /// The body as JSON.
    ///
    /// # Panics
    /// When it is none.
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|error| panic!("{error}: {:?}", String::from_utf8_lossy(&self.body)))
    }

    /// What a program is told about what went wrong.
    pub fn error(&self) -> (u16, String) {
        let error = self.json()["error"].as_str().unwrap_or("").to_owned();
        (self.status, error)
    }
}

impl Web {
    /// At an address.
    pub const fn at(address: SocketAddr) -> Self {
        Self(address)
    }

    /// The address.
    pub const fn address(self) -> SocketAddr {
        self.0
    }

    /// A connection on which nothing has been said.
    ///
    /// # Panics
    /// When there is nobody.
    pub fn connect(self) -> TcpStream {
        let stream = TcpStream::connect(self.0).expect("the web interface takes connections");
        stream
            .set_nodelay(true)
            .and_then(|()| stream.set_read_timeout(Some(PATIENCE)))
            .expect("a connection has options");
        stream
    }

    /// Sends bytes as they are, and gives everything that comes until the arm closes, empty if it closes
    /// without a word.
    pub fn raw(self, bytes: &[u8]) -> Vec<u8> {
        let mut stream = self.connect();
        // It may have been closed before all of it was sent.
        let _ = stream.write_all(bytes);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        answer
    }

    /// A request with more headers, each with its end; asked again while all connections are in use.
    ///
    /// # Panics
    /// When there is no answer.
    pub fn request(self, method: &str, path: &str, headers: &str, body: &[u8]) -> Answer {
        let head = format!(
            "{method} {path} HTTP/1.1\r\nHost: {}\r\nContent-Length: {}\r\n{headers}\r\n",
            self.0,
            body.len()
        );
        let deadline = Instant::now() + PATIENCE;
        loop {
            let bytes = self.raw(&[head.as_bytes(), body].concat());
            match Answer::read(&bytes) {
                Some(answer) if answer.status != 503 => return answer,
                answer => assert!(Instant::now() < deadline, "{method} {path}: {answer:?}"),
            }
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// `GET`.
    pub fn get(self, path: &str) -> Answer {
        self.request("GET", path, "", b"")
    }

    /// `POST` of a body.
    pub fn post(self, path: &str, body: &str) -> Answer {
        self.request("POST", path, "", body.as_bytes())
    }

    /// `POST` that is to succeed.
    ///
    /// # Panics
    /// When it does not.
    pub fn done(self, path: &str, body: &str) -> Value {
        let answer = self.post(path, body);
        let text = String::from_utf8_lossy(&answer.body).into_owned();
        assert_eq!(answer.status, 200, "POST {path}: {text}");
        answer.json()
    }

    /// The state of the machine.
    pub fn state(self) -> Value {
        self.get("/api/state").json()
    }

    /// What is done with the drawing; empty where there has been none.
    pub fn job_state(self) -> String {
        let state = self.state();
        state["job"]["state"]
            .as_str()
            .unwrap_or_default()
            .to_owned()
    }

    /// A WebSocket.
    ///
    /// # Panics
    /// When it is refused.
    pub fn web_socket(self, path: &str) -> WebSocket {
        self.try_web_socket(path).expect("a WebSocket is accepted")
    }

    /// A WebSocket, if it is accepted.
    ///
    /// # Errors
    /// Why not.
    pub fn try_web_socket(self, path: &str) -> Result<WebSocket, tungstenite::Error> {
        let request = format!("ws://{}{path}", self.0).into_client_request()?;
        match tungstenite::client(request, self.connect()) {
            Ok((socket, _)) => Ok(WebSocket(socket)),
            Err(tungstenite::HandshakeError::Failure(error)) => Err(error),
            Err(other) => panic!("{other}"),
        }
    }
}

const UPGRADE: &str = "Host: line-us.local\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
    Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";

impl Web {
    /// So many connections at once, each of which does something that it should not, then says no more.
    /// Returns when all of them are answered or closed.
    ///
    /// # Panics
    /// When one of them is not.
    pub fn crowd(self, size: usize) {
        let live = format!("GET /api/live HTTP/1.1\r\n{UPGRADE}");
        let gcode = format!("GET / HTTP/1.1\r\n{UPGRADE}\u{1}\u{2}\u{3}");
        let headers = format!("GET / HTTP/1.1\r\n{}", "A: b\r\n".repeat(30));
        let long = format!("GET / HTTP/1.1\r\nA: {}\r\n\r\n", "x".repeat(10_000));
        let page = "GET / HTTP/1.1\r\n\r\n";
        let words = ["", "G", page, &live, &gcode, &headers, &long];
        let streams: Vec<_> = (0..size)
            .map(|number| {
                let mut stream = self.connect();
                // It may be turned away before it has said anything.
                let _ = stream.write_all(words[number % words.len()].as_bytes());
                stream
            })
            .collect();
        for mut stream in streams {
            let _ = stream.shutdown(Shutdown::Write);
            let mut answer = Vec::new();
            if let Err(error) = stream.read_to_end(&mut answer) {
                // Reset, but not forgotten.
                assert_eq!(error.kind(), ErrorKind::ConnectionReset, "{error}");
            }
        }
    }
}

/// A WebSocket.
pub struct WebSocket(tungstenite::WebSocket<TcpStream>);

impl WebSocket {
    /// The next text message.
    ///
    /// # Panics
    /// When something else comes, or nothing.
    pub fn message(&mut self) -> String {
        match self.0.read() {
            Ok(Message::Text(text)) => text.to_string(),
            other => panic!("no text message: {other:?}"),
        }
    }

    /// A command and its reply.
    ///
    /// # Panics
    /// When the arm has closed.
    pub fn say(&mut self, line: &str) -> String {
        self.send(Message::text(line));
        self.message()
    }

    /// Sends a message.
    ///
    /// # Panics
    /// When the arm has closed.
    pub fn send(&mut self, message: Message) {
        self.0.send(message).expect("the arm takes messages");
    }

    /// The next message of any kind.
    ///
    /// # Panics
    /// When the connection breaks off.
    pub fn anything(&mut self) -> Message {
        self.0.read().expect("something comes")
    }

    /// The connection under it, for what no client does.
    pub fn stream(&mut self) -> &mut TcpStream {
        self.0.get_mut()
    }

    /// Vanishes without a word, but not without a trace.
    pub fn die(self) {
        let _ = self.0.get_ref().shutdown(Shutdown::Both);
    }
}
