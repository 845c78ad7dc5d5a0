//! A line's body as words: a capital letter and a number, `G1X-12.345`. No blanks, which are removed
//! on the way here, no comments and no lower case.

use super::command::Fault;
use crate::text::Decimal;

/// Reads the words of a body from front to back, and ends at the first one that is none.
#[derive(Clone, Copy, Debug)]
pub struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Words<'a> {
    /// The words of `body`.
    pub const fn new(body: &'a [u8]) -> Self {
        Self { rest: body }
    }
}

impl Iterator for Words<'_> {
    /// A letter and its number.
    type Item = Result<(u8, Decimal), Fault>;

    fn next(&mut self) -> Option<Self::Item> {
        let (letter, after) = self.rest.split_first()?;
        self.rest = &[];
        if !letter.is_ascii_uppercase() {
            return Some(Err(Fault::ExpectedLetter));
        }
        let Some((number, rest)) = Decimal::read(after) else {
            return Some(Err(Fault::BadNumber));
        };
        self.rest = rest;
        Some(Ok((*letter, number)))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::String;
    use std::vec::Vec;

    /// Letters with their numbers in thousandths, and what ended them.
    fn read(body: &str) -> (Vec<(char, i64)>, Option<Fault>) {
        let mut found = Vec::new();
        for word in Words::new(body.as_bytes()) {
            match word {
                Ok((letter, number)) => {
                    let thousandths = number.to_fixed(20, 1_000_000).unwrap() as f64 / 1048.576;
                    found.push((char::from(letter), thousandths.round() as i64));
                }
                Err(fault) => return (found, Some(fault)),
            }
        }
        (found, None)
    }

    #[test]
    fn numbers_as_hosts_write_them() {
        for (number, thousandths) in [
            ("5", 5000),
            ("+5", 5000),
            ("-5", -5000),
            (".5", 500),
            ("5.", 5000),
            ("1E1", 10_000),
            ("1e1", 10_000),
            ("1.5E-1", 150),
            ("-12.345", -12_345),
            ("007", 7000),
        ] {
            let body = String::from("X") + number;
            assert_eq!(
                read(&body),
                (Vec::from([('X', thousandths)]), None),
                "{body}"
            );
            let body = body + "Y1";
            let both = Vec::from([('X', thousandths), ('Y', 1000)]);
            assert_eq!(read(&body), (both, None), "{body}");
        }
    }

    #[test]
    fn garbled_numbers() {
        for body in [
            "X", "X+", "X-.", "X--5", "XY5", "XNAN", "XINF", "X1E", "X*5", "G",
        ] {
            assert_eq!(read(body).1, Some(Fault::BadNumber), "{body}");
        }
    }

    #[test]
    fn other_characters() {
        for body in [
            "version", "$fb", "%", "(X5)", ";X5", "x5", "5", "#", "X1x2", "X1.2.3", "X5;", "X0x10",
            "\u{e9}", "?",
        ] {
            assert_eq!(read(body).1, Some(Fault::ExpectedLetter), "{body}");
        }
    }
}
