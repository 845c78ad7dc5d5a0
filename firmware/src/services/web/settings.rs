//! Settings: given, and changed all together or not at all.

use super::exchange::{Exchange, Trouble, parse};
use super::failure::{Failure, Status};
use super::state::Speed;
use crate::services::House;
use embedded_io_async::{Read, Write};
use heapless::String;
use protocol_core::machine::Client;
use protocol_core::motion::{StepRange, StepSize};
use protocol_core::settings::{
    AccessPointName, AllowedOrigin, MAX_NAME, MAX_ORIGIN, MachineName, StartMode,
};
use serde::{Deserialize, Deserializer, Serialize};

/// A text in a request; longer ones are no valid value of anything.
type Text = String<96>;

#[derive(Serialize)]
struct Shown<'a> {
    name: &'a str,
    speed: Speed,
    waves: bool,
    start_mode: &'static str,
    access_point_name: &'static str,
    allowed_origin: Option<&'a str>,
}

/// Names in the API, in the order of M552's numbers.
const START_MODES: [&str; 4] = [
    "station",
    "access_point",
    "access_point_locked",
    "station_long_press",
];
const ACCESS_POINT_NAMES: [&str; 2] = ["setup", "machine"];

/// Gives the settings.
pub async fn give<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    house: &House,
) -> Result<(), Trouble> {
    let (name, origin, start, access_point, waves) = house.settings(|settings| {
        (
            settings.name.clone(),
            settings.allowed_origin.clone(),
            settings.start,
            settings.access_point,
            settings.waves,
        )
    });
    let known = |names: &[&'static str], number: u8| {
        let place = usize::from(number).wrapping_sub(1);
        names.get(place).copied().unwrap_or_default()
    };
    let shown = Shown {
        name: name.as_str(),
        speed: house.arm.with(|machine| machine.steps()).into(),
        waves,
        start_mode: known(&START_MODES, start.number()),
        access_point_name: known(&ACCESS_POINT_NAMES, access_point.number()),
        allowed_origin: match &origin {
            AllowedOrigin::None => None,
            origin => Some(origin.as_str()),
        },
    };
    exchange.json(Status::OK, &shown).await
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    name: Option<Text>,
    speed: Option<AskedSpeed>,
    waves: Option<bool>,
    start_mode: Option<Text>,
    access_point_name: Option<Text>,
    /// Absent, `null`, or a text.
    #[serde(default, deserialize_with = "given")]
    allowed_origin: Option<Option<Text>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AskedSpeed {
    pen_down: Option<i32>,
    pen_up: Option<i32>,
}

fn given<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Option<Text>>, D::Error> {
    Option::deserialize(deserializer).map(Some)
}

/// What can be.
struct Change {
    name: Option<MachineName>,
    waves: Option<bool>,
    start: Option<StartMode>,
    access_point: Option<AccessPointName>,
    allowed_origin: Option<AllowedOrigin>,
    pen_down: Option<StepSize>,
    pen_up: Option<StepSize>,
}

impl Asked {
    fn check(self) -> Result<Change, Failure> {
        let speed = self.speed.as_ref();
        Ok(Change {
            name: checked(self.name.as_ref(), |text| {
                MachineName::new(text).ok_or_else(|| {
                    Failure::bad_value(format_args!(
                        "name is '{text:.40}', it may be 1 to {MAX_NAME} letters, digits and inner hyphens"
                    ))
                })
            })?,
            waves: self.waves,
            start: checked(self.start_mode.as_ref(), |text| {
                let number = number("start_mode", text, &START_MODES)?;
                StartMode::from_number(number).ok_or_else(unreachable_value)
            })?,
            access_point: checked(self.access_point_name.as_ref(), |text| {
                let number = number("access_point_name", text, &ACCESS_POINT_NAMES)?;
                AccessPointName::from_number(number).ok_or_else(unreachable_value)
            })?,
            allowed_origin: match self.allowed_origin {
                None => None,
                Some(None) => Some(AllowedOrigin::None),
                Some(Some(text)) => Some(origin(&text)?),
            },
            pen_down: step(
                "pen_down",
                StepRange::PEN_DOWN,
                speed.and_then(|speed| speed.pen_down),
            )?,
            pen_up: step(
                "pen_up",
                StepRange::PEN_UP,
                speed.and_then(|speed| speed.pen_up),
            )?,
        })
    }
}

fn checked<T>(
    text: Option<&Text>,
    check: impl FnOnce(&str) -> Result<T, Failure>,
) -> Result<Option<T>, Failure> {
    text.map(|text| check(text)).transpose()
}

fn unreachable_value() -> Failure {
    Failure::bad_value(format_args!("this value is not known"))
}

fn number(field: &str, text: &str, names: &[&str]) -> Result<u8, Failure> {
    match names.iter().position(|name| *name == text) {
        Some(place) => Ok(place as u8 + 1),
        None => Err(Failure::bad_value(format_args!(
            "{field} is '{text:.40}', it may be one of: {}",
            List(names)
        ))),
    }
}

struct List<'a>(&'a [&'a str]);

impl core::fmt::Display for List<'_> {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        for (place, item) in self.0.iter().enumerate() {
            let comma = if place == 0 { "" } else { ", " };
            write!(out, "{comma}{item}")?;
        }
        Ok(())
    }
}

fn origin(text: &str) -> Result<AllowedOrigin, Failure> {
    match AllowedOrigin::new(text) {
        Some(origin) if !text.is_empty() => Ok(origin),
        _ => Err(Failure::bad_value(format_args!(
            "allowed_origin is '{text:.80}', it may be null, * or an origin of at most {MAX_ORIGIN} bytes as https://example.org"
        ))),
    }
}

fn step(field: &str, range: StepRange, units: Option<i32>) -> Result<Option<StepSize>, Failure> {
    let Some(units) = units else { return Ok(None) };
    match range.step(i64::from(units) << StepSize::FRACTION_BITS) {
        Some(step) => Ok(Some(step)),
        None => Err(Failure::bad_value(format_args!(
            "speed.{field} may be {} to {}",
            range.least, range.most
        ))),
    }
}

/// Changes settings, and gives them as they are then.
pub async fn change<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    client: Client,
    house: &House,
) -> Result<(), Trouble> {
    let asked: Asked = parse(exchange.body().await?)?;
    let change = asked.check()?;
    let stored = change.name.is_some()
        || change.waves.is_some()
        || change.start.is_some()
        || change.access_point.is_some()
        || change.allowed_origin.is_some();
    if stored {
        let outcome = house.change(client, |settings| {
            settings.name = change.name.unwrap_or(settings.name.clone());
            settings.waves = change.waves.unwrap_or(settings.waves);
            settings.start = change.start.unwrap_or(settings.start);
            settings.access_point = change.access_point.unwrap_or(settings.access_point);
            settings.allowed_origin = change
                .allowed_origin
                .unwrap_or(settings.allowed_origin.clone());
        });
        outcome.await.map_err(|error| Failure::not_stored(&error))?;
    }
    house
        .arm
        .with(|machine| machine.change_steps(change.pen_down, change.pen_up));
    give(exchange, house).await
}
