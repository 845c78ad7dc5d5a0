//! TCP of `embassy-net` through the traits of `edge-nal`, with the three options that a request-and-reply protocol needs and
//! that `edge-nal-embassy` 0.9 has no access to: no Nagle delay, keep-alive, and a time limit for a peer that has vanished.
//!
//! `flush` ends a segment: what is written after it does not share one with what was written before. (`embassy-net`'s own `flush`
//! waits until the peer has acknowledged, a round trip for each reply.) The segment leaves as soon as the task waits for
//! anything, so a reply followed by a `read` costs nothing extra, and only a reply right behind another one makes way for the
//! network stack first.
#![allow(unsafe_code)]

use core::{
    cell::RefCell,
    fmt,
    future::{Future, poll_fn},
    mem::ManuallyDrop,
    net::{IpAddr, SocketAddr},
    pin::pin,
    ptr::NonNull,
    task::Poll,
};

use edge_nal::{AddrType, Close, Dns, Readable, TcpBind, TcpConnect, TcpShutdown, TcpSplit};
use embassy_futures::yield_now;
use embassy_net::{
    IpListenEndpoint, Stack,
    dns::DnsQueryType,
    tcp::{AcceptError, ConnectError, Error as NetError, TcpReader, TcpSocket, TcpWriter},
};
use embassy_time::Duration;
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};

/// A silent peer is asked for a sign of life this often.
pub const KEEP_ALIVE: Duration = Duration::from_secs(5);
/// A peer that acknowledges nothing, not even keep-alives, is given up after this.
pub const TIMEOUT: Duration = Duration::from_secs(20);

/// Buffers of one connection.
pub struct Buffers<const RX: usize, const TX: usize> {
    rx: [u8; RX],
    tx: [u8; TX],
}

impl<const RX: usize, const TX: usize> Buffers<RX, TX> {
    /// Empty buffers.
    pub const fn new() -> Self {
        Self {
            rx: [0; RX],
            tx: [0; TX],
        }
    }
}

impl<const RX: usize, const TX: usize> Default for Buffers<RX, TX> {
    fn default() -> Self {
        Self::new()
    }
}

/// Connections that a service may have at a time: `N`, each with its buffers.
pub struct Pool<const N: usize, const RX: usize, const TX: usize> {
    free: RefCell<[Option<&'static mut Buffers<RX, TX>>; N]>,
}

impl<const N: usize, const RX: usize, const TX: usize> Pool<N, RX, TX> {
    /// A pool of these buffers.
    pub fn new(buffers: &'static mut [Buffers<RX, TX>; N]) -> Self {
        Self {
            free: RefCell::new(buffers.each_mut().map(Some)),
        }
    }

    fn take(&self) -> Option<&'static mut Buffers<RX, TX>> {
        self.free.borrow_mut().iter_mut().find_map(Option::take)
    }

    fn give_back(&self, buffers: &'static mut Buffers<RX, TX>) {
        if let Some(place) = self
            .free
            .borrow_mut()
            .iter_mut()
            .find(|place| place.is_none())
        {
            *place = Some(buffers);
        }
    }
}

/// Why a connection failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// Reset by the peer, or given up.
    Connection(NetError),
    /// Could not listen.
    Accept(AcceptError),
    /// Could not connect.
    Connect(ConnectError),
    /// The host's name is not known.
    Name,
    /// All connections of the pool are in use.
    NoBuffers,
    /// Not an IPv4 address.
    Address,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

impl core::error::Error for Error {}

impl embedded_io_async::Error for Error {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Connection(_) => ErrorKind::ConnectionReset,
            Self::Accept(_) | Self::Connect(_) | Self::Name => ErrorKind::Other,
            Self::NoBuffers => ErrorKind::OutOfMemory,
            Self::Address => ErrorKind::InvalidInput,
        }
    }
}

impl From<NetError> for Error {
    fn from(error: NetError) -> Self {
        Self::Connection(error)
    }
}

/// TCP of one network stack, with one service's connections.
#[derive(Clone, Copy)]
pub struct Tcp<const N: usize, const RX: usize, const TX: usize> {
    stack: Stack<'static>,
    pool: &'static Pool<N, RX, TX>,
}

