//! Addresses for the guests of the machine's own network.

use super::portal;
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
    let options = options(&mut gateway);
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

/// What guests are told beside their address: the machine is their router and knows all names, and where the
/// setup page is (option 114, RFC 8910).
fn options(gateway: &mut [Ipv4Addr; 1]) -> ServerOptions<'_> {
    let mut options = ServerOptions::new(OWN_ADDRESS, Some(gateway));
    options.dns = &[OWN_ADDRESS];
    options.captive_url = Some(portal::URL);
    options
}

#[cfg(test)]
mod tests {
    use super::*;
    use edge_dhcp::{Options, Packet};

    /// A request of a phone (RFC 2131, section 2): discover, and what it wants to know.
    fn discover() -> Vec<u8> {
        let mut packet = vec![1, 1, 6, 0, 1, 2, 3, 4];
        packet.resize(28, 0);
        packet.extend([2, 0, 0, 0, 0, 9]);
        packet.resize(236, 0);
        packet.extend([99, 130, 83, 99, 53, 1, 1, 55, 4, 1, 3, 6, 114, 255]);
        packet
    }

    #[test]
    fn a_guest_is_told_what_brings_up_the_setup_page() {
        let mut server = Server::<_, LEASES>::new(|| 0, OWN_ADDRESS);
        let mut gateway = [Ipv4Addr::UNSPECIFIED];
        let options = options(&mut gateway);
        let asked = discover();
        let request = Packet::decode(&asked).unwrap();
        let mut buffer = Options::buf();
        let offer = server.handle_request(&mut buffer, &options, &request);
        let mut bytes = [0; MAX_PACKET];
        let offer = offer.unwrap().encode(&mut bytes).unwrap();
        let mut url = vec![114, 19];
        url.extend(b"http://192.168.4.1/");
        for (what, option) in [
            ("subnet", &[1, 4, 255, 255, 255, 0][..]),
            ("router", &[3, 4, 192, 168, 4, 1]),
            ("names", &[6, 4, 192, 168, 4, 1]),
            ("setup page", &url),
        ] {
            let found = offer.windows(option.len()).any(|bytes| bytes == option);
            assert!(found, "{what}: {offer:?}");
        }
    }
}
