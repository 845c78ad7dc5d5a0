//! Decimal numbers, read exactly and rounded once, when they become a fixed-point quantity.
//!
//! Accepted: an optional sign, digits with an optional point (`5`, `5.`, `.5`), an optional
//! exponent (`1.5e-07`, as Python writes it). Not accepted: `nan`, `inf`, hexadecimal.

/// A number as it was written: `mantissa * 10^exponent`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decimal {
    negative: bool,
    mantissa: u64,
    exponent: i32,
}

/// The value does not fit the quantity it is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfRange;

/// The largest power of ten in 64 bits.
const LARGEST_POWER: u32 = 19;
/// Digits kept; further ones are below anything the arm can resolve.
const MAX_DIGITS: u32 = 18;
/// Written exponents are cut off here: far beyond any limit, and nothing overflows.
const MAX_EXPONENT: i32 = 9_999;

impl Decimal {
    /// Reads a number from the front of `text`; gives it with the rest, `None` where no number
    /// begins.
    pub(crate) fn read(text: &[u8]) -> Option<(Self, &[u8])> {
        let (negative, mut rest) = signed(text);
        let mut number = Self {
            negative,
            mantissa: 0,
            exponent: 0,
        };
        let (mut any, mut kept, mut after_point) = (false, 0, false);
        loop {
            match rest {
                [digit @ b'0'..=b'9', tail @ ..] => {
                    any = true;
                    if kept < MAX_DIGITS {
                        number.mantissa = number.mantissa * 10 + u64::from(digit - b'0');
                        kept += u32::from(number.mantissa != 0);
                        number.exponent -= i32::from(after_point);
                    } else {
                        number.exponent += i32::from(!after_point);
                    }
                    rest = tail;
                }
                [b'.', tail @ ..] if !after_point => {
                    after_point = true;
                    rest = tail;
                }
                _ => break,
            }
        }
        if !any {
            return None;
        }
        if let [b'e' | b'E', tail @ ..] = rest
            && let Some((exponent, tail)) = read_exponent(tail)
        {
            number.exponent = number.exponent.saturating_add(exponent);
            rest = tail;
        }
        Some((number, rest))
    }

    /// -1, 0 or 1, as the value is below, at or above zero.
    pub const fn sign(self) -> i32 {
        match (self.mantissa, self.negative) {
            (0, _) => 0,
            (_, true) => -1,
            (_, false) => 1,
        }
    }

    /// The value, if it is a whole number that is not negative and fits.
    pub fn whole(self) -> Option<u32> {
        let whole = match (self.sign(), self.exponent) {
            (0, _) => 0,
            (-1, _) => return None,
            (_, 0..) => {
                let power = 10u64.checked_pow(self.exponent.unsigned_abs())?;
                self.mantissa.checked_mul(power)?
            }
            _ => {
                let power = 10u64.checked_pow(self.exponent.unsigned_abs())?;
                self.mantissa
                    .is_multiple_of(power)
                    .then_some(self.mantissa / power)?
            }
        };
        u32::try_from(whole).ok()
    }

    /// The value times `2^fraction_bits`, rounded to the nearest whole number, halves away from
    /// zero.
    ///
    /// # Errors
    /// [`OutOfRange`] when the magnitude is more than `limit` (given in whole units).
    #[cold]
    pub fn to_fixed(self, fraction_bits: u32, limit: u32) -> Result<i64, OutOfRange> {
        let magnitude = if self.mantissa == 0 {
            0
        } else if self.exponent >= 0 {
            let whole = u32::try_from(self.exponent)
                .ok()
                .and_then(|exponent| 10u64.checked_pow(exponent))
                .and_then(|power| self.mantissa.checked_mul(power))
                .filter(|&whole| whole <= u64::from(limit))
                .ok_or(OutOfRange)?;
            whole << fraction_bits
        } else {
            match 10u64.checked_pow(self.exponent.unsigned_abs()) {
                Some(power) => scale_down(self.mantissa, fraction_bits, power, limit)?,
                // Digits beyond the nineteenth place are nothing at any resolution used here.
                None => {
                    let beyond = self.exponent.unsigned_abs() - LARGEST_POWER;
                    let mantissa = 10u64
                        .checked_pow(beyond)
                        .map_or(0, |power| self.mantissa / power);
                    scale_down(mantissa, fraction_bits, 10u64.pow(LARGEST_POWER), limit)?
                }
            }
        };
        let magnitude = i64::try_from(magnitude).map_err(|_| OutOfRange)?;
        Ok(if self.negative { -magnitude } else { magnitude })
    }
}

/// `mantissa * 2^bits / power`, rounded, in the narrowest arithmetic that holds it: a 64-bit
/// division is hundreds of instructions on the chip, a 128-bit one thousands.
fn scale_down(mantissa: u64, bits: u32, power: u64, limit: u32) -> Result<u64, OutOfRange> {
    let whole = mantissa / power;
    let part = mantissa % power;
    if whole > u64::from(limit) || (whole == u64::from(limit) && part > 0) {
        return Err(OutOfRange);
    }
    let fraction = if power.leading_zeros() > bits {
        ((part << bits) + power / 2) / power
    } else {
        let (part, power) = (u128::from(part), u128::from(power));
        // Less than 2^bits + 1, because part < power.
        (((part << bits) + power / 2) / power) as u64
    };
    Ok((whole << bits) + fraction)
}

