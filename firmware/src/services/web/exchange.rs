//! One request and its answer: bytes in, bytes out, in one buffer, each step with its limit of time.

use super::failure::{Failure, Status};
use super::request::too_large;
use super::{MAX_BODY, MAX_HEAD, PATIENCE};
use core::fmt::Write as _;
use core::ops::Range;
use embassy_time::with_timeout;
use embedded_io_async::{Read, Write};
use heapless::String;
use protocol_core::settings::AllowedOrigin;
use serde::Serialize;

/// The buffer of a connection: a head, then a body or a piece of it, then the answer.
pub type Room = [u8; MAX_HEAD];
/// Longest head of an answer.
const MAX_ANSWER_HEAD: usize = 640;

/// Why a request is not answered as it should be.
#[derive(Debug)]
pub enum Trouble {
    /// It is refused.
    Failure(Failure),
    /// The client is gone, or takes nothing.
    Gone,
}

impl<F: Into<Failure>> From<F> for Trouble {
    fn from(failure: F) -> Self {
        Self::Failure(failure.into())
    }
}

/// Reads a head into `room`; gives its length, and how much is in the room by then.
pub async fn receive_head<S: Read>(
    socket: &mut S,
    room: &mut Room,
) -> Result<(usize, usize), Trouble> {
    let mut filled = 0;
    let reading = async {
        loop {
            let Some(free @ [_, ..]) = room.get_mut(filled..) else {
                return Err(too_large().into());
            };
            let Ok(read @ 1..) = socket.read(free).await else {
                return Err(Trouble::Gone);
            };
            // The end may have begun in what came before.
            let from = filled.saturating_sub(END.len() - 1);
            filled += read;
            let new = room.get(from..filled).unwrap_or_default();
            if let Some(at) = new.windows(END.len()).position(|bytes| bytes == END) {
                return Ok(from + at + END.len());
            }
        }
    };
    return match with_timeout(PATIENCE, reading).await {
        Ok(Ok(head)) => Ok((head, filled)),
        Ok(Err(trouble)) => Err(trouble),
        // Browsers open connections in advance and say nothing.
        Err(_) if filled == 0 => Err(Trouble::Gone),
        Err(_) => Err(Failure::too_slow().into()),
    };

    const END: &[u8] = b"\r\n\r\n";
}

/// What an answer is, beside its status.
#[derive(Clone, Copy, Debug, Default)]
pub struct Answer<'a> {
    /// `Content-Type`; none for an answer without a body.
    pub kind: Option<&'a str>,
    /// Bytes of the body; where it is not known, the end of the connection is the end of the body.
    pub length: Option<usize>,
    /// More headers, each with its end.
    pub headers: &'a str,
}

/// A request whose head has been read.
pub struct Exchange<'a, S> {
    pub socket: &'a mut S,
    pub room: &'a mut Room,
    /// Bytes of the body that are in the room.
    pub here: usize,
    /// Bytes of the body that have not been taken, those in the room included.
    pub left: usize,
    /// The answer is to have no body.
    pub head_only: bool,
    /// What a page from elsewhere is told: that it may.
    pub allowed: Option<AllowedOrigin>,
}

