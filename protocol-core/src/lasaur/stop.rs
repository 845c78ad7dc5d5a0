//! How a reply names the reason of a stop (`spec lasaurgrbl, Flag Characters`).

use crate::machine::StopReason;
use core::fmt;

/// A reason as its letter, `O` with its number.
pub(super) struct Letter(pub(super) StopReason);

impl fmt::Display for Letter {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self.0 {
            StopReason::Power => "P",
            StopReason::Limit(_) => "L",
            StopReason::Requested => "R",
            StopReason::ReceiveOverflow => "B",
            StopReason::LineOverflow => "I",
            StopReason::Transmission => "T",
            StopReason::Other(number) => return write!(out, "O{number}"),
        })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::motion::Side;
    use std::string::ToString;

    #[test]
    fn letters_of_the_page() {
        for (reason, letter) in [
            (StopReason::Power, "P"),
            (StopReason::Limit(Side::X2), "L"),
            (StopReason::Requested, "R"),
            (StopReason::ReceiveOverflow, "B"),
            (StopReason::LineOverflow, "I"),
            (StopReason::Transmission, "T"),
            (StopReason::Other(7), "O7"),
        ] {
            assert_eq!(Letter(reason).to_string(), letter);
        }
    }
}
