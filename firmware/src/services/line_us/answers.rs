//! Replies to one client, who may be slow: what it does not take is lost to itself alone.

use embassy_time::{Duration, with_timeout};
use embedded_io_async::{Read, Write};
use protocol_core::lineus::{MAX_REPLY, Reply};

/// How long a reply may wait for a client that does not read. After that the reply is lost, and so are
/// later ones, without a wait, until the client reads again: its commands are executed all the same.
pub const PATIENCE: Duration = Duration::from_secs(2);
/// How often a client that did not take the whole of a reply is tried again.
const RETRY: Duration = Duration::from_millis(100);

/// The way of replies to one client: whole, in order, each in one write as long as it reads.
/// `N` is the length of the longest one.
pub struct Answers<S, const N: usize = MAX_REPLY> {
    link: Link<S>,
    /// The rest of a reply of which only a part went out: it comes before anything else.
    rest: heapless::Vec<u8, N>,
}

impl<S: Read + Write, const N: usize> Answers<S, N> {
    /// To a client that has just come.
    pub const fn new(socket: S) -> Self {
        Self {
            link: Link {
                socket,
                slow: false,
                gone: false,
            },
            rest: heapless::Vec::new(),
        }
    }

    /// Reads what the client has sent, and meanwhile sees to what it has not yet taken.
    pub async fn read(&mut self, chunk: &mut [u8]) -> Result<usize, S::Error> {
        while !self.rest.is_empty() && !self.link.gone {
            if let Ok(read) = with_timeout(RETRY, self.link.socket.read(chunk)).await {
                return read;
            }
            self.send_rest().await;
        }
        self.link.socket.read(chunk).await
    }

    async fn send_rest(&mut self) {
        let sent = self.link.push(&self.rest).await;
        self.rest.drain(..sent);
    }

    /// Sends a reply with its terminator.
    pub async fn send(&mut self, reply: &Reply) {
        self.send_message(reply.as_bytes()).await;
    }

    /// Sends a message.
    pub async fn send_message(&mut self, message: &[u8]) {
        if !self.rest.is_empty() {
            self.send_rest().await;
            if !self.rest.is_empty() {
                return;
            }
        }
        let sent = self.link.push(message).await;
        if let Some(rest @ [_, ..]) = message.get(sent..)
            && sent > 0
        {
            // It fits: no message is longer.
            let _ = self.rest.extend_from_slice(rest);
        }
        // The next reply is to come in a segment of its own. A socket that fails here fails at the next
        // write as well.
        let _ = self.link.socket.flush().await;
    }
}

struct Link<S> {
    socket: S,
    /// The client does not read: no reply waits for it.
    slow: bool,
    /// The client cannot be written to any more.
    gone: bool,
}

impl<S: Write> Link<S> {
    /// Writes as much of `bytes` as the client takes in time, and gives how much that was.
    async fn push(&mut self, bytes: &[u8]) -> usize {
        let mut sent = 0;
        while let Some(rest @ [_, ..]) = bytes.get(sent..)
            && !self.gone
        {
            let patience = if self.slow { Duration::MIN } else { PATIENCE };
            match with_timeout(patience, self.socket.write(rest)).await {
                Ok(Ok(written @ 1..)) => {
                    sent += written;
                    self.slow = false;
                }
                Ok(_) => self.gone = true,
                Err(_) => {
                    self.slow = true;
                    break;
                }
            }
        }
        sent
    }
}