impl<S: Read + Write> Exchange<'_, S> {
    /// The whole of a short body.
    pub async fn body(&mut self) -> Result<&[u8], Trouble> {
        if self.left > MAX_BODY {
            return Err(Failure::too_large(MAX_BODY).into());
        }
        let reading = async {
            while self.here < self.left {
                let free = self.room.get_mut(self.here..).unwrap_or_default();
                match self.socket.read(free).await {
                    Ok(read @ 1..) => self.here += read,
                    _ => return Err(short()),
                }
            }
            Ok(())
        };
        let read = with_timeout(PATIENCE, reading).await;
        read.map_err(|_| Failure::too_slow())??;
        let body = self.room.get(..self.left).unwrap_or_default();
        self.left = 0;
        Ok(body)
    }

    /// The next piece of a long body; empty at its end.
    pub async fn piece(&mut self) -> Result<&[u8], Trouble> {
        if self.left == 0 {
            return Ok(&[]);
        }
        if self.here == 0 {
            let most = self.left.min(self.room.len());
            let free = self.room.get_mut(..most).unwrap_or_default();
            let read = with_timeout(PATIENCE, self.socket.read(free)).await;
            match read.map_err(|_| Failure::too_slow())? {
                Ok(read @ 1..) => self.here = read,
                _ => return Err(short().into()),
            }
        }
        let taken = self.here.min(self.left);
        self.left -= taken;
        self.here = 0;
        Ok(self.room.get(..taken).unwrap_or_default())
    }

    /// A part of the last piece, up to its end, comes again as the next one.
    pub fn put_back(&mut self, part: Range<usize>) {
        self.left += part.len();
        self.here = part.len();
        self.room.copy_within(part, 0);
    }

    /// Answers with JSON.
    pub async fn json(&mut self, status: Status, value: &impl Serialize) -> Result<(), Trouble> {
        let length = serde_json_core::to_slice(value, self.room.as_mut_slice()).ok();
        self.send(status, length).await
    }

    /// Answers with the JSON in the room: one sender for everything that is told.
    async fn send(&mut self, status: Status, length: Option<usize>) -> Result<(), Trouble> {
        let Some(length) = length else {
            // What is told about the machine fits; this would be a mistake of its own.
            return self.head(Status::SERVER_ERROR, Answer::default()).await;
        };
        let answer = Answer {
            kind: Some("application/json"),
            length: Some(length),
            headers: "Cache-Control: no-store\r\n",
        };
        self.head(status, answer).await?;
        if self.head_only {
            return Ok(());
        }
        let body = self.room.get(..length).unwrap_or_default();
        push(self.socket, body).await
    }

    /// Answers with why not.
    pub async fn refuse(&mut self, failure: &Failure) -> Result<(), Trouble> {
        self.json(failure.status, failure).await
    }

    /// The head of an answer.
    pub async fn head(&mut self, status: Status, answer: Answer<'_>) -> Result<(), Trouble> {
        let mut head = String::<MAX_ANSWER_HEAD>::new();
        let Status(code, reason) = status;
        // It fits: the longest headers are the page's, and a test reads them.
        let _ = write!(head, "HTTP/1.1 {code} {reason}\r\n");
        if let Some(kind) = answer.kind {
            let _ = write!(head, "Content-Type: {kind}\r\n");
        }
        let length = match (answer.kind, code) {
            (Some(_), _) => answer.length,
            // These two never have a body (RFC 9110, section 8.6).
            (None, 204 | 304) => None,
            (None, _) => Some(0),
        };
        if let Some(length) = length {
            let _ = write!(head, "Content-Length: {length}\r\n");
        }
        if let Some(allowed) = &self.allowed {
            let origin = allowed.as_str();
            let _ = write!(
                head,
                "Access-Control-Allow-Origin: {origin}\r\nVary: Origin\r\n"
            );
        }
        let _ = write!(
            head,
            "X-Content-Type-Options: nosniff\r\n{}Connection: close\r\n\r\n",
            answer.headers
        );
        push(self.socket, head.as_bytes()).await
    }

    /// A part of the body of an answer.
    pub async fn push(&mut self, bytes: &[u8]) -> Result<(), Trouble> {
        push(self.socket, bytes).await
    }

    /// A part of the body of an answer, in JSON.
    pub async fn push_json(&mut self, value: &impl Serialize) -> Result<(), Trouble> {
        let length = serde_json_core::to_slice(value, self.room.as_mut_slice()).unwrap_or(0);
        let bytes = self.room.get(..length).unwrap_or_default();
        push(self.socket, bytes).await
    }
}

fn short() -> Failure {
    Failure::bad_request("the body is shorter than its Content-Length")
}

/// Writes all of it, as long as the client takes something.
pub async fn push<S: Write>(socket: &mut S, bytes: &[u8]) -> Result<(), Trouble> {
    let mut rest = bytes;
    while !rest.is_empty() {
        match with_timeout(PATIENCE, socket.write(rest)).await {
            Ok(Ok(written @ 1..)) => rest = rest.get(written..).unwrap_or_default(),
            _ => return Err(Trouble::Gone),
        }
    }
    Ok(())
}

/// Reads what belongs into the body of a request.
pub fn parse<T: serde::de::DeserializeOwned>(body: &[u8]) -> Result<T, Failure> {
    let mut unescaped = [0; MAX_BODY];
    let bad = |why: &dyn core::fmt::Display| {
        Failure::new(Status::BAD_REQUEST, "bad_json", format_args!("{why}"))
    };
    let read = serde_json_core::from_slice_escaped(body, &mut unescaped);
    let (value, length) = read.map_err(|error| bad(&error))?;
    let rest = body.get(length..).unwrap_or_default();
    if rest.trim_ascii().is_empty() {
        Ok(value)
    } else {
        Err(bad(&"there is something behind the JSON"))
    }
}
