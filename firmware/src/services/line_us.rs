//! Line-us G-code over TCP: a pool of connections, one session each.
//!
//! Each of [`MAX_CLIENTS`] workers accepts, serves, and accepts again; when all are busy, the doorman
//! takes the next client, says so, and closes. What a slow client loses is its own replies.

use super::House;
use crate::log::info;
use core::fmt::Display;
use core::net::{IpAddr, Ipv4Addr, SocketAddr};
use core::sync::atomic::{AtomicU8, Ordering};
use edge_nal::{Close, TcpAccept, TcpShutdown};
use embassy_futures::select::{Either, select};
use embassy_futures::yield_now;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer, with_timeout};
use embedded_io_async::{Read, Write};
use protocol_core::lineus::{Diagnostics, MAX_REPLY, Refusal, Reply, Request, Session};
use protocol_core::machine::{Client, MAX_CLIENTS};
use protocol_core::motion::{Micros, Steps};
use protocol_core::settings::{MachineName, Settings};
use protocol_core::wifi::{Full, Heard, MAX_NETWORKS, Network, Networks, Password, Ssid};

/// The port of Line-us.
pub const PORT: u16 = 1337;
/// The port, at every address that the machine has.
pub const ANYWHERE: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::UNSPECIFIED), PORT);
/// Bytes taken from a socket at a time.
const CHUNK: usize = 512;
/// How long a reply may wait for a client that does not read. After that the reply is lost, and so are
/// later ones, without a wait, until the client reads again: its commands are executed all the same.
pub const PATIENCE: Duration = Duration::from_secs(2);
/// How often a client that did not take the whole of a reply is tried again.
const RETRY: Duration = Duration::from_millis(100);
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
            self.count(1);
            info!("client {} connected", peer);
            house.greet_first_client().await;
            serve(&mut socket, client, house).await;
            // It may be gone already; then there is nothing to close.
            let _ = with_timeout(FAREWELL, socket.close(Close::Both)).await;
            info!("client {} left", peer);
            self.count(-1);
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

    fn count(&self, change: i8) {
        // Workers share one executor: nobody comes in between.
        let busy = self.busy.load(Ordering::Relaxed);
        self.busy
            .store(busy.saturating_add_signed(change), Ordering::Relaxed);
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

/// Serves one connection until its client has closed it and everything received is executed.
pub async fn serve(socket: impl Read + Write, client: Client, house: &House) {
    let mut session = Session::new();
    let mut reply = Reply::new();
    let mut answers = Answers::new(socket);
    reply.hello(&house.name(), house.identity);
    answers.send(&reply).await;
    let mut chunk = [0; CHUNK];
    while let Ok(length @ 1..) = answers.read(&mut chunk).await {
        let mut input = chunk.get(..length).unwrap_or_default();
        while let Some(request) = session.next_request(&mut input, &mut reply) {
            perform(&request, &mut reply, client, house).await;
            answers.send(&reply).await;
        }
        // A client that sends faster than it is served would else keep everybody waiting.
        if length == CHUNK {
            yield_now().await;
        }
    }
    house.arm.with(|machine| machine.client_gone(client));
}

/// Does what a line asks for, and puts the answer into `reply`.
async fn perform(request: &Request, reply: &mut Reply, client: Client, house: &House) {
    let arm = &house.arm;
    match request {
        Request::Answered => {}
        Request::Errand(errand) => reply.report(&arm.errand(client, errand).await),
        Request::SetSpeed { pen_down, pen_up } => {
            arm.with(|machine| {
                let now = machine.steps();
                machine.set_steps(Steps {
                    pen_down: pen_down.unwrap_or(now.pen_down),
                    pen_up: pen_up.unwrap_or(now.pen_up),
                });
            });
            reply.ok();
        }
        Request::Position => reply.position(arm.with(|machine| machine.position())),
        Request::Angles => reply.angles(arm.with(|machine| machine.angles())),
        Request::Capabilities => reply.capabilities(&house.name(), house.wifi.is_setup()),
        Request::Diagnostics => diagnose(reply, house),
        Request::Name => reply.name(&house.name()),
        Request::Rename(name) => rename(name, reply, client, house).await,
        Request::Start => house.settings(|settings| reply.start(settings)),
        Request::SetStart { mode, name } => {
            let set = |settings: &mut Settings| {
                settings.start = mode.unwrap_or(settings.start);
                settings.access_point = name.unwrap_or(settings.access_point);
                Ok(())
            };
            change("start mode", set, reply, client, house).await;
        }
        Request::Waves => reply.waves(house.settings(|settings| settings.waves)),
        Request::SetWaves(on) => {
            let set = |settings: &mut Settings| {
                settings.waves = *on;
                Ok(())
            };
            change("setting", set, reply, client, house).await;
        }
        Request::Networks => list(reply, house).await,
        Request::Remember { ssid, password } => {
            remember(ssid, password.as_ref(), reply, client, house).await;
        }
        Request::Forget(ssid) => {
            forget(ssid, reply, client, house).await;
        }
        Request::ForgetAll => {
            let forget = |settings: &mut Settings| {
                settings.networks.clear();
                Ok(())
            };
            change("networks", forget, reply, client, house).await;
            house.wifi.changed();
        }
        Request::Calibrate => calibrate(true, reply, client, house).await,
        Request::ClearCalibration => calibrate(false, reply, client, house).await,
    }
}

fn diagnose(reply: &mut Reply, house: &House) {
    let (position, calibration) = house
        .arm
        .with(|machine| (machine.position(), machine.calibration()));
    reply.diagnostics(&Diagnostics {
        name: &house.name(),
        identity: house.identity,
        uptime: Micros::new(house.uptime().as_micros()),
        position,
        calibration,
        wifi: &house.wifi.status(),
        networks: house.settings(|settings| settings.networks.len()),
        free_memory: (house.vitals.free_memory)(),
        reset_reason: house.vitals.reset_reason,
        memory: house.store.health().text(),
        last_panic: house.vitals.last_panic,
    });
}

async fn rename(name: &MachineName, reply: &mut Reply, client: Client, house: &House) {
    let renamed = house.change(client, |settings| settings.name = name.clone());
    match renamed.await {
        Ok(()) => reply.name(name),
        Err(error) => refuse_store("name", &error, reply),
    }
}

/// Networks that are heard and networks that are remembered.
async fn list(reply: &mut Reply, house: &House) {
    let fill = |heard: &[Heard]| {
        house.settings(|settings| reply.networks(heard, &settings.networks));
    };
    house.wifi.with_heard(fill).await;
}

/// A station remembers the network and stays where it is. In setup the reply comes first, because the
/// attempt to join may end this connection, and the network is remembered if it succeeds.
async fn remember(
    ssid: &Ssid,
    password: Option<&Password>,
    reply: &mut Reply,
    client: Client,
    house: &House,
) {
    if house.wifi.is_setup() {
        match house.settings(|settings| completed(ssid, password, &settings.networks)) {
            Ok(network) => {
                reply.ok();
                house.wifi.attempt(network);
            }
            Err(refusal) => reply.refuse(&refusal),
        }
        return;
    }
    let put = |settings: &mut Settings| {
        let network = completed(ssid, password, &settings.networks)?;
        settings
            .networks
            .put(network)
            .map_err(|Full| Refusal::TooManyNetworks)
    };
    change("network", put, reply, client, house).await;
    house.wifi.changed();
}

/// A network for which there is a place; one that comes without a password has the one that is
/// remembered, or is open.
fn completed<'a>(
    ssid: &Ssid,
    password: Option<&Password>,
    known: &Networks,
) -> Result<Network, Refusal<'a>> {
    let remembered = known.find(ssid);
    if remembered.is_none() && known.len() == MAX_NETWORKS {
        return Err(Refusal::TooManyNetworks);
    }
    let password = password.or(remembered.and_then(|known| known.password.as_ref()));
    Ok(Network {
        ssid: ssid.clone(),
        password: password.cloned(),
    })
}

