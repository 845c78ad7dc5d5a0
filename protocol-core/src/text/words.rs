//! A line as words: a code, then letters with values.
//!
//! Blanks and comments (`; to the end`, `( between )`) separate words and mean nothing else; inside
//! double quotes they are part of the value. A value may be quoted; a quote inside a quoted value is
//! written twice, `P"say ""hi"""`, in both directions. Blanks between a number and the next letter
//! may be left out, `G1X100Y200`.

use super::decimal::{Decimal, OutOfRange};
use core::fmt;
use heapless::Vec;

/// What is wrong with the form of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WordError<'a> {
    /// Bytes that are not UTF-8.
    NotUtf8,
    /// What should be a command's code is something else.
    NoCode(&'a str),
    /// A `(` without its `)`.
    OpenComment,
    /// A quoted value that does not end.
    OpenQuote(char),
    /// A character where a parameter letter should be.
    NoLetter(char),
    /// A letter without a number.
    NoNumber(char),
    /// What follows the letter is not a decimal number.
    NotANumber(char, &'a str),
    /// A value of a letter that takes none, or none where one is needed.
    NoValue(char),
    /// A value where a letter takes none.
    Value(char, &'a str),
}

/// The text value of a parameter, quotes not yet taken off: bytes, because names of networks are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text<'a> {
    raw: &'a [u8],
    quoted: bool,
}

impl<'a> Text<'a> {
    /// The value itself, doubled quotes made single; `None` when it is longer than `N` bytes.
    pub fn unescape<const N: usize>(&self) -> Option<Vec<u8, N>> {
        let mut value = Vec::new();
        let mut bytes = self.raw.iter();
        while let Some(&byte) = bytes.next() {
            value.push(byte).ok()?;
            if self.quoted && byte == b'"' {
                bytes.next();
            }
        }
        Some(value)
    }

    /// Whether the value is `word`, in any letter case.
    pub fn is(&self, word: &str) -> bool {
        self.raw.eq_ignore_ascii_case(word.as_bytes())
    }

    /// The value as it was written, for messages.
    pub fn raw(&self) -> &'a [u8] {
        self.raw
    }
}

