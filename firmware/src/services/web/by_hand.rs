//! Moves by hand, and calibration.

use super::exchange::{Exchange, Trouble, parse};
use super::failure::{Failure, Status};
use super::state::Place;
use crate::services::House;
use crate::services::job::State;
use embedded_io_async::{Read, Write};
use protocol_core::lineus::STOPPED;
use protocol_core::machine::{Client, Errand, Limited, Manner, Report, Target};
use protocol_core::motion::{Coordinate, MAX_COORDINATE, Position, WideCoordinate};
use serde::{Deserialize, Serialize};

/// Longest relative move of X and Y, in units.
pub const MAX_JOG: i32 = 500;
/// Longest relative move of Z.
const MAX_LIFT: i32 = 1000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Axes {
    x: Option<i32>,
    y: Option<i32>,
    z: Option<i32>,
}

impl Axes {
    fn check(&self, most_xy: i32, most_z: i32) -> Result<(), Failure> {
        for (name, value, most) in [
            ("x", self.x, most_xy),
            ("y", self.y, most_xy),
            ("z", self.z, most_z),
        ] {
            if value.is_some_and(|value| !(-most..=most).contains(&value)) {
                let reason = format_args!("{name} may be -{most} to {most}");
                return Err(Failure::bad_value(reason));
            }
        }
        Ok(())
    }
}

/// Where a move ends.
#[derive(Serialize)]
struct End {
    x: i32,
    y: i32,
    z: i32,
    note: Option<&'static str>,
}

/// A move relative to where the pen is.
pub async fn jog<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    client: Client,
    house: &House,
) -> Result<(), Trouble> {
    let axes: Axes = parse(exchange.body().await?)?;
    axes.check(MAX_JOG, MAX_LIFT)?;
    let here = house.arm.with(|machine| machine.position());
    let by = |from: Coordinate, units: Option<i32>| {
        units.map(|units| WideCoordinate::from_bits(i64::from(from.bits()) + bits(units)))
    };
    let target = Target {
        x: by(here.x, axes.x),
        y: by(here.y, axes.y),
        z: by(here.z, axes.z),
    };
    travel(exchange, target, client, house).await
}

/// A move to a place.
pub async fn go<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    client: Client,
    house: &House,
) -> Result<(), Trouble> {
    let axes: Axes = parse(exchange.body().await?)?;
    axes.check(MAX_COORDINATE as i32, MAX_COORDINATE as i32)?;
    let at = |units: Option<i32>| units.map(|units| WideCoordinate::from_bits(bits(units)));
    let target = Target {
        x: at(axes.x),
        y: at(axes.y),
        z: at(axes.z),
    };
    travel(exchange, target, client, house).await
}

/// Home, with the pen lifted before.
pub async fn home<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    client: Client,
    house: &House,
) -> Result<(), Trouble> {
    free(house)?;
    errand(Target::PEN_UP, client, house).await?;
    travel(exchange, Target::HOME, client, house).await
}

/// Makes the place where the arm rests the calibration point, or removes the calibration.
pub async fn calibrate<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    here: bool,
    client: Client,
    house: &House,
) -> Result<(), Trouble> {
    if house.job.state().is_some_and(State::is_under_way) {
        return Err(Failure::busy("a drawing is under way: stop it first").into());
    }
    let calibrated = house.calibrate(here, client).await;
    calibrated.map_err(|error| Failure::not_stored(&error))?;
    let place = Place::from(house.arm.with(|machine| machine.position()));
    exchange.json(Status::OK, &place).await
}

/// Nobody moves the arm by hand while it draws.
fn free(house: &House) -> Result<(), Failure> {
    match house.job.state() {
        None | Some(State::Paused | State::Done | State::Stopped) => Ok(()),
        Some(_) => Err(Failure::busy(
            "a drawing is under way: pause or stop it first",
        )),
    }
}

async fn travel<S: Read + Write>(
    exchange: &mut Exchange<'_, S>,
    target: Target,
    client: Client,
    house: &House,
) -> Result<(), Trouble> {
    free(house)?;
    let (end, limited) = errand(target, client, house).await?;
    let Place { x, y, z } = end.into();
    let note = limited.map(Limited::text);
    exchange.json(Status::OK, &End { x, y, z, note }).await
}

async fn errand(
    target: Target,
    client: Client,
    house: &House,
) -> Result<(Position, Option<Limited>), Failure> {
    let errand = Errand::Move(Manner::Straight, target);
    match house.arm.errand(client, &errand).await {
        Report::Moving { end, limited } => Ok((end, limited)),
        Report::Resting => Ok((house.arm.with(|machine| machine.position()), None)),
        Report::Stopped => Err(Failure::busy(STOPPED)),
    }
}

fn bits(units: i32) -> i64 {
    i64::from(units) << Coordinate::FRACTION_BITS
}
