//! What the machine is to do, looked for while time goes on.

use super::client::{Client, is_like};
use super::command::{ClientExpectation, Expectation, Outcome, Remembered};
use super::stage::Stage;
use crate::scripted::arm::{HOME, PEN_DOWN_BELOW};
use crate::scripted::journal::{note, seconds};
use crate::scripted::radio::shown;
use embassy_time::{Duration, Instant};
use protocol_core::settings::Settings;
use protocol_core::wifi::{Joined, Ssid};

/// How long something is waited for where a line does not say it.
pub const PATIENCE: Duration = Duration::from_secs(10);
/// A client that could not connect tries again this often.
const CONNECT_EVERY: Duration = Duration::from_millis(100);

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
        Expectation::Client(name, expectation) => client(stage, *name, expectation, patience),
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
                if opened.front() == Some(ssid) {
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
        Expectation::Remembers(what) => remembers(&stage.board.remembered(), what),
        Expectation::Opens(_)
        | Expectation::ClosesItsNetwork
        | Expectation::Tries(..)
        | Expectation::MayTry(_)
        | Expectation::TriesNothing(_) => radio(stage, expectation, patience),
        _ => arm(stage, expectation, patience),
    }
}

fn radio(stage: &mut Stage, expectation: &Expectation, patience: Duration) -> Result<(), String> {
    match expectation {
        Expectation::Opens(ssid) => {
            let record = stage.board.radio.clone();
            stage.pass_time(patience, |_| !record.opened.borrow().is_empty())?;
            match record.opened.borrow_mut().pop_front() {
                Some(opened) if opened == *ssid => Ok(()),
                Some(other) => Err(format!("the machine opens {}", shown(&other))),
                None => Err("the machine opens no network".into()),
            }
        }
        Expectation::ClosesItsNetwork => {
            let closed = stage.pass_time(patience, |stage| stage.board.air.own().is_none())?;
            closed.then_some(()).ok_or("it stays open".into())
        }
        Expectation::Tries(ssid, outcome) => {
            stage.tries_allowed = None;
            let record = stage.board.radio.clone();
            stage.pass_time(patience, |_| !record.tries.borrow().is_empty())?;
            let tried = record.tries.borrow_mut().pop_front();
            match tried {
                Some((other, ended)) if other == *ssid && is(ended, *outcome) => Ok(()),
                Some((other, ended)) => {
                    Err(format!("the machine tries {}: {ended:?}", shown(&other)))
                }
                None => Err("the machine tries no network".into()),
            }
        }
        Expectation::MayTry(ssid) => {
            stage.tries_allowed = Some(ssid.clone());
            Ok(())
        }
        Expectation::TriesNothing(time) => {
            stage.tries_allowed = None;
            let record = stage.board.radio.clone();
            stage.pass_time(*time, |_| !record.tries.borrow().is_empty())?;
            match record.tries.borrow().front() {
                Some((ssid, ended)) => Err(format!("the machine tries {}: {ended:?}", shown(ssid))),
                None => Ok(()),
            }
        }
        _ => Err("nothing of the radio".into()),
    }
}

const fn is(joined: Joined, outcome: Outcome) -> bool {
    matches!(
        (joined, outcome),
        (Joined::Yes, Outcome::Joined)
            | (Joined::NotFound, Outcome::NotFound)
            | (Joined::WrongPassword, Outcome::Refused)
            | (Joined::Failed(_), Outcome::Failed)
    )
}

/// Forgets the attempts that a line has allowed.
pub fn forgive_tries(stage: &mut Stage) {
    if let Some(allowed) = &stage.tries_allowed {
        let mut tries = stage.board.radio.tries.borrow_mut();
        tries.retain(|(ssid, _)| ssid != allowed);
    }
}

fn arm(stage: &mut Stage, expectation: &Expectation, patience: Duration) -> Result<(), String> {
    let record = stage.board.arm.clone();
    match expectation {
        Expectation::ArmWaves => {
            let since = stage.acted;
            let waved = stage.pass_time(patience, |_| record.waved(since))?;
            stage.acted = record.length();
            waved
                .then_some(())
                .ok_or_else(|| match record.length() > since {
                    true => format!("it moves, and is at {}", place(record.place())),
                    false => "it does not move".into(),
                })
        }
        Expectation::ArmRests(at) => {
            let there =
                |place: [f64; 3]| at.is_none_or(|at| place.map(|axis| axis.round() as i32) == at);
            let rests =
                stage.pass_time(patience, |_| !record.is_moving() && there(record.place()))?;
            rests.then_some(()).ok_or_else(|| {
                let moving = if record.is_moving() { "moves" } else { "rests" };
                format!("it {moving} at {}", place(record.place()))
            })
        }
        Expectation::ArmStays(time) => {
            let before = record.length();
            let moved = stage.pass_time(*time, |_| record.length() > before)?;
            match moved {
                true => Err(format!("it moves at {}", seconds(record.there_since()))),
                false => Ok(()),
            }
        }
        Expectation::Pen { down } => {
            let there = stage.pass_time(patience, |_| is_down(record.place()) == *down)?;
            there
                .then_some(())
                .ok_or_else(|| format!("it is at {}", place(record.place())))
        }
        Expectation::PenStays { down, time } => {
            let changes = stage.pass_time(*time, |_| is_down(record.place()) != *down)?;
            match changes {
                true => Err(format!(
                    "it is at {} at {}",
                    place(record.place()),
                    seconds(record.there_since())
                )),
                false => Ok(()),
            }
        }
        Expectation::NibPasses(x, y, z) => {
            let since = stage.passed;
            let found = stage.pass_time(patience, |stage| {
                let Some(index) = record.passed(since, *x, *y, *z) else {
                    return false;
                };
                stage.passed = index;
                true
            })?;
            found.then_some(()).ok_or_else(|| {
                let closest = record.closest(since, *x, *y);
                closest.map_or("it does not move".into(), |closest| {
                    format!("it comes no closer than {}", place(closest))
                })
            })
        }
        _ => Err("nothing of the arm".into()),
    }
}

