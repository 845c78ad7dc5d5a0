//! New firmware over the network: does what `protocol_core::update` says.
//!
//! Written only while the arm rests, into the slot that does not run. Until the very last word is written,
//! nothing that starts has changed.

mod boot;
mod fetch;
mod install;
mod trial;
mod trust;

pub use boot::{at_start, choice};
pub use trust::KEY_NAME;

use super::House;
use crate::board::FirmwareSlots;
use crate::log::{info, warning};
use core::cell::Cell;
use edge_nal::{Dns, TcpConnect};
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer};
use embedded_storage_async::nor_flash::ReadNorFlash;
use fetch::Server;
use protocol_core::machine::Client;
use protocol_core::motion::Micros;
use protocol_core::panel::Lamp;
use protocol_core::update::{
    ARM_TIME, IMAGE_TIME, MAX_MANIFEST, Progress, Rejection, Running, Standing, Status, Version,
};

/// How long the reply has to leave before the restart.
const FAREWELL: Duration = Duration::from_secs(1);
/// How often it is looked whether the arm rests.
const LOOK: Duration = Duration::from_millis(100);

/// The way of the other services to updates.
pub struct Update {
    /// `None` as long as no service runs: a board without slots.
    status: Mutex<CriticalSectionRawMutex, Cell<Option<Status>>>,
    request: Signal<CriticalSectionRawMutex, ()>,
    outcome: Signal<CriticalSectionRawMutex, Result<Version, Rejection>>,
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
            status: Mutex::new(Cell::new(None)),
            request: Signal::new(),
            outcome: Signal::new(),
        }
    }

    /// How updates stand.
    pub fn status(&self) -> Status {
        self.status.lock(Cell::get).unwrap_or(Status::NONE)
    }

    /// Updates, and gives the version that starts in a moment. Whoever stops waiting does not stop the
    /// update.
    ///
    /// # Errors
    /// A [`Rejection`]: nothing has changed then.
    pub async fn ask(&self) -> Result<Version, Rejection> {
        self.status.lock(|status| {
            let now = status.get().ok_or(Rejection::NoSlots)?;
            if now.progress != Progress::Idle {
                return Err(Rejection::UnderWay);
            }
            if let Standing::Trial { .. } = now.standing {
                return Err(Rejection::OnTrial);
            }
            // Nobody else gets past this before the outcome is there.
            let progress = Progress::Asking;
            status.set(Some(Status { progress, ..now }));
            Ok(())
        })?;
        self.outcome.reset();
        self.request.signal(());
        self.outcome.wait().await
    }

    fn change(&self, change: impl FnOnce(&mut Status)) {
        self.status.lock(|status| {
            if let Some(mut now) = status.get() {
                change(&mut now);
                status.set(Some(now));
            }
        });
    }

    fn show(&self, progress: Progress) {
        self.change(|status| status.progress = progress);
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
    update.status.lock(|told| told.set(Some(status)));
    if let Standing::Trial { .. } = standing {
        trial::stand(house, &mut slots).await;
        update.change(|status| status.standing = Standing::Settled);
    }
    loop {
        update.request.wait().await;
        let outcome = perform(house, &network, &mut slots).await;
        house.panel.show_first(None);
        match outcome {
            Ok(version) => {
                info!("new firmware is in place, starting it");
                update.show(Progress::Restarting(version));
                update.outcome.signal(outcome);
                Timer::after(FAREWELL).await;
                slots.restart().await;
            }
            Err(rejection) => {
                warning!("no update: see M122");
                update.change(|status| {
                    status.progress = Progress::Idle;
                    status.refused = Some(rejection);
                });
                update.outcome.signal(outcome);
            }
        }
    }
}

async fn perform<N, S>(house: &House, network: &N, slots: &mut S) -> Result<Version, Rejection>
where
    N: TcpConnect + Dns,
    S: FirmwareSlots,
{
    let address = house.settings(|settings| settings.update_address.clone());
    let address = address.ok_or(Rejection::NoAddress)?;
    let server = Server::find(network, &address).await?;
    let mut text = [0; MAX_MANIFEST];
    let text = server.manifest(&mut text).await?;
    let manifest = trust::read(text)?;
    let slot = u32::try_from(slots.other().capacity()).unwrap_or(u32::MAX);
    manifest.check(&Running {
        board: slots.board(),
        version: Version::FIRMWARE,
        slot,
    })?;

    let version = manifest.version;
    house.update.show(Progress::Waiting(version));
    let _rest = rest(house).await?;
    house.panel.show_first(Some(Lamp::Update));
    let show = |percent| {
        house.update.show(Progress::Loading { version, percent });
    };
    show(0);
    let path = address.beside(&manifest.image);
    let mut image = server.get(&path, IMAGE_TIME).await?;
    if image.length() != manifest.size {
        return Err(Rejection::WrongLength {
            served: image.length(),
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
    Ok(version)
}

/// Waits until nothing is drawn and the pen is up, and keeps it so.
async fn rest(house: &House) -> Result<super::arm::Rest<'_>, Rejection> {
    let until = Instant::now() + duration(ARM_TIME);
    let is_idle = || {
        house
            .arm
            .with(|machine| machine.is_idle() && !machine.position().pen_is_down())
    };
    loop {
        if is_idle() {
            let rest = house.arm.rest(Client::HOUSE).await;
            // Somebody may have been faster.
            if !house.arm.with(|machine| machine.position().pen_is_down()) {
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
