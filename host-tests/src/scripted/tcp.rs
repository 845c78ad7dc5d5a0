//! The machine's end of TCP: like a chip's, it takes a connection only while somebody waits for one.

use super::power::Power;
use super::wire::{End, Wire};
use edge_nal::{Close, Readable, TcpAccept, TcpShutdown, TcpSplit};
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::fmt;
use std::future::poll_fn;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::rc::Rc;
use std::task::{Poll, Waker};

type Shared = Rc<RefCell<Wire>>;

/// The port that the machine listens at.
#[derive(Debug, Default)]
pub struct Port {
    connecting: RefCell<VecDeque<(SocketAddr, Shared)>>,
    /// Calls of `accept` that wait.
    waiting: Cell<usize>,
    wakers: RefCell<Vec<Waker>>,
    connected: Cell<u16>,
}

impl Port {
    /// A client connects; `None` when nobody waits for one.
    pub fn connect(&self) -> Option<Shared> {
        let mut connecting = self.connecting.borrow_mut();
        if self.waiting.get() <= connecting.len() {
            return None;
        }
        self.connected.set(self.connected.get() + 1);
        let address = IpAddr::V4(Ipv4Addr::new(192, 168, 4, 2));
        let peer = SocketAddr::new(address, 50_000 + self.connected.get());
        let wire = Shared::new(RefCell::new(Wire::new()));
        connecting.push_back((peer, wire.clone()));
        self.wakers.take().into_iter().for_each(Waker::wake);
        Some(wire)
    }

    /// Nobody waits any more, and who was waiting for somebody is forgotten.
    pub fn power_off(&self) {
        for (_, wire) in self.connecting.take() {
            let mut wire = wire.borrow_mut();
            wire.machine_forgets = true;
            wire.power_failed = true;
        }
        self.wakers.take();
    }
}

/// The other side is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gone(End);

impl fmt::Display for Gone {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, out)
    }
}

impl std::error::Error for Gone {}

impl embedded_io_async::Error for Gone {
    fn kind(&self) -> ErrorKind {
        match self.0 {
            End::Lost => ErrorKind::TimedOut,
            End::Closed | End::Reset => ErrorKind::ConnectionReset,
        }
    }
}

/// Takes connections.
pub struct Acceptor {
    /// Where they come in.
    pub port: Rc<Port>,
    /// Without which nothing is sent.
    pub power: Power,
}

struct Waiting<'a>(&'a Cell<usize>);

impl<'a> Waiting<'a> {
    fn new(count: &'a Cell<usize>) -> Self {
        count.set(count.get() + 1);
        Self(count)
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        self.0.set(self.0.get() - 1);
    }
}

impl TcpAccept for Acceptor {
    type Error = Gone;
    type Socket<'a> = Socket;

    async fn accept(&self) -> Result<(SocketAddr, Socket), Gone> {
        let _waiting = Waiting::new(&self.port.waiting);
        let (peer, wire) = poll_fn(|context| {
            if let Some(connection) = self.port.connecting.borrow_mut().pop_front() {
                return Poll::Ready(connection);
            }
            let mut wakers = self.port.wakers.borrow_mut();
            if !wakers.iter().any(|waker| waker.will_wake(context.waker())) {
                wakers.push(context.waker().clone());
            }
            Poll::Pending
        })
        .await;
        let power = self.power.clone();
        Ok((peer, Socket(Stream { wire, power })))
    }
}

/// A connection. Dropped before it is closed, it is reset.
pub struct Socket(Stream);

impl Drop for Socket {
    fn drop(&mut self) {
        let mut wire = self.0.wire.borrow_mut();
        wire.machine_forgets = true;
        wire.outgoing.clear();
        wire.power_failed = !self.0.power.is_on();
    }
}

impl ErrorType for Socket {
    type Error = Gone;
}

impl Read for Socket {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Gone> {
        self.0.read(buffer).await
    }
}

impl Readable for Socket {
    async fn readable(&mut self) -> Result<(), Gone> {
        self.0.readable().await
    }
}

impl Write for Socket {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Gone> {
        self.0.write(bytes).await
    }

    async fn flush(&mut self) -> Result<(), Gone> {
        Ok(())
    }
}

impl TcpSplit for Socket {
    type Read<'a> = Stream;
    type Write<'a> = Stream;

    fn split(&mut self) -> (Stream, Stream) {
        (self.0.clone(), self.0.clone())
    }
}

impl TcpShutdown for Socket {
    async fn close(&mut self, what: Close) -> Result<(), Gone> {
        if what != Close::Read {
            self.0.wire.borrow_mut().machine_finishes = true;
            self.0
                .until(|wire| match wire.broken() {
                    Some(end) => Some(Err(Gone(end))),
                    None => wire.outgoing.is_empty().then_some(Ok(())),
                })
                .await?;
        }
        if what != Close::Write {
            while self.0.read(&mut [0; 64]).await? > 0 {}
        }
        Ok(())
    }

    async fn abort(&mut self) -> Result<(), Gone> {
        let mut wire = self.0.wire.borrow_mut();
        wire.client_sees.get_or_insert(End::Reset);
        Ok(())
    }
}

/// The bytes of a connection, both ways.
#[derive(Clone)]
pub struct Stream {
    wire: Shared,
    power: Power,
}

impl Stream {
    /// Tries until something comes of it; without power nothing does.
    async fn until<T>(&self, mut attempt: impl FnMut(&mut Wire) -> Option<T>) -> T {
        poll_fn(|context| {
            let mut wire = self.wire.borrow_mut();
            let result = match self.power.is_on() {
                true => attempt(&mut wire),
                false => None,
            };
            if result.is_none() {
                wire.register(context.waker());
            }
            result.map_or(Poll::Pending, Poll::Ready)
        })
        .await
    }
}

impl ErrorType for Stream {
    type Error = Gone;
}

impl Read for Stream {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Gone> {
        self.until(|wire| {
            let length = wire.arrived.len().min(buffer.len());
            if length > 0 {
                let bytes = wire.arrived.drain(..length);
                buffer
                    .iter_mut()
                    .zip(bytes)
                    .for_each(|(to, from)| *to = from);
                return Some(Ok(length));
            }
            wire.machine_sees.map(|end| match end {
                End::Closed => Ok(0),
                End::Reset | End::Lost => Err(Gone(end)),
            })
        })
        .await
    }
}

impl Readable for Stream {
    async fn readable(&mut self) -> Result<(), Gone> {
        self.until(|wire| {
            (!wire.arrived.is_empty() || wire.machine_sees.is_some()).then_some(Ok(()))
        })
        .await
    }
}

impl Write for Stream {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Gone> {
        self.until(|wire| {
            if let Some(end) = wire.broken() {
                return Some(Err(Gone(end)));
            }
            if wire.machine_finishes {
                return Some(Err(Gone(End::Closed)));
            }
            let fits = bytes.len().min(wire.room());
            wire.outgoing.extend(bytes.iter().take(fits));
            (fits > 0 || bytes.is_empty()).then_some(Ok(fits))
        })
        .await
    }

    async fn flush(&mut self) -> Result<(), Gone> {
        Ok(())
    }
}
