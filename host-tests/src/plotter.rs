//! The machine as a plotter: orders in millimetres go into its plan as a host would send them, and every
//! set-point is on record. No text, no sockets, and no real time.

use crate::model::Order;
use protocol_core::arm::Calibration;
use protocol_core::machine::{ArmData, Machine, NotPlanned, SetPoint};
use protocol_core::motion::{Feed, Intensity, Micros, Millimetres, Segment, TablePoint};

/// No job of a test takes longer, in microseconds.
const PATIENCE_US: u64 = 3_600_000_000;

/// An arm at physical home with the pen up.
pub struct Plotter {
    /// The arm itself.
    pub machine: Machine,
    /// Between two set-points, in microseconds.
    pub frame_us: u64,
    /// Time of the last set-point.
    pub now_us: u64,
    /// All set-points since the arm was at home.
    pub frames: Vec<SetPoint>,
}

impl Plotter {
    /// It gives a set-point each `frame_us`.
    pub fn new(frame_us: u64) -> Self {
        Self::of(ArmData::default(), frame_us)
    }

    /// On some other board.
    pub fn of(data: ArmData, frame_us: u64) -> Self {
        let mut plotter = Self {
            machine: Machine::new(data, Calibration::default()),
            frame_us,
            now_us: 0,
            frames: Vec::new(),
        };
        plotter.machine.home().expect("there is room");
        plotter.rest();
        plotter.frames.drain(..plotter.frames.len() - 1);
        plotter
    }

    /// The next servo frame.
    pub fn tick(&mut self) -> SetPoint {
        self.now_us += self.frame_us;
        let set_point = self.machine.tick(Micros::new(self.now_us));
        self.frames.push(set_point);
        set_point
    }

    /// Adds an order if there is room.
    ///
    /// # Panics
    /// When the machine is stopped.
    pub fn plan(&mut self, order: &Order) -> bool {
        let planned = match *order {
            Order::Line {
                to,
                feed,
                intensity,
            } => self.machine.plan(&Segment {
                to: point(to),
                feed: Feed::from_bits((feed * 65536.0).round() as i64),
                intensity: Intensity(intensity),
            }),
            Order::Dwell { seconds, intensity } => self.machine.dwell(
                Micros::new((seconds * 1e6).round() as u64),
                Intensity(intensity),
            ),
        };
        assert_ne!(planned, Err(NotPlanned::Stopped), "{order:?}");
        planned.is_ok()
    }

    /// Has a job done, each order as soon as there is room, and gives the seconds that took.
    pub fn draw(&mut self, orders: &[Order]) -> f64 {
        let begun = self.now_us;
        let mut orders = orders.iter().peekable();
        loop {
            while orders.peek().is_some_and(|order| self.plan(order)) {
                orders.next();
            }
            if orders.peek().is_none() && self.machine.plan_is_done() {
                return (self.now_us - begun) as f64 / 1e6;
            }
            self.tick();
            assert!(self.now_us - begun < PATIENCE_US, "the job does not end");
        }
    }

    /// Ticks until nothing moves and the pen is up.
    pub fn rest(&mut self) {
        let begun = self.now_us;
        while self.machine.is_busy() {
            self.tick();
            assert!(self.now_us - begun < PATIENCE_US, "the arm does not rest");
        }
    }
}

/// Millimetres to the nearest 1/65536.
pub fn point([x, y]: [f64; 2]) -> TablePoint {
    let bits = |value: f64| Millimetres::from_bits((value * 65536.0).round() as i32);
    TablePoint {
        x: bits(x),
        y: bits(y),
    }
}
