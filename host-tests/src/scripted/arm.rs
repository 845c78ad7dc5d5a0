//! The servos: every set-point is looked at, and every place the nib has been is kept.

use super::power::Power;
use crate::model;
use embassy_time::{Duration, Instant};
use firmware::board;
use protocol_core::machine::SetPoint;
use protocol_core::motion::{Micros, Position};
use std::cell::RefCell;
use std::rc::Rc;

/// Where the arm is when it starts: x, y, z.
pub const HOME: [f64; 3] = [1000.0; 3];
/// The pen is down below this (`spec 1.0.4a, G94`).
pub const PEN_DOWN_BELOW: f64 = 500.0;
/// The longest way from home that still is a little wave, along each axis.
const WAVE: f64 = 600.0;
/// What rounding to 1/65536 of a unit may put a place outside by.
const ROUNDING: f64 = 1.0 / 32.0;
/// A servo's own limits, in microseconds (`reference/arm.md`).
const PULSES: std::ops::RangeInclusive<f64> = 500.0..=2500.0;

/// What the arm did: places with the time at which it came there.
#[derive(Debug, Default)]
pub struct ArmRecord(RefCell<Path>);

#[derive(Debug, Default)]
struct Path {
    places: Vec<(Instant, [f64; 3])>,
    last_frame: Option<Instant>,
}

fn place(position: Position) -> [f64; 3] {
    [position.x, position.y, position.z].map(|coordinate| coordinate.to_f64())
}

impl ArmRecord {
    /// The power has gone: the arm stands still.
    pub fn power_off(&self) {
        let mut path = self.0.borrow_mut();
        path.last_frame = None;
    }

    /// Where the nib is; home before the first set-point.
    pub fn place(&self) -> [f64; 3] {
        let path = self.0.borrow();
        path.places.last().map_or(HOME, |(_, place)| *place)
    }

    /// Since when it is there.
    pub fn there_since(&self) -> Instant {
        let path = self.0.borrow();
        path.places.last().map_or(Instant::MIN, |(at, _)| *at)
    }

    /// How many places there are, for [`Self::passed`] and [`Self::waved`].
    pub fn length(&self) -> usize {
        self.0.borrow().places.len()
    }

    /// Where in the record, from `since` on, the nib was at x, y and, if it is given, z.
    pub fn passed(&self, since: usize, x: f64, y: f64, z: Option<f64>) -> Option<usize> {
        let path = self.0.borrow();
        let at = |a: f64, b: f64| (a - b).abs() <= ROUNDING;
        let mut places = path.places.iter().skip(since);
        let found = places.position(|(_, place)| {
            at(place[0], x) && at(place[1], y) && z.is_none_or(|z| at(place[2], z))
        });
        found.map(|index| since + index)
    }

    /// The closest that the nib came to x, y since then.
    pub fn closest(&self, since: usize, x: f64, y: f64) -> Option<[f64; 3]> {
        let path = self.0.borrow();
        let distance = |place: &[f64; 3]| (place[0] - x).hypot(place[1] - y);
        let places = path.places.iter().skip(since).map(|(_, place)| *place);
        places.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// Whether a little motion near home, with the pen up, has brought the arm back home since then.
    pub fn waved(&self, since: usize) -> bool {
        let path = self.0.borrow();
        let places = path.places.get(since..).unwrap_or_default();
        let near = |place: &[f64; 3]| {
            let axes = place.iter().zip(HOME);
            place[2] >= PEN_DOWN_BELOW && axes.clone().all(|(a, home)| (a - home).abs() <= WAVE)
        };
        let went = places.iter().any(|(_, place)| *place != HOME);
        let back = places.last().is_some_and(|(_, place)| *place == HOME);
        went && back && places.iter().all(|(_, place)| near(place))
    }
}

/// The servos of the board.
pub struct Servos {
    /// What they did.
    pub record: Rc<ArmRecord>,
    /// Without which they do nothing.
    pub power: Power,
    /// Time between two frames.
    pub frame: Duration,
}

impl board::Servos for Servos {
    fn write(&mut self, _: Micros, set_point: &SetPoint) {
        if !self.power.is_on() {
            return;
        }
        let now = Instant::now();
        let mut path = self.record.0.borrow_mut();
        if let Some(last) = path.last_frame.replace(now)
            && now - last != self.frame
        {
            self.power.offend(format!(
                "a servo frame comes {} us after the one before",
                (now - last).as_micros()
            ));
        }
        let place = place(set_point.position);
        if path.places.last().map_or(HOME, |(_, last)| *last) == place {
            return;
        }
        path.places.push((now, place));
        let [x, y, z] = place;
        let (near_x, near_y) = model::closest(x, y);
        if (near_x - x).hypot(near_y - y) > ROUNDING || !(0.0..=1000.0).contains(&z) {
            self.power.offend(format!(
                "the arm leaves its drawing area: {x:.2} {y:.2} {z:.2}"
            ));
        }
        for pulse in set_point.pulses {
            let unit = f64::from(protocol_core::motion::PulseWidth::PER_MICROSECOND);
            let width = f64::from(pulse.get()) / unit;
            if !PULSES.contains(&width) {
                self.power
                    .offend(format!("a servo gets a pulse of {width:.2} us"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_time::Duration;
    use firmware::board::Servos as _;
    use firmware::boards::desktop::clock::HandTime;
    use protocol_core::machine::{ArmData, Machine};
    use protocol_core::motion::{Coordinate, PulseWidth};

    /// What is said of set-points that come every 10 ms, after home.
    fn offence(after_home: impl FnOnce(&mut SetPoint), late: u64) -> Option<String> {
        let time = HandTime::take();
        let mut servos = Servos {
            record: Rc::default(),
            power: Power::present(),
            frame: Duration::from_millis(10),
        };
        let mut machine = Machine::new(ArmData::default(), Default::default());
        let mut set_point = machine.tick(Micros::default());
        servos.write(Micros::default(), &set_point);
        assert_eq!(servos.power.offence(), None);
        after_home(&mut set_point);
        time.go_on_to(Instant::from_millis(10 + late));
        servos.write(Micros::default(), &set_point);
        servos.power.offence()
    }

    fn at(x: i16, y: i16, z: i16) -> impl FnOnce(&mut SetPoint) {
        move |set_point| {
            set_point.position = Position {
                x: Coordinate::from_units(x),
                y: Coordinate::from_units(y),
                z: Coordinate::from_units(z),
            };
        }
    }

    #[test]
    fn what_must_never_happen_is_an_offence() {
        assert_eq!(offence(at(1950, 0, 0), 0), None);
        let said = |offence: Option<String>| offence.unwrap_or_default();
        for (x, y, z) in [
            (1951, 0, 0),
            (690, -300, 0),
            (1000, 1000, -1),
            (1000, 1000, 1001),
        ] {
            let said = said(offence(at(x, y, z), 0));
            assert!(
                said.contains("leaves its drawing area"),
                "{x} {y} {z}: {said}"
            );
        }
        assert!(said(offence(at(1000, 900, 0), 1)).contains("11000 us after"));
        let wide = |set_point: &mut SetPoint| {
            at(1000, 900, 0)(set_point);
            set_point.pulses[2] = PulseWidth::from_micros(2501);
        };
        assert!(said(offence(wide, 0)).contains("2501.00 us"));
    }
}
