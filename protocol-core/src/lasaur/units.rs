//! Numbers of a line as lengths and rates, in millimetres or inches.

use crate::motion::{Feed, MOST_FEED, Millimetres, TablePoint};
use crate::text::{Decimal, OutOfRange};

/// Largest coordinate or offset a line may give, in mm either way.
pub const MAX_COORDINATE: u32 = 10_000;

/// Tenths of a millimetre in an inch.
const TENTHS_PER_INCH: i64 = 254;
/// Fraction bits of a number of inches, before it becomes millimetres: finer than those, so that it
/// is rounded once in effect.
const INCH_BITS: u32 = 24;
/// Fraction bits of millimetres and of millimetres a minute.
const BITS: u32 = Millimetres::FRACTION_BITS;

/// What numbers of coordinates and rates are in (G20, G21).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unit {
    /// G21.
    #[default]
    Millimetre,
    /// G20.
    Inch,
}

/// A number that its word cannot have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadNumber;

impl From<OutOfRange> for BadNumber {
    fn from(_: OutOfRange) -> Self {
        Self
    }
}

impl Unit {
    /// A coordinate as written.
    ///
    /// # Errors
    /// [`BadNumber`] beyond [`MAX_COORDINATE`].
    pub(super) fn coordinate(self, number: Decimal) -> Result<Millimetres, BadNumber> {
        let bits = self.fixed(number, MAX_COORDINATE)?;
        let bits = i32::try_from(bits).map_err(|_| BadNumber)?;
        Ok(Millimetres::from_bits(bits))
    }

    /// A rate as written, limited to what the arm can do.
    ///
    /// # Errors
    /// [`BadNumber`] for zero and less.
    pub(super) fn feed(self, number: Decimal) -> Result<Feed, BadNumber> {
        if number.sign() <= 0 {
            return Err(BadNumber);
        }
        let bits = self.fixed(number, MOST_FEED.into());
        Ok(bits.map_or(Feed::new(MOST_FEED), Feed::from_bits))
    }

    /// In 1/65536 mm or mm a minute, within `limit` of them either way.
    fn fixed(self, number: Decimal, limit: u32) -> Result<i64, BadNumber> {
        match self {
            Self::Millimetre => Ok(number.to_fixed(BITS, limit)?),
            Self::Inch => {
                // Below 2^15 inches, 2^39 with their fraction, 2^47 in tenths of a millimetre.
                let inches = number.to_fixed(INCH_BITS, limit)?;
                let tenths = inches * TENTHS_PER_INCH;
                let divisor = 10 << (INCH_BITS - BITS);
                let rounded = (tenths.abs() + divisor / 2) / divisor;
                if rounded > i64::from(limit) << BITS {
                    return Err(BadNumber);
                }
                Ok(if tenths < 0 { -rounded } else { rounded })
            }
        }
    }
}

/// The sum, `None` where it lies farther out than the sum of two coordinates can.
pub(super) fn sum(a: Millimetres, b: Millimetres) -> Option<Millimetres> {
    let most = (2 * MAX_COORDINATE) << BITS;
    let sum = a.bits().checked_add(b.bits())?;
    (sum.unsigned_abs() <= most).then_some(Millimetres::from_bits(sum))
}

/// A place in whole millimetres.
pub(super) const fn place(x: i16, y: i16) -> TablePoint {
    TablePoint {
        x: Millimetres::new(x),
        y: Millimetres::new(y),
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::text::Decimal;
    use proptest::prelude::*;

    fn number(text: &str) -> Decimal {
        let (number, rest) = Decimal::read(text.as_bytes()).unwrap();
        assert!(rest.is_empty(), "{text}: {rest:?} is left");
        number
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
            (Unit::Millimetre, "1500", Ok(1500 << 16)),
            (Unit::Millimetre, "30000", Ok(30_000 << 16)),
            (Unit::Millimetre, "30000.1", Ok(30_000 << 16)),
            (Unit::Millimetre, "1E30", Ok(30_000 << 16)),
            (Unit::Millimetre, "1E-30", Ok(6 << 16)),
            (Unit::Millimetre, "0", Err(BadNumber)),
            (Unit::Millimetre, "-0", Err(BadNumber)),
            (Unit::Millimetre, "-5", Err(BadNumber)),
            (Unit::Millimetre, "0E5", Err(BadNumber)),
            (Unit::Inch, "10", Ok(254 << 16)),
            (Unit::Inch, "1500", Ok(30_000 << 16)),
            (Unit::Inch, "1E9", Ok(30_000 << 16)),
            (Unit::Inch, "0", Err(BadNumber)),
        ] {
            let found = unit.feed(number(text)).map(Feed::bits);
            assert_eq!(found, bits, "{text} {unit:?}");
        }
    }

    #[test]
    fn sums_stay_within_twice_the_largest_coordinate() {
        let most = Millimetres::new(10_000);
        assert_eq!(sum(most, most), Some(Millimetres::new(20_000)));
        let tiny = Millimetres::from_bits(1);
        assert_eq!(sum(Millimetres::new(20_000), tiny), None);
        let wide = Millimetres::from_bits(i32::MAX);
        assert_eq!(sum(wide, wide), None);
    }

    proptest! {
        #[test]
        fn inches_are_25_4_millimetres(thousandths in -390_000i64..390_000) {
            let text = std::format!("{thousandths}E-3");
            let found = Unit::Inch.coordinate(number(&text)).unwrap().bits();
            let exact = thousandths as f64 * 25.4 / 1000.0 * 65536.0;
            prop_assert!((f64::from(found) - exact).abs() <= 0.51, "{text}: {found}, not {exact}");
        }
    }
}
