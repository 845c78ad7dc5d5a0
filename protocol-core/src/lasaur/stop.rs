//! Why the machine is in stop mode (`spec lasaurgrbl, Flag Characters`).

use core::fmt;

/// A reason to stop. The last cause wins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// `P`: loss of power.
    Power,
    /// `L`: a limit was hit.
    Limit,
    /// `R`: `!`.
    Requested,
    /// `B`: more bytes than the receive buffer holds.
    ReceiveOverflow,
    /// `I`: a line longer than there may be.
    LineOverflow,
    /// `T`: a line whose checksum was wrong to the end.
    Transmission,
    /// `O` and a number: anything else.
    Other(u8),
}

impl fmt::Display for StopReason {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Power => "P",
            Self::Limit => "L",
            Self::Requested => "R",
            Self::ReceiveOverflow => "B",
            Self::LineOverflow => "I",
            Self::Transmission => "T",
            Self::Other(number) => return write!(out, "O{number}"),
        })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn letters_of_the_page() {
        for (reason, letter) in [
            (StopReason::Power, "P"),
            (StopReason::Limit, "L"),
            (StopReason::Requested, "R"),
            (StopReason::ReceiveOverflow, "B"),
            (StopReason::LineOverflow, "I"),
            (StopReason::Transmission, "T"),
            (StopReason::Other(7), "O7"),
        ] {
            assert_eq!(reason.to_string(), letter);
        }
    }
}
