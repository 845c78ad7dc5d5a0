//! The core's own work, as the firmware calls it.

use crate::measure;
use core::cell::RefCell;
use core::hint::black_box;
use protocol_core::arm::{Angles, PenLift, inverse};
use protocol_core::lineus::{Command, Refusal, parse};
use protocol_core::machine::{ArmData, Client, Errand, Machine, Manner, SetPoint, Target};
use protocol_core::motion::{
    Coordinate, Feed, Intensity, Micros, Millimetres, PLAN_SEGMENTS, Position, Segment, TablePoint,
};

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
    measure::report(
        "set-point of a plan",
        &STROKE_MILLIS.map(in_a_stroke),
        next_set_point,
    );
    measure::report("plan a segment", &[full_but_one()], plan_one_more);
}

/// In the rise, the cruise and the fall of a stroke of 600 ms.
const STROKE_MILLIS: [u64; 5] = [60, 100, 300, 400, 610];

/// An arm in the middle of a stroke, and the time of its last frame.
fn in_a_stroke(millis: u64) -> RefCell<(Machine, u64)> {
    let mut machine = Machine::new(ArmData::default(), Default::default());
    machine.home().expect("there is room");
    let mut now = 0;
    while !machine.plan_is_done() {
        now += 10_000;
        machine.tick(Micros::new(now));
    }
    machine
        .plan(&segment(25, 45, Intensity(200)))
        .expect("there is room");
    for _ in 0..millis / 10 {
        now += 10_000;
        machine.tick(Micros::new(now));
    }
    RefCell::new((machine, now))
}

/// An arm whose plan has room for one segment, in a curve that is limited by look-ahead throughout.
fn full_but_one() -> RefCell<(Machine, u64)> {
    let arm = in_a_stroke(300);
    {
        let (machine, _) = &mut *arm.borrow_mut();
        for number in 1..PLAN_SEGMENTS as i16 {
            machine
                .plan(&segment(25 + number / 2, 45 + number, Intensity(200)))
                .expect("there is room");
        }
    }
    arm
}

fn segment(x: i16, y: i16, intensity: Intensity) -> Segment {
    Segment {
        to: TablePoint {
            x: Millimetres::new(x),
            y: Millimetres::new(y),
        },
        feed: Feed::DEFAULT,
        intensity,
    }
}

fn plan_one_more(arm: &RefCell<(Machine, u64)>) {
    let (machine, _) = &mut *arm.borrow_mut();
    black_box(machine.plan(&segment(42, 78, Intensity(200)))).ok();
}

/// A frame in the middle of a stroke: profile, pen, drawing area, kinematics, calibration, pulses.
fn next_set_point(arm: &RefCell<(Machine, u64)>) -> SetPoint {
    let (machine, now) = &mut *arm.borrow_mut();
    machine.tick(Micros::new(*now + 10_000))
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
