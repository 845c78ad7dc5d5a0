//! The web interface: the page, the API under it, and the WebSocket of the original, on one port.
//! `docs/api.md` is the contract.
//!
//! Each of [`CONNECTIONS`] workers serves one request, closes, and accepts again; when all are busy, the
//! doorman says so to the next one. A WebSocket keeps its worker, and one worker is always left for requests.
//!
//! Heads are read with `httparse` and frames with `edge-ws`. Whole servers, `picoserve` 0.20 and `edge-http`
//! 0.8, were looked at first: the one adds a `Content-Length` to its own position without a check, the other
//! unwraps it, so that one header of a stranger would end the firmware.

#![allow(
    clippy::result_large_err,
    clippy::large_enum_variant,
    reason = "there is no heap: why a request is refused is carried as it is"
)]

mod access;
mod api;
mod by_hand;
mod drawing;
mod exchange;
mod failure;
mod frames;
mod gcode;
mod live;
mod networks;
mod page;
mod query;
mod request;
mod settings;
mod state;
mod update;

pub use page::PAGE_SIZE;

use super::House;
use crate::log::info;
use core::net::{IpAddr, Ipv4Addr, SocketAddr};
use core::sync::atomic::{AtomicU8, Ordering};
use edge_nal::{Close, TcpAccept, TcpShutdown};
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer, with_timeout};
use embedded_io_async::{Read, Write};
use exchange::{Answer, Exchange, Room, Trouble, push, receive_head};
use failure::{Failure, Status};
use protocol_core::machine::{Client, MAX_WEB_CLIENTS};
use request::{Accept, Owner, Refused, Request, What};

/// The port of the web.
pub const PORT: u16 = 80;
/// The port, at every address that the machine has.
pub const ANYWHERE: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::UNSPECIFIED), PORT);
/// Connections that are served at once.
pub const CONNECTIONS: usize = MAX_WEB_CLIENTS;
/// How many of them may be WebSockets.
pub const SOCKETS: usize = CONNECTIONS - 1;
/// Longest request line and headers, in bytes.
pub const MAX_HEAD: usize = 2048;
/// Longest body of a request, drawings excepted, in bytes.
pub const MAX_BODY: usize = 512;
/// How long the machine waits for a head, a short body, the next piece of a drawing, or for a client to take
/// something.
pub const PATIENCE: Duration = Duration::from_secs(5);
/// How long a request and its answer may take in all, WebSockets and updates excepted.
const IN_ALL: Duration = Duration::from_secs(60);
/// How long a client has to close after its answer.
const FAREWELL: Duration = Duration::from_secs(1);
/// How long a client that is turned away has to read why, while others wait.
const TURNED_AWAY: Duration = Duration::from_millis(250);

/// The pool of connections.
#[derive(Default)]
pub struct Server {
    busy: AtomicU8,
    sockets: AtomicU8,
    /// A worker became busy or free.
    changed: Signal<CriticalSectionRawMutex, ()>,
}

impl Server {
    /// With nobody connected.
    pub const fn new() -> Self {
        Self {
            busy: AtomicU8::new(0),
            sockets: AtomicU8::new(0),
            changed: Signal::new(),
        }
    }

    /// One worker of the pool: serves one request after the other, for ever.
    pub async fn work<A: TcpAccept>(&self, acceptor: &A, client: Client, house: &House) -> ! {
        loop {
            let Ok((_, mut socket)) = acceptor.accept().await else {
                // Out of sockets, or a client that left before it was met: not at full speed, though.
                Timer::after_millis(10).await;
                continue;
            };
            count(&self.busy, 1);
            self.changed.signal(());
            self.serve(&mut socket, client, house).await;
            house.drawings.abandon(client).await;
            house.arm.with(|machine| machine.client_gone(client));
            let _ = with_timeout(FAREWELL, take_leave(&mut socket)).await;
            count(&self.busy, -1);
            self.changed.signal(());
        }
    }

    /// Tells clients that come when all workers are busy, and closes.
    pub async fn turn_away<A: TcpAccept>(&self, acceptor: &A) -> ! {
        loop {
            if usize::from(self.busy.load(Ordering::Relaxed)) < CONNECTIONS {
                self.changed.wait().await;
                continue;
            }
            // A worker that becomes free meanwhile takes the client instead.
            let accepted = select(acceptor.accept(), self.changed.wait()).await;
            if let Either::First(Ok((peer, mut socket))) = accepted {
                info!(
                    "web client {} turned away: {} are connected",
                    peer, CONNECTIONS
                );
                // Whether it hears it is up to the client.
                let _ = with_timeout(TURNED_AWAY, farewell(&mut socket)).await;
            }
        }
    }

