//! The words of a line, taken off its front one by one.

use embassy_time::Duration;

/// What is left of a line.
#[derive(Clone, Copy, Debug)]
pub struct Words<'a>(&'a str);

impl<'a> Words<'a> {
    /// A whole line.
    pub fn new(line: &'a str) -> Self {
        Self(line.trim())
    }

    /// Takes these words off, if they are next; commas between them may be there or not.
    pub fn eat(&mut self, words: &str) -> bool {
        let before = *self;
        for word in words.split(' ') {
            if self.next_word() != Some(word) {
                *self = before;
                return false;
            }
        }
        true
    }

    /// Takes one word off.
    pub fn next_word(&mut self) -> Option<&'a str> {
        self.skip_commas();
        let end = self.0.find([' ', ',']).unwrap_or(self.0.len());
        let (word, rest) = self.0.split_at(end);
        if word.is_empty() {
            return None;
        }
        self.0 = rest.trim_start();
        Some(word)
    }

    /// Takes off a text in double quotes, with `\"`, `\\`, `\r`, `\n`, `\0` and `\x7f` in it, or one
    /// word without quotes.
    pub fn text(&mut self) -> Result<Vec<u8>, String> {
        self.skip_commas();
        let Some(quoted) = self.0.strip_prefix('"') else {
            let word = self.next_word().ok_or("a text is missing")?;
            return Ok(word.as_bytes().to_vec());
        };
        let mut text = Vec::new();
        let mut rest = quoted.chars();
        loop {
            match rest.next().ok_or("a quote is not closed")? {
                '"' => break,
                '\\' => text.push(escaped(&mut rest)?),
                other => text.extend(other.encode_utf8(&mut [0; 4]).bytes()),
            }
        }
        self.0 = rest.as_str().trim_start();
        Ok(text)
    }

    /// Takes a number off.
    pub fn number<T: std::str::FromStr>(&mut self) -> Result<T, String> {
        let word = self.next_word().ok_or("a number is missing")?;
        word.parse().map_err(|_| format!("{word:?} is no number"))
    }

    /// Takes a time off, such as `1.5 s`.
    pub fn time(&mut self) -> Result<Duration, String> {
        let count: f64 = self.number()?;
        let unit = match self.next_word() {
            Some("ms") => 1e3,
            Some("s") => 1e6,
            Some("min") => 60e6,
            _ => return Err("a time has a unit: ms, s or min".into()),
        };
        if !(0.0..=1e6).contains(&count) {
            return Err(format!("{count} is no time"));
        }
        Ok(Duration::from_micros((count * unit).round() as u64))
    }

    /// All that is left.
    pub const fn rest(&self) -> &'a str {
        self.0
    }

    /// Takes off all that is left.
    pub fn take_rest(&mut self) -> &'a str {
        std::mem::take(&mut self.0)
    }

    /// Nothing may be left.
    pub fn end(mut self) -> Result<(), String> {
        self.skip_commas();
        match self.0 {
            "" => Ok(()),
            rest => Err(format!("{rest:?} is not understood")),
        }
    }

    /// Takes `within 5 s` off the line's end, if it is there.
    pub fn split_within(self) -> (Self, Option<Duration>) {
        let Some((front, back)) = self.0.rsplit_once(" within ") else {
            return (self, None);
        };
        let mut words = Self(back);
        match words.time() {
            Ok(time) if words.end().is_ok() => (Self(front.trim_end()), Some(time)),
            _ => (self, None),
        }
    }

    fn skip_commas(&mut self) {
        self.0 = self.0.trim_start_matches([' ', ',']);
    }
}

fn escaped(rest: &mut std::str::Chars<'_>) -> Result<u8, String> {
    match rest.next() {
        Some('r') => Ok(b'\r'),
        Some('n') => Ok(b'\n'),
        Some('0') => Ok(0),
        Some(same @ ('"' | '\\')) => Ok(same as u8),
        Some('x') => {
            let digits = rest.as_str().get(..2).unwrap_or_default();
            let byte = u8::from_str_radix(digits, 16);
            let byte = byte.map_err(|_| "\\x needs two hexadecimal digits")?;
            *rest = rest.as_str().get(2..).unwrap_or_default().chars();
            Ok(byte)
        }
        _ => Err("after \\ comes one of \" \\ r n 0 x".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_quoted_or_a_word() {
        let mut words = Words::new(r#""a \"b\" \x00\xff\\", c d"#);
        assert_eq!(words.text().unwrap(), b"a \"b\" \0\xff\\");
        assert_eq!(words.text().unwrap(), b"c");
        assert_eq!(words.rest(), "d");
        for wrong in ["", "\"open", "\"\\q\"", "\"\\x1\""] {
            assert!(Words::new(wrong).text().is_err(), "{wrong}");
        }
    }

    #[test]
    fn times_have_a_unit() {
        let time = |text| Words::new(text).time();
        assert_eq!(time("1.5 s"), Ok(Duration::from_millis(1500)));
        assert_eq!(time("20 ms"), Ok(Duration::from_millis(20)));
        assert_eq!(time("2 min"), Ok(Duration::from_secs(120)));
        for wrong in ["5", "5 hours", "-1 s", "x s", ""] {
            assert!(time(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn within_is_at_the_end_only() {
        let (words, within) = Words::new("light blue within 2 s").split_within();
        assert_eq!(
            (words.rest(), within),
            ("light blue", Some(Duration::from_secs(2)))
        );
        let (words, within) = Words::new("A hears within reach").split_within();
        assert_eq!((words.rest(), within), ("A hears within reach", None));
    }
}