async fn forget(ssid: &Ssid, reply: &mut Reply, client: Client, house: &House) {
    let remove = |settings: &mut Settings| match settings.networks.remove(ssid) {
        true => Ok(()),
        false => Err(Refusal::NoSuchNetwork(ssid.as_bytes())),
    };
    change("network", remove, reply, client, house).await;
    house.wifi.changed();
}

/// Changes settings, and answers `ok`, or why not.
async fn change<'a>(
    what: &str,
    change: impl FnOnce(&mut Settings) -> Result<(), Refusal<'a>>,
    reply: &mut Reply,
    client: Client,
    house: &House,
) {
    match house.change(client, change).await {
        Ok(Ok(())) => reply.ok(),
        Ok(Err(refusal)) => reply.refuse(&refusal),
        Err(error) => refuse_store(what, &error, reply),
    }
}

/// Makes the place where the arm rests the calibration point, or removes the calibration.
async fn calibrate(here: bool, reply: &mut Reply, client: Client, house: &House) {
    let calibrated = house.change(client, |settings| {
        settings.calibration = match here {
            true => house.arm.with(|machine| machine.calibration_here()),
            false => Default::default(),
        };
    });
    match calibrated.await {
        Ok(()) => reply.ok(),
        Err(error) => refuse_store("calibration", &error, reply),
    }
}

