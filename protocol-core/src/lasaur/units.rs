//! Millimetres and feed rates, with their units in the type.

use core::fmt;

/// Largest coordinate or offset a line may give, in mm either way.
pub const MAX_COORDINATE: u32 = 10_000;
/// Largest seek or feed rate, in mm/min.
pub const MAX_FEED: u32 = 1_000_000;

/// Tenths of a millimetre in an inch.
const TENTHS_PER_INCH: i64 = 254;

/// What numbers of coordinates and rates are in (G20, G21).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unit {
    /// G21.
    #[default]
    Millimetre,
    /// G20.
    Inch,
}

/// A length or a coordinate on the table, in 1/65536 mm.
///
/// Written coordinates and offsets are within +-[`MAX_COORDINATE`], a target, which is their sum,
/// within twice that; the range of the type is +-32767 mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Millimetres(i32);

impl Millimetres {
    /// Fraction bits of the representation.
    pub const FRACTION_BITS: u32 = 16;

    /// A whole number of millimetres.
    pub const fn new(millimetres: i16) -> Self {
        Self((millimetres as i32) << Self::FRACTION_BITS)
    }

    /// From 1/65536 mm.
    pub const fn from_bits(bits: i32) -> Self {
        Self(bits)
    }

    /// In 1/65536 mm.
    pub const fn bits(self) -> i32 {
        self.0
    }

    /// The sum, `None` where it lies beyond every target.
    pub fn checked_add(self, other: Self) -> Option<Self> {
        let most = (2 * MAX_COORDINATE) << Self::FRACTION_BITS;
        let sum = self.0.checked_add(other.0)?;
        (sum.unsigned_abs() <= most).then_some(Self(sum))
    }
}

/// As replies show it: three decimals, rounded to the nearest, and no minus before a zero.
impl fmt::Display for Millimetres {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scaled = u64::from(self.0.unsigned_abs()) * 1000;
        let micrometres = (scaled + (1 << (Self::FRACTION_BITS - 1))) >> Self::FRACTION_BITS;
        let sign = if self.0 < 0 && micrometres > 0 {
            "-"
        } else {
            ""
        };
        let (whole, part) = (micrometres / 1000, micrometres % 1000);
        write!(out, "{sign}{whole}.{part:03}")
    }
}

/// A place on the table, measured from the physical home; offsets are part of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Point {
    /// To the right.
    pub x: Millimetres,
    /// Away.
    pub y: Millimetres,
}

impl Point {
    /// A place in whole millimetres.
    pub const fn new(x: i16, y: i16) -> Self {
        Self {
            x: Millimetres::new(x),
            y: Millimetres::new(y),
        }
    }
}

/// A rate along the way, above zero and at most [`MAX_FEED`], in 1/256 mm/min.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Feed(u32);

impl Feed {
    /// Fraction bits of the representation.
    pub const FRACTION_BITS: u32 = 8;

    /// A whole number of mm/min; zero becomes the slowest rate there is.
    pub const fn new(millimetres_per_minute: u16) -> Self {
        let bits = (millimetres_per_minute as u32) << Self::FRACTION_BITS;
        Self(if bits == 0 { 1 } else { bits })
    }

    /// In 1/256 mm/min.
    pub const fn bits(self) -> u32 {
        self.0
    }
}

/// A number that its word cannot have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadNumber;

impl From<crate::text::OutOfRange> for BadNumber {
    fn from(_: crate::text::OutOfRange) -> Self {
        Self
    }
}

/// Fraction bits of a number of inches, before it becomes millimetres: finer than those, so that it
/// is rounded once in effect.
const INCH_BITS: u32 = 24;

impl Unit {
    /// A coordinate as written.
    ///
    /// # Errors
    /// [`BadNumber`] beyond [`MAX_COORDINATE`].
    pub(super) fn coordinate(self, number: crate::text::Decimal) -> Result<Millimetres, BadNumber> {
        let bits = self.fixed(number, Millimetres::FRACTION_BITS, MAX_COORDINATE)?;
        i32::try_from(bits).map(Millimetres).map_err(|_| BadNumber)
    }

    /// A rate as written, rounded up to the slowest there is.
    ///
    /// # Errors
    /// [`BadNumber`] for zero and less, and beyond [`MAX_FEED`].
    pub(super) fn feed(self, number: crate::text::Decimal) -> Result<Feed, BadNumber> {
        if number.sign() <= 0 {
            return Err(BadNumber);
        }
        let bits = self.fixed(number, Feed::FRACTION_BITS, MAX_FEED)?;
        let bits = u32::try_from(bits).map_err(|_| BadNumber)?;
        Ok(Feed(bits.max(1)))
    }