impl<const N: usize, const RX: usize, const TX: usize> Tcp<N, RX, TX> {
    /// TCP on `stack`, which must have room for `N` sockets.
    pub fn new(stack: Stack<'static>, pool: &'static Pool<N, RX, TX>) -> Self {
        Self { stack, pool }
    }
}

impl<const N: usize, const RX: usize, const TX: usize> TcpBind for Tcp<N, RX, TX> {
    type Error = Error;
    type Accept<'a> = Acceptor<N, RX, TX>;

    async fn bind(&self, local: SocketAddr) -> Result<Acceptor<N, RX, TX>, Error> {
        let addr = match local.ip() {
            ip if ip.is_unspecified() => None,
            IpAddr::V4(ip) => Some(ip.into()),
            IpAddr::V6(_) => return Err(Error::Address),
        };
        Ok(Acceptor {
            tcp: *self,
            local: IpListenEndpoint {
                addr,
                port: local.port(),
            },
        })
    }
}

impl<const N: usize, const RX: usize, const TX: usize> TcpConnect for Tcp<N, RX, TX> {
    type Error = Error;
    type Socket<'a> = Socket<N, RX, TX>;

    async fn connect(&self, remote: SocketAddr) -> Result<Socket<N, RX, TX>, Error> {
        let IpAddr::V4(address) = remote.ip() else {
            return Err(Error::Address);
        };
        let mut socket = Socket::new(*self)?;
        let connected = socket.inner.connect((address, remote.port())).await;
        connected.map_err(Error::Connect)?;
        Ok(socket)
    }
}

impl<const N: usize, const RX: usize, const TX: usize> Dns for Tcp<N, RX, TX> {
    type Error = Error;

    async fn get_host_by_name(&self, host: &str, _: AddrType) -> Result<IpAddr, Error> {
        let found = self.stack.dns_query(host, DnsQueryType::A).await;
        let first = found.ok().and_then(|found| found.first().copied());
        first.map(IpAddr::from).ok_or(Error::Name)
    }

    /// Nobody asks.
    async fn get_host_by_address(&self, _: IpAddr, _: &mut [u8]) -> Result<usize, Error> {
        Err(Error::Name)
    }
}

/// Accepts connections. There is no backlog: as many can arrive at the same time as tasks wait in `accept`; others are refused.
pub struct Acceptor<const N: usize, const RX: usize, const TX: usize> {
    tcp: Tcp<N, RX, TX>,
    local: IpListenEndpoint,
}

impl<const N: usize, const RX: usize, const TX: usize> edge_nal::TcpAccept for Acceptor<N, RX, TX> {
    type Error = Error;
    type Socket<'a> = Socket<N, RX, TX>;

    async fn accept(&self) -> Result<(SocketAddr, Socket<N, RX, TX>), Error> {
        let mut socket = Socket::new(self.tcp)?;
        socket
            .inner
            .accept(self.local)
            .await
            .map_err(Error::Accept)?;
        let peer = socket
            .inner
            .remote_endpoint()
            .ok_or(Error::Connection(NetError::ConnectionReset))?;
        Ok((SocketAddr::new(peer.addr.into(), peer.port), socket))
    }
}

/// A connection. Dropping it says nothing to the peer: `close` or `abort` it first.
pub struct Socket<const N: usize, const RX: usize, const TX: usize> {
    inner: ManuallyDrop<TcpSocket<'static>>,
    buffers: NonNull<Buffers<RX, TX>>,
    /// A segment was ended and the network stack has not run since.
    ended: bool,
    pool: &'static Pool<N, RX, TX>,
}

impl<const N: usize, const RX: usize, const TX: usize> Socket<N, RX, TX> {
    fn new(tcp: Tcp<N, RX, TX>) -> Result<Self, Error> {
        let buffers = NonNull::from(tcp.pool.take().ok_or(Error::NoBuffers)?);
        // SAFETY: taken from the pool, where they lay as `&'static mut`; `drop` puts them back when `inner` is gone.
        let Buffers { rx, tx } = unsafe { &mut *buffers.as_ptr() };
        let mut inner = TcpSocket::new(tcp.stack, rx, tx);
        inner.set_nagle_enabled(false);
        inner.set_keep_alive(Some(KEEP_ALIVE));
        inner.set_timeout(Some(TIMEOUT));
        Ok(Self {
            inner: ManuallyDrop::new(inner),
            buffers,
            ended: false,
            pool: tcp.pool,
        })
    }
}