fn signed(text: &[u8]) -> (bool, &[u8]) {
    match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, text),
    }
}

/// The exponent after an `e`, `None` when no digit follows it: then the `e` is no exponent.
fn read_exponent(text: &[u8]) -> Option<(i32, &[u8])> {
    let (negative, mut rest) = signed(text);
    let mut value = None;
    while let [digit @ b'0'..=b'9', tail @ ..] = rest {
        let next = value.unwrap_or(0) * 10 + i32::from(digit - b'0');
        value = Some(next.min(MAX_EXPONENT));
        rest = tail;
    }
    value.map(|value| (if negative { -value } else { value }, rest))
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::format;

    fn fixed(text: &str) -> Result<i64, OutOfRange> {
        let (number, rest) = Decimal::read(text.as_bytes()).unwrap();
        assert!(rest.is_empty(), "{text}: {rest:?} is left");
        number.to_fixed(16, 1_000_000)
    }

    #[test]
    fn numbers_that_clients_send() {
        for (text, value) in [
            ("1000", 1000.0),
            ("-567", -567.0),
            ("+5", 5.0),
            (".5", 0.5),
            ("5.", 5.0),
            ("-.25", -0.25),
            ("12.345", 12.345),
            ("900.0000", 900.0),
            ("999.9999999", 999.9999999),
            ("1.5e-07", 0.0),
            ("1.5e2", 150.0),
            ("1E+3", 1000.0),
            ("0.1e1", 1.0),
            ("0.30000000000000004", 0.3),
            ("0.01234567890123456789", 0.012345678901234568),
            ("0.010000000000000000000000000", 0.01),
            ("1000000", 1_000_000.0),
            ("0000000000000000000000012", 12.0),
            ("1e-400", 0.0),
            ("0e400", 0.0),
            ("123456789012345678901234567890e-27", 123.456789),
        ] {
            let expected = (value * 65536.0_f64).round() as i64;
            assert_eq!(fixed(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn values_beyond_the_limit_are_out_of_range() {
        for text in [
            "1000001",
            "1000000.0000001",
            "1e7",
            "1e400",
            "-99999999999999999999",
        ] {
            assert_eq!(fixed(text), Err(OutOfRange), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_is_not_read() {
        for text in [
            "", "-", "+", ".", "-.", "nan", "inf", "e5", "x10", "--5", "+-5",
        ] {
            assert_eq!(Decimal::read(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn reading_stops_where_the_number_ends() {
        for (text, rest) in [
            ("100Y2", "Y2"),
            ("0x10", "x10"),
            ("1e", "e"),
            ("1.2.3", ".3"),
            ("5-", "-"),
        ] {
            let (_, left) = Decimal::read(text.as_bytes()).unwrap();
            assert_eq!(left, rest.as_bytes(), "{text}");
        }
    }

    #[test]
    fn whole_numbers_however_they_are_written() {
        for (text, whole) in [
            ("0", Some(0)),
            ("-0", Some(0)),
            ("0e400", Some(0)),
            ("007", Some(7)),
            ("54.", Some(54)),
            ("54.0", Some(54)),
            ("3E1", Some(30)),
            ("300e-1", Some(30)),
            ("4294967295", Some(u32::MAX)),
            ("4294967296", None),
            ("54.1", None),
            ("1e-400", None),
            ("1e400", None),
            ("-1", None),
        ] {
            let (number, rest) = Decimal::read(text.as_bytes()).unwrap();
            assert!(rest.is_empty(), "{text}");
            assert_eq!(number.whole(), whole, "{text}");
            assert_eq!(
                number.sign() < 0,
                text.starts_with("-1"),
                "the sign of {text}"
            );
        }
    }

    proptest! {
        #[test]
        fn decimals_are_rounded_to_the_nearest(mantissa in 0u64..1_000_000_000_000, places in 0usize..9) {
            let text = {
                let digits = format!("{mantissa:0>width$}", width = places + 1);
                let (whole, part) = digits.split_at(digits.len() - places);
                format!("{whole}.{part}")
            };
            let exact = (u128::from(mantissa) << 16, 10u128.pow(places as u32));
            let expected = (exact.0 + exact.1 / 2) / exact.1;
            let limit = 1_000_000u128 << 16;
            let beyond = exact.0 > limit * exact.1;
            prop_assert_eq!(fixed(&text), if beyond { Err(OutOfRange) } else { Ok(expected as i64) });
        }

        #[test]
        fn any_bytes_are_read_or_not_without_a_panic(text: std::vec::Vec<u8>) {
            if let Some((number, _)) = Decimal::read(&text) {
                for bits in [0, 16, 32] {
                    let _ = number.to_fixed(bits, 1000);
                }
            }
        }
    }
}
