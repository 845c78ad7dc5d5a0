//! The head of a request becomes a typed value here, once: what is asked for, by whom, with how long a
//! body. Nothing downstream sees headers.

use super::access::{self, Asker};
use super::failure::{Failure, Status};
use super::query::Query;
use crate::services::portal;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use protocol_core::settings::{AllowedOrigin, MachineName};

/// Most headers of a request; more are refused.
pub const MAX_HEADERS: usize = 32;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    Page,
    /// G-code over a WebSocket.
    Gcode,
    Machine,
    State,
    Live,
    Begin,
    Proceed,
    Pause,
    Resume,
    Stop,
    Drawing,
    Jog,
    Move,
    Home,
    Calibrate,
    ClearCalibration,
    Settings,
    ChangeSettings,
    Networks,
    AddNetwork,
    ForgetNetwork,
    Update,
    /// What a browser asks before it lets a page from elsewhere ask.
    Preflight,
}

/// Method, path, and what that is.
const ROUTES: [(&str, &str, What); 22] = [
    ("GET", "/", What::Page),
    ("GET", "/index.html", What::Page),
    ("GET", "/api", What::Machine),
    ("GET", "/api/state", What::State),
    ("GET", "/api/live", What::Live),
    ("POST", "/api/job", What::Begin),
    ("POST", "/api/job/more", What::Proceed),
    ("POST", "/api/job/pause", What::Pause),
    ("POST", "/api/job/resume", What::Resume),
    ("POST", "/api/job/stop", What::Stop),
    ("GET", "/api/job/drawing", What::Drawing),
    ("POST", "/api/jog", What::Jog),
    ("POST", "/api/move", What::Move),
    ("POST", "/api/home", What::Home),
    ("POST", "/api/calibration", What::Calibrate),
    ("DELETE", "/api/calibration", What::ClearCalibration),
    ("GET", "/api/settings", What::Settings),
    ("PATCH", "/api/settings", What::ChangeSettings),
    ("GET", "/api/networks", What::Networks),
    ("POST", "/api/networks", What::AddNetwork),
    ("POST", "/api/networks/forget", What::ForgetNetwork),
    ("POST", "/api/update", What::Update),
];

/// Base64 of a SHA-1, as a WebSocket is accepted with.
pub type Accept = [u8; 28];

/// A request without its body.
#[derive(Clone, Debug)]
pub struct Request {
    pub what: What,
    /// The answer is to have no body.
    pub head_only: bool,
    /// Bytes of its body.
    pub length: usize,
    /// How a WebSocket that is asked for is accepted.
    pub accept: Option<Accept>,
    /// The page that the client has already, by its tag, is this one.
    pub has_page: bool,
    pub query: Query,
    /// A page from elsewhere asks, and may.
    pub from_elsewhere: bool,
}

/// What a request is answered with instead of being served.
#[derive(Clone, Debug)]
pub enum Refused {
    /// Go there.
    Redirect(&'static str),
    /// No.
    Failure(Failure),
}

impl From<Failure> for Refused {
    fn from(failure: Failure) -> Self {
        Self::Failure(failure)
    }
}

/// What the machine knows about who may ask.
#[derive(Clone, Debug)]
pub struct Owner<'a> {
    pub name: &'a MachineName,
    /// The name under which it is found, where that is another one.
    pub found_as: Option<&'a str>,
    pub allowed: &'a AllowedOrigin,
    /// On its own network.
    pub setup: bool,
    /// The tag of the page.
    pub page_tag: &'a str,
}

impl Request {
    /// Reads a whole head.
    pub fn read(head: &[u8], owner: &Owner<'_>) -> Result<Self, Refused> {
        let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
        let mut parsed = httparse::Request::new(&mut headers);
        match parsed.parse(head) {
            Ok(httparse::Status::Complete(_)) => {}
            Err(httparse::Error::TooManyHeaders) => return Err(too_large().into()),
            _ => return Err(Failure::bad_request("this is not HTTP/1.1").into()),
        }
        let (Some(method), Some(target)) = (parsed.method, parsed.path) else {
            return Err(Failure::bad_request("this is not HTTP/1.1").into());
        };
        let headers = Headers(parsed.headers);
        let (path, query) = target.split_once('?').unwrap_or((target, ""));

        let asker = Asker {
            host: headers.once("host")?,
            origin: headers.once("origin")?,
        };
        if let Some(url) = portal::redirect(owner.setup, asker.host, path) {
            return Err(Refused::Redirect(url));
        }
        let from_elsewhere = access::check(&asker, owner)?;
        let length = length(&headers)?;
        let accept = accept(&headers)?;
        let what = route(method, path, accept.is_some())?;
        if what == What::Live && accept.is_none() {
            let message = format_args!("there is only a WebSocket here");
            return Err(Failure::new(Status::UPGRADE_REQUIRED, "websocket_only", message).into());
        }
        Ok(Self {
            what,
            head_only: method == "HEAD",
            length,
            accept,
            has_page: headers
                .once("if-none-match")?
                .is_some_and(|tags| tags.contains(owner.page_tag)),
            query: match what {
                What::Begin | What::Proceed => Query::read(query)?,
                _ => Query::default(),
            },
            from_elsewhere,
        })
    }
}

