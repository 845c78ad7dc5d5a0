//! The core's fixed-point kinematics against f64, over the whole drawing area.

use host_tests::model;
use protocol_core::arm::{Angles, PenLift, ServoRange, forward, inverse};
use protocol_core::machine::{ArmData, position_of};
use protocol_core::motion::{Coordinate, Position};

/// Between two points of the grid, in drawing units.
const GRID: f64 = 5.0;
/// Largest error of a pulse, in microseconds of a servo that has 500..2500 us for 180 degrees.
const PULSE_TOLERANCE: f64 = 0.1;
/// Largest distance between a point and what forward kinematics makes of its angles or pulses.
const LOOP_TOLERANCE: f64 = 0.2;

/// The grid, and points a hair inside the edges all around, each rounded to what a coordinate holds.
fn points() -> Vec<(f64, f64)> {
    let steps = |from: f64, to: f64| {
        let count = ((to - from) / GRID) as i32;
        (0..=count).map(move |i| from + GRID * f64::from(i))
    };
    let grid = steps(500.0, 1950.0).flat_map(|x| steps(-1600.0, 1600.0).map(move |y| (x, y)));
    // From outside to the closest point of the edge, and on by a little towards the middle.
    let edge = (0..36_000).flat_map(|i| {
        let angle = f64::from(i).to_radians() / 100.0;
        let (x, y) = model::closest(1000.0 + 4000.0 * angle.cos(), 100.0 + 4000.0 * angle.sin());
        let hugging = |by: f64| (x + (1000.0 - x) * by, y + (100.0 - y) * by);
        [hugging(1e-6), hugging(1e-4), hugging(1e-2)]
    });
    // The notch's own edges cannot be seen from outside.
    let notch = (0..2000).flat_map(|i| {
        let along = f64::from(i) / 10.0;
        [(500.0 + along, 0.0), (700.0, -along)]
    });
    let bits = |value: f64| (value * 65536.0).round() / 65536.0;
    grid.chain(edge)
        .chain(notch)
        .map(|(x, y)| (bits(x), bits(y)))
        .filter(|&(x, y)| model::inside(x, y))
        .collect()
}

fn coordinate(value: f64) -> Coordinate {
    Coordinate::from_bits((value * 65536.0).round() as i32)
}

fn pulses(angles: Angles) -> [f64; 3] {
    let servo = ServoRange::default();
    angles.to_array().map(|angle| servo.pulse(angle).to_f64())
}

/// The largest of something, and where.
#[derive(Default)]
struct Worst {
    value: f64,
    at: [f64; 3],
}

impl Worst {
    fn see(&mut self, value: f64, at: [f64; 3]) {
        if value >= self.value || value.is_nan() {
            *self = Self { value, at };
        }
    }
}

#[test]
fn pulses_are_within_a_tenth_of_a_microsecond_of_f64_everywhere() {
    let points = points();
    assert!(points.len() > 150_000, "only {} points", points.len());
    let mut worst = [(); 3].map(|()| Worst::default());
    for (index, &(x, y)) in points.iter().enumerate() {
        // Z runs through its range as well, although no other servo depends on it.
        let z = (index % 16_001) as f64 / 16.0;
        let position = Position {
            x: coordinate(x),
            y: coordinate(y),
            z: coordinate(z),
        };
        let got = pulses(inverse(position, PenLift::default()));
        let expected = model::inverse(x, y, z).map(model::pulse);
        for ((worst, got), expected) in worst.iter_mut().zip(got).zip(expected) {
            worst.see((got - expected).abs(), [x, y, z]);
        }
    }
    for (servo, worst) in ["shoulder", "elbow", "pen"].iter().zip(&worst) {
        println!(
            "{servo}: off by at most {:.4} us, at {:?}, of {} points",
            worst.value,
            worst.at,
            points.len()
        );
    }
    for (servo, worst) in ["shoulder", "elbow", "pen"].iter().zip(&worst) {
        assert!(
            worst.value <= PULSE_TOLERANCE,
            "{servo} is off by {} us at {:?}",
            worst.value,
            worst.at
        );
    }
}

#[test]
fn forward_of_inverse_is_where_it_began_everywhere() {
    let mut worst = Worst::default();
    let mut worst_of_pulses = Worst::default();
    let data = ArmData::default();
    for (index, (x, y)) in points().into_iter().enumerate() {
        let z = (index % 1001) as f64;
        let position = Position {
            x: coordinate(x),
            y: coordinate(y),
            z: coordinate(z),
        };
        let angles = inverse(position, data.lift);
        let off = |back: Position| {
            let [dx, dy, dz] = [
                back.x.to_f64() - x,
                back.y.to_f64() - y,
                back.z.to_f64() - z,
            ];
            dx.hypot(dy).hypot(dz)
        };
        worst.see(off(forward(angles, data.lift)), [x, y, z]);
        let servo = ServoRange::default();
        let pulses = angles.to_array().map(|angle| servo.pulse(angle));
        worst_of_pulses.see(off(position_of(pulses, &data)), [x, y, z]);
    }
    for (what, worst) in [("angles", worst), ("pulses", worst_of_pulses)] {
        println!(
            "back from {what}: off by at most {:.4} units, at {:?}",
            worst.value, worst.at
        );
        assert!(
            worst.value <= LOOP_TOLERANCE,
            "back from {what}: off by {} units at {:?}",
            worst.value,
            worst.at
        );
    }
}

#[test]
fn forward_agrees_with_f64_everywhere() {
    let mut worst = Worst::default();
    for (x, y) in points() {
        let angles = inverse(
            Position {
                x: coordinate(x),
                y: coordinate(y),
                z: coordinate(0.0),
            },
            PenLift::default(),
        );
        let expected = model::forward(angles.to_array().map(|angle| angle.to_f64()));
        let got = forward(angles, PenLift::default());
        worst.see(
            (got.x.to_f64() - expected[0]).hypot(got.y.to_f64() - expected[1]),
            [x, y, 0.0],
        );
    }
    println!("forward: off by at most {:.5} units", worst.value);
    assert!(
        worst.value <= 0.01,
        "off by {} units at {:?}",
        worst.value,
        worst.at
    );
}
