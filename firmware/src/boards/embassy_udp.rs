//! The socket of discovery on boards with embassy-net.
//!
//! Messages leave with the stack's own time to live, 64, and not with 255 as RFC 6762 (section 11) would like
//! it: edge-nal-embassy 0.9 has no access to that. Who receives them must not look at it.

use crate::services::discovery::MAX_SENT;
use core::net::Ipv4Addr;
use edge_nal::UdpBind;
use edge_nal_embassy::{Udp, UdpBuffers, UdpError, UdpSocket};
use embassy_net::Stack;
use static_cell::StaticCell;

/// Room for messages that wait to be read: one of the longest, or several as they usually are.
const WAITING: usize = 2048;
/// Messages that may wait, in each direction.
const MESSAGES: usize = 8;

/// Where discovery has its socket.
pub struct Multicast {
    stack: Stack<'static>,
    udp: Udp<'static>,
}

impl Multicast {
    /// On this stack, which needs room for one more socket.
    ///
    /// # Panics
    /// When it is called twice.
    pub fn new(stack: Stack<'static>) -> Self {
        static BUFFERS: StaticCell<UdpBuffers<1, MAX_SENT, WAITING, MESSAGES>> = StaticCell::new();
        let udp = Udp::new(stack, BUFFERS.init_with(UdpBuffers::new));
        Self { stack, udp }
    }

    /// The machine's address, `None` as long as it has none.
    pub fn address(&self) -> Option<Ipv4Addr> {
        let config = self.stack.config_v4()?;
        Some(config.address.address())
    }
}

impl UdpBind for Multicast {
    type Error = UdpError;
    type Socket<'a> = UdpSocket<'a>;

    async fn bind(&self, local: core::net::SocketAddr) -> Result<UdpSocket<'_>, UdpError> {
        self.udp.bind(local).await
    }
}
