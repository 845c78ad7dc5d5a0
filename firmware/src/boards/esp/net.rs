//! The network stack: a DHCP client on a joined network, 192.168.4.1 on the machine's own.

use super::interface::{self, Interfaces, Side};
use crate::board::Address;
use crate::boards::embassy_tcp::{Buffers, Pool, Tcp};
use crate::boards::embassy_udp::Multicast;
use crate::services::dhcp::{self, MAX_PACKET, OWN_ADDRESS, OWN_PREFIX};
use crate::services::names;
use crate::services::web;
use edge_nal_embassy::{Udp, UdpBuffers};
use embassy_futures::join::join;
use embassy_net::{Config, ConfigV4, Ipv4Cidr, Runner, Stack, StackResources, StaticConfigV4};
use esp_hal::rng::Rng;
use protocol_core::machine::MAX_CLIENTS;
use static_cell::StaticCell;

/// Line-us connections: the clients, and the one that is told that there are too many.
pub const CONNECTIONS: usize = MAX_CLIENTS + 1;
/// Connections of browsers, and the one that is told that there are too many.
pub const WEB_CONNECTIONS: usize = web::CONNECTIONS + 1;
/// Services for guests, each with a socket: addresses and names.
const FOR_GUESTS: usize = 2;
/// Sockets: the connections, the services for guests, and one each for updates, the DHCP client, the DNS
/// client and discovery.
const SOCKETS: usize = CONNECTIONS + WEB_CONNECTIONS + FOR_GUESTS + 4;
/// Buffer of a connection in bytes, in each direction: a segment of Ethernet.
const BUFFER: usize = 1536;
/// The connections.
pub type Connections = Tcp<CONNECTIONS, BUFFER, BUFFER>;
/// The connection for updates.
pub type UpdateConnection = Tcp<1, BUFFER, BUFFER>;
/// Buffer of a browser's connection in bytes, in each direction. Requests are short, and the page goes out
/// in pieces of this size.
const WEB_BUFFER: usize = 1024;
/// The connections of browsers.
pub type WebConnections = Tcp<WEB_CONNECTIONS, WEB_BUFFER, WEB_BUFFER>;
/// Requests of guests that may wait to be read, for each service.
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
        static UDP: StaticCell<UdpBuffers<FOR_GUESTS, MAX_PACKET, MAX_PACKET, REQUESTS>> =
            StaticCell::new();

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

    /// The socket for discovery.
    ///
    /// # Panics
    /// When it is called twice.
    pub fn multicast(&self) -> Multicast {
        Multicast::new(self.stack)
    }

    /// The connections for browsers.
    ///
    /// # Panics
    /// When it is called twice.
    pub fn web_connections(&self) -> WebConnections {
        static BUFFERS: StaticCell<[Buffers<WEB_BUFFER, WEB_BUFFER>; WEB_CONNECTIONS]> =
            StaticCell::new();
        static POOL: StaticCell<Pool<WEB_CONNECTIONS, WEB_BUFFER, WEB_BUFFER>> = StaticCell::new();

        let buffers = BUFFERS.init_with(|| [const { Buffers::new() }; WEB_CONNECTIONS]);
        Tcp::new(self.stack, POOL.init(Pool::new(buffers)))
    }

    /// The stack, to ask it for its address.
    pub fn stack(&self) -> Stack<'static> {
        self.stack
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
        let addresses = dhcp::serve(&self.udp);
        join(addresses, names::serve(&self.udp, names::ANYWHERE))
            .await
            .0
    }
}
