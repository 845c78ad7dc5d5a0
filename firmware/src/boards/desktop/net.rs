//! The desktop's sockets, without Nagle's delay: each reply leaves at once, in its own segment. A client
//! that has vanished without a word is noticed by keep-alive probes.

use core::net::SocketAddr;
use edge_nal::{TcpAccept, TcpBind};
use edge_nal_std::{Stack, TcpAcceptor, TcpSocket};
use socket2::{SockRef, TcpKeepalive};
use std::io;
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
        Stack::new().bind(address).await.map(Self)
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
