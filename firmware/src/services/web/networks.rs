//! Networks: heard, remembered, forgotten. A password goes in, and never out.

use super::exchange::{Answer, Exchange, Trouble, parse};
use super::failure::{Failure, Status};
use super::state::{Lossy, Words};
use crate::services::House;
use crate::services::line_us::perform;
use embedded_io_async::{Read, Write};
use heapless::{String, Vec};
use protocol_core::lineus::{Reply, Request};
use protocol_core::machine::Client;
use protocol_core::wifi::{
    Heard, MAX_HEARD, MAX_NETWORKS, MAX_PASSWORD, MAX_SSID, MIN_PASSWORD, Password, Security, Ssid,
};
use serde::{Deserialize, Serialize};

/// A text in a request; longer ones are no valid value of anything.
type Text = String<96>;

#[derive(Serialize)]
struct Entry<'a> {
    name: Words<Lossy<'a>>,
    signal: Option<i8>,
    security: Option<&'static str>,
    heard: bool,
    remembered: bool,
}

/// Networks that are heard, strongest first, and those that are remembered and not heard.
pub async fn give<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    house: &House,
) -> Result<(), Trouble> {
    let heard: Vec<Heard, MAX_HEARD> = house.wifi.with_heard(copy).await;
    let answer = Answer {
        kind: Some("application/json"),
        length: None,
        headers: "Cache-Control: no-store\r\n",
    };
    exchange.head(Status::OK, answer).await?;
    if exchange.head_only {
        return Ok(());
    }
    exchange.push(b"{\"networks\":[").await?;
    let mut comma: &[u8] = b"";
    for (place, network) in heard.iter().enumerate() {
        let ssid = &network.ssid;
        if heard.iter().take(place).any(|other| other.ssid == *ssid) {
            continue;
        }
        exchange.push(comma).await?;
        comma = b",";
        let remembered = house.settings(|settings| settings.networks.find(ssid).is_some());
        let entry = Entry {
            name: Words(Lossy(ssid.as_bytes())),
            signal: Some(network.signal_dbm),
            security: Some(match network.security {
                Security::Open => "open",
                Security::Password => "password",
                Security::Unsupported => "unsupported",
            }),
            heard: true,
            remembered,
        };
        exchange.push_json(&entry).await?;
    }
    for place in 0..MAX_NETWORKS {
        let ssid = house.settings(|settings| {
            let network = settings.networks.iter().nth(place);
            network.map(|network| network.ssid.clone())
        });
        let Some(ssid) = ssid else { break };
        if heard.iter().any(|network| network.ssid == ssid) {
            continue;
        }
        exchange.push(comma).await?;
        comma = b",";
        let entry = Entry {
            name: Words(Lossy(ssid.as_bytes())),
            signal: None,
            security: None,
            heard: false,
            remembered: true,
        };
        exchange.push_json(&entry).await?;
    }
    exchange.push(b"]}").await
}

fn copy(heard: &[Heard]) -> Vec<Heard, MAX_HEARD> {
    heard.iter().cloned().collect()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Added {
    name: Text,
    password: Option<Text>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Forgotten {
    name: Text,
}

#[derive(Serialize)]
struct Trying {
    trying: bool,
}

#[derive(Serialize)]
struct Nothing {}

/// Remembers a network, or tries it first in setup.
pub async fn add<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    client: Client,
    house: &House,
) -> Result<(), Trouble> {
    let added: Added = parse(exchange.body().await?)?;
    let ssid = ssid(&added.name)?;
    // An empty field of a form is no password.
    let password = added.password.filter(|password| !password.is_empty());
    let password = match password {
        None => None,
        Some(password) => match Password::new(password.as_bytes()) {
            Some(password) => Some(password),
            None => {
                let reason = format_args!("password may be {MIN_PASSWORD} to {MAX_PASSWORD} bytes");
                return Err(Failure::bad_value(reason).into());
            }
        },
    };
    let full = house.settings(|settings| {
        settings.networks.len() == MAX_NETWORKS && settings.networks.find(&ssid).is_none()
    });
    if full {
        let reason = format_args!("{MAX_NETWORKS} networks are remembered: forget one first");
        return Err(Failure::bad_value(reason).into());
    }
    let trying = house.wifi.is_setup();
    let request = Request::Remember { ssid, password };
    done(&request, client, house).await?;
    exchange.json(Status::OK, &Trying { trying }).await
}

/// Forgets a network.
pub async fn forget<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    client: Client,
    house: &House,
) -> Result<(), Trouble> {
    let forgotten: Forgotten = parse(exchange.body().await?)?;
    let ssid = ssid(&forgotten.name)?;
    if house.settings(|settings| settings.networks.find(&ssid).is_none()) {
        let reason = format_args!("no network '{}' is remembered", forgotten.name);
        return Err(Failure::bad_value(reason).into());
    }
    done(&Request::Forget(ssid), client, house).await?;
    exchange.json(Status::OK, &Nothing {}).await
}

fn ssid(name: &str) -> Result<Ssid, Failure> {
    Ssid::new(name.as_bytes())
        .ok_or_else(|| Failure::bad_value(format_args!("name may be 1 to {MAX_SSID} bytes")))
}

/// As the command that does the same.
async fn done(request: &Request, client: Client, house: &House) -> Result<(), Failure> {
    let mut reply = Reply::new();
    perform(request, &mut reply, client, house).await;
    match reply.reason() {
        Some(reason) => Err(Failure::not_stored(&reason)),
        None => Ok(()),
    }
}