/// Reads the words of one line from front to back.
///
/// On bytes, because a command of letters and numbers needs no more: that the line is UTF-8 is checked
/// where something else is met. What is rare is a function of its own that is given the rest of the
/// line and gives it back, so that the common way stays in registers.
#[derive(Clone, Copy, Debug)]
pub struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Words<'a> {
    /// The words of `line`.
    pub const fn new(line: &'a [u8]) -> Self {
        Self { rest: line }
    }

    /// The command's code: a letter in upper case and a number, `('G', 1)` for `g01`; `None` for a
    /// line of comments only.
    ///
    /// # Errors
    /// [`WordError::NoCode`] with what is there instead.
    #[inline(always)]
    pub fn code(&mut self) -> Result<Option<(u8, u32)>, WordError<'a>> {
        let start = first_word(self.rest)?;
        if start.is_empty() {
            return Ok(None);
        }
        if let [letter, digits @ ..] = start
            && let Some(letter) = upper_case(*letter)
        {
            let (number, length, rest) = short_number(digits);
            let plain = matches!(rest, [] | [b' ', ..]) || ends_number(rest);
            if (1..=MAX_CODE_DIGITS).contains(&length) && plain {
                self.rest = rest;
                return Ok(Some((letter, number)));
            }
        }
        Err(no_code(start))
    }

    /// The code of the line, of which nobody knows what it means.
    #[cold]
    pub fn unknown(self) -> WordError<'a> {
        first_word(self.rest).map_or_else(|error| error, no_code)
    }

    /// The next parameter's letter in upper case, `None` at the end of the line.
    #[inline(always)]
    pub fn letter(&mut self) -> Result<Option<char>, WordError<'a>> {
        let mut start = skip_blanks(self.rest);
        loop {
            match start {
                [] => return Ok(None),
                [letter, rest @ ..] => {
                    if let Some(letter) = upper_case(*letter) {
                        self.rest = rest;
                        return Ok(Some(char::from(letter)));
                    }
                }
            }
            start = after_comments(start)?;
        }
    }

    /// The number after `letter`, quoted or not.
    #[inline(always)]
    pub fn number(&mut self, letter: char) -> Result<Decimal, WordError<'a>> {
        let (number, rest) = any_number(self.rest, letter)?;
        self.rest = rest;
        Ok(number)
    }

    /// The number after `letter` as [`Decimal::to_fixed`] gives it.
    #[inline(always)]
    pub fn fixed(
        &mut self,
        letter: char,
        bits: u32,
        limit: u32,
    ) -> Result<Result<i64, OutOfRange>, WordError<'a>> {
        // Whole numbers in 32 bits, which is what the chip is quick at; everything else goes around.
        let (negative, digits) = match self.rest {
            [b'-', digits @ ..] => (true, digits),
            digits => (false, digits),
        };
        let (number, length, rest) = short_number(digits);
        let short = (1..=MAX_SHORT_DIGITS).contains(&length) && matches!(rest, [] | [b' ', ..]);
        if !short || number > limit {
            return Ok(self.number(letter)?.to_fixed(bits, limit));
        }
        self.rest = rest;
        let magnitude = i64::from(number) << bits;
        Ok(Ok(if negative { -magnitude } else { magnitude }))
    }

    /// The text after `letter`, quoted or up to the next blank or comment.
    pub fn text(&mut self, letter: char) -> Result<Text<'a>, WordError<'a>> {
        let [b'"', inner @ ..] = self.rest else {
            let raw = token_bytes(self.rest);
            if raw.is_empty() {
                return Err(WordError::NoValue(letter));
            }
            self.rest = self.rest.get(raw.len()..).unwrap_or_default();
            return Ok(Text { raw, quoted: false });
        };
        let mut bytes = inner.iter().enumerate().peekable();
        while let Some((at, byte)) = bytes.next() {
            if *byte == b'"' && bytes.next_if(|(_, next)| **next == b'"').is_none() {
                let (raw, rest) = inner.split_at(at);
                self.rest = rest.get(1..).unwrap_or_default();
                return Ok(Text { raw, quoted: true });
            }
        }
        Err(WordError::OpenQuote(letter))
    }

    /// The text after `letter`, quoted or up to the next blank, in which a `;` begins no comment: it
    /// separates the parts of the value.
    pub fn list(&mut self, letter: char) -> Result<Text<'a>, WordError<'a>> {
        let end = self
            .rest
            .iter()
            .position(|byte| separates(*byte) && *byte != b';');
        let (raw, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        if raw.is_empty() || raw.starts_with(b"\"") {
            return self.text(letter);
        }
        self.rest = rest;
        Ok(Text { raw, quoted: false })
    }

    /// Nothing may follow `letter`.
    pub fn no_value(&mut self, letter: char) -> Result<(), WordError<'a>> {
        match token(self.rest) {
            Some("") => Ok(()),
            Some(text) => Err(WordError::Value(letter, text)),
            None => Err(WordError::NotUtf8),
        }
    }
}

/// What comes after blanks; tabs are rare enough to pass for comments.
#[inline(always)]
fn skip_blanks(mut rest: &[u8]) -> &[u8] {
    while let [b' ', after @ ..] = rest {
        rest = after;
    }
    rest
}

/// What comes after blanks and comments at the start of a line.
#[inline(always)]
fn first_word(line: &[u8]) -> Result<&[u8], WordError<'_>> {
    let mut start = skip_blanks(line);
    while let [b'\t' | b';' | b'(', ..] = start {
        start = after_comments(start)?;
    }
    Ok(start)
}

#[cold]
fn no_code(start: &[u8]) -> WordError<'_> {
    token(start).map_or(WordError::NotUtf8, WordError::NoCode)
}

/// The letter in upper case, `None` for any other byte.
#[inline(always)]
const fn upper_case(byte: u8) -> Option<u8> {
    let upper = byte & !0x20;
    if upper.is_ascii_uppercase() {
        Some(upper)
    } else {
        None
    }
}

/// Any number that is not short.
#[cold]
fn any_number(value: &[u8], letter: char) -> Result<(Decimal, &[u8]), WordError<'_>> {
    let (quoted, inner) = match value {
        [b'"', inner @ ..] => (true, inner),
        inner => (false, inner),
    };
    match (Decimal::read(inner), quoted) {
        (Some((number, [b'"', rest @ ..])), true) => return Ok((number, rest)),
        // `0x10` would otherwise read as zero and a parameter X.
        (Some((_, [b'x' | b'X', ..])), _)
            if matches!(inner, [b'0', ..] | [b'+' | b'-', b'0', ..]) => {}
        (Some((number, rest)), false) if ends_number(rest) => return Ok((number, rest)),
        _ => {}
    }
    if quoted && !inner.contains(&b'"') {
        return Err(WordError::OpenQuote(letter));
    }
    Err(match token(value) {
        None => WordError::NotUtf8,
        Some("" | "\"\"") => WordError::NoNumber(letter),
        Some(text) => WordError::NotANumber(letter, text),
    })
}

