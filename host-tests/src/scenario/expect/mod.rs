//! What the machine is to do, looked for while time goes on.

mod arm;
mod client;
mod radio;

use super::command::{Expectation, Remembered};
use super::stage::Stage;
use crate::scripted::radio::shown;
use embassy_time::Duration;
use protocol_core::settings::Settings;

/// How long something is waited for where a line does not say it.
pub const PATIENCE: Duration = Duration::from_secs(10);

/// Plays an expectation.
///
/// # Errors
/// What happens instead.
pub fn expect(
    stage: &mut Stage,
    expectation: &Expectation,
    within: Option<Duration>,
) -> Result<(), String> {
    let patience = within.unwrap_or(PATIENCE);
    match expectation {
        Expectation::Client(name, expectation) => {
            client::expect(stage, *name, expectation, patience)
        }
        Expectation::ComputerJoins(ssid) => {
            let there = stage.pass_time(patience, |stage| {
                let air = &stage.board.air;
                air.own().as_ref() == Some(ssid) || air.find(ssid).is_some()
            })?;
            if !there {
                return Err(format!("network {} is not there", shown(ssid)));
            }
            if stage.board.air.own().as_ref() == Some(ssid) {
                // This network has been noticed.
                let mut opened = stage.board.radio.opened.borrow_mut();
                if opened.front().is_some_and(|own| own.ssid == *ssid) {
                    opened.pop_front();
                }
            }
            stage.computer = Some(ssid.clone());
            Ok(())
        }
        Expectation::Light(pattern) => {
            let shown = stage.pass_time(patience, |stage| {
                stage.board.light.pattern() == Some(*pattern)
            })?;
            if !shown {
                return Err(stage.board.light.describe());
            }
            stage.looked = Some(*pattern);
            Ok(())
        }
        Expectation::LightStays(pattern, time) => {
            let changes =
                stage.pass_time(*time, |stage| stage.board.light.pattern() != Some(*pattern))?;
            if changes {
                return Err(stage.board.light.describe());
            }
            stage.looked = Some(*pattern);
            Ok(())
        }
        Expectation::LightWasNever(hue) => match stage.board.light.was(*hue, stage.powered) {
            true => Err(format!("the light was {hue}")),
            false => Ok(()),
        },
        Expectation::PowerIsOff => {
            let off = stage.pass_time(patience, |stage| !stage.board.power.is_on())?;
            off.then_some(()).ok_or("power is on".into())
        }
        Expectation::StartsAgain => {
            if !stage.pass_time(patience, |stage| stage.board.restarts > 0)? {
                return Err("it goes on".into());
            }
            stage.board.restarts -= 1;
            stage.begin();
            Ok(())
        }
        Expectation::MayStartAgain => {
            stage.starts_allowed = true;
            Ok(())
        }
        Expectation::Runs(names) => {
            let running = stage.board.running().unwrap_or("nothing");
            match names.iter().any(|name| name == running) {
                true => Ok(()),
                false => Err(format!("it runs {running}")),
            }
        }
        Expectation::IsFound(host) => {
            let found = stage.pass_time(patience, |stage| stage.board.found_as() == *host)?;
            let now = || stage.board.found_as().unwrap_or("nothing".into());
            found
                .then_some(())
                .ok_or_else(|| format!("it is found as {}", now()))
        }
        Expectation::Remembers(what) => remembers(&stage.board.remembered(), what),
        Expectation::Opens(..)
        | Expectation::ClosesItsNetwork
        | Expectation::Tries(..)
        | Expectation::MayTry(_)
        | Expectation::TriesNothing(_) => radio::expect(stage, expectation, patience),
        _ => arm::expect(stage, expectation, patience),
    }
}

/// Forgets what a line has allowed: attempts to join, and starts.
pub fn forgive(stage: &mut Stage) {
    if stage.starts_allowed {
        stage.board.restarts = 0;
    }
    if let Some(allowed) = &stage.tries_allowed {
        let mut tries = stage.board.radio.tries.borrow_mut();
        tries.retain(|(ssid, _)| ssid != allowed);
    }
}

fn remembers(settings: &Settings, what: &Remembered) -> Result<(), String> {
    let found = match what {
        Remembered::Nothing => *settings == Settings::default(),
        Remembered::Networks(count) => settings.networks.len() == *count,
        Remembered::Network(ssid, password) => {
            let network = settings.networks.find(ssid);
            network.is_some_and(|network| password.is_none() || network.password == *password)
        }
        Remembered::Names(names) => names.iter().any(|name| name == settings.name.as_str()),
    };
    if found {
        return Ok(());
    }
    let names: Vec<String> = settings
        .networks
        .iter()
        .map(|network| shown(&network.ssid))
        .collect();
    Err(format!(
        "the machine remembers name {}, {} networks: {}, and all in all {settings:?}",
        settings.name.as_str(),
        names.len(),
        names.join(", "),
    ))
}
