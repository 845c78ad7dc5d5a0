//! How high the paper lies: heights at four corners, and between them (`reference/line-us.md`, section
//! 5, G31).
//!
//! The corners are those of the drawing area of the original's app, (650, -1000) to (1775, 1000), which
//! is what its clients draw in; two of them are beyond the arm's reach, and are the ends of the plane
//! all the same. Beyond the rectangle a place has the height of the rectangle's nearest edge. Seen from
//! above with the body at the left, y points up: top is y = 1000, right is x = 1775.

// Arithmetic of the compiler, and of a setting that is put in force: not of a set-point.
#![allow(clippy::cast_possible_truncation)]

use super::tables::high_half;
use crate::motion::{Coordinate, PEN_UP};
use core::fmt;

/// Largest height of a corner, up or down, in units of Z.
pub const MAX_HEIGHT: i16 = 500;
/// Body's side of the rectangle, x in drawing units.
const LEFT: i16 = 650;
const RIGHT: i16 = 1775;
const BOTTOM: i16 = -1000;
const TOP: i16 = 1000;

/// The Z at which the nib touches the paper, at the four corners of the map, in whole units of Z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ZMap([i16; 4]);

impl ZMap {
    /// The paper lies at Z = 0 everywhere.
    pub const FLAT: Self = Self([0; 4]);
    /// Length of [`Self::to_bytes`].
    pub const BYTES: usize = 8;

    /// Top left, top right, bottom right, bottom left, each within +-[`MAX_HEIGHT`].
    pub fn new(corners: [i16; 4]) -> Option<Self> {
        let within = corners
            .iter()
            .all(|height| height.unsigned_abs() <= MAX_HEIGHT.unsigned_abs());
        within.then_some(Self(corners))
    }

    /// Top left, top right, bottom right, bottom left.
    pub const fn corners(self) -> [i16; 4] {
        self.0
    }

    /// Reads four whole numbers, `0;100;300;200`.
    pub fn parse(text: &[u8]) -> Option<Self> {
        let mut parts = core::str::from_utf8(text).ok()?.split(';');
        let mut corners = [0; 4];
        for corner in &mut corners {
            *corner = parts.next()?.trim_ascii().parse().ok()?;
        }
        match parts.next() {
            None => Self::new(corners),
            Some(_) => None,
        }
    }

    /// For the settings: four little-endian numbers.
    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let [[a, b], [c, d], [e, f], [g, h]] = self.0.map(i16::to_le_bytes);
        [a, b, c, d, e, f, g, h]
    }

    /// What [`Self::to_bytes`] made.
    pub fn from_bytes([a, b, c, d, e, f, g, h]: [u8; Self::BYTES]) -> Option<Self> {
        Self::new([[a, b], [c, d], [e, f], [g, h]].map(i16::from_le_bytes))
    }
}

/// `0;100;300;200`.
impl fmt::Display for ZMap {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [top_left, top_right, bottom_right, bottom_left] = self.0;
        write!(out, "{top_left};{top_right};{bottom_right};{bottom_left}")
    }
}

/// The map ready for use: `base + x along_x + y (along_y + x twist)` from the bottom left corner, in
/// thousandths, because a height counts by its part of the whole lift.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// In 1/2^28.
    base: i32,
    /// A unit of x, in 1/2^40.
    along_x: i32,
    /// A unit of y, in 1/2^40.
    along_y: i32,
    /// A unit of x and a unit of y, in 1/2^50.
    twist: i32,
}

impl Surface {
    pub(super) fn new(map: ZMap) -> Self {
        let [top_left, top_right, bottom_right, bottom_left] = map.0.map(i64::from);
        let (width, height) = (i64::from(RIGHT - LEFT), i64::from(TOP - BOTTOM));
        let whole = i64::from(PEN_UP.rounded());
        // At most 1000 / 1125 thousandths a unit: 30 bits.
        Self {
            base: ((bottom_left << 28) / whole) as i32,
            along_x: (((bottom_right - bottom_left) << 40) / (whole * width)) as i32,
            along_y: (((top_left - bottom_left) << 40) / (whole * height)) as i32,
            twist: (((top_right - bottom_right - top_left + bottom_left) << 50)
                / (whole * width * height)) as i32,
        }
    }