/// What comes after comments.
///
/// # Errors
/// [`WordError::NoLetter`] when there is no comment.
#[cold]
fn after_comments(rest: &[u8]) -> Result<&[u8], WordError<'_>> {
    let text = str::from_utf8(rest).map_err(|_| WordError::NotUtf8)?;
    let after = match text.as_bytes() {
        [b'\t', ..] => text.trim_start_matches('\t'),
        [b';', ..] => "",
        [b'(', ..] => text.split_once(')').ok_or(WordError::OpenComment)?.1,
        _ => return Err(WordError::NoLetter(text.chars().next().unwrap_or(' '))),
    };
    Ok(skip_blanks(after.as_bytes()))
}

/// What comes up to the next blank or comment, `None` if it is not UTF-8.
#[cold]
fn token(rest: &[u8]) -> Option<&str> {
    str::from_utf8(token_bytes(rest)).ok()
}

#[cold]
fn token_bytes(rest: &[u8]) -> &[u8] {
    let end = rest.iter().position(|&byte| separates(byte));
    end.and_then(|end| rest.get(..end)).unwrap_or(rest)
}

/// Digits at the front of `text`: their value, which is right for up to [`MAX_SHORT_DIGITS`], how many
/// there are, and what follows.
#[inline(always)]
fn short_number(text: &[u8]) -> (u32, usize, &[u8]) {
    let (mut number, mut rest) = (0u32, text.iter());
    while let Some(digit) = rest.as_slice().first() {
        let digit = u32::from(*digit).wrapping_sub(u32::from(b'0'));
        if digit > 9 {
            break;
        }
        number = number.wrapping_mul(10).wrapping_add(digit);
        rest.next();
    }
    let rest = rest.as_slice();
    (number, text.len() - rest.len(), rest)
}

/// Digits that fit 32 bits.
const MAX_SHORT_DIGITS: usize = 9;
/// Longest number of a code, in digits.
const MAX_CODE_DIGITS: usize = 4;

const fn separates(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b';' | b'(')
}

/// A number may also be followed by the next letter at once.
#[cold]
const fn ends_number(rest: &[u8]) -> bool {
    match rest {
        [] => true,
        [next, ..] => separates(*next) || next.is_ascii_alphabetic(),
    }
}

/// Longest piece of a client's own text that a message repeats, in characters.
pub const MAX_EXCERPT: usize = 24;

/// A text as a message may repeat it: shortened to `most` characters, and without those that would end
/// the quoted message or the reply.
pub fn excerpt(text: &str, most: usize) -> impl fmt::Display + '_ {
    excerpt_of_bytes(text.as_bytes(), most)
}

