//! What arm and pen are to do.

use crate::scenario::command::Expectation;
use crate::scenario::stage::Stage;
use crate::scripted::arm::{HOME, PEN_DOWN_BELOW};
use crate::scripted::journal::seconds;
use embassy_time::Duration;

pub fn expect(
    stage: &mut Stage,
    expectation: &Expectation,
    patience: Duration,
) -> Result<(), String> {
    let record = stage.board.arm.clone();
    match expectation {
        Expectation::ArmWaves => {
            let since = stage.acted;
            let waved = stage.pass_time(patience, |stage| {
                record.waved(since) && !stage.board.arm_is_busy()
            })?;
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
            let rests = stage.pass_time(patience, |stage| {
                !stage.board.arm_is_busy() && there(record.place())
            })?;
            rests.then_some(()).ok_or_else(|| {
                let moving = if stage.board.arm_is_busy() {
                    "moves"
                } else {
                    "rests"
                };
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