    /// The height of the paper as a part of the lift, in 1/2^28.
    #[inline]
    pub(super) fn part_of_lift(&self, x: Coordinate, y: Coordinate) -> i32 {
        const fn within(at: Coordinate, least: i16, most: i16) -> i32 {
            let (least, most) = ((least as i32) << 16, (most as i32) << 16);
            let bits = at.bits();
            // Up to 2000 units in 1/2^20: 31 bits.
            (if bits < least {
                0
            } else if bits > most {
                most - least
            } else {
                bits - least
            }) << 4
        }
        let (x, y) = (within(x, LEFT, RIGHT), within(y, BOTTOM, TOP));
        let along_y = self.along_y + (high_half(x, self.twist) << 2);
        self.base + high_half(x, self.along_x) + high_half(y, along_y)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    #[test]
    fn a_map_as_clients_write_it() {
        let later = ZMap::new([0, 100, 300, 200]);
        for text in ["0;100;300;200", "0; 100 ;300;200", "+0;100;0300;200"] {
            assert_eq!(ZMap::parse(text.as_bytes()), later, "{text}");
        }
        assert_eq!(
            ZMap::parse(b"-500;500;-1;0").map(|map| map.to_string()),
            Some("-500;500;-1;0".to_string())
        );
        for text in [
            "",
            "0",
            "0;100;300",
            "0;100;300;200;",
            "0;100;300;200;1",
            "0;100;300;501",
            "-501;0;0;0",
            "0;100;300;1e2",
            "0;100;300;2.5",
            "0,100,300,200",
            ";;;",
            "0;0;0;99999999",
        ] {
            assert_eq!(ZMap::parse(text.as_bytes()), None, "{text:?}");
        }
        assert_eq!(ZMap::parse(b"0;0;0;\xff"), None);
    }

    fn height(map: [i16; 4], x: f64, y: f64) -> f64 {
        let bits = |value: f64| Coordinate::from_bits((value * 65536.0).round() as i32);
        let surface = Surface::new(ZMap::new(map).unwrap());
        f64::from(surface.part_of_lift(bits(x), bits(y))) * 1000.0 / f64::from(1 << 28)
    }

    #[test]
    fn corners_middle_and_beyond() {
        let map = [0, 100, 300, 200];
        for ((x, y), expected) in [
            ((650.0, 1000.0), 0.0),
            ((1775.0, 1000.0), 100.0),
            ((1775.0, -1000.0), 300.0),
            ((650.0, -1000.0), 200.0),
            ((1212.5, 0.0), 150.0),
            ((500.0, 1500.0), 0.0),
            ((1900.0, 0.0), 200.0),
            ((700.0, -1500.0), 200.0 + 100.0 * 50.0 / 1125.0),
        ] {
            let found = height(map, x, y);
            assert!((found - expected).abs() < 0.001, "({x}, {y}): {found}");
        }
    }

    proptest! {
        #[test]
        fn it_is_bilinear(corners: [i16; 4], x in 650.0..1775.0, y in -1000.0..1000.0) {
            let corners = corners.map(|corner| corner % (MAX_HEIGHT + 1));
            let [top_left, top_right, bottom_right, bottom_left] = corners.map(f64::from);
            let (u, v) = ((x - 650.0) / 1125.0, (y + 1000.0) / 2000.0);
            let exact = (bottom_left * (1.0 - u) + bottom_right * u) * (1.0 - v)
                + (top_left * (1.0 - u) + top_right * u) * v;
            let found = height(corners, x, y);
            prop_assert!((found - exact).abs() < 0.001, "{found}, exactly {exact}");
        }

        #[test]
        fn maps_survive_their_bytes(bytes: [u8; 8]) {
            if let Some(map) = ZMap::from_bytes(bytes) {
                prop_assert_eq!(map.to_bytes(), bytes);
                prop_assert_eq!(ZMap::parse(map.to_string().as_bytes()), Some(map));
            }
        }
    }
}
