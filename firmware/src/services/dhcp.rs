//! Addresses for the guests of the machine's own network.

use crate::log::warning;
use core::net::{IpAddr, Ipv4Addr, SocketAddr};
use edge_dhcp::io::{self, DEFAULT_SERVER_PORT};
use edge_dhcp::server::{Server, ServerOptions};
use edge_nal::UdpBind;
use embassy_time::{Instant, Timer};

/// Address of the machine on its own network.
pub const OWN_ADDRESS: Ipv4Addr = Ipv4Addr::new(192, 168, 4, 1);
/// Bits of its network's prefix.
pub const OWN_PREFIX: u8 = 24;
/// Addresses given out: more than guests, because phones come back with another hardware address and
/// take another one. When all are taken, the next guest gets none until one has expired.
const LEASES: usize = 16;
/// Longest DHCP packet.
pub const MAX_PACKET: usize = 1024;

/// Gives addresses to whoever asks, for ever.
pub async fn serve(udp: &impl UdpBind) -> ! {
    let any = SocketAddr::new(IpAddr::V4(Ipv4Addr::UNSPECIFIED), DEFAULT_SERVER_PORT);
    let mut server = Server::<_, LEASES>::new(|| Instant::now().as_secs(), OWN_ADDRESS);
    server.range_start = Ipv4Addr::new(192, 168, 4, 2);
    server.range_end = Ipv4Addr::new(192, 168, 4, 1 + LEASES as u8);
    let mut gateway = [Ipv4Addr::UNSPECIFIED];
    let options = ServerOptions::new(OWN_ADDRESS, Some(&mut gateway));
    let mut packet = [0; MAX_PACKET];
    loop {
        if let Ok(mut socket) = udp.bind(any).await {
            // It ends with an error only.
            let _ = io::server::run(&mut server, &options, &mut socket, &mut packet).await;
        }
        warning!("the address service starts again");
        Timer::after_secs(1).await;
    }
}
