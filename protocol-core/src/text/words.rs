//! A line as words: a code, then letters with values.
//!
//! Blanks and comments (`; to the end`, `( between )`) separate words and mean nothing else; inside
//! double quotes they are part of the value. A value may be quoted; a quote inside a quoted value is
//! written twice, `P"say ""hi"""`, in both directions. Blanks between a number and the next letter
//! may be left out, `G1X100Y200`.

use super::decimal::Decimal;
use core::fmt;
use heapless::String;

/// What is wrong with the form of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WordError<'a> {
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

/// The text value of a parameter, quotes not yet taken off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text<'a> {
    raw: &'a str,
    quoted: bool,
}

impl<'a> Text<'a> {
    /// The value itself, doubled quotes made single; `None` when it is longer than `N` bytes.
    pub fn unescape<const N: usize>(&self) -> Option<String<N>> {
        let mut value = String::new();
        let mut characters = self.raw.chars();
        while let Some(character) = characters.next() {
            value.push(character).ok()?;
            if self.quoted && character == '"' {
                characters.next();
            }
        }
        Some(value)
    }

    /// Whether the value is `word`, in any letter case.
    pub fn is(&self, word: &str) -> bool {
        self.raw.eq_ignore_ascii_case(word)
    }

    /// The value as it was written, for messages.
    pub fn raw(&self) -> &'a str {
        self.raw
    }
}

/// Reads the words of one line from front to back.
#[derive(Clone, Copy, Debug)]
pub struct Words<'a> {
    rest: &'a str,
}

impl<'a> Words<'a> {
    /// The words of `line`.
    pub const fn new(line: &'a str) -> Self {
        Self { rest: line }
    }

    /// The command's code: a letter in upper case and a number, `('G', 1)` for `g01`.
    /// `Ok(None)` for a line of comments only; `Err(Err(text))` for what is no code.
    pub fn code(&mut self) -> Result<Option<(u8, u16)>, Result<WordError<'a>, &'a str>> {
        self.skip_blanks().map_err(Ok)?;
        let bytes = self.rest.as_bytes();
        let Some((letter, digits)) = bytes.split_first() else {
            return Ok(None);
        };
        let mut number: u16 = 0;
        let mut length = 1;
        for digit in digits {
            if !digit.is_ascii_digit() || length > 4 {
                break;
            }
            number = number * 10 + u16::from(digit - b'0');
            length += 1;
        }
        let followed_by_word = match bytes.get(length) {
            None => true,
            Some(&next) => ends_value(next) || next.is_ascii_alphabetic(),
        };
        if !letter.is_ascii_alphabetic() || length == 1 || !followed_by_word {
            return Err(Err(self.token()));
        }
        self.rest = self.rest.get(length..).unwrap_or_default();
        Ok(Some((letter.to_ascii_uppercase(), number)))
    }

