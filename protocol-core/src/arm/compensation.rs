//! Between the nib and the arm: how high the paper lies, and how far the nib moves to the side as it
//! comes down.
//!
//! Both are nothing where the pen is fully lifted, so that home, the calibration point and every way in
//! the air are what they are without them, and they grow evenly as it comes down:
//!
//! - the map: `Z' = Z + h (1 - Z / 1000)`, with h the height of the paper under the nib. Z = 0 is on the
//!   paper everywhere, Z = 1000 is the lifted pen everywhere, and the order of heights stays, because
//!   h is less than 1000.
//! - the shift: the nib is `s (1 - Z' / 1000)` further out than the arm, so the arm stays that much
//!   further in, on the line from the shoulder to the nib. It follows Z' and not Z, because it is the
//!   lift itself that moves the nib, wherever the paper is.

use super::square_of;
use super::tables::{RECIPROCAL, high_half};
use super::z_map::{Surface, ZMap};
use crate::motion::{Coordinate, PEN_UP, Position, hold};
use core::fmt;

/// How far the nib moves away from the shoulder while the pen comes down all the way, in hundredths of
/// a millimetre; a nib that moves towards it has a negative one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NibShift(i16);

impl NibShift {
    /// The lift is vertical.
    pub const NONE: Self = Self(0);
    /// Most millimetres, either way.
    pub const MOST: u8 = 2;

    /// From hundredths of a millimetre, if it is not more than [`Self::MOST`].
    pub const fn from_hundredths(hundredths: i16) -> Option<Self> {
        if hundredths.unsigned_abs() > Self::MOST as u16 * 100 {
            return None;
        }
        Some(Self(hundredths))
    }

    /// In hundredths of a millimetre.
    pub const fn hundredths(self) -> i16 {
        self.0
    }
}

/// Millimetres with two decimals.
impl fmt::Display for NibShift {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let magnitude = self.0.unsigned_abs();
        write!(out, "{sign}{}.{:02}", magnitude / 100, magnitude % 100)
    }
}

/// Map and shift, ready for use.
#[derive(Clone, Copy, Debug)]
pub struct Compensation {
    map: ZMap,
    shift: NibShift,
    /// Flat and vertical: as most arms are, so it is asked first.
    is_none: bool,
    surface: Surface,
    /// The shift over the whole lift, in thousandths, in 1/2^28.
    pull: i32,
}

impl Default for Compensation {
    /// A flat map and a vertical lift: nothing is compensated.
    fn default() -> Self {
        Self::new(ZMap::FLAT, NibShift::NONE)
    }
}

impl Compensation {
    /// For a map and a shift.
    pub fn new(map: ZMap, shift: NibShift) -> Self {
        // A hundredth of a millimetre is a fifth of a unit.
        let pull = (i64::from(shift.0) << 28) / (5 * i64::from(PEN_UP.rounded()));
        Self {
            map,
            shift,
            is_none: map == ZMap::FLAT && shift == NibShift::NONE,
            surface: Surface::new(map),
            pull: pull as i32,
        }
    }

    /// The map.
    pub const fn map(&self) -> ZMap {
        self.map
    }

    /// The shift.
    pub const fn shift(&self) -> NibShift {
        self.shift
    }

    /// Whether nib and arm are always at the same place.
    pub const fn is_none(&self) -> bool {
        self.is_none
    }

    /// Where the arm has to be so that the nib is at `nib`. Where that is outside the drawing area, the
    /// arm is held at its edge, and the nib misses its place by less than the shift.
    ///
    /// Z is between -500 and 1000.
    #[inline(always)]
    pub fn arm(&self, nib: Position) -> Position {
        if self.is_none || nib.z == PEN_UP {
            return nib;
        }
        self.below(nib)
    }

