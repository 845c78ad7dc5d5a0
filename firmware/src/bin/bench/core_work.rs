//! The core's own work, as the firmware calls it.

use crate::measure;
use core::cell::RefCell;
use core::hint::black_box;
use protocol_core::arm::{Angles, Compensation, NibShift, PenLift, ZMap, inverse};
use protocol_core::lineus::{Command, Refusal, parse};
use protocol_core::machine::{ArmData, Client, Errand, Machine, Manner, SetPoint, Target};
use protocol_core::motion::{
    Coordinate, Feed, Intensity, Micros, Millimetres, PEN_DOWN, PLAN_SEGMENTS, Position, Segment,
    TablePoint,
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
    let usual = Compensation::default();
    measure::report("set-point", &moves(POINTS, usual), set_point);
    // With the pen up there is nothing to compensate.
    let down = POINTS.map(|to| Position { z: PEN_DOWN, ..to });
    let map = ZMap::new([0, 100, 300, 200]).expect("heights in range");
    let shift = NibShift::from_hundredths(85).expect("a shift in range");
    for (name, map, shift) in [
        ("set-point, pen on its way down", ZMap::FLAT, NibShift::NONE),
        ("set-point, map", map, NibShift::NONE),
        ("set-point, map and shift", map, shift),
    ] {
        let compensation = Compensation::new(map, shift);
        measure::report(name, &moves(down, compensation), set_point);
    }
    measure::report(
        "set-point of a plan",
        &STROKE_MILLIS.map(in_a_stroke),
        set_point,
    );
    measure::report(
        "set-point that begins a segment",
        &[before_a_segment()],
        set_point,
    );
    measure::report("plan a segment", &[full_but_one()], plan_one_more);
}

/// Arms on their way from home, and the time of the next frame.
fn moves(targets: [Position; 5], compensation: Compensation) -> [RefCell<(Machine, Micros)>; 5] {
    targets.map(|to| {
        let mut machine = Machine::new(ArmData::default(), Default::default());
        machine.set_compensation(compensation);
        machine.tick(Micros::default());
        let client = Client::new(0).expect("there is a first client");
        machine.take(client, &Errand::Move(Manner::Straight, Target::at(to)));
        RefCell::new((machine, Micros::new(50_000)))
    })
}

/// In the rise, the cruise and the fall of a stroke of 700 ms.
const STROKE_MILLIS: [u64; 5] = [100, 250, 340, 400, 600];

/// An arm in the middle of a stroke, and the time of its next frame.
fn in_a_stroke(millis: u64) -> RefCell<(Machine, Micros)> {
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
    RefCell::new((machine, Micros::new(now + 10_000)))
}

/// An arm that begins its next segment in the next frame.
fn before_a_segment() -> RefCell<(Machine, Micros)> {
    let begin = || {
        let arm = in_a_stroke(100);
        arm.borrow_mut()
            .0
            .plan(&segment(30, 80, Intensity(200)))
            .expect("there is room");
        arm.borrow_mut().0.plan_has_changed();
        arm
    };
    let run = |arm: &RefCell<(Machine, Micros)>, frames: u64| {
        let (machine, next) = &mut *arm.borrow_mut();
        for _ in 0..frames {
            machine.tick(*next);
            *next = *next + Micros::new(10_000);
        }
        machine.plan_has_changed()
    };
    let frames = (1..200)
        .find(|frames| run(&begin(), *frames))
        .expect("the second segment begins");
    let arm = begin();
    run(&arm, frames - 1);
    arm
}

/// An arm in the middle of a stroke, whose plan has room for one more segment.
fn full_but_one() -> RefCell<(Machine, Micros)> {
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

fn plan_one_more(arm: &RefCell<(Machine, Micros)>) {
    let (machine, _) = &mut *arm.borrow_mut();
    black_box(machine.plan(&segment(42, 78, Intensity(200)))).ok();
}

fn parsed(line: &&'static [u8]) {
    let command: Result<Command, Refusal<'_>> = parse(line);
    black_box(&command);
}

fn angles(position: &Position) -> Angles {
    inverse(*position, PenLift::default())
}

/// A frame in the middle of a move or a stroke: step or profile, drawing area, kinematics, calibration,
/// three pulse widths.
fn set_point(arm: &RefCell<(Machine, Micros)>) -> SetPoint {
    let (machine, next) = &mut *arm.borrow_mut();
    machine.tick(*next)
}
