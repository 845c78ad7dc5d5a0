//! The desktop's sockets, without Nagle's delay: each reply leaves at once, in its own segment. A client
//! that has vanished without a word is noticed by keep-alive probes.

use crate::services::discovery::{GROUP, PORT};
use core::net::{IpAddr, Ipv4Addr, SocketAddr};
use edge_nal::{AddrType, Dns, TcpAccept, TcpBind, TcpConnect, UdpBind};
use edge_nal_std::{Stack, TcpAcceptor, TcpSocket, UdpSocket};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use socket2::{Domain, Protocol, SockRef, Socket, TcpKeepalive, Type};
use std::io;
use std::net::TcpStream;
use std::sync::Arc;
use std::time::Duration;

/// A silent client is asked for a sign of life after 10 s, and given up after three questions more.
const KEEP_ALIVE: TcpKeepalive = TcpKeepalive::new()
    .with_time(Duration::from_secs(10))
    .with_interval(Duration::from_secs(5))
    .with_retries(3);

/// Listens on one address.
pub struct Listener(TcpAcceptor);

impl Listener {
    /// Binds to an address.
    ///
    /// # Errors
    /// When it is taken, or not this computer's.
    pub async fn bind(address: SocketAddr) -> io::Result<Self> {
        TcpBind::bind(&Stack::new(), address).await.map(Self)
    }
}

impl TcpAccept for Listener {
    type Error = io::Error;
    type Socket<'a> = TcpSocket;

    async fn accept(&self) -> io::Result<(SocketAddr, TcpSocket)> {
        let (peer, socket) = self.0.accept().await?;
        let options = SockRef::from(socket.get_ref());
        options.set_tcp_nodelay(true)?;
        options.set_tcp_keepalive(&KEEP_ALIVE)?;
        Ok((peer, socket))
    }
}

/// The way to other computers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outside;

impl TcpConnect for Outside {
    type Error = io::Error;
    type Socket<'a> = TcpSocket;

    async fn connect(&self, remote: SocketAddr) -> io::Result<TcpSocket> {
        async_io::Async::<TcpStream>::connect(remote)
            .await
            .map(TcpSocket::new)
    }
}

impl Dns for Outside {
    type Error = io::Error;

    /// The system's answer may take half a minute, and comes in a thread of its own: the arm goes on.
    async fn get_host_by_name(&self, host: &str, kind: AddrType) -> io::Result<IpAddr> {
        let answer = Arc::new(Signal::<CriticalSectionRawMutex, _>::new());
        let (host, told) = (host.to_owned(), answer.clone());
        std::thread::Builder::new().spawn(move || {
            let ask = async { Stack::new().get_host_by_name(&host, kind).await };
            told.signal(embassy_futures::block_on(ask));
        })?;
        answer.wait().await
    }

    async fn get_host_by_address(&self, _: IpAddr, _: &mut [u8]) -> io::Result<usize> {
        Err(io::ErrorKind::Unsupported.into())
    }
}

/// Multicast on one of this computer's networks, on a port that other programs may have as well.
#[derive(Clone, Copy, Debug)]
pub struct Multicast(Ipv4Addr);

impl Multicast {
    /// On the network where clients connect to `address`; where that is any of the computer's, on the one
    /// that its multicasts take.
    ///
    /// # Errors
    /// When the address is one of IPv6, or there is no network.
    pub fn beside(address: IpAddr) -> io::Result<Self> {
        match address {
            IpAddr::V4(address) if !address.is_unspecified() => Ok(Self(address)),
            IpAddr::V4(any) => {
                // Nothing is sent by that.
                let probe = std::net::UdpSocket::bind((any, 0))?;
                probe.connect((GROUP, PORT))?;
                match probe.local_addr()?.ip() {
                    IpAddr::V4(address) => Ok(Self(address)),
                    IpAddr::V6(_) => Err(io::ErrorKind::AddrNotAvailable.into()),
                }
            }
            IpAddr::V6(_) => Err(io::Error::new(
                io::ErrorKind::InvalidInput,
                "clients find the arm at an address of IPv4 only",
            )),
        }
    }

    /// This computer's address on that network.
    pub const fn address(&self) -> Ipv4Addr {
        self.0
    }
}

impl UdpBind for Multicast {
    type Error = io::Error;
    type Socket<'a> = UdpSocket;

    async fn bind(&self, local: SocketAddr) -> io::Result<UdpSocket> {
        let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
        socket.set_reuse_address(true)?;
        #[cfg(unix)]
        socket.set_reuse_port(true)?;
        socket.bind(&local.into())?;
        socket.set_multicast_if_v4(&self.0)?;
        // RFC 6762, section 11.
        socket.set_multicast_ttl_v4(255)?;
        socket.set_ttl_v4(255)?;
        let socket = async_io::Async::new(std::net::UdpSocket::from(socket))?;
        Ok(UdpSocket::new(socket))
    }
}