    /// A function of its own, so that the way of an exact arm stays in registers.
    #[inline(never)]
    fn below(&self, nib: Position) -> Position {
        let down = PEN_UP.bits() - nib.z.bits();
        let raised = high_half(self.surface.part_of_lift(nib.x, nib.y), down << 4);
        let arm = Position {
            z: Coordinate::from_bits(nib.z.bits() + raised),
            ..nib
        };
        if self.pull == 0 {
            return arm;
        }
        let out = self.out_at(arm.z);
        let square = square_of(nib.x.bits()).wrapping_add(square_of(nib.y.bits()));
        // 1/2^16 units times 2^6 times 2^39 parts of a unit, without the lower 32 bits: 1/2^29.
        let part = high_half(out << 6, RECIPROCAL.at(square >> 23, square << 8));
        let inwards = |bits: i32| Coordinate::from_bits(bits - high_half(bits << 3, part));
        let pulled = Position {
            x: inwards(arm.x.bits()),
            y: inwards(arm.y.bits()),
            z: arm.z,
        };
        hold(pulled).0
    }

    /// Where the nib is when the arm is at `arm`, whose Z may be below 0: the inverse of [`Self::arm`].
    pub fn nib(&self, arm: Position) -> Position {
        let out = i64::from(self.out_at(arm.z));
        let (x, y) = (i64::from(arm.x.bits()), i64::from(arm.y.bits()));
        let radius = ((x * x + y * y).cast_unsigned().isqrt() as i64).max(1);
        let outwards = |bits: i64| Coordinate::from_bits((bits + bits * out / radius) as i32);
        let (x, y) = (outwards(x), outwards(y));
        Position {
            x,
            y,
            z: self.height_over_paper(x, y, arm.z),
        }
    }

    /// The Z of a nib over (x, y) with the arm at the height `arm`: 0 on the paper, limited to
    /// 0..=1000.
    pub(crate) fn height_over_paper(
        &self,
        x: Coordinate,
        y: Coordinate,
        arm: Coordinate,
    ) -> Coordinate {
        const WHOLE: i64 = 1 << 28;
        let down = i64::from(PEN_UP.bits() - arm.bits());
        let height = i64::from(self.surface.part_of_lift(x, y));
        // A height is at most half of the lift.
        let down = down * WHOLE / (WHOLE - height).max(1);
        let within = (i64::from(PEN_UP.bits()) - down).clamp(0, PEN_UP.bits().into());
        Coordinate::from_bits(within as i32)
    }