fn refuse_store(what: &str, error: &dyn Display, reply: &mut Reply) {
    reply.error(format_args!(
        "the {what} is not stored and stays as it was: {error}"
    ));
}

/// The way of replies to one client: whole, in order, each in one write as long as it reads.
struct Answers<S> {
    link: Link<S>,
    /// The rest of a reply of which only a part went out: it comes before anything else.
    rest: heapless::Vec<u8, MAX_REPLY>,
}

impl<S: Read + Write> Answers<S> {
    const fn new(socket: S) -> Self {
        Self {
            link: Link {
                socket,
                slow: false,
                gone: false,
            },
            rest: heapless::Vec::new(),
        }
    }

    /// Reads what the client has sent, and meanwhile sees to what it has not yet taken.
    async fn read(&mut self, chunk: &mut [u8]) -> Result<usize, S::Error> {
        while !self.rest.is_empty() && !self.link.gone {
            if let Ok(read) = with_timeout(RETRY, self.link.socket.read(chunk)).await {
                return read;
            }
            self.send_rest().await;
        }
        self.link.socket.read(chunk).await
    }

    async fn send_rest(&mut self) {
        let sent = self.link.push(&self.rest).await;
        self.rest.drain(..sent);
    }

    async fn send(&mut self, reply: &Reply) {
        if !self.rest.is_empty() {
            self.send_rest().await;
            if !self.rest.is_empty() {
                return;
            }
        }
        let message = reply.as_bytes();
        let sent = self.link.push(message).await;
        if let Some(rest @ [_, ..]) = message.get(sent..)
            && sent > 0
        {
            // It fits: no message is longer.
            let _ = self.rest.extend_from_slice(rest);
        }
        // The next reply is to come in a segment of its own. A socket that fails here fails at the next
        // write as well.
        let _ = self.link.socket.flush().await;
    }
}

struct Link<S> {
    socket: S,
    /// The client does not read: no reply waits for it.
    slow: bool,
    /// The client cannot be written to any more.
    gone: bool,
}

impl<S: Write> Link<S> {
    /// Writes as much of `bytes` as the client takes in time, and gives how much that was.
    async fn push(&mut self, bytes: &[u8]) -> usize {
        let mut sent = 0;
        while let Some(rest @ [_, ..]) = bytes.get(sent..)
            && !self.gone
        {
            let patience = if self.slow { Duration::MIN } else { PATIENCE };
            match with_timeout(patience, self.socket.write(rest)).await {
                Ok(Ok(written @ 1..)) => {
                    sent += written;
                    self.slow = false;
                }
                Ok(_) => self.gone = true,
                Err(_) => {
                    self.slow = true;
                    break;
                }
            }
        }
        sent
    }
}
