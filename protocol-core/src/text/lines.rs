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

/// Why a line cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineError {
    /// More than [`MAX_LINE`] bytes came before the terminator; the whole line is dropped.
    TooLong,
    /// The bytes are not UTF-8.
    NotUtf8,
}

/// Collects bytes until a line is complete.
#[derive(Debug, Default)]
pub struct LineBuffer {
    bytes: Vec<u8, MAX_LINE>,
    too_long: bool,
    /// The line in `bytes` has been handed out; the next byte begins a new one.
    handed_out: bool,
}

const fn ends_line(byte: u8) -> bool {
    matches!(byte, b'\r' | b'\n' | 0)
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
    /// gives that line; `None` when `input` is used up first.
    pub fn next_line(&mut self, input: &mut &[u8]) -> Option<Result<&str, LineError>> {
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
            self.collect(line);
            *input = rest.get(1..).unwrap_or_default();
            if self.too_long || !self.is_blank() {
                break;
            }
            self.restart();
        }
        self.handed_out = true;
        if self.too_long {
            return Some(Err(LineError::TooLong));
        }
        Some(core::str::from_utf8(&self.bytes).map_err(|_| LineError::NotUtf8))
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

    fn is_blank(&self) -> bool {
        self.bytes.iter().all(|&byte| matches!(byte, b' ' | b'\t'))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::{string::String, vec::Vec};

    fn lines(chunks: &[&[u8]]) -> Vec<Result<String, LineError>> {
        let mut buffer = LineBuffer::new();
        let mut found = Vec::new();
        for chunk in chunks {
            let mut input = *chunk;
            while let Some(line) = buffer.next_line(&mut input) {
                found.push(line.map(String::from));
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
            [Ok(longest), Err(LineError::TooLong), Ok("G28".into())]
        );
    }

    #[test]
    fn a_long_line_in_pieces_is_one_error() {
        let part = [b'x'; 200];
        assert_eq!(
            lines(&[&part, &part, &part, b"\nM114\n"]),
            [Err(LineError::TooLong), Ok("M114".into())]
        );
    }

    #[test]
    fn bytes_that_are_not_utf8_spoil_their_line_alone() {
        assert_eq!(
            lines(&[b"G28\n\xff\xfe\nM114\n"]),
            [Ok("G28".into()), Err(LineError::NotUtf8), Ok("M114".into())]
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
