//! The pen as a plotter's laser: how deep, how fast, and whether it is where it should be.

use super::super::units::{Coordinate, Micros, PEN_DOWN, PEN_DOWN_BELOW, PEN_UP};
use super::moment::Moment;
use crate::arm::PenLift;

/// Heights of the pen while it draws; board data, as the paper's own height is.
///
/// An intensity of 1 is `contact`, one of 255 `full`, and what is between them lies in between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PenDepth {
    contact: Coordinate,
    full: Coordinate,
}

impl PenDepth {
    /// Z 400 and Z 0.
    pub const DEFAULT: Self = Self {
        contact: Coordinate::from_units(400),
        full: PEN_DOWN,
    };

    /// Z where the pen touches lightly, and Z where it is pressed down most. `None` unless both are heights
    /// of a pen that is down, 0 up to below 500, and the second is not above the first.
    pub const fn new(contact: Coordinate, full: Coordinate) -> Option<Self> {
        let down = full.bits() >= PEN_DOWN.bits()
            && full.bits() <= contact.bits()
            && contact.bits() < PEN_DOWN_BELOW.bits();
        if down {
            Some(Self { contact, full })
        } else {
            None
        }
    }

    /// Z where the pen touches lightly.
    pub const fn contact(&self) -> Coordinate {
        self.contact
    }

    /// Z where the pen is pressed down most.
    pub const fn full(&self) -> Coordinate {
        self.full
    }
}

impl Default for PenDepth {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Laser intensity, the S word: 0 is off, the pen up; above it, the pen is down, the deeper the more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Intensity(pub u8);

impl Intensity {
    /// Pen up.
    pub const OFF: Self = Self(0);

    /// Whether the pen is up.
    pub const fn is_off(self) -> bool {
        self.0 == 0
    }
}

impl PenDepth {
    /// Height at the nominal speed, in 1/65536 units below light contact.
    pub(super) fn below_contact(self, intensity: Intensity) -> i32 {
        let whole = i64::from(self.contact.bits()) - i64::from(self.full.bits());
        (whole * i64::from(intensity.0.saturating_sub(1)) / 254) as i32
    }
}

/// Where the pen is. It goes to where it is sent no faster than its servo turns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pen {
    height: i32,
    target: i32,
    /// It has been put onto the paper.
    down: bool,
    /// When it was there.
    seen: Moment,
    /// Of the servo, in 1/65536 units a microsecond.
    rate: u32,
}

impl Pen {
    pub(super) fn new(lift: PenLift, degrees_per_second: u16) -> Self {
        Self {
            height: PEN_UP.bits(),
            target: PEN_UP.bits(),
            down: false,
            seen: Moment::default(),
            rate: lift.rate(degrees_per_second).clamp(1, MOST_RATE),
        }
    }

    pub(super) const fn height(&self) -> Coordinate {
        Coordinate::from_bits(self.height)
    }

    pub(super) const fn is_up(&self) -> bool {
        self.height == PEN_UP.bits()
    }

    pub(super) const fn is_down(&self) -> bool {
        self.down
    }

    /// It is at `height` now, whatever it was told before, and stays there.
    pub(super) fn put(&mut self, height: Coordinate, now: Moment) {
        (self.height, self.target, self.seen) = (height.bits(), height.bits(), now);
        self.down = false;
    }

    /// Sends it somewhere, and tells how long that takes.
    pub(super) fn send(&mut self, target: Coordinate, now: Moment) -> Micros {
        self.follow(self.target, now);
        self.target = target.bits();
        self.down = false;
        let way = self.target.abs_diff(self.height);
        Micros::new(u64::from(way.div_ceil(self.rate)))
    }

    /// It is where it was sent.
    pub(super) fn arrive(&mut self, now: Moment) {
        (self.height, self.seen) = (self.target, now);
        self.down = self.target != PEN_UP.bits();
    }

    /// Lets time pass towards where it was sent.
    pub(super) fn wait(&mut self, now: Moment) {
        self.follow(self.target, now);
    }

    /// Lets time pass towards `target`.
    #[inline]
    pub(super) fn follow(&mut self, target: i32, now: Moment) {
        self.target = target;
        if self.height != target {
            let passed = now.micros_since(self.seen).min(MOST_PASSED);
            let most = (self.rate * passed).cast_signed();
            self.height += (target - self.height).clamp(-most, most);
        }
        self.seen = now;
    }
}

/// The fastest pen crosses its thousand units in 16 ms.
const MOST_RATE: u32 = 4096;
/// What counts of the time between two frames, in microseconds; its product with the rate fits 31 bits.
const MOST_PASSED: u32 = 1 << 18;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::HOME_ANGLES;

    fn at(micros: u64) -> Moment {
        Moment::from(Micros::new(micros))
    }

    #[test]
    fn intensities_lie_evenly_between_contact_and_full() {
        let depth = PenDepth::default();
        for (intensity, below) in [(1, 0.0), (128, 200.0), (255, 400.0), (64, 99.2126)] {
            let found = f64::from(depth.below_contact(Intensity(intensity))) / 65536.0;
            assert!((found - below).abs() < 0.001, "S{intensity}: {found}");
        }
    }

    #[test]
    fn a_pen_that_draws_is_down() {
        let depth = |contact: i16, full: i16| {
            PenDepth::new(
                Coordinate::from_units(contact),
                Coordinate::from_units(full),
            )
        };
        assert_eq!(depth(400, 0), Some(PenDepth::DEFAULT));
        assert!(depth(499, 499).is_some());
        assert_eq!([depth(500, 0), depth(300, 301), depth(300, -1)], [None; 3]);
    }

    #[test]
    fn the_pen_is_as_fast_as_its_servo() {
        let mut pen = Pen::new(PenLift::default(), 600);
        // 27 degrees at 600 degrees a second.
        let contact = PenDepth::default().contact;
        let takes = pen.send(contact, at(0)).get();
        assert!((45_000..45_060).contains(&takes), "{takes} us");
        pen.wait(at(takes / 2));
        let half = pen.height().to_f64();
        assert!((half - 700.0).abs() < 0.1, "{half}");
        assert!(!pen.is_down() && !pen.is_up());
        pen.wait(at(takes));
        assert_eq!(pen.height(), contact);
    }

    #[test]
    fn a_long_frame_is_no_overflow() {
        let mut pen = Pen::new(PenLift::new(HOME_ANGLES.pen), u16::MAX);
        pen.send(PenDepth::default().full, at(0));
        pen.wait(at(u64::MAX >> 9));
        assert_eq!(pen.height(), PenDepth::default().full);
    }
}