    /// How far the nib is further out than the arm, in 1/65536 units, with the arm at this height.
    #[inline]
    fn out_at(&self, z: Coordinate) -> i32 {
        // Down by at most 1500 units: 31 bits.
        high_half(self.pull, (PEN_UP.bits() - z.bits()) << 4)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::motion::contains;
    use proptest::prelude::*;
    use std::string::ToString;

    #[test]
    fn shifts_have_their_range_and_two_decimals() {
        for (hundredths, text) in [(0, "0.00"), (85, "0.85"), (-200, "-2.00"), (-5, "-0.05")] {
            let shift = NibShift::from_hundredths(hundredths).unwrap();
            assert_eq!(shift.to_string(), text);
            assert_eq!(shift.hundredths(), hundredths);
        }
        for hundredths in [201, -201, i16::MAX, i16::MIN] {
            assert_eq!(NibShift::from_hundredths(hundredths), None);
        }
    }

    fn place(x: f64, y: f64, z: f64) -> Position {
        let bits = |value: f64| Coordinate::from_bits((value * 65536.0).round() as i32);
        Position {
            x: bits(x),
            y: bits(y),
            z: bits(z),
        }
    }

    fn compensation(map: [i16; 4], hundredths: i16) -> Compensation {
        Compensation::new(
            ZMap::new(map).unwrap(),
            NibShift::from_hundredths(hundredths).unwrap(),
        )
    }

    #[test]
    fn the_arm_follows_the_paper_and_the_lift() {
        // Straight ahead a shift is along x alone.
        for (map, hundredths, nib, arm) in [
            ([100; 4], 0, (1400.0, 0.0, 0.0), (1400.0, 0.0, 100.0)),
            ([100; 4], 0, (1400.0, 0.0, 500.0), (1400.0, 0.0, 550.0)),
            ([-200; 4], 0, (1400.0, 0.0, 0.0), (1400.0, 0.0, -200.0)),
            ([0; 4], 100, (1400.0, 0.0, 0.0), (1380.0, 0.0, 0.0)),
            ([0; 4], 100, (1400.0, 0.0, 250.0), (1385.0, 0.0, 250.0)),
            ([0; 4], -100, (1400.0, 0.0, 0.0), (1420.0, 0.0, 0.0)),
            ([0; 4], 50, (900.0, 1200.0, 0.0), (894.0, 1192.0, 0.0)),
            // The paper is met on the way down: so much is left of the shift.
            ([250; 4], 100, (1400.0, 0.0, 0.0), (1385.0, 0.0, 250.0)),
            ([500; 4], 200, (1400.0, 0.0, 1000.0), (1400.0, 0.0, 1000.0)),
        ] {
            let found = compensation(map, hundredths).arm(place(nib.0, nib.1, nib.2));
            for (found, expected) in [(found.x, arm.0), (found.y, arm.1), (found.z, arm.2)] {
                let off = (found.to_f64() - expected).abs();
                assert!(
                    off < 0.003,
                    "{map:?}, {hundredths}, {nib:?}: {found:?}, not {arm:?}"
                );
            }
        }
    }

    #[test]
    fn without_map_and_shift_nothing_is_changed() {
        let none = Compensation::default();
        assert!(none.is_none());
        for nib in [place(1950.0, 0.0, 0.0), place(700.25, -1500.5, 333.3)] {
            assert_eq!(none.arm(nib), nib);
        }
    }

    #[test]
    fn the_arm_is_held_at_the_edge() {
        let arm = compensation([0; 4], -200).arm(place(1940.0, 0.0, 0.0));
        assert!((arm.x.to_f64() - 1950.0).abs() < 0.001, "{arm:?}");
        let arm = compensation([0; 4], 200).arm(place(510.0, 10.0, 0.0));
        assert!((arm.x.to_f64() - 500.0).abs() < 0.001, "{arm:?}");
    }

    prop_compose! {
        fn inside()(x in 500.0..1950.0, y in -1600.0..1600.0, z in 0.0..1000.0) -> Position {
            hold(place(x, y, z)).0
        }
    }

    proptest! {
        #[test]
        fn nib_and_arm_are_each_others_inverse(corners: [i16; 4], hundredths in -200i16..=200, nib in inside()) {
            let compensation = compensation(corners.map(|corner| corner % 501), hundredths);
            let arm = compensation.arm(nib);
            prop_assert!(contains(arm.x, arm.y), "the arm is outside, {arm:?}");
            let back = compensation.nib(arm);
            // Where the arm is held at the edge the nib is off.
            let most = f64::from(hundredths.abs()) / 5.0 * 1.5 + 0.01;
            // Along the axes it is further to an edge that the nib goes straight to, by up to a half.
            let far = 1.5 * most;
            let free = [(far, 0.0), (-far, 0.0), (0.0, far), (0.0, -far)].iter().all(|(dx, dy)| {
                let near = place(nib.x.to_f64() + dx, nib.y.to_f64() + dy, 0.0);
                contains(near.x, near.y)
            });
            let tolerance = if free { 0.01 } else { most };
            let off = (back.x.to_f64() - nib.x.to_f64()).hypot(back.y.to_f64() - nib.y.to_f64());
            prop_assert!(off <= tolerance, "{nib:?} becomes {back:?}");
            if free {
                prop_assert!((back.z.to_f64() - nib.z.to_f64()).abs() < 0.01, "{nib:?} becomes {back:?}");
            }
        }

        #[test]
        fn higher_stays_higher(corners: [i16; 4], a in inside(), z in 0.0..1000.0) {
            let compensation = compensation(corners.map(|corner| corner % 501), 0);
            let b = place(a.x.to_f64(), a.y.to_f64(), z);
            let order = |first: Coordinate, second: Coordinate| first.bits() - second.bits();
            let (before, after) = (order(a.z, b.z), order(compensation.arm(a).z, compensation.arm(b).z));
            prop_assert!(before.signum() == after.signum() || before.abs() < 8);
        }
    }
}
