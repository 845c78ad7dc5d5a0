//! Jobs in millimetres.

use host_tests::model::{self, Order};

/// mm a minute of the pen on the paper, and above it.
pub const DRAWING: f64 = 1500.0;
pub const TRAVELLING: f64 = 8000.0;

pub fn line(x: f64, y: f64, feed: f64, intensity: u8) -> Order {
    Order::Line {
        to: [x, y],
        feed,
        intensity,
    }
}

/// An example drawing, moved to the table; what lies beyond is drawn at its edge.
pub fn example(name: &str) -> Vec<Order> {
    let path = format!("{}/../examples/{name}.gcode", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|why| panic!("{path}: {why}"));
    let reports = model::reports(&text);
    reports
        .map(|report| {
            let [x, y, z] = report.target;
            let (x, y) = ((x - 710.0) / 20.0, (y + 900.0) / 20.0);
            let down = z < 500.0;
            line(
                x.clamp(0.0, 50.0),
                y.clamp(0.0, 90.0),
                if down { DRAWING } else { TRAVELLING },
                if down { 200 } else { 0 },
            )
        })
        .collect()
}

/// From (5, 5), strokes of `points` corners with travels between them, and so many in all.
pub fn polylines(seed: u64, strokes: usize, points: usize, feed: f64) -> Vec<Order> {
    let mut random = Random(seed);
    let mut orders = Vec::new();
    for _ in 0..strokes {
        for point in 0..points {
            let (x, y) = (random.below(50.0), random.below(90.0));
            let (feed, intensity) = if point == 0 {
                (TRAVELLING, 0)
            } else {
                (feed, 255)
            };
            orders.push(line(x, y, feed, intensity));
        }
    }
    orders
}

/// A circle of segments of a given length.
pub fn circle(radius: f64, length: f64, feed: f64) -> Vec<Order> {
    let count = (std::f64::consts::TAU * radius / length).round() as usize;
    let at = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / count as f64;
        (25.0 + radius * angle.cos(), 45.0 + radius * angle.sin())
    };
    let mut orders = vec![line(at(0).0, at(0).1, TRAVELLING, 0)];
    orders.extend((1..=count).map(|i| line(at(i).0, at(i).1, feed, 128)));
    orders
}

/// From the middle outwards, a turn each 2 mm.
pub fn spiral(turns: f64, length: f64, feed: f64) -> Vec<Order> {
    let mut orders = vec![line(25.0, 45.0, TRAVELLING, 0)];
    let mut angle: f64 = 0.0;
    while angle < turns * std::f64::consts::TAU {
        let radius = angle / std::f64::consts::PI;
        angle += length / radius.hypot(1.0 / std::f64::consts::PI);
        let radius = angle / std::f64::consts::PI;
        let (x, y) = (25.0 + radius * angle.cos(), 45.0 + radius * angle.sin());
        orders.push(line(x, y, feed, 255));
    }
    orders
}

/// A small generator, so that a job is the same in every run (xorshift64).
struct Random(u64);

impl Random {
    fn below(&mut self, most: f64) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64 * most
    }
}
