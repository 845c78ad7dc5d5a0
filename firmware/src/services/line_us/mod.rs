//! Line-us G-code over TCP: a pool of connections, one session each.
//!
//! Each of [`MAX_CLIENTS`] workers accepts, serves, and accepts again; when all are busy, the doorman
//! takes the next client, says so, and closes. What a slow client loses is its own replies.

mod answers;
mod drawings;
mod perform;

pub(super) use answers::Answers;
pub use answers::PATIENCE;
pub(super) use perform::perform;

use super::House;
use crate::log::info;
use core::net::{IpAddr, Ipv4Addr, SocketAddr};
use core::sync::atomic::{AtomicU8, Ordering};
use edge_nal::{Close, TcpAccept, TcpShutdown};
use embassy_futures::select::{Either, select};
use embassy_futures::yield_now;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer, with_timeout};
use embedded_io_async::{Read, Write};
use heapless::Vec;
use protocol_core::lineus::{Reply, Request, Session};
use protocol_core::machine::{Client, MAX_CLIENTS};

/// The port of Line-us.
pub const PORT: u16 = 1337;
/// The port, at every address that the machine has.
pub const ANYWHERE: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::UNSPECIFIED), PORT);
/// Bytes taken from a socket at a time.
const CHUNK: usize = 512;
/// How long a client has to close after its last reply.
const FAREWELL: Duration = Duration::from_secs(1);
/// How long a client that is turned away has to read why, while others wait.
const TURNED_AWAY: Duration = Duration::from_millis(250);

/// The pool of connections.
#[derive(Default)]
pub struct Server {
    busy: AtomicU8,
    /// A worker became busy or free.
    changed: Signal<CriticalSectionRawMutex, ()>,
}

impl Server {
    /// With nobody connected.
    pub const fn new() -> Self {
        Self {
            busy: AtomicU8::new(0),
            changed: Signal::new(),
        }
    }

    /// One worker of the pool: serves one client after the other, for ever.
    pub async fn work<A: TcpAccept>(&self, acceptor: &A, client: Client, house: &House) -> ! {
        loop {
            let Ok((peer, mut socket)) = acceptor.accept().await else {
                // Out of sockets, or a client that left before it was met: not at full speed, though.
                Timer::after_millis(10).await;
                continue;
            };
            self.count(1, house);
            info!("client {} connected", peer);
            house.greet_first_client().await;
            serve(&mut socket, client, house).await;
            // It may be gone already; then there is nothing to close.
            let _ = with_timeout(FAREWELL, socket.close(Close::Both)).await;
            info!("client {} left", peer);
            self.count(-1, house);
        }
    }

    /// Tells clients that come when all workers are busy, and closes.
    pub async fn turn_away<A: TcpAccept>(&self, acceptor: &A) -> ! {
        loop {
            if usize::from(self.busy.load(Ordering::Relaxed)) < MAX_CLIENTS {
                self.changed.wait().await;
                continue;
            }
            // A worker that becomes free meanwhile takes the client instead.
            let accepted = select(acceptor.accept(), self.changed.wait()).await;
            if let Either::First(Ok((peer, mut socket))) = accepted {
                info!("client {} turned away: {} are connected", peer, MAX_CLIENTS);
                // Whether it hears it is up to the client.
                let _ = with_timeout(TURNED_AWAY, farewell(&mut socket)).await;
            }
        }
    }

    fn count(&self, change: i8, house: &House) {
        // Workers share one executor: nobody comes in between.
        let busy = self.busy.load(Ordering::Relaxed);
        let busy = busy.saturating_add_signed(change);
        self.busy.store(busy, Ordering::Relaxed);
        house.clients.store(busy, Ordering::Relaxed);
        self.changed.signal(());
    }
}

/// Tells why, and waits for the client to close: closed at once, what it has sent meanwhile would make
/// its system throw the message away.
async fn farewell<S: Read + Write + TcpShutdown>(socket: &mut S) -> Result<(), S::Error> {
    let mut reply = Reply::new();
    reply.error(format_args!(
        "{MAX_CLIENTS} clients are connected already, no more fit"
    ));
    socket.write_all(reply.as_bytes()).await?;
    socket.close(Close::Write).await?;
    while socket.read(&mut [0; 64]).await? > 0 {}
    Ok(())
}

/// Does what a line of a connection asks for, and puts the answer into `reply`. At its end, the connection
/// abandons what it was recording: [`Drawings::abandon`](super::drawings::Drawings::abandon).
pub async fn answer(
    request: &Request,
    session: &mut Session,
    reply: &mut Reply,
    client: Client,
    house: &House,
) {
    if !drawings::record(request, session, reply, client, house).await {
        perform(request, reply, client, house).await;
    }
}

/// How a browser begins, on behalf of any page that names this port: a form may have G-code in it. Other
/// methods come only after the answer to one of these has allowed them.
const BROWSER: [&[u8]; 4] = [b"GET ", b"HEAD ", b"POST ", b"OPTIONS "];

/// Serves one connection until its client has closed it and everything received is executed.
pub async fn serve(socket: impl Read + Write, client: Client, house: &House) {
    let mut session = Session::new();
    let mut reply = Reply::new();
    let mut answers: Answers<_> = Answers::new(socket);
    reply.hello(&house.name(), house.identity);
    answers.send(&reply).await;
    let mut chunk = [0; CHUNK];
    let mut start = Vec::<u8, 8>::new();
    while let Ok(length @ 1..) = answers.read(&mut chunk).await {
        let mut input = chunk.get(..length).unwrap_or_default();
        if !start.is_full() {
            let missing = start.capacity() - start.len();
            start.extend(input.iter().take(missing).copied());
            if BROWSER.iter().any(|method| start.starts_with(method)) {
                info!("a browser is at the wrong port");
                break;
            }
        }
        while let Some(request) = session.next_request(&mut input, &mut reply) {
            answer(&request, &mut session, &mut reply, client, house).await;
            answers.send(&reply).await;
        }
        // A client that sends faster than it is served would else keep everybody waiting.
        if length == CHUNK {
            yield_now().await;
        }
    }
    house.drawings.abandon(client).await;
    house.arm.with(|machine| machine.client_gone(client));
}
