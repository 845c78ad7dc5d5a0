//! UDP on a network where nobody else says anything.

use core::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use edge_nal::{
    MulticastV4, MulticastV6, Readable, UdpBind, UdpReceive, UdpSend, UdpSplit, UdpSplitMulticast,
};
use embedded_io_async::ErrorType;
use std::convert::Infallible;
use std::future::pending;

/// The network, and a socket on it.
#[derive(Clone, Copy, Debug)]
pub struct Quiet;

impl ErrorType for Quiet {
    type Error = Infallible;
}

impl UdpBind for Quiet {
    type Error = Infallible;
    type Socket<'a> = Self;

    async fn bind(&self, _local: SocketAddr) -> Result<Self, Infallible> {
        Ok(*self)
    }
}

impl UdpReceive for Quiet {
    async fn receive(&mut self, _buffer: &mut [u8]) -> Result<(usize, SocketAddr), Infallible> {
        pending().await
    }
}

impl Readable for Quiet {
    async fn readable(&mut self) -> Result<(), Infallible> {
        pending().await
    }
}

impl UdpSend for Quiet {
    async fn send(&mut self, _remote: SocketAddr, _data: &[u8]) -> Result<(), Infallible> {
        Ok(())
    }
}

impl UdpSplit for Quiet {
    type Receive<'a> = Self;
    type Send<'a> = Self;

    fn split(&mut self) -> (Self, Self) {
        (*self, *self)
    }
}

impl UdpSplitMulticast for Quiet {
    type MulticastV4<'a> = Self;
    type MulticastV6<'a> = Self;

    fn split_multicast(&mut self) -> (Self, Self, Self, Self) {
        (*self, *self, *self, *self)
    }
}

impl MulticastV4 for Quiet {
    async fn join_v4(&mut self, _group: Ipv4Addr, _interface: Ipv4Addr) -> Result<(), Infallible> {
        Ok(())
    }

    async fn leave_v4(&mut self, _group: Ipv4Addr, _interface: Ipv4Addr) -> Result<(), Infallible> {
        Ok(())
    }
}

impl MulticastV6 for Quiet {
    async fn join_v6(&mut self, _group: Ipv6Addr, _interface: u32) -> Result<(), Infallible> {
        Ok(())
    }

    async fn leave_v6(&mut self, _group: Ipv6Addr, _interface: u32) -> Result<(), Infallible> {
        Ok(())
    }
}
