//! The checksum of a body (`spec lasaurgrbl, Calculating the Checksum`).
//!
//! Of a body of ASCII it is half of the sum of its characters modulo 128, plus 128: six bits. What that
//! can tell, and what it cannot:
//!
//! - any one character that becomes another is noticed, but for one: halving loses the lowest bit, so a
//!   character that goes up by one where the sum is even, or down by one where it is odd, leaves the
//!   checksum as it was. Of the 127 wrong characters at a place, one is not noticed.
//! - two characters that change places are never noticed, and any other change of several characters
//!   passes with one chance in 64;
//! - a byte of 128 or more is noticed where it carries, and otherwise passes: its high bit is what the sum
//!   subtracts. So a body that is not ASCII is not right, whatever its sum; nobody sends one.

/// Sum of a body, without prefix, checksum and newline, after real-time bytes and blanks were removed. It
/// lies in 128..=191 for ASCII; for other bytes it may be too large for a byte, and matches none then.
pub fn checksum(body: &[u8]) -> u16 {
    let sum = body.iter().fold(0u16, |sum, &byte| {
        let sum = sum.wrapping_add(u16::from(byte));
        if sum >= 128 { sum - 128 } else { sum }
    });
    (sum >> 1) + 128
}

/// Whether `sum` is the checksum of `body`, and the body one that can have been sent.
pub fn is_right(sum: u8, body: &[u8]) -> bool {
    body.is_ascii() && checksum(body) == u16::from(sum)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// The page's algorithm, statement by statement.
    fn of_the_page(line_string: &[u8]) -> u16 {
        let mut itr = 0;
        let mut checksum: u16 = 0;
        while itr < line_string.len() {
            checksum = checksum.wrapping_add(u16::from(line_string[itr]));
            itr += 1;
            if checksum >= 128 {
                checksum -= 128;
            }
        }
        (checksum >> 1) + 128
    }

    #[test]
    fn bodies_seen_on_the_wire() {
        for (body, sum) in [
            ("?", 0x9f),
            ("", 0x80),
            ("G90", 0x98),
            ("M80", 0x9a),
            ("S255", 0xb7),
            ("G0X0Y0", 0x84),
            ("G0X120Y150", 0xa8),
            ("G10L2P1X220Y140", 0x80),
            ("G1X-12.345Y0.001F1500S128", 0xb6),
        ] {
            assert_eq!(checksum(body.as_bytes()), sum, "{body}");
            assert!(is_right(sum as u8, body.as_bytes()), "{body}");
        }
    }

    #[test]
    fn a_sum_that_includes_newline_or_blanks_is_wrong() {
        assert_eq!(checksum(b"?\n"), 0xa4);
        assert!(!is_right(0xa4, b"?"));
        assert_eq!(checksum(b"G0 X120 Y150"), 0x88);
        assert!(!is_right(0x88, b"G0X120Y150"));
    }

    /// Every place of every body, every byte there can be: which change is not noticed is known
    /// beforehand.
    #[test]
    fn one_wrong_character_is_noticed_unless_it_only_turns_the_lowest_bit_of_the_sum() {
        for body in [&b"G0X120Y150"[..], b"G1X-12.345Y0.001F1500S128", b"S255"] {
            let sum = checksum(body) as u8;
            let parity: u32 = body.iter().map(|&byte| u32::from(byte)).sum::<u32>() % 2;
            for place in 0..body.len() {
                let right = body[place];
                let unseen = if parity == 0 { right + 1 } else { right - 1 };
                for wrong in (0..=255).filter(|&wrong| wrong != right) {
                    let mut changed = Vec::from(body);
                    changed[place] = wrong;
                    assert_eq!(
                        is_right(sum, &changed),
                        wrong == unseen,
                        "{} as {}",
                        body.escape_ascii(),
                        changed.escape_ascii()
                    );
                }
            }
        }
    }

    proptest! {
        #[test]
        fn it_is_what_the_page_computes(body: Vec<u8>) {
            prop_assert_eq!(checksum(&body), of_the_page(&body));
        }

        #[test]
        fn of_ascii_it_is_half_of_the_sum_modulo_128(body in "[ -~]{0,76}") {
            let sum: u32 = body.bytes().map(u32::from).sum();
            prop_assert_eq!(u32::from(checksum(body.as_bytes())), 128 + sum % 128 / 2);
        }
    }
}
