//! Lines out of a byte stream, however it was cut into packets.
//!
//! A line ends with one of, or any combination of, `\r`, `\n`, `\0` (`reference/line-us.md`,
//! section 2). Between terminators there may be nothing or blanks only: that is no line.

use heapless::Vec;

/// Longest line in bytes, terminators not counted.
///
/// It fits the longest legal command, `M587 S"..." P"..."` with a network name of 32 bytes and a
/// password of 63, every byte of them a quote that is written twice (202 bytes), and leaves room
/// for blanks and a comment. A longer line is dropped whole and answered with one error.
pub const MAX_LINE: usize = 256;

/// More than [`MAX_LINE`] bytes came before the terminator; the whole line is dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLong;

/// Collects bytes until a line is complete.
#[derive(Clone, Debug, Default)]
pub struct LineBuffer {
    bytes: Vec<u8, MAX_LINE>,
    too_long: bool,
    /// The line in `bytes` has been handed out; the next byte begins a new one.
    handed_out: bool,
}

const fn ends_line(byte: u8) -> bool {
    // Nearly every byte is past all three, and needs one comparison.
    byte <= b'\r' && matches!(byte, b'\r' | b'\n' | 0)
}

fn is_blank(line: &[u8]) -> bool {
    line.iter().all(|&byte| matches!(byte, b' ' | b'\t'))
}

impl LineBuffer {
    /// An empty buffer.
    pub const fn new() -> Self {
        Self {
            bytes: Vec::new(),
            too_long: false,
            handed_out: false,
        }
    }

    /// Takes bytes off the front of `input` up to the end of the next line that is not empty, and
    /// gives that line; `None` when `input` is used up first. A line that came whole is not copied.
    pub fn next_line<'l, 'i: 'l>(
        &'l mut self,
        input: &mut &'i [u8],
    ) -> Option<Result<&'l [u8], TooLong>> {
        if self.handed_out {
            self.restart();
        }
        loop {
            let Some(end) = input.iter().position(|&byte| ends_line(byte)) else {
                self.collect(input);
                *input = &[];
                return None;
            };
            let (line, rest) = input.split_at(end);
            *input = rest.get(1..).unwrap_or_default();
            if self.bytes.is_empty() && !self.too_long && line.len() <= MAX_LINE {
                if is_blank(line) {
                    continue;
                }
                return Some(Ok(line));
            }
            self.collect(line);
            if self.too_long || !is_blank(&self.bytes) {
                break;
            }
            self.restart();
        }
        self.handed_out = true;
        Some(if self.too_long {
            Err(TooLong)
        } else {
            Ok(&self.bytes)
        })
    }

    fn collect(&mut self, part: &[u8]) {
        if self.bytes.extend_from_slice(part).is_err() {
            self.too_long = true;
        }
    }

    fn restart(&mut self) {
        self.bytes.clear();
        self.too_long = false;
        self.handed_out = false;
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::{string::String, vec::Vec};

    fn lines(chunks: &[&[u8]]) -> Vec<Result<String, TooLong>> {
        let mut buffer = LineBuffer::new();
        let mut found = Vec::new();
        for chunk in chunks {
            let mut input = *chunk;
            while let Some(line) = buffer.next_line(&mut input) {
                found.push(line.map(|line| String::from_utf8_lossy(line).into_owned()));
            }
        }
        found
    }

    #[test]
    fn every_terminator_seen_on_the_wire_ends_one_line() {
        for terminator in ["\0", "\0\n", "\r\n\0", "\n", "\r\n"] {
            let stream = std::format!("G28{terminator}M114{terminator}");
            let expected = [Ok("G28".into()), Ok("M114".into())];
            assert_eq!(lines(&[stream.as_bytes()]), expected, "{terminator:?}");
        }
    }

    #[test]
    fn empty_and_blank_lines_are_no_lines() {
        assert_eq!(lines(&[b"\r\n\0\n  \t\n\0\0"]), []);
    }

    #[test]
    fn the_longest_line_fits_and_one_more_byte_does_not() {
        let longest = "x".repeat(MAX_LINE);
        let stream = std::format!("{longest}\n{longest}y\nG28\n");
        assert_eq!(
            lines(&[stream.as_bytes()]),
            [Ok(longest), Err(TooLong), Ok("G28".into())]
        );
    }

    #[test]
    fn a_long_line_in_pieces_is_one_error() {
        let part = [b'x'; 200];
        assert_eq!(
            lines(&[&part, &part, &part, b"\nM114\n"]),
            [Err(TooLong), Ok("M114".into())]
        );
    }

    proptest! {
        #[test]
        fn packets_do_not_matter(stream: Vec<u8>, cuts: Vec<proptest::sample::Index>) {
            let mut at: Vec<usize> = cuts.iter().map(|cut| cut.index(stream.len() + 1)).collect();
            at.extend([0, stream.len()]);
            at.sort_unstable();
            let pieces: Vec<&[u8]> = at.windows(2).map(|w| &stream[w[0]..w[1]]).collect();
            prop_assert_eq!(lines(&pieces), lines(&[&stream]));
        }
    }
}
