//! Quantities with their units in the type, so that a wrong unit does not compile.

use core::ops::{Add, Neg, Sub};

/// A coordinate inside the arm's reach, in 1/65536 of a drawing unit; 20 drawing units are 1 mm
/// (`reference/arm.md`).
///
/// The range, +-32767 units, is far beyond the arm; targets that a client may ask for are
/// [`WideCoordinate`]s until the drawing area has limited them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Coordinate(i32);

impl Coordinate {
    /// Fraction bits of the representation.
    pub const FRACTION_BITS: u32 = 16;

    /// A whole number of drawing units.
    pub const fn from_units(units: i16) -> Self {
        Self((units as i32) << Self::FRACTION_BITS)
    }

    /// From 1/65536 units.
    pub const fn from_bits(bits: i32) -> Self {
        Self(bits)
    }

    /// In 1/65536 units.
    pub const fn bits(self) -> i32 {
        self.0
    }

    /// The nearest whole number of drawing units, halves away from zero.
    pub const fn rounded(self) -> i32 {
        let half = 1 << (Self::FRACTION_BITS - 1);
        let magnitude = ((self.0.unsigned_abs() + half) >> Self::FRACTION_BITS) as i32;
        if self.0 < 0 { -magnitude } else { magnitude }
    }

    /// In drawing units, for people and pictures.
    pub fn to_f64(self) -> f64 {
        f64::from(self.0) / f64::from(1 << Self::FRACTION_BITS)
    }
}

impl Add for Coordinate {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Sub for Coordinate {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Neg for Coordinate {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

/// A coordinate as asked for, in 1/65536 of a drawing unit: it may lie anywhere, also far out of
/// reach, because scale and offset have been applied to it but not the drawing area.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct WideCoordinate(i64);

impl WideCoordinate {
    /// From 1/65536 units.
    pub const fn from_bits(bits: i64) -> Self {
        Self(bits)
    }

    /// In 1/65536 units.
    pub const fn bits(self) -> i64 {
        self.0
    }
}

impl From<Coordinate> for WideCoordinate {
    fn from(near: Coordinate) -> Self {
        Self(i64::from(near.0))
    }
}

/// A place of the nib: `x` away from the body, `y` to the left of it, `z` 0 (on the paper) to
/// 1000 (lifted).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Position {
    /// Away from the body.
    pub x: Coordinate,
    /// To the left when looking along x.
    pub y: Coordinate,
    /// Height of the nib, 0..=1000 drawing units.
    pub z: Coordinate,
}

impl Position {
    /// A position in whole drawing units.
    pub const fn from_units(x: i16, y: i16, z: i16) -> Self {
        Self {
            x: Coordinate::from_units(x),
            y: Coordinate::from_units(y),
            z: Coordinate::from_units(z),
        }
    }

    /// Whether the nib touches the paper: Z < 500 (`reference/line-us.md`, section 4).
    pub fn pen_is_down(self) -> bool {
        self.z < PEN_DOWN_BELOW
    }
}

/// Home, where the arm is after power-on (`spec 1.0.4a, G28`).
pub const HOME: Position = Position::from_units(1000, 1000, 1000);
/// Z of the lifted pen.
pub const PEN_UP: Coordinate = Coordinate::from_units(1000);
/// Z of the pen on the paper.
pub const PEN_DOWN: Coordinate = Coordinate::from_units(0);
/// The pen is down where Z is less than this (`reference/line-us.md`, section 4).
pub const PEN_DOWN_BELOW: Coordinate = Coordinate::from_units(500);

/// An angle in millionths of a degree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Microdegrees(i32);

impl Microdegrees {
    /// A whole number of degrees, -2147..=2147.
    pub const fn from_degrees(degrees: i16) -> Self {
        Self(degrees as i32 * 1_000_000)
    }

    /// From millionths of a degree.
    pub const fn new(microdegrees: i32) -> Self {
        Self(microdegrees)
    }

    /// In millionths of a degree.
    pub const fn get(self) -> i32 {
        self.0
    }

    /// The nearest hundredth of a degree, halves away from zero.
    pub const fn centidegrees(self) -> i32 {
        let magnitude = ((self.0.unsigned_abs() + 5_000) / 10_000) as i32;
        if self.0 < 0 { -magnitude } else { magnitude }
    }

    /// In degrees, for people and pictures.
    pub fn to_f64(self) -> f64 {
        f64::from(self.0) / 1e6
    }
}

impl Add for Microdegrees {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Microdegrees {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

/// The length of a servo pulse in tenths of a nanosecond: four decimals of a microsecond are
/// exact, so that a trace holds every pulse without loss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct PulseWidth(u32);

impl PulseWidth {
    /// Tenths of a nanosecond in a microsecond.
    pub const PER_MICROSECOND: u32 = 10_000;

    /// A whole number of microseconds.
    pub const fn from_micros(micros: u16) -> Self {
        Self(micros as u32 * Self::PER_MICROSECOND)
    }

    /// From tenths of a nanosecond.
    pub const fn new(tenths_of_nanos: u32) -> Self {
        Self(tenths_of_nanos)
    }

    /// In tenths of a nanosecond.
    pub const fn get(self) -> u32 {
        self.0
    }

    /// In microseconds, for people and pictures.
    pub fn to_f64(self) -> f64 {
        f64::from(self.0) / f64::from(Self::PER_MICROSECOND)
    }
}

/// A point in time or a span of it, in microseconds; the core is told the time and has no clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Micros(u64);

impl Micros {
    /// From microseconds.
    pub const fn new(micros: u64) -> Self {
        Self(micros)
    }

    /// From milliseconds.
    pub const fn from_millis(millis: u32) -> Self {
        Self(millis as u64 * 1_000)
    }

    /// From seconds.
    pub const fn from_secs(secs: u32) -> Self {
        Self(secs as u64 * 1_000_000)
    }

    /// In microseconds.
    pub const fn get(self) -> u64 {
        self.0
    }
}

impl Add for Micros {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Sub for Micros {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_takes_halves_away_from_zero() {
        let half = 1 << 15;
        assert_eq!(Coordinate::from_bits(half).rounded(), 1);
        assert_eq!(Coordinate::from_bits(half - 1).rounded(), 0);
        assert_eq!(Coordinate::from_bits(-half).rounded(), -1);
        assert_eq!(Coordinate::from_bits(1 - half).rounded(), 0);
        assert_eq!(Microdegrees::new(-5_000).centidegrees(), -1);
        assert_eq!(Microdegrees::new(134_995_000).centidegrees(), 13_500);
    }

    #[test]
    fn the_pen_is_down_below_five_hundred() {
        assert!(Position::from_units(1000, 0, 499).pen_is_down());
        assert!(!Position::from_units(1000, 0, 500).pen_is_down());
    }
}
