//! Whose pages may drive the arm, beside its own.

use heapless::String;

/// Longest origin, in bytes.
pub const MAX_ORIGIN: usize = 64;

/// An origin as browsers send it (RFC 6454, section 6.2): `http` or `https`, a host, a port where it is
/// not the usual one; no path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin(String<MAX_ORIGIN>);

impl Origin {
    /// An origin, if `text` is one.
    pub fn new(text: &str) -> Option<Self> {
        let host = text
            .strip_prefix("http://")
            .or(text.strip_prefix("https://"))?;
        let plain = |byte: u8| {
            byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"-._:[]".contains(&byte)
        };
        if host.is_empty() || !host.bytes().all(plain) {
            return None;
        }
        String::try_from(text).ok().map(Self)
    }

    /// As browsers send it.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Host and port, as in a `Host` header.
    pub fn host(&self) -> &str {
        self.0.split_once("//").map_or("", |(_, host)| host)
    }
}

/// Whose pages may drive the arm, beside its own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AllowedOrigin {
    /// Nobody's.
    #[default]
    None,
    /// Everybody's.
    Any,
    /// Those of this origin.
    Only(Origin),
}

impl AllowedOrigin {
    /// What [`Self::as_str`] gives, `None` for anything else.
    pub fn new(text: &str) -> Option<Self> {
        match text {
            "" => Some(Self::None),
            "*" => Some(Self::Any),
            origin => Origin::new(origin).map(Self::Only),
        }
    }

    /// Empty, `*`, or the origin.
    pub fn as_str(&self) -> &str {
        match self {
            Self::None => "",
            Self::Any => "*",
            Self::Only(origin) => origin.as_str(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn origins_as_browsers_send_them() {
        for (origin, host) in [
            ("https://example.org", "example.org"),
            ("http://10.0.0.7:8000", "10.0.0.7:8000"),
            ("http://[fe80::1]:80", "[fe80::1]:80"),
        ] {
            let origin = Origin::new(origin).unwrap();
            assert_eq!(origin.host(), host);
        }
        for none in [
            "",
            "null",
            "*",
            "example.org",
            "ftp://example.org",
            "https://",
            "https://example.org/",
            "https://Example.org",
            "https://a b",
            "https://a\r\nb",
            "https://0123456789012345678901234567890123456789012345678901234567",
        ] {
            assert_eq!(Origin::new(none), None, "{none:?}");
        }
    }

    #[test]
    fn what_is_allowed_survives_its_text() {
        for text in ["", "*", "https://example.org"] {
            assert_eq!(AllowedOrigin::new(text).unwrap().as_str(), text);
        }
        assert_eq!(AllowedOrigin::new("null"), None);
    }
}
