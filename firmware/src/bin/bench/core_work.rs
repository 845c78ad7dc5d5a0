//! The core's own work, as the firmware calls it.

use crate::measure;
use core::cell::RefCell;
use core::hint::black_box;
use protocol_core::arm::{Angles, PenLift, inverse};
use protocol_core::lineus::{Command, Refusal, parse};
use protocol_core::machine::{ArmData, Client, Errand, Machine, Manner, SetPoint, Target};
use protocol_core::motion::{Coordinate, Micros, Position};

/// The points of the other measurements, in 1/65536 units.
const POINTS: [Position; 5] = [
    point(65_536_000, 65_536_000, 65_536_000),
    point(92_681_901, 0, 0),
    point(42_598_400, -65_536_000, 32_768_000),
    point(116_326_400, 52_428_800, 65_536_000),
    point(45_875_200, -98_304_000, 0),
];

const fn point(x: i32, y: i32, z: i32) -> Position {
    Position {
        x: Coordinate::from_bits(x),
        y: Coordinate::from_bits(y),
        z: Coordinate::from_bits(z),
    }
}

/// Measures and prints.
pub fn report() {
    measure::report("parse", &[&b"G01 X1234 Y-567 Z1000"[..]], parsed);
    measure::report("inverse kinematics", &POINTS, angles);
    let moves = POINTS.map(|to| {
        let mut machine = Machine::new(ArmData::default(), Default::default());
        machine.tick(Micros::default());
        let client = Client::new(0).expect("there is a first client");
        machine.take(client, &Errand::Move(Manner::Straight, Target::at(to)));
        RefCell::new(machine)
    });
    measure::report("set-point", &moves, set_point);
}

fn parsed(line: &&'static [u8]) {
    let command: Result<Command, Refusal<'_>> = parse(line);
    black_box(&command);
}

fn angles(position: &Position) -> Angles {
    inverse(*position, PenLift::default())
}

/// A frame in the middle of a move: step, drawing area, kinematics, calibration, three pulse widths.
fn set_point(machine: &RefCell<Machine>) -> SetPoint {
    machine.borrow_mut().tick(Micros::new(50_000))
}
