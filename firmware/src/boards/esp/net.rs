//! The network stack: a DHCP client on a joined network, 192.168.4.1 on the machine's own.

use super::interface::{self, Interfaces, Side};
use crate::board::Address;
use crate::boards::embassy_tcp::{Buffers, Pool, Tcp};
use crate::services::dhcp::{self, MAX_PACKET, OWN_ADDRESS, OWN_PREFIX};
use edge_nal_embassy::{Udp, UdpBuffers};
use embassy_net::{Config, ConfigV4, Ipv4Cidr, Runner, Stack, StackResources, StaticConfigV4};
use esp_hal::rng::Rng;
use protocol_core::machine::MAX_CLIENTS;
use static_cell::StaticCell;

/// Line-us connections: the clients, and the one that is told that there are too many.
pub const CONNECTIONS: usize = MAX_CLIENTS + 1;
/// Sockets: the connections, the one for updates, the DHCP client, the DHCP server, the DNS client.
const SOCKETS: usize = CONNECTIONS + 4;
/// Buffer of a connection in bytes, in each direction: a segment of Ethernet.
const BUFFER: usize = 1536;
/// The connections.
pub type Connections = Tcp<CONNECTIONS, BUFFER, BUFFER>;
/// The connection for updates.
pub type UpdateConnection = Tcp<1, BUFFER, BUFFER>;
/// DHCP requests that may wait to be read.
const REQUESTS: usize = 4;

/// The stack's own task: run it for ever.
pub type NetRunner = Runner<'static, Interfaces>;

/// The network stack.
pub struct Net {
    stack: Stack<'static>,
    udp: Udp<'static>,
}

impl Net {
    /// Starts the stack, on the station's side. The runner must be spawned.
    ///
    /// # Panics
    /// When it is called twice.
    pub(super) fn start(interfaces: Interfaces) -> (Self, NetRunner) {
        static RESOURCES: StaticCell<StackResources<SOCKETS>> = StaticCell::new();
        static UDP: StaticCell<UdpBuffers<1, MAX_PACKET, MAX_PACKET, REQUESTS>> = StaticCell::new();

        let rng = Rng::new();
        let seed = u64::from(rng.random()) << 32 | u64::from(rng.random());
        let (stack, runner) = embassy_net::new(
            interfaces,
            Config::dhcpv4(Default::default()),
            RESOURCES.init_with(StackResources::new),
            seed,
        );
        let udp = Udp::new(stack, UDP.init_with(UdpBuffers::new));
        (Self { stack, udp }, runner)
    }

    /// The connections for Line-us.
    ///
    /// # Panics
    /// When it is called twice.
    pub fn connections(&self) -> Connections {
        static BUFFERS: StaticCell<[Buffers<BUFFER, BUFFER>; CONNECTIONS]> = StaticCell::new();
        static POOL: StaticCell<Pool<CONNECTIONS, BUFFER, BUFFER>> = StaticCell::new();

        let buffers = BUFFERS.init_with(|| [const { Buffers::new() }; CONNECTIONS]);
        Tcp::new(self.stack, POOL.init(Pool::new(buffers)))
    }

    /// The connection for updates.
    ///
    /// # Panics
    /// When it is called twice.
    pub fn update_connection(&self) -> UpdateConnection {
        static BUFFERS: StaticCell<[Buffers<BUFFER, BUFFER>; 1]> = StaticCell::new();
        static POOL: StaticCell<Pool<1, BUFFER, BUFFER>> = StaticCell::new();

        let buffers = BUFFERS.init_with(|| [const { Buffers::new() }]);
        Tcp::new(self.stack, POOL.init(Pool::new(buffers)))
    }
}

impl Address for Net {
    fn ask(&self) {
        interface::choose(Side::Station);
        self.stack.set_config_v4(ConfigV4::Dhcp(Default::default()));
    }

    async fn serve_guests(&self) -> ! {
        interface::choose(Side::AccessPoint);
        self.stack.set_config_v4(ConfigV4::Static(StaticConfigV4 {
            address: Ipv4Cidr::new(OWN_ADDRESS, OWN_PREFIX),
            gateway: None,
            dns_servers: Default::default(),
        }));
        dhcp::serve(&self.udp).await
    }
}