    fn fixed(self, number: crate::text::Decimal, bits: u32, limit: u32) -> Result<i64, BadNumber> {
        match self {
            Self::Millimetre => Ok(number.to_fixed(bits, limit)?),
            Self::Inch => {
                // Below 2^20 inches, 2^44 with their fraction, 2^52 in tenths of a millimetre.
                let inches = number.to_fixed(INCH_BITS, limit)?;
                let tenths = inches * TENTHS_PER_INCH;
                let divisor = 10 << (INCH_BITS - bits);
                let rounded = (tenths.abs() + divisor / 2) / divisor;
                if rounded > i64::from(limit) << bits {
                    return Err(BadNumber);
                }
                Ok(if tenths < 0 { -rounded } else { rounded })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::text::Decimal;
    use proptest::prelude::*;
    use std::string::ToString;

    fn number(text: &str) -> Decimal {
        let (number, rest) = Decimal::read(text.as_bytes()).unwrap();
        assert!(rest.is_empty(), "{text}: {rest:?} is left");
        number
    }

    #[test]
    fn three_decimals_rounded_to_the_nearest() {
        for (bits, text) in [
            (0, "0.000"),
            (1 << 16, "1.000"),
            (-(1 << 16), "-1.000"),
            (32, "0.000"),
            (-32, "0.000"),
            (33, "0.001"),
            (-33, "-0.001"),
            (i32::MAX, "32768.000"),
            (i32::MIN, "-32768.000"),
        ] {
            assert_eq!(Millimetres::from_bits(bits).to_string(), text, "{bits}");
        }
    }

    #[test]
    fn limits_of_coordinates_in_both_units() {
        for (unit, text, fits) in [
            (Unit::Millimetre, "10000", true),
            (Unit::Millimetre, "-10000", true),
            (Unit::Millimetre, "10000.001", false),
            (Unit::Inch, "393.7007", true),
            (Unit::Inch, "393.701", false),
            (Unit::Inch, "-393.701", false),
            (Unit::Millimetre, "1E30", false),
        ] {
            let found = unit.coordinate(number(text));
            assert_eq!(found.is_ok(), fits, "{text} {unit:?}: {found:?}");
        }
    }

    #[test]
    fn limits_of_rates_in_both_units() {
        for (unit, text, bits) in [
            (Unit::Millimetre, "1500", Ok(1500 << 8)),
            (Unit::Millimetre, "1000000", Ok(1_000_000 << 8)),
            (Unit::Millimetre, "1000000.1", Err(BadNumber)),
            (Unit::Millimetre, "1E-30", Ok(1)),
            (Unit::Millimetre, "0", Err(BadNumber)),
            (Unit::Millimetre, "-0", Err(BadNumber)),
            (Unit::Millimetre, "-5", Err(BadNumber)),
            (Unit::Millimetre, "0E5", Err(BadNumber)),
            (Unit::Inch, "10", Ok(254 << 8)),
            (Unit::Inch, "40000", Err(BadNumber)),
        ] {
            let found = unit.feed(number(text)).map(Feed::bits);
            assert_eq!(found, bits, "{text} {unit:?}");
        }
    }

    #[test]
    fn sums_stay_within_twice_the_largest_coordinate() {
        let most = Millimetres::new(10_000);
        assert_eq!(most.checked_add(most), Some(Millimetres::new(20_000)));
        let tiny = Millimetres::from_bits(1);
        assert_eq!(Millimetres::new(20_000).checked_add(tiny), None);
        let wide = Millimetres::from_bits(i32::MAX);
        assert_eq!(wide.checked_add(wide), None);
    }

    proptest! {
        #[test]
        fn inches_are_25_4_millimetres(thousandths in -390_000i64..390_000) {
            let text = std::format!("{thousandths}E-3");
            let found = Unit::Inch.coordinate(number(&text)).unwrap().bits();
            let exact = thousandths as f64 * 25.4 / 1000.0 * 65536.0;
            prop_assert!((f64::from(found) - exact).abs() <= 0.51, "{text}: {found}, not {exact}");
        }

        #[test]
        fn three_decimals_come_back_as_they_were_written(micrometres in -10_000_000i64..=10_000_000) {
            let sign = if micrometres < 0 { "-" } else { "" };
            let text = std::format!("{sign}{}.{:03}", micrometres.abs() / 1000, micrometres.abs() % 1000);
            prop_assert_eq!(Unit::Millimetre.coordinate(number(&text)).unwrap().to_string(), text);
        }
    }
}
