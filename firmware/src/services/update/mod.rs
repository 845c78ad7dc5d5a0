//! New firmware over the network: does what `protocol_core::update` says.
//!
//! Written only while the arm rests, into the slot that does not run. Until the very last word is written,
//! nothing that starts has changed.

mod body;
mod boot;
mod fetch;
mod install;
mod offer;
mod trial;
mod trust;

pub use boot::{at_start, choice};
pub use offer::Handover;
pub use trust::KEY_NAME;

use super::House;
use super::arm::Rest;
use crate::board::FirmwareSlots;
use crate::log::{info, warning};
use core::cell::Cell;
use edge_nal::{Dns, TcpConnect};
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_sync::watch::Watch;
use embassy_time::{Duration, Instant, Timer};
use embedded_storage_async::nor_flash::ReadNorFlash;
use fetch::Server;
use offer::Offer;
use protocol_core::machine::{Client, Machine};
use protocol_core::motion::Micros;
use protocol_core::panel::Lamp;
use protocol_core::update::{
    ARM_TIME, MAX_MANIFEST, Progress, Rejection, Running, Standing, Status, Version,
};

/// How long the reply has to leave before the restart.
const FAREWELL: Duration = Duration::from_secs(1);
/// How often it is looked whether the arm rests.
const LOOK: Duration = Duration::from_millis(100);

/// How many can wait for the outcome of an update: whoever asked for it, and some who asked for earlier ones and
/// have yet to read that these are over.
const WAITING: usize = 4;

/// Where the new firmware comes from.
#[derive(Clone, Copy, Debug)]
enum Source {
    /// The server whose address is kept.
    Server,
    /// Whoever hands it over.
    Offer,
}

/// Tells one update from the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Ticket(u32);

#[derive(Clone, Copy)]
struct Desk {
    /// `None` as long as no service runs: a board without slots.
    status: Option<Status>,
    ticket: Ticket,
}

type Outcome = Result<Version, Rejection>;

/// The way of the other services to updates.
pub struct Update {
    desk: Mutex<CriticalSectionRawMutex, Cell<Desk>>,
    request: Signal<CriticalSectionRawMutex, (Source, Ticket)>,
    outcome: Watch<CriticalSectionRawMutex, (Ticket, Outcome), WAITING>,
    offer: Offer,
}

impl Default for Update {
    fn default() -> Self {
        Self::new()
    }
}

impl Update {
    /// With nothing to do.
    pub const fn new() -> Self {
        Self {
            desk: Mutex::new(Cell::new(Desk {
                status: None,
                ticket: Ticket(0),
            })),
            request: Signal::new(),
            outcome: Watch::new(),
            offer: Offer::new(),
        }
    }

    /// How updates stand.
    pub fn status(&self) -> Status {
        self.desk.lock(Cell::get).status.unwrap_or(Status::NONE)
    }

    /// Whether one is under way.
    pub fn is_under_way(&self) -> bool {
        self.status().progress != Progress::Idle
    }

    /// Updates from the server whose address is kept, and gives the version that starts in a moment. Whoever
    /// stops waiting does not stop the update.
    ///
    /// # Errors
    /// A [`Rejection`]: nothing has changed then.
    pub async fn ask(&self) -> Outcome {
        let ticket = self.begin()?;
        self.request.signal((Source::Server, ticket));
        self.outcome(ticket).await
    }

    /// Updates from an image of `length` bytes that is handed over, with its manifest.
    ///
    /// # Errors
    /// A [`Rejection`] where nothing can be handed over now; nothing has changed then.
    pub fn offer(&self, manifest: &[u8], length: u32) -> Result<Handover<'_>, Rejection> {
        let ticket = self.begin()?;
        self.offer.put(manifest, length);
        self.request.signal((Source::Offer, ticket));
        Ok(Handover::new(self, ticket))
    }

    /// Nobody else gets past this before the outcome is there.
    fn begin(&self) -> Result<Ticket, Rejection> {
        self.desk.lock(|desk| {
            let Desk { status, ticket } = desk.get();
            let now = status.ok_or(Rejection::NoSlots)?;
            if now.progress != Progress::Idle {
                return Err(Rejection::UnderWay);
            }
            if let Standing::Trial { .. } = now.standing {
                return Err(Rejection::OnTrial);
            }
            let progress = Progress::Asking;
            let ticket = Ticket(ticket.0.wrapping_add(1));
            desk.set(Desk {
                status: Some(Status { progress, ..now }),
                ticket,
            });
            Ok(ticket)
        })
    }

    async fn outcome(&self, ticket: Ticket) -> Outcome {
        let mut outcomes = self.outcome.receiver().ok_or(Rejection::UnderWay)?;
        let is_this = |(of, _): &(Ticket, Outcome)| *of == ticket;
        outcomes.get_and(is_this).await.1
    }

    fn change(&self, change: impl FnOnce(&mut Status)) {
        self.desk.lock(|desk| {
            let mut now = desk.get();
            if let Some(status) = &mut now.status {
                change(status);
                desk.set(now);
            }
        });
    }

    fn show(&self, progress: Progress) {
        self.change(|status| status.progress = progress);
    }

    fn tell(&self, ticket: Ticket, outcome: Outcome) {
        self.outcome.sender().send((ticket, outcome));
    }
}