    /// The next parameter's letter in upper case, `None` at the end of the line.
    pub fn letter(&mut self) -> Result<Option<char>, WordError<'a>> {
        self.skip_blanks()?;
        let Some(first) = self.rest.chars().next() else {
            return Ok(None);
        };
        if !first.is_ascii_alphabetic() {
            return Err(WordError::NoLetter(first));
        }
        self.rest = self.rest.get(1..).unwrap_or_default();
        Ok(Some(first.to_ascii_uppercase()))
    }

    /// The number after `letter`, quoted or not.
    pub fn number(&mut self, letter: char) -> Result<Decimal, WordError<'a>> {
        let quoted = self.rest.starts_with('"');
        let value = match quoted {
            true => self.rest.get(1..).unwrap_or_default(),
            false => self.rest,
        };
        if let Some((number, left)) = Decimal::read(value.as_bytes()) {
            let left = value.get(value.len() - left.len()..).unwrap_or_default();
            match left.as_bytes().first() {
                Some(b'"') if quoted => {
                    self.rest = left.get(1..).unwrap_or_default();
                    return Ok(number);
                }
                // `0x10` would otherwise read as zero and a parameter X.
                Some(b'x' | b'X') if value.as_bytes().first() == Some(&b'0') => {}
                next if !quoted
                    && next.is_none_or(|&next| ends_value(next) || next.is_ascii_alphabetic()) =>
                {
                    self.rest = left;
                    return Ok(number);
                }
                _ => {}
            }
        }
        match self.token() {
            "" | "\"\"" => Err(WordError::NoNumber(letter)),
            token => Err(WordError::NotANumber(letter, token)),
        }
    }

    /// The text after `letter`, quoted or up to the next blank or comment.
    pub fn text(&mut self, letter: char) -> Result<Text<'a>, WordError<'a>> {
        if let Some(inner) = self.rest.strip_prefix('"') {
            let mut bytes = inner.bytes().enumerate().peekable();
            while let Some((at, byte)) = bytes.next() {
                if byte != b'"' {
                    continue;
                }
                if bytes.next_if(|&(_, next)| next == b'"').is_none() {
                    let (raw, rest) = inner.split_at(at);
                    self.rest = rest.get(1..).unwrap_or_default();
                    return Ok(Text { raw, quoted: true });
                }
            }
            return Err(WordError::OpenQuote(letter));
        }
        let raw = self.token();
        if raw.is_empty() {
            return Err(WordError::NoValue(letter));
        }
        self.rest = self.rest.get(raw.len()..).unwrap_or_default();
        Ok(Text { raw, quoted: false })
    }

    /// Nothing may follow `letter`.
    pub fn no_value(&mut self, letter: char) -> Result<(), WordError<'a>> {
        match self.token() {
            "" => Ok(()),
            token => Err(WordError::Value(letter, token)),
        }
    }

    /// What comes up to the next blank or comment.
    fn token(&self) -> &'a str {
        let end = self.rest.bytes().position(ends_value);
        self.rest
            .get(..end.unwrap_or(self.rest.len()))
            .unwrap_or_default()
    }

    fn skip_blanks(&mut self) -> Result<(), WordError<'a>> {
        loop {
            match self.rest.as_bytes().first() {
                Some(b' ' | b'\t') => self.rest = self.rest.get(1..).unwrap_or_default(),
                Some(b';') => self.rest = "",
                Some(b'(') => match self.rest.split_once(')') {
                    Some((_, after)) => self.rest = after,
                    None => return Err(WordError::OpenComment),
                },
                _ => return Ok(()),
            }
        }
    }
}

const fn ends_value(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b';' | b'(')
}

/// Longest piece of a client's own text that a message repeats, in characters.
pub const MAX_EXCERPT: usize = 24;

/// A client's text as a message may repeat it: shortened, and without the characters that would
/// end the quoted message or the reply.
pub fn excerpt(text: &str) -> impl fmt::Display + '_ {
    struct Excerpt<'a>(&'a str);
    impl fmt::Display for Excerpt<'_> {
        fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
            use fmt::Write;
            for (count, character) in self.0.chars().enumerate() {
                if count == MAX_EXCERPT {
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
    Excerpt(text)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::format;
    use std::string::String as StdString;

    fn code(line: &str) -> Option<(u8, u16)> {
        Words::new(line).code().unwrap()
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
            assert_eq!(Words::new(line).code(), Err(Err(token)), "{line}");
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
            let mut words = Words::new(line);
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
            "nan", "inf", "-inf", "0x10", "0X1F", "1.2.3", "--1", "1-", "\"5", "\"x\"", "1,5",
            "\u{b2}",
        ] {
            assert_eq!(
                Words::new(value).number('X'),
                Err(WordError::NotANumber('X', value)),
                "{value}"
            );
        }
        assert_eq!(Words::new("").number('X'), Err(WordError::NoNumber('X')));
        assert_eq!(Words::new(" 5").number('X'), Err(WordError::NoNumber('X')));
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
            let text = Words::new(value).text('S').unwrap();
            assert_eq!(text.unescape::<64>().unwrap(), meaning, "{value}");
        }
        assert_eq!(
            Words::new("\"open").text('S'),
            Err(WordError::OpenQuote('S'))
        );
        assert_eq!(Words::new(" x").text('S'), Err(WordError::NoValue('S')));
    }

    #[test]
    fn an_unclosed_comment_is_an_error() {
        assert_eq!(Words::new("G1 (oops").code(), Ok(Some((b'G', 1))));
        let mut words = Words::new(" (oops");
        assert_eq!(words.letter(), Err(WordError::OpenComment));
    }

    proptest! {
        #[test]
        fn quoting_and_unquoting_is_the_identity(value in "\\PC{0,32}") {
            let written = format!("\"{}\"", value.replace('"', "\"\""));
            let text = Words::new(&written).text('S').unwrap();
            let read = text.unescape::<256>().unwrap();
            prop_assert_eq!(read.as_str(), value);
        }

        #[test]
        fn excerpts_are_short_and_end_no_message(text: StdString) {
            let shown = format!("{}", excerpt(&text));
            prop_assert!(shown.chars().count() <= MAX_EXCERPT + 3);
            prop_assert!(!shown.contains(['"', '\r', '\n', '\0']));
        }
    }
}