fn is_down(place: [f64; 3]) -> bool {
    place[2] < PEN_DOWN_BELOW
}

fn place([x, y, z]: [f64; 3]) -> String {
    let home = if [x, y, z] == HOME { " (home)" } else { "" };
    format!("{x:.2} {y:.2} {z:.2}{home}")
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

fn client(
    stage: &mut Stage,
    name: char,
    expectation: &ClientExpectation,
    patience: Duration,
) -> Result<(), String> {
    match expectation {
        ClientExpectation::Connects => {
            let until = Instant::now() + patience;
            loop {
                stage.wait(Duration::MIN)?;
                match connect(stage, name) {
                    Ok(client) => {
                        stage.clients.push(client);
                        return stage.wait(Duration::MIN);
                    }
                    Err(why) if Instant::now() >= until => return Err(why),
                    Err(_) => stage.wait(CONNECT_EVERY)?,
                }
            }
        }
        ClientExpectation::CannotConnect => {
            stage.wait(Duration::MIN)?;
            match connect(stage, name) {
                Ok(_) => Err("it can".into()),
                Err(_) => Ok(()),
            }
        }
        ClientExpectation::Hears(expected) => {
            stage.client(name)?;
            stage.pass_time(patience, |stage| heard_or_gone(stage, name))?;
            let client = stage.client(name)?;
            let Some(message) = client.heard.pop_front() else {
                return Err(match client.end() {
                    Some(end) => format!("{name} is disconnected ({end:?})"),
                    None => format!("{name} hears nothing"),
                });
            };
            match expected.iter().any(|expected| is_like(&message, expected)) {
                true => Ok(()),
                false => Err(format!("{name} hears {message}")),
            }
        }
        ClientExpectation::HearsSeveral(expected) => {
            stage.client(name)?;
            stage.pass_time(patience, |stage| heard_or_gone(stage, name))?;
            let client = stage.client(name)?;
            if client.heard.is_empty() {
                return Err(format!("{name} hears nothing"));
            }
            note(format_args!("    {} messages", client.heard.len()));
            let heard = client.heard.drain(..);
            let other = heard
                .into_iter()
                .find(|message| !is_like(message, expected));
            other.map_or(Ok(()), |other| Err(format!("{name} hears {other}")))
        }
        ClientExpectation::HearsNothing(time) => {
            stage.client(name)?;
            stage.pass_time(*time, |stage| heard_or_gone(stage, name))?;
            let client = stage.client(name)?;
            match (client.heard.front(), client.end()) {
                (Some(message), _) => Err(format!("{name} hears {message}")),
                (None, Some(end)) => Err(format!("{name} is disconnected ({end:?})")),
                (None, None) => Ok(()),
            }
        }
        ClientExpectation::IsDisconnected => {
            stage.client(name)?;
            let gone = stage.pass_time(patience, |stage| {
                stage
                    .client(name)
                    .is_ok_and(|client| client.end().is_some())
            })?;
            stage.client(name)?.end_expected = true;
            gone.then_some(()).ok_or(format!("{name} stays connected"))
        }
    }
}

fn heard_or_gone(stage: &mut Stage, name: char) -> bool {
    stage
        .client(name)
        .is_ok_and(|client| !client.heard.is_empty() || client.end().is_some())
}

fn connect(stage: &mut Stage, name: char) -> Result<Client, String> {
    let connected = |client: &Client| client.name() == name && client.is_connected();
    if stage.clients.iter().any(connected) {
        return Err(format!("{name} is connected already"));
    }
    let Some(network) = stage.computer.clone() else {
        return Err("the computer is in no network".into());
    };
    if !stage.board.is_reachable(&network) {
        return Err(format!(
            "the computer is in {}; {}",
            shown(&network),
            whereabouts(stage)
        ));
    }
    let wire = stage.board.port.connect();
    let wire = wire.ok_or("nobody there takes a connection")?;
    note(format_args!("    {name} is connected"));
    Ok(Client::new(name, network, wire))
}

fn whereabouts(stage: &Stage) -> String {
    let board = &stage.board;
    let named = |ssid: Option<Ssid>| ssid.map_or("none".into(), |ssid| shown(&ssid));
    match board.power.is_on() {
        false => "the machine has no power".into(),
        true => format!(
            "the machine has joined {} and opened {}",
            named(board.air.joined()),
            named(board.air.own())
        ),
    }
}
