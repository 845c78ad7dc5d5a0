//! Where manifests are fetched from.

use heapless::String;

/// Longest address, in bytes.
pub const MAX_ADDRESS: usize = 96;
/// Longest name of a host, in bytes.
pub const MAX_HOST: usize = 64;
/// Longest name of an image, in bytes.
pub const MAX_IMAGE_NAME: usize = 64;
/// Longest path on a server, in bytes.
pub const MAX_PATH: usize = MAX_ADDRESS + MAX_IMAGE_NAME;
const SCHEME: &str = "http://";
const PORT: u16 = 80;

/// The address of a manifest: `http://HOST[:PORT]/PATH`.
///
/// Plain HTTP, because nothing that is not signed is ever run. Host: a name or an IPv4 address, letters,
/// digits, points and inner hyphens. Path: letters, digits and `/ . _ - ~ + %`; no query, no user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ManifestAddress {
    // Its length in one byte: commands are moved about.
    text: String<MAX_ADDRESS, u8>,
    // Where the parts lie in the text.
    host_end: u8,
    path_start: u8,
    port: u16,
}

const _: () = assert!(MAX_ADDRESS <= u8::MAX as usize);

impl ManifestAddress {
    /// An address, if `text` is one.
    pub fn new(text: &str) -> Option<Self> {
        let rest = text.strip_prefix(SCHEME)?;
        let (authority, _) = rest.split_once('/')?;
        let path_start = SCHEME.len() + authority.len();
        let (host, port) = match authority.split_once(':') {
            Some((host, digits)) => (host, port(digits)?),
            None => (authority, PORT),
        };
        let path = text.get(path_start..)?;
        if !is_host(host) || !path.bytes().all(is_of_a_path) {
            return None;
        }
        Some(Self {
            text: String::try_from(text).ok()?,
            host_end: u8::try_from(SCHEME.len() + host.len()).ok()?,
            path_start: u8::try_from(path_start).ok()?,
            port,
        })
    }

    /// As it was written.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// The server's name, or its IPv4 address.
    pub fn host(&self) -> &str {
        let place = SCHEME.len()..usize::from(self.host_end);
        self.text.get(place).unwrap_or_default()
    }

    /// The server's port.
    pub const fn port(&self) -> u16 {
        self.port
    }

    /// The manifest's path on the server.
    pub fn path(&self) -> &str {
        self.text
            .get(usize::from(self.path_start)..)
            .unwrap_or_default()
    }

    /// The path of a file beside the manifest.
    pub fn beside(&self, name: &ImageName) -> String<MAX_PATH> {
        let folder = self
            .path()
            .rsplit_once('/')
            .map_or("", |(folder, _)| folder);
        let mut path = String::new();
        // Both fit: each is within its limit, and the folder is shorter than its address.
        let _ = path.push_str(folder);
        let _ = path.push('/');
        let _ = path.push_str(name.as_str());
        path
    }
}

fn port(digits: &str) -> Option<u16> {
    let is_plain = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    let port = is_plain.then(|| digits.parse().ok()).flatten()?;
    (port != 0).then_some(port)
}

fn is_host(host: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'.';
    let labels = |host: &str| {
        host.split('.')
            .all(|label| !label.is_empty() && !label.starts_with('-') && !label.ends_with('-'))
    };
    host.len() <= MAX_HOST && host.bytes().all(allowed) && labels(host)
}

const fn is_of_a_path(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'/' | b'.' | b'_' | b'-' | b'~' | b'+' | b'%')
}

/// The name of an image, a file beside its manifest: letters, digits and `. _ - +`, 1 to
/// [`MAX_IMAGE_NAME`] of them, the first no point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageName(String<MAX_IMAGE_NAME>);

impl ImageName {
    /// A name, if `text` is one.
    pub fn new(text: &str) -> Option<Self> {
        let allowed =
            |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'_' | b'-' | b'+');
        if text.is_empty() || text.starts_with('.') || !text.bytes().all(allowed) {
            return None;
        }
        String::try_from(text).ok().map(Self)
    }

    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::format;

    fn parts(text: &str) -> Option<(std::string::String, u16, std::string::String)> {
        let address = ManifestAddress::new(text)?;
        assert_eq!(address.as_str(), text);
        Some((address.host().into(), address.port(), address.path().into()))
    }

    #[test]
    fn addresses_have_a_host_a_port_and_a_path() {
        for (text, host, port, path) in [
            (
                "http://192.168.1.7:8000/quill.txt",
                "192.168.1.7",
                8000,
                "/quill.txt",
            ),
            ("http://example.com/", "example.com", 80, "/"),
            (
                "http://a-b.example/~me/v1.0/x_y+z%20.txt",
                "a-b.example",
                80,
                "/~me/v1.0/x_y+z%20.txt",
            ),
        ] {
            assert_eq!(
                parts(text),
                Some((host.into(), port, path.into())),
                "{text}"
            );
        }
    }

    #[test]
    fn nothing_else_is_an_address() {
        let long = format!("http://example.com/{}", "x".repeat(MAX_ADDRESS));
        let long_host = format!("http://{}/", "x".repeat(MAX_HOST + 1));
        for text in [
            "",
            "example.com/x",
            "https://example.com/x",
            "HTTP://example.com/x",
            "http://example.com",
            "http:///x",
            "http://:80/x",
            "http://a:/x",
            "http://a:0/x",
            "http://a:65536/x",
            "http://a:+8/x",
            "http://me@a/x",
            "http://a/x?y=1",
            "http://a/x#y",
            "http://a/x y",
            "http://a/x\r\nHost: b",
            "http://-a/x",
            "http://a-/x",
            "http://a..b/x",
            "http://.a/x",
            "http://[::1]/x",
            "http://a/\u{e9}",
            "http://a/\"",
            &long,
            &long_host,
        ] {
            assert_eq!(ManifestAddress::new(text), None, "{text:?}");
        }
    }

    #[test]
    fn an_image_lies_beside_its_manifest() {
        let name = ImageName::new("quill-0.2.0-esp32c3.bin").unwrap();
        for (address, path) in [
            ("http://a/esp32c3.txt", "/quill-0.2.0-esp32c3.bin"),
            (
                "http://a/quill/v1/m.txt",
                "/quill/v1/quill-0.2.0-esp32c3.bin",
            ),
            ("http://a/quill/", "/quill/quill-0.2.0-esp32c3.bin"),
        ] {
            assert_eq!(ManifestAddress::new(address).unwrap().beside(&name), path);
        }
        for bad in [
            "",
            ".",
            "..",
            "../x",
            "a/b",
            "/a",
            "a b",
            "a?b",
            "http://b/x",
            "\u{e9}",
        ] {
            assert_eq!(ImageName::new(bad), None, "{bad:?}");
        }
        assert_eq!(ImageName::new(&"x".repeat(MAX_IMAGE_NAME + 1)), None);
    }

    proptest! {
        #[test]
        fn whatever_is_an_address_fits_a_request(text in "(http://)?[ -~]{0,140}") {
            if let Some(address) = ManifestAddress::new(&text) {
                prop_assert!(address.path().starts_with('/'));
                prop_assert!(!address.path().contains([' ', '\r', '\n', '?', '#']));
                let name = ImageName::new(&"x".repeat(MAX_IMAGE_NAME)).unwrap();
                prop_assert!(address.beside(&name).ends_with(name.as_str()));
            }
        }
    }
}
