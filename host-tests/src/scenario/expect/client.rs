//! What a client is to find.

use crate::scenario::client::{Client, is_like};
use crate::scenario::command::ClientExpectation;
use crate::scenario::stage::Stage;
use crate::scripted::journal::note;
use crate::scripted::radio::shown;
use embassy_time::{Duration, Instant};
use protocol_core::wifi::Ssid;

/// A client that could not connect tries again this often.
const CONNECT_EVERY: Duration = Duration::from_millis(100);

pub fn expect(
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
