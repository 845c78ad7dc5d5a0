//! The desktop's sockets, without Nagle's delay: each reply leaves at once, in its own segment.

use core::net::SocketAddr;
use edge_nal::{TcpAccept, TcpBind};
use edge_nal_std::{Stack, TcpAcceptor, TcpSocket};
use std::io;

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
        socket.get_ref().set_nodelay(true)?;
        Ok((peer, socket))
    }
}
