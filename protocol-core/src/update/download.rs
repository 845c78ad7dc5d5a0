//! What of a server's answer is taken, and for how long one waits for it.

use super::Rejection;
use crate::motion::Micros;

/// A server that says nothing for so long is given up.
pub const SILENCE: Micros = Micros::from_secs(10);
/// A manifest comes within this time.
pub const MANIFEST_TIME: Micros = Micros::from_secs(20);
/// An image comes within this time: 1280 kB at 4.4 kB/s.
pub const IMAGE_TIME: Micros = Micros::from_secs(300);
/// The arm comes to rest with its pen up within this time.
pub const ARM_TIME: Micros = Micros::from_secs(60);
/// Longest head of an answer, in bytes.
pub const MAX_HEAD: usize = 1024;
/// Most header lines of an answer.
pub const MAX_HEADERS: usize = 24;

/// The head of an answer as far as it matters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Head {
    status: u16,
    length: Option<u32>,
    unclear: bool,
}

impl Head {
    /// An answer with this status.
    pub const fn new(status: u16) -> Self {
        Self {
            status,
            length: None,
            unclear: false,
        }
    }

    /// Takes notice of one header line.
    pub fn header(&mut self, name: &str, value: &[u8]) {
        if name.eq_ignore_ascii_case("content-length") {
            let length = core::str::from_utf8(value)
                .ok()
                .filter(|text| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit()));
            // Said twice is unclear, even if it is the same.
            self.unclear |= self.length.is_some();
            match length.and_then(|text| text.parse().ok()) {
                Some(length) => self.length = Some(length),
                None => self.unclear = true,
            }
        }
        let is_plain = value.eq_ignore_ascii_case(b"identity");
        let is_encoding = name.eq_ignore_ascii_case("transfer-encoding")
            || name.eq_ignore_ascii_case("content-encoding");
        self.unclear |= is_encoding && !is_plain;
    }

    /// How many bytes follow.
    ///
    /// # Errors
    /// A [`Rejection`], unless the answer is 200 and of one clear length.
    pub const fn length(&self) -> Result<u32, Rejection> {
        match (self.status, self.length) {
            (200, Some(length)) if !self.unclear => Ok(length),
            (200, _) => Err(Rejection::NoLength),
            (status @ 300..=399, _) => Err(Rejection::Redirect(status)),
            (status, _) => Err(Rejection::Status(status)),
        }
    }
}

/// A download on its way.
#[derive(Clone, Copy, Debug)]
pub struct Download {
    expected: u32,
    received: u32,
    until: Micros,
    limit: Micros,
}

impl Download {
    /// Begins; `limit` is the time for all of it.
    pub fn begin(now: Micros, limit: Micros) -> Self {
        Self {
            expected: 0,
            received: 0,
            until: now + limit,
            limit,
        }
    }

    /// Its length is known.
    pub const fn of(self, expected: u32) -> Self {
        Self { expected, ..self }
    }

    /// Bytes of all of it.
    pub const fn expected(&self) -> u32 {
        self.expected
    }

    /// Bytes that have yet to come.
    pub const fn missing(&self) -> u32 {
        self.expected - self.received
    }

    /// How much of it has come, in percent.
    pub fn percent(&self) -> u8 {
        let percent = u64::from(self.received) * 100 / u64::from(self.expected.max(1));
        percent as u8
    }

    /// How long to wait for the next bytes.
    ///
    /// # Errors
    /// [`Rejection::Slow`] when there is no time left.
    pub fn patience(&self, now: Micros) -> Result<Micros, Rejection> {
        match now < self.until {
            true => Ok((self.until - now).min(SILENCE)),
            false => Err(Rejection::Slow(self.limit)),
        }
    }

    /// Nothing has come for that time.
    pub fn timed_out(&self, now: Micros) -> Rejection {
        match self.patience(now) {
            Ok(_) => Rejection::Silent,
            Err(slow) => slow,
        }
    }

    /// Bytes have come; none means that the connection has ended.
    ///
    /// # Errors
    /// [`Rejection::Truncated`].
    pub fn take(&mut self, count: u32) -> Result<(), Rejection> {
        if count == 0 {
            return Err(Rejection::Truncated {
                received: self.received,
                expected: self.expected,
            });
        }
        self.received = self.expected.min(self.received.saturating_add(count));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(status: u16, headers: &[(&str, &str)]) -> Result<u32, Rejection> {
        let mut head = Head::new(status);
        for (name, value) in headers {
            head.header(name, value.as_bytes());
        }
        head.length()
    }

    #[test]
    fn an_answer_has_status_200_and_one_length() {
        let length = ("Content-Length", "512");
        assert_eq!(head(200, &[("Server", "x"), length]), Ok(512));
        assert_eq!(head(200, &[("content-length", "0")]), Ok(0));
        assert_eq!(
            head(200, &[length, ("Content-Encoding", "identity")]),
            Ok(512)
        );
        for headers in [
            &[][..],
            &[length, length],
            &[("Content-Length", "")],
            &[("Content-Length", "-1")],
            &[("Content-Length", "+1")],
            &[("Content-Length", "4294967296")],
            &[("Content-Length", "1, 1")],
            &[length, ("Transfer-Encoding", "chunked")],
            &[length, ("Content-Encoding", "gzip")],
        ] {
            assert_eq!(head(200, headers), Err(Rejection::NoLength), "{headers:?}");
        }
    }

    #[test]
    fn redirects_and_errors_are_named() {
        let length = ("Content-Length", "512");
        for status in [300, 301, 302, 304, 307, 308] {
            assert_eq!(head(status, &[length]), Err(Rejection::Redirect(status)));
        }
        for status in [100, 204, 206, 400, 404, 500, 999] {
            assert_eq!(head(status, &[length]), Err(Rejection::Status(status)));
        }
    }

    #[test]
    fn a_download_has_its_time_and_its_length() {
        let at = Micros::from_secs;
        let mut download = Download::begin(at(50), at(25)).of(1000);
        assert_eq!(download.patience(at(50)), Ok(SILENCE));
        assert_eq!(download.take(600), Ok(()));
        assert_eq!((download.missing(), download.percent()), (400, 60));
        assert_eq!(download.patience(at(70)), Ok(at(5)));
        assert_eq!(download.timed_out(at(70)), Rejection::Silent);
        assert_eq!(download.patience(at(75)), Err(Rejection::Slow(at(25))));
        assert_eq!(download.timed_out(at(75)), Rejection::Slow(at(25)));
        let truncated = Rejection::Truncated {
            received: 600,
            expected: 1000,
        };
        assert_eq!(download.take(0), Err(truncated));
        assert_eq!(download.take(400), Ok(()));
        assert_eq!((download.missing(), download.percent()), (0, 100));
    }
}
