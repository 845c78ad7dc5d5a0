//! What stands behind the question mark: parameters of a drawing.

use super::failure::Failure;
use crate::services::job::{MAX_NAME, Title};
use heapless::Vec;

/// Longest name of a drawing, in characters.
pub const MAX_NAME_CHARACTERS: usize = 32;
// Of at most four bytes in UTF-8, but names of drawings are not made of those alone: longer ones are cut.
const _: () = assert!(MAX_NAME >= MAX_NAME_CHARACTERS);

/// Parameters of a drawing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Query {
    /// `name`, `lines`, `seconds`.
    pub title: Title,
    /// `more=1`: pieces follow.
    pub more: bool,
    /// `last=1`: this is the last piece.
    pub last: bool,
    /// `id` of the drawing.
    pub id: Option<u32>,
    /// `at`: bytes before this piece.
    pub at: Option<u32>,
}

impl Query {
    /// Reads the parameters; a name is percent-encoded.
    pub fn read(text: &str) -> Result<Self, Failure> {
        let mut query = Self::default();
        for pair in text.split('&').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
            match key {
                "name" => query.title.name = name(value),
                "lines" => query.title.lines = Some(number(key, value)?),
                "seconds" => query.title.seconds = Some(number(key, value)?),
                "more" => query.more = flag(key, value)?,
                "last" => query.last = flag(key, value)?,
                "id" => query.id = Some(number(key, value)?),
                "at" => query.at = Some(number(key, value)?),
                _ => {
                    let reason = format_args!("there is no parameter '{key:.24}' here");
                    return Err(Failure::bad_value(reason));
                }
            }
        }
        Ok(query)
    }
}

fn number(key: &str, value: &str) -> Result<u32, Failure> {
    let digits = value.bytes().all(|byte| byte.is_ascii_digit());
    match value.parse() {
        Ok(number) if digits => Ok(number),
        _ => Err(Failure::bad_value(format_args!("{key} is no whole number"))),
    }
}

fn flag(key: &str, value: &str) -> Result<bool, Failure> {
    match value {
        "1" => Ok(true),
        "0" => Ok(false),
        _ => Err(Failure::bad_value(format_args!("{key} may be 0 or 1"))),
    }
}

/// As much of a name as there is room for; control characters and what is not UTF-8 is left out.
fn name(encoded: &str) -> heapless::String<MAX_NAME> {
    let mut bytes = Vec::<u8, { 4 * MAX_NAME_CHARACTERS }>::new();
    let mut rest = encoded.as_bytes();
    while let Some((&first, behind)) = rest.split_first() {
        rest = behind;
        let byte = match (first, behind) {
            (b'+', _) => b' ',
            (b'%', [high, low, behind @ ..]) => match (digit(*high), digit(*low)) {
                (Some(high), Some(low)) => {
                    rest = behind;
                    high << 4 | low
                }
                _ => first,
            },
            _ => first,
        };
        if bytes.push(byte).is_err() {
            break;
        }
    }
    let mut name = heapless::String::new();
    let text = bytes.utf8_chunks().flat_map(|chunk| chunk.valid().chars());
    for character in text
        .filter(|character| !character.is_control())
        .take(MAX_NAME_CHARACTERS)
    {
        if name.push(character).is_err() {
            break;
        }
    }
    name
}

fn digit(byte: u8) -> Option<u8> {
    char::from(byte).to_digit(16).map(|digit| digit as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn parameters_of_a_drawing() {
        let query = Query::read("name=My%20cat%2B%c3%a9.svg&more=1&lines=12&seconds=0").unwrap();
        assert_eq!(query.title.name, "My cat+\u{e9}.svg");
        assert_eq!(
            (query.title.lines, query.title.seconds),
            (Some(12), Some(0))
        );
        assert!(query.more && !query.last);
        let query = Query::read("id=3&at=65000&last=1").unwrap();
        assert_eq!(
            (query.id, query.at, query.last),
            (Some(3), Some(65000), true)
        );
        assert_eq!(Query::read("").unwrap(), Query::default());
    }

    #[test]
    fn what_cannot_be_is_named() {
        for (text, reason) in [
            ("size=1", "there is no parameter 'size' here"),
            ("lines=-1", "lines is no whole number"),
            ("lines=", "lines is no whole number"),
            ("id=4294967296", "id is no whole number"),
            ("more=yes", "more may be 0 or 1"),
        ] {
            assert_eq!(Query::read(text).unwrap_err().message, reason);
        }
    }

    #[test]
    fn names_are_cut_and_cleaned() {
        assert_eq!(name("a%00b%0a%ffc%"), "abc%");
        assert_eq!(name("%zz%4"), "%zz%4");
        assert_eq!(name(&"x".repeat(100)), "x".repeat(32).as_str());
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "\\PC{0,200}") {
            let _ = Query::read(&text);
            let _ = name(&text);
        }
    }
}