/// The update service of a board with two slots, for ever. `standing` is what [`at_start`] has found.
pub async fn run<N, S>(house: &House, network: N, mut slots: S, standing: Standing) -> !
where
    N: TcpConnect + Dns,
    S: FirmwareSlots,
{
    let update = &house.update;
    let status = Status {
        standing,
        ..Status::NONE
    };
    update.desk.lock(|desk| {
        let status = Some(status);
        desk.set(Desk {
            status,
            ..desk.get()
        });
    });
    if let Standing::Trial { .. } = standing {
        trial::stand(house, &mut slots).await;
        update.change(|status| status.standing = Standing::Settled);
    }
    loop {
        let (source, ticket) = update.request.wait().await;
        let outcome = perform(house, &network, &mut slots, source).await;
        house.panel.show_first(None);
        match outcome {
            // The arm rests until the end: a move that began now would be cut off, maybe with its pen down.
            Ok((version, _rest)) => {
                info!("new firmware is in place, starting it");
                update.show(Progress::Restarting(version));
                update.tell(ticket, Ok(version));
                Timer::after(FAREWELL).await;
                slots.restart().await;
            }
            Err(rejection) => {
                warning!("no update: see M122");
                update.change(|status| {
                    status.progress = Progress::Idle;
                    status.refused = Some(rejection);
                });
                update.tell(ticket, Err(rejection));
            }
        }
    }
}

/// Gives the version that is in place, and the arm at rest.
async fn perform<'a, N, S>(
    house: &'a House,
    network: &N,
    slots: &mut S,
    source: Source,
) -> Result<(Version, Rest<'a>), Rejection>
where
    N: TcpConnect + Dns,
    S: FirmwareSlots,
{
    let address = match source {
        Source::Server => {
            let address = house.settings(|settings| settings.update_address.clone());
            Some(address.ok_or(Rejection::NoAddress)?)
        }
        Source::Offer => None,
    };
    let server = match &address {
        Some(address) => Some(Server::find(network, address).await?),
        None => None,
    };
    let mut text = [0; MAX_MANIFEST];
    let text = match &server {
        Some(server) => server.manifest(&mut text).await?,
        None => house.update.offer.manifest(&mut text),
    };
    let manifest = trust::read(text)?;
    let slot = u32::try_from(slots.other().capacity()).unwrap_or(u32::MAX);
    manifest.check(&Running {
        board: slots.board(),
        version: Version::FIRMWARE,
        slot,
    })?;

    let version = manifest.version;
    house.update.show(Progress::Waiting(version));
    let rest = rest(house).await?;
    house.panel.show_first(Some(Lamp::Update));
    let show = |percent| {
        house.update.show(Progress::Loading { version, percent });
    };
    show(0);
    let mut image = match &server {
        Some(server) => server.image(&manifest.image).await?,
        None => house.update.offer.image(),
    };
    if image.length() != manifest.size {
        return Err(Rejection::WrongLength {
            offered: image.length(),
            expected: manifest.size,
        });
    }
    install::write(&mut image, slots.other(), &manifest, show).await?;
    drop(image);
    house.update.show(Progress::Checking(version));
    // The manifest again as well: it has lain in memory all the while.
    let manifest = trust::read(text)?;
    install::check(slots.other(), &manifest).await?;
    boot::switch(slots, version).await?;
    Ok((version, rest))
}

/// Waits until nothing is drawn or recorded and the pen is up, and keeps the arm so: a restart loses nobody's work.
async fn rest(house: &House) -> Result<Rest<'_>, Rejection> {
    let until = Instant::now() + duration(ARM_TIME);
    let is_done = || {
        let is_up = |machine: &mut Machine| !machine.position().pen_is_down();
        house.arm.with(is_up) && !house.has_drawing_under_way()
    };
    loop {
        if is_done() && house.arm.with(|machine| machine.is_idle()) {
            let rest = house.arm.rest(Client::HOUSE).await;
            // Somebody may have been faster.
            if is_done() {
                return Ok(rest);
            }
        }
        if let Either::Second(()) = select(Timer::after(LOOK), Timer::at(until)).await {
            return Err(Rejection::Drawing);
        }
    }
}

fn now() -> Micros {
    Micros::new(Instant::now().as_micros())
}

const fn duration(micros: Micros) -> Duration {
    Duration::from_micros(micros.get())
}