/// More headers than are read.
pub fn too_large() -> Failure {
    let message = format_args!(
        "request line and headers may have {} bytes and {MAX_HEADERS} headers",
        super::MAX_HEAD
    );
    Failure::new(Status::HEAD_TOO_LARGE, "too_large", message)
}

struct Headers<'a>(&'a [httparse::Header<'a>]);

impl<'a> Headers<'a> {
    /// The value of a header that may come once, where it is text.
    fn once(&self, name: &str) -> Result<Option<&'a str>, Failure> {
        let named = |header: &&httparse::Header<'a>| header.name.eq_ignore_ascii_case(name);
        let mut found = self.0.iter().filter(named);
        let Some(header) = found.next() else {
            return Ok(None);
        };
        if found.next().is_some() {
            return Err(Failure::bad_request(
                "a header that may come once comes twice",
            ));
        }
        match core::str::from_utf8(header.value) {
            Ok(value) => Ok(Some(value.trim())),
            Err(_) => Err(Failure::bad_request("a header is not text")),
        }
    }

    /// Whether a list, as in `Connection: keep-alive, Upgrade`, has this in it.
    fn lists(&self, name: &str, wanted: &str) -> bool {
        let named = |header: &&httparse::Header<'a>| header.name.eq_ignore_ascii_case(name);
        self.0.iter().filter(named).any(|header| {
            header
                .value
                .split(|byte| *byte == b',')
                .any(|item| item.trim_ascii().eq_ignore_ascii_case(wanted.as_bytes()))
        })
    }
}

fn length(headers: &Headers<'_>) -> Result<usize, Failure> {
    if headers.once("transfer-encoding")?.is_some() {
        let message = format_args!("a body needs its Content-Length");
        return Err(Failure::new(
            Status::LENGTH_REQUIRED,
            "length_required",
            message,
        ));
    }
    let Some(length) = headers.once("content-length")? else {
        return Ok(0);
    };
    let digits = !length.is_empty() && length.bytes().all(|byte| byte.is_ascii_digit());
    match length.parse::<u32>() {
        Ok(length) if digits => Ok(length as usize),
        _ if digits => Err(Failure::too_large(u32::MAX as usize)),
        _ => Err(Failure::bad_request("Content-Length is no number")),
    }
}

