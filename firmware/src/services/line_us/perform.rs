//! What a line asks for is done here.

use super::drawings;
use crate::services::House;
use crate::services::update::KEY_NAME;
use core::fmt::Display;
use protocol_core::lineus::{Diagnostics, Refusal, Reply, Request};
use protocol_core::machine::Client;
use protocol_core::motion::Micros;
use protocol_core::settings::{MachineName, Settings};
use protocol_core::wifi::{Full, Heard, MAX_NETWORKS, Network, Networks, Password, Ssid};

/// Does what a line asks for, and puts the answer into `reply`.
pub async fn perform(request: &Request, reply: &mut Reply, client: Client, house: &House) {
    let arm = &house.arm;
    match request {
        Request::Answered | Request::HangUp => {}
        Request::Errand(errand) => reply.report(&arm.errand(client, errand).await),
        Request::SetSpeed { pen_down, pen_up } => {
            arm.with(|machine| machine.change_steps(*pen_down, *pen_up));
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
        Request::OwnNetwork => house.settings(|settings| reply.own_network(settings)),
        Request::ProtectOwnNetwork(password) => {
            let set = |settings: &mut Settings| {
                settings.own_password = password.clone();
                Ok(())
            };
            change("password", set, reply, client, house).await;
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
        Request::Forget(ssid) => forget(ssid, reply, client, house).await,
        Request::ForgetAll => {
            let forget = |settings: &mut Settings| {
                settings.networks.clear();
                Ok(())
            };
            change("networks", forget, reply, client, house).await;
        }
        Request::Update => match house.update.ask().await {
            Ok(version) => reply.updated(version),
            Err(rejection) => reply.error(format_args!("{rejection}")),
        },
        Request::SetUpdateAddress(address) => {
            let set = |settings: &mut Settings| {
                settings.update_address = address.clone();
                Ok(())
            };
            change("address", set, reply, client, house).await;
        }
        Request::Drawings
        | Request::Space
        | Request::Draw(_)
        | Request::StopDrawing
        | Request::BeginRecording(_)
        | Request::RecordLine
        | Request::EndRecording
        | Request::Delete(_)
        | Request::Replaying
        | Request::SetReplay(_) => drawings::perform(request, reply, client, house).await,
        Request::Button => reply.button(house.settings(|settings| settings.button)),
        Request::SetButton(choice) => {
            let set = |settings: &mut Settings| {
                settings.button = *choice;
                Ok(())
            };
            change("choice", set, reply, client, house).await;
        }
        Request::Compensation => {
            house.settings(|settings| reply.compensation(settings.map, settings.shift));
        }
        Request::SetCompensation { map, shift } => {
            let set = |settings: &mut Settings| {
                settings.map = map.unwrap_or(settings.map);
                settings.shift = shift.unwrap_or(settings.shift);
                Ok(())
            };
            change("map", set, reply, client, house).await;
        }
        Request::Directions => reply.directions(house.settings(|settings| settings.directions)),
        Request::SetDirections(servos) => {
            let set = |settings: &mut Settings| {
                let now = settings.directions.reversed;
                let pairs = servos.iter().zip(now);
                let mut new = pairs.map(|(new, now)| new.unwrap_or(now));
                settings.directions.reversed = now.map(|now| new.next().unwrap_or(now));
                Ok(())
            };
            change("direction", set, reply, client, house).await;
        }
        Request::FactoryReset => match house.forget_everything().await {
            Ok(()) => reply.ok(),
            Err(error) => refuse_store("factory reset", &error, reply),
        },
        Request::Calibrate => calibrate(true, reply, client, house).await,
        Request::ClearCalibration => calibrate(false, reply, client, house).await,
    }
}

fn diagnose(reply: &mut Reply, house: &House) {
    let (position, calibration, compensation, directions) = house.arm.with(|machine| {
        let compensation = *machine.compensation();
        (
            machine.position(),
            machine.calibration(),
            compensation,
            machine.directions(),
        )
    });
    reply.diagnostics(&Diagnostics {
        name: &house.name(),
        host: house.discovery.host().as_deref(),
        identity: house.identity,
        uptime: Micros::new(house.uptime().as_micros()),
        position,
        calibration,
        compensation: &compensation,
        directions,
        wifi: &house.wifi.status(),
        networks: house.settings(|settings| settings.networks.len()),
        free_memory: (house.vitals.free_memory)(),
        reset_reason: house.vitals.reset_reason,
        memory: house.store.health().text(),
        update: &house.update.status(),
        update_key: KEY_NAME,
        space: house.drawings.space(),
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
    match house.calibrate(here, client).await {
        Ok(()) => reply.ok(),
        Err(error) => refuse_store("calibration", &error, reply),
    }
}

fn refuse_store(what: &str, error: &dyn Display, reply: &mut Reply) {
    reply.error(format_args!(
        "the {what} is not stored and stays as it was: {error}"
    ));
}
