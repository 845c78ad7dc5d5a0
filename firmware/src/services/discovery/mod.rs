//! Discovery: the machine is found by name (`<name>.local`) and by what it does (`_lineus._tcp`), with
//! multicast DNS (RFC 6762) and DNS service discovery (RFC 6763).
//!
//! Names, records and messages are edge-mdns's and domain's. When to say what is our own: the crate's
//! responder neither claims names nor gives one up, it answers whatever the type asked for, and a question
//! with many names ends it.

mod messages;
mod records;
mod responder;

pub use messages::{MAX_ENTRIES, MAX_MESSAGE, MAX_SENT};
pub use records::{MAX_HOST, Ports};

use super::House;
use crate::log::{info, warning};
use core::cell::RefCell;
use core::net::{IpAddr, Ipv4Addr, SocketAddr};
use edge_nal::{MulticastV4, UdpBind, UdpReceive, UdpSend};
use embassy_futures::select::{Either3, select3};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer, with_timeout};
use heapless::String;
use protocol_core::motion::Micros;
use responder::{Place, Responder};

/// Port of multicast DNS.
pub const PORT: u16 = 5353;
/// Where everybody listens.
pub const GROUP: Ipv4Addr = Ipv4Addr::new(224, 0, 0, 251);
/// How long a message may wait for the network to take it; then it is lost.
const PATIENCE: Duration = Duration::from_secs(1);
/// The machine's address is looked at so often.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// How the machine is found, for the other services.
pub struct Discovery {
    host: Mutex<CriticalSectionRawMutex, RefCell<Option<String<MAX_HOST>>>>,
    renamed: Signal<CriticalSectionRawMutex, ()>,
}

impl Default for Discovery {
    fn default() -> Self {
        Self::new()
    }
}

impl Discovery {
    /// Not found yet.
    pub const fn new() -> Self {
        Self {
            host: Mutex::new(RefCell::new(None)),
            renamed: Signal::new(),
        }
    }

    /// The name under which the machine is found, without `.local`, which is not its own where somebody else
    /// has that; `None` while there is none.
    pub fn host(&self) -> Option<String<MAX_HOST>> {
        self.host.lock(|host| host.borrow().clone())
    }

    /// The machine has another name.
    pub fn renamed(&self) {
        self.renamed.signal(());
    }

    fn tell(&self, responder: &Responder) {
        let new = responder.host();
        self.host.lock(|host| {
            let mut host = host.borrow_mut();
            let same = host.as_deref() == new;
            if same {
                return;
            }
            if let Some(name) = new {
                info!("found as {}.local", name);
            }
            *host = new.and_then(|name| String::try_from(name).ok());
        });
    }
}

/// Makes the machine known, for ever. `address` is the machine's own, on whatever network it is.
pub async fn run<U: UdpBind>(
    house: &House,
    udp: &U,
    address: impl Fn() -> Option<Ipv4Addr>,
    ports: Ports,
) -> ! {
    let [.., a, b, c, d] = house.identity.mac;
    let mut responder = Responder::new(ports, u32::from_be_bytes([a, b, c, d]));
    let any = SocketAddr::new(IpAddr::V4(Ipv4Addr::UNSPECIFIED), PORT);
    loop {
        if let Ok(mut socket) = udp.bind(any).await
            && socket
                .join_v4(GROUP, address().unwrap_or(Ipv4Addr::UNSPECIFIED))
                .await
                .is_ok()
        {
            // It ends with an error of the socket, which is made anew.
            serve(house, &mut responder, &mut socket, &address).await;
        }
        warning!("discovery starts again");
        Timer::after_secs(1).await;
    }
}

/// Until the socket fails.
async fn serve(
    house: &House,
    responder: &mut Responder,
    socket: &mut (impl UdpReceive + UdpSend),
    address: &impl Fn() -> Option<Ipv4Addr>,
) {
    let group = SocketAddr::new(IpAddr::V4(GROUP), PORT);
    let mut received = [0; MAX_MESSAGE];
    let mut buffer = [0; MAX_SENT];
    loop {
        let place = address().map(|address| Place {
            connection: house.wifi.connection(),
            address,
        });
        responder.set(&house.name(), place, now());
        while let Some(length) = responder.say(now(), &mut buffer) {
            send(socket, group, buffer.get(..length).unwrap_or_default()).await;
        }
        house.discovery.tell(responder);
        let look = Instant::now() + LOOK_EVERY;
        let next = responder
            .next()
            .map_or(look, |next| look.min(Instant::from_micros(next.get())));
        let happened = select3(
            socket.receive(&mut received),
            Timer::at(next),
            house.discovery.renamed.wait(),
        );
        match happened.await {
            Either3::First(Ok((length, from))) => {
                let message = received.get(..length).unwrap_or_default();
                let one_shot = from.port() != PORT;
                if let Some(length) = responder.take(message, one_shot, now(), &mut buffer) {
                    send(socket, from, buffer.get(..length).unwrap_or_default()).await;
                }
            }
            Either3::First(Err(_)) => return,
            Either3::Second(()) | Either3::Third(()) => {}
        }
    }
}

/// A message that the network does not take is lost, as any may be.
async fn send(socket: &mut impl UdpSend, to: SocketAddr, message: &[u8]) {
    let _ = with_timeout(PATIENCE, socket.send(to, message)).await;
}

fn now() -> Micros {
    Micros::new(Instant::now().as_micros())
}