/// The same of bytes: what is not UTF-8 becomes a question mark.
pub fn excerpt_of_bytes(text: &[u8], most: usize) -> impl fmt::Display + '_ {
    struct Excerpt<'a>(&'a [u8], usize);
    impl fmt::Display for Excerpt<'_> {
        fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
            use fmt::Write;
            let characters = self.0.utf8_chunks().flat_map(|chunk| {
                let broken = (!chunk.invalid().is_empty()).then_some('?');
                chunk.valid().chars().chain(broken)
            });
            for (count, character) in characters.enumerate() {
                if count == self.1 {
                    return out.write_str("...");
                }
                out.write_char(match character {
                    '"' => '\'',
                    '\\' => '/',
                    control if control.is_control() => '?',
                    other => other,
                })?;
            }
            Ok(())
        }
    }
    Excerpt(text, most)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::format;
    use std::string::String as StdString;

    fn code(line: &str) -> Option<(u8, u32)> {
        Words::new(line.as_bytes()).code().unwrap()
    }

    #[test]
    fn codes_in_any_case_and_length() {
        for line in [
            "G1",
            "g1",
            "G01",
            "g001 X5",
            "  G01",
            "(note) G1",
            "G1X5",
            "G1;note",
            "G1(note)",
        ] {
            assert_eq!(code(line), Some((b'G', 1)), "{line}");
        }
        assert_eq!(code("M114"), Some((b'M', 114)));
    }

    #[test]
    fn a_line_of_comments_has_no_code() {
        assert_eq!(code("; a note"), None);
        assert_eq!(code("(one) (two) ; three"), None);
    }

    #[test]
    fn what_is_no_code_is_given_back() {
        for (line, token) in [
            ("undefined", "undefined"),
            ("G", "G"),
            ("G-1 X5", "G-1"),
            ("G1.5", "G1.5"),
            ("G00001", "G00001"),
            ("42", "42"),
            ("\u{e9}1", "\u{e9}1"),
        ] {
            assert_eq!(
                Words::new(line.as_bytes()).code(),
                Err(WordError::NoCode(token)),
                "{line}"
            );
        }
    }

    #[test]
    fn letters_and_numbers_with_and_without_blanks() {
        for line in [
            "X1 Y2",
            " x1  y2 ",
            "X1Y2",
            "X\"1\" Y\"2\"",
            "X1(a)Y2;b",
            "X1.0\tY2.",
        ] {
            let mut words = Words::new(line.as_bytes());
            for (letter, value) in [('X', 1), ('Y', 2)] {
                assert_eq!(words.letter(), Ok(Some(letter)), "{line}");
                assert_eq!(
                    words.number(letter).unwrap().to_fixed(0, 9),
                    Ok(value),
                    "{line}"
                );
            }
            assert_eq!(words.letter(), Ok(None), "{line}");
        }
    }

    #[test]
    fn numbers_that_are_none() {
        for value in [
            "nan", "inf", "-inf", "0x10", "0X1F", "-0x10", "+0x5", "1.2.3", "--1", "1-", "\"x\"",
            "1,5", "\u{b2}",
        ] {
            assert_eq!(
                Words::new(value.as_bytes()).number('X'),
                Err(WordError::NotANumber('X', value)),
                "{value}"
            );
        }
        assert_eq!(Words::new(b"").number('X'), Err(WordError::NoNumber('X')));
        assert_eq!(Words::new(b" 5").number('X'), Err(WordError::NoNumber('X')));
    }

    #[test]
    fn text_plain_and_quoted() {
        for (value, meaning) in [
            ("my-ssid P", "my-ssid"),
            ("\"password with spaces\" P", "password with spaces"),
            ("\"a;b(c)\"", "a;b(c)"),
            ("\"say \"\"hi\"\"\"", "say \"hi\""),
            ("\"\"", ""),
            ("*;all", "*"),
        ] {
            let text = Words::new(value.as_bytes()).text('S').unwrap();
            assert_eq!(
                text.unescape::<64>().unwrap(),
                meaning.as_bytes(),
                "{value}"
            );
        }
        assert_eq!(
            Words::new(b"\"open").text('S'),
            Err(WordError::OpenQuote('S'))
        );
        assert_eq!(Words::new(b" x").text('S'), Err(WordError::NoValue('S')));
    }

    #[test]
    fn an_unclosed_comment_is_an_error() {
        assert_eq!(Words::new(b"G1 (oops").code(), Ok(Some((b'G', 1))));
        let mut words = Words::new(b" (oops");
        assert_eq!(words.letter(), Err(WordError::OpenComment));
    }

    proptest! {
        #[test]
        fn quoting_and_unquoting_is_the_identity(value: std::vec::Vec<u8>) {
            let doubled = value.iter().flat_map(|&byte| match byte {
                b'"' => [b'"', b'"'].into_iter().take(2),
                other => [other, other].into_iter().take(1),
            });
            let written: std::vec::Vec<u8> =
                [b'"'].into_iter().chain(doubled).chain([b'"']).collect();
            let text = Words::new(&written).text('S').unwrap();
            let read = text.unescape::<256>().unwrap();
            prop_assert_eq!(&read[..], &value[..]);
        }

        #[test]
        fn excerpts_are_short_and_end_no_message(text: StdString) {
            let shown = format!("{}", excerpt(&text, MAX_EXCERPT));
            prop_assert!(shown.chars().count() <= MAX_EXCERPT + 3);
            prop_assert!(!shown.contains(['"', '\r', '\n', '\0']));
        }
    }
}