    /// Serves one request.
    async fn serve<S: Read + Write>(&self, socket: &mut S, client: Client, house: &House) {
        let mut room: Room = [0; _];
        let received = receive_head(socket, &mut room).await;
        let request = received.map(|(head, filled)| {
            let request = read(room.get(..head).unwrap_or_default(), house);
            room.copy_within(head..filled, 0);
            (request, filled - head)
        });
        let (request, here) = match request {
            Ok(request) => request,
            Err(Trouble::Gone) => return,
            Err(Trouble::Failure(failure)) => (Err(failure.into()), 0),
        };
        let mut exchange = Exchange {
            socket,
            room: &mut room,
            here,
            left: request.as_ref().map_or(0, |request| request.length),
            head_only: request.as_ref().is_ok_and(|request| request.head_only),
            allowed: request
                .as_ref()
                .is_ok_and(|request| request.from_elsewhere)
                .then(|| house.settings(|settings| settings.allowed_origin.clone())),
        };
        // What goes wrong in an answer is the client's loss.
        let _ = match request {
            Err(Refused::Redirect(to)) => redirect(&mut exchange, to).await,
            Err(Refused::Failure(failure)) => exchange.refuse(&failure).await,
            Ok(Request {
                accept: Some(accept),
                what: what @ (What::Gcode | What::Live),
                ..
            }) => self.upgrade(exchange, accept, what, client, house).await,
            Ok(request) => {
                let limit = match request.what {
                    What::Update => update::IN_ALL,
                    _ => IN_ALL,
                };
                let answer = api::answer(&mut exchange, request, client, house);
                with_timeout(limit, answer).await.unwrap_or(Ok(()))
            }
        };
    }

    async fn upgrade<S: Read + Write>(
        &self,
        mut exchange: Exchange<'_, S>,
        accept: Accept,
        what: What,
        client: Client,
        house: &House,
    ) -> Result<(), Trouble> {
        if usize::from(self.sockets.load(Ordering::Relaxed)) >= SOCKETS {
            return exchange.refuse(&Failure::full()).await;
        }
        count(&self.sockets, 1);
        let Exchange { socket, room, .. } = exchange;
        let outcome = async {
            push(socket, b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: ").await?;
            push(socket, &accept).await?;
            push(socket, b"\r\n\r\n").await?;
            match what {
                What::Live => live::serve(socket, room, exchange.here, house).await,
                _ => gcode::serve(socket, room, exchange.here, client, house).await,
            }
            Ok(())
        };
        let outcome = outcome.await;
        count(&self.sockets, -1);
        outcome
    }
}

fn count(count: &AtomicU8, change: i8) {
    // Workers share one executor: nobody comes in between.
    let now = count.load(Ordering::Relaxed);
    count.store(now.saturating_add_signed(change), Ordering::Relaxed);
}

fn read(head: &[u8], house: &House) -> Result<Request, Refused> {
    let setup = house.wifi.is_setup();
    let found_as = house.discovery.host();
    house.settings(|settings| {
        let owner = Owner {
            name: &settings.name,
            found_as: found_as.as_deref(),
            allowed: &settings.allowed_origin,
            setup,
            page_tag: page::TAG,
        };
        Request::read(head, &owner)
    })
}

async fn redirect<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    to: &str,
) -> Result<(), Trouble> {
    let mut headers = heapless::String::<96>::new();
    for part in ["Location: ", to, "\r\nCache-Control: no-store\r\n"] {
        // It fits.
        let _ = headers.push_str(part);
    }
    let answer = Answer {
        headers: &headers,
        ..Answer::default()
    };
    exchange.head(Status::FOUND, answer).await
}

/// Closes, and waits for the client to close: closed at once, what it has sent meanwhile would make its
/// system throw the answer away.
async fn take_leave<S: Read + TcpShutdown>(socket: &mut S) -> Result<(), S::Error> {
    socket.close(Close::Write).await?;
    while socket.read(&mut [0; 64]).await? > 0 {}
    Ok(())
}

async fn farewell<S: Read + Write + TcpShutdown>(socket: &mut S) -> Result<(), S::Error> {
    let failure = Failure::full();
    let mut body = [0; 160];
    let length = serde_json_core::to_slice(&failure, &mut body).unwrap_or(0);
    let mut head = heapless::String::<192>::new();
    // It fits.
    let _ = core::fmt::write(
        &mut head,
        format_args!(
            "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/json\r\n\
             Content-Length: {length}\r\nRetry-After: 1\r\nConnection: close\r\n\r\n"
        ),
    );
    socket.write_all(head.as_bytes()).await?;
    socket
        .write_all(body.get(..length).unwrap_or_default())
        .await?;
    take_leave(socket).await
}