impl<const N: usize, const RX: usize, const TX: usize> Drop for Socket<N, RX, TX> {
    fn drop(&mut self) {
        // SAFETY: not used after this, as `self` is being dropped.
        unsafe { ManuallyDrop::drop(&mut self.inner) };
        // SAFETY: the socket that borrowed them is gone.
        self.pool.give_back(unsafe { &mut *self.buffers.as_ptr() });
    }
}

/// Lets the network stack send what has just been written.
///
/// Writing wakes the stack's task, but embassy runs tasks that were woken in one round in reverse order: after one yield this task
/// may be first again. After two, the stack has run.
async fn hand_over() {
    yield_now().await;
    yield_now().await;
}

impl<const N: usize, const RX: usize, const TX: usize> ErrorType for Socket<N, RX, TX> {
    type Error = Error;
}

impl<const N: usize, const RX: usize, const TX: usize> Read for Socket<N, RX, TX> {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut waited = false;
        let result = {
            let mut read = pin!(self.inner.read(buffer));
            poll_fn(|cx| {
                let result = read.as_mut().poll(cx);
                waited |= result.is_pending();
                result
            })
            .await
        };
        self.ended &= !waited;
        Ok(result?)
    }
}

impl<const N: usize, const RX: usize, const TX: usize> Write for Socket<N, RX, TX> {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Error> {
        if core::mem::take(&mut self.ended) {
            hand_over().await;
        }
        Ok(self.inner.write(bytes).await?)
    }

    async fn flush(&mut self) -> Result<(), Error> {
        self.ended = true;
        Ok(())
    }
}

impl<const N: usize, const RX: usize, const TX: usize> Readable for Socket<N, RX, TX> {
    async fn readable(&mut self) -> Result<(), Error> {
        // `wait_read_ready` alone would sleep through the end of the stream.
        poll_fn(|cx| match pin!(self.inner.wait_read_ready()).poll(cx) {
            Poll::Pending if self.inner.may_recv() => Poll::Pending,
            _ => Poll::Ready(()),
        })
        .await;
        Ok(())
    }
}

impl<const N: usize, const RX: usize, const TX: usize> TcpShutdown for Socket<N, RX, TX> {
    async fn close(&mut self, what: Close) -> Result<(), Error> {
        if what != Close::Read {
            self.inner.close();
            self.inner.flush().await?;
        }
        if what != Close::Write {
            let mut discarded = [0; 64];
            while self.inner.read(&mut discarded).await? > 0 {}
        }
        Ok(())
    }

    async fn abort(&mut self) -> Result<(), Error> {
        self.inner.abort();
        self.inner.flush().await?;
        Ok(())
    }
}

/// Receiving half of a connection.
pub struct ReadHalf<'a>(TcpReader<'a>);
/// Sending half of a connection.
pub struct WriteHalf<'a>(TcpWriter<'a>);

impl<const N: usize, const RX: usize, const TX: usize> TcpSplit for Socket<N, RX, TX> {
    type Read<'a> = ReadHalf<'a>;
    type Write<'a> = WriteHalf<'a>;

    fn split(&mut self) -> (ReadHalf<'_>, WriteHalf<'_>) {
        let (read, write) = self.inner.split();
        (ReadHalf(read), WriteHalf(write))
    }
}

impl ErrorType for ReadHalf<'_> {
    type Error = Error;
}

impl Read for ReadHalf<'_> {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Error> {
        Ok(self.0.read(buffer).await?)
    }
}

impl Readable for ReadHalf<'_> {
    /// Ends when there is something to read; unlike [`Socket`], not at the end of the stream.
    async fn readable(&mut self) -> Result<(), Error> {
        self.0.wait_read_ready().await;
        Ok(())
    }
}

impl ErrorType for WriteHalf<'_> {
    type Error = Error;
}

impl Write for WriteHalf<'_> {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Error> {
        Ok(self.0.write(bytes).await?)
    }

    async fn flush(&mut self) -> Result<(), Error> {
        hand_over().await;
        Ok(())
    }
}