/// How a WebSocket is accepted, if one is asked for (RFC 6455, section 4.2).
fn accept(headers: &Headers<'_>) -> Result<Option<Accept>, Failure> {
    if !headers.lists("upgrade", "websocket") || !headers.lists("connection", "upgrade") {
        return Ok(None);
    }
    if headers.once("sec-websocket-version")? != Some("13") {
        return Err(Failure::bad_request("Sec-WebSocket-Version is not 13"));
    }
    let Some(key) = headers.once("sec-websocket-key")? else {
        return Err(Failure::bad_request("Sec-WebSocket-Key is missing"));
    };
    let mut hash = sha1_smol::Sha1::new();
    hash.update(key.as_bytes());
    hash.update(b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11");
    let mut accept = [0; 28];
    // 20 bytes are 28 characters.
    let _ = STANDARD.encode_slice(hash.digest().bytes(), &mut accept);
    Ok(Some(accept))
}

fn route(method: &str, path: &str, web_socket: bool) -> Result<What, Failure> {
    let mut here = ROUTES
        .iter()
        .filter(|(_, known, _)| *known == path)
        .peekable();
    if here.peek().is_none() {
        let message = format_args!("there is nothing at this path");
        return Err(Failure::new(Status::NOT_FOUND, "not_found", message));
    }
    if method == "OPTIONS" {
        return Ok(What::Preflight);
    }
    let method = if method == "HEAD" { "GET" } else { method };
    match here.find(|(known, ..)| *known == method) {
        Some((_, "/", _)) if web_socket => Ok(What::Gcode),
        Some((.., what)) => Ok(*what),
        None => {
            let message = format_args!("this path has no such method");
            Err(Failure::new(Status::BAD_METHOD, "bad_method", message))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::format;
    use std::string::String;

    fn read(head: &str) -> Result<Request, Refused> {
        let owner = Owner {
            name: &MachineName::default(),
            found_as: None,
            allowed: &AllowedOrigin::None,
            setup: false,
            page_tag: "\"tag\"",
        };
        Request::read(head.as_bytes(), &owner)
    }

    fn failure(head: &str) -> (u16, &'static str) {
        match read(head) {
            Err(Refused::Failure(failure)) => (failure.status.0, failure.error),
            other => panic!("{head:?}: {other:?}"),
        }
    }

    const HOST: &str = "Host: line-us.local\r\n";

    #[test]
    fn what_is_asked_for() {
        for (method, path, what) in ROUTES {
            if what == What::Live {
                continue;
            }
            let request = read(&format!("{method} {path} HTTP/1.1\r\n{HOST}\r\n")).unwrap();
            assert_eq!((request.what, request.length), (what, 0), "{method} {path}");
        }
        let head = read(&format!("HEAD /?x=1 HTTP/1.1\r\n{HOST}\r\n")).unwrap();
        assert!(head.head_only && head.what == What::Page);
        let before = read(&format!("OPTIONS /api/job HTTP/1.1\r\n{HOST}\r\n")).unwrap();
        assert_eq!(before.what, What::Preflight);
    }

    #[test]
    fn a_websocket_is_accepted_as_in_the_rfc() {
        let upgrade = "Upgrade: WebSocket\r\nConnection: keep-alive, Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
        let request = read(&format!("GET / HTTP/1.1\r\n{HOST}{upgrade}\r\n")).unwrap();
        assert_eq!(request.what, What::Gcode);
        assert_eq!(&request.accept.unwrap(), b"s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
        let live = read(&format!("GET /api/live HTTP/1.1\r\n{HOST}{upgrade}\r\n")).unwrap();
        assert_eq!(live.what, What::Live);
        let plain = failure(&format!("GET /api/live HTTP/1.1\r\n{HOST}\r\n"));
        assert_eq!(plain, (426, "websocket_only"));
        let old = upgrade.replace("13", "8");
        let old = failure(&format!("GET / HTTP/1.1\r\n{HOST}{old}\r\n"));
        assert_eq!(old, (400, "bad_request"));
    }

    #[test]
    fn lengths_are_numbers() {
        let post = |length: &str| format!("POST /api/jog HTTP/1.1\r\n{HOST}{length}\r\n");
        let length = |text: &str| read(&post(text)).unwrap().length;
        assert_eq!(length("Content-Length: 17\r\n"), 17);
        assert_eq!(length(""), 0);
        for (header, answer) in [
            ("Content-Length: -1\r\n", (400, "bad_request")),
            ("Content-Length: +1\r\n", (400, "bad_request")),
            ("Content-Length: 1e3\r\n", (400, "bad_request")),
            ("Content-Length:\r\n", (400, "bad_request")),
            (
                "Content-Length: 1\r\nContent-Length: 1\r\n",
                (400, "bad_request"),
            ),
            (
                "Content-Length: 99999999999999999999\r\n",
                (413, "too_large"),
            ),
            ("Transfer-Encoding: chunked\r\n", (411, "length_required")),
            (
                "Content-Length: 3\r\nTransfer-Encoding: chunked\r\n",
                (411, "length_required"),
            ),
        ] {
            assert_eq!(failure(&post(header)), answer, "{header}");
        }
    }

    #[test]
    fn heads_that_are_none() {
        for (head, answer) in [
            ("\r\n\r\n", (400, "bad_request")),
            ("GET\r\n\r\n", (400, "bad_request")),
            ("GET / HTTP/2.0\r\n\r\n", (400, "bad_request")),
            ("GET / HTTP/1.1\r\nno colon\r\n\r\n", (400, "bad_request")),
            (
                "GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
                (400, "bad_request"),
            ),
            (
                "GET /nothing HTTP/1.1\r\nHost: 10.0.0.1\r\n\r\n",
                (404, "not_found"),
            ),
            (
                "PUT /api/job HTTP/1.1\r\nHost: 10.0.0.1\r\n\r\n",
                (405, "bad_method"),
            ),
            (
                "POST /api/job?size=1 HTTP/1.1\r\nHost: 10.0.0.1\r\n\r\n",
                (400, "bad_value"),
            ),
        ] {
            assert_eq!(failure(head), answer, "{head:?}");
        }
        let many: String = (0..33).map(|number| format!("A{number}: b\r\n")).collect();
        let many = failure(&format!("GET / HTTP/1.1\r\n{many}\r\n"));
        assert_eq!(many, (431, "too_large"));
    }

    #[test]
    fn a_page_that_is_there_already() {
        let has = |tags: &str| {
            read(&format!("GET / HTTP/1.1\r\n{HOST}{tags}\r\n"))
                .unwrap()
                .has_page
        };
        assert!(has("If-None-Match: \"other\", W/\"tag\"\r\n"));
        assert!(!has("If-None-Match: \"other\"\r\n") && !has(""));
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(head: Vec<u8>) {
            let owner = Owner {
                name: &MachineName::default(),
                found_as: None,
                allowed: &AllowedOrigin::None,
                setup: false,
                page_tag: "\"tag\"",
            };
            let _ = Request::read(&head, &owner);
        }

        #[test]
        fn any_headers_are_read_or_refused(method in "[A-Z]{1,7}", path in "/[ -~]{0,40}", headers in "([A-Za-z-]{1,20}: [ -~]{0,30}\r\n){0,6}") {
            let _ = read(&format!("{method} {path} HTTP/1.1\r\n{headers}\r\n"));
        }
    }
}
