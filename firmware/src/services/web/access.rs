//! Who may ask: pages from elsewhere may not, unless the owner allows it.
//!
//! A browser tells two things that a page cannot change: `Origin`, whose page it is, and `Host`, under
//! which name the machine was found. `docs/api.md` tells why both are looked at.

use super::failure::{Failure, Status};
use super::request::{Owner, Refused};
use crate::services::portal;
use core::net::{Ipv4Addr, Ipv6Addr};
use protocol_core::settings::AllowedOrigin;

/// What may stand behind the machine's name: names that are nobody's on the Internet (RFC 6762, RFC 8375,
/// ICANN's reservation of `internal`, and what many routers call their network).
const DOMAINS: [&str; 4] = ["local", "lan", "home.arpa", "internal"];

/// What a request tells about who asks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asker<'a> {
    pub host: Option<&'a str>,
    pub origin: Option<&'a str>,
}

/// Whether who asks may; says whether it is a page from elsewhere.
pub fn check(asker: &Asker<'_>, owner: &Owner<'_>) -> Result<bool, Refused> {
    if let Some(host) = asker.host
        && !is_own(host, owner)
    {
        if owner.setup {
            return Err(Refused::Redirect(portal::URL));
        }
        let message = format_args!(
            "this machine is {}.local, not '{host:.64}'",
            owner.name.as_str()
        );
        return Err(Failure::new(Status::MISDIRECTED, "foreign_host", message).into());
    }
    let Some(origin) = asker.origin else {
        return Ok(false);
    };
    let own = origin
        .strip_prefix("http://")
        .zip(asker.host)
        .is_some_and(|(origin, host)| origin.eq_ignore_ascii_case(host));
    let allowed = match owner.allowed {
        AllowedOrigin::None => false,
        AllowedOrigin::Any => true,
        AllowedOrigin::Only(allowed) => allowed.as_str() == origin,
    };
    if own || allowed {
        return Ok(!own);
    }
    let message = format_args!("a page of '{origin:.64}' may not drive this machine");
    Err(Failure::new(Status::FORBIDDEN, "foreign_origin", message).into())
}

fn is_own(host: &str, owner: &Owner<'_>) -> bool {
    let allowed = match owner.allowed {
        AllowedOrigin::Only(origin) => origin.host().eq_ignore_ascii_case(host),
        _ => false,
    };
    let name = without_port(host);
    let found = owner.found_as.is_some_and(|found| is_name(name, found));
    allowed || is_address(host) || found || is_name(name, owner.name.as_str())
}

fn without_port(host: &str) -> &str {
    let end = host.rfind(':').unwrap_or(host.len());
    let name = host.get(..end).unwrap_or(host);
    name.strip_suffix('.').unwrap_or(name)
}

fn is_address(host: &str) -> bool {
    if let Some(rest) = host.strip_prefix('[') {
        return rest
            .split_once(']')
            .is_some_and(|(address, _)| address.parse::<Ipv6Addr>().is_ok());
    }
    without_port(host).parse::<Ipv4Addr>().is_ok()
}

fn is_name(name: &str, own: &str) -> bool {
    if name.eq_ignore_ascii_case("localhost") {
        return true;
    }
    let (first, domain) = name.split_once('.').unwrap_or((name, ""));
    let domain = domain.is_empty()
        || DOMAINS
            .iter()
            .any(|known| domain.eq_ignore_ascii_case(known));
    domain && first.eq_ignore_ascii_case(own)
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol_core::settings::{MachineName, Origin};

    fn outcome(host: &str, origin: &str, allowed: &str, setup: bool) -> Result<bool, u16> {
        let owner = Owner {
            name: &MachineName::default(),
            allowed: &AllowedOrigin::new(allowed).unwrap(),
            found_as: Some("line-us-2"),
            setup,
            page_tag: "",
        };
        let some = |text: &'static str| (!text.is_empty()).then_some(text);
        let (host, origin): (&'static str, &'static str) = (
            std::boxed::Box::leak(host.into()),
            std::boxed::Box::leak(origin.into()),
        );
        let asker = Asker {
            host: some(host),
            origin: some(origin),
        };
        check(&asker, &owner).map_err(|refused| match refused {
            Refused::Redirect(_) => 302,
            Refused::Failure(failure) => failure.status.0,
        })
    }

    #[test]
    fn hosts_that_are_the_machine() {
        for host in [
            "",
            "192.168.1.20",
            "127.0.0.1:8080",
            "[::1]:8080",
            "[fe80::1]",
            "localhost:8080",
            "line-us.local",
            "Line-Us.LOCAL:80",
            "line-us.local.",
            "line-us",
            "line-us-2.local:80",
            "line-us.home.arpa",
        ] {
            assert_eq!(outcome(host, "", "", false), Ok(false), "{host}");
            assert_eq!(outcome(host, "", "", true), Ok(false), "{host}");
        }
    }

    #[test]
    fn hosts_that_are_not() {
        for host in [
            "example.org",
            "line-us.example.org",
            "line-us.local.example.org",
            "other.local",
            "192.168.1.20.example.org",
            "1.2.3",
            "[example]",
            "a b",
            ":80",
        ] {
            assert_eq!(outcome(host, "", "", false), Err(421), "{host}");
            assert_eq!(outcome(host, "", "*", false), Err(421), "{host}");
            assert_eq!(outcome(host, "", "", true), Err(302), "{host}");
        }
    }

    #[test]
    fn pages_from_elsewhere_may_not_unless_they_are_allowed() {
        let there = "https://example.org";
        for (host, origin, allowed, expected) in [
            ("line-us.local", "http://line-us.local", "", Ok(false)),
            ("127.0.0.1:8080", "http://127.0.0.1:8080", "", Ok(false)),
            ("127.0.0.1:8080", "http://127.0.0.1:8081", "", Err(403)),
            ("127.0.0.1", "https://127.0.0.1", "", Err(403)),
            ("line-us.local", there, "", Err(403)),
            ("line-us.local", "null", "", Err(403)),
            ("", "http://", "", Err(403)),
            ("line-us.local", there, there, Ok(true)),
            ("line-us.local", "https://example.com", there, Err(403)),
            ("line-us.local", "https://example.org.evil", there, Err(403)),
            ("line-us.local", "null", "*", Ok(true)),
            ("example.org", there, there, Ok(true)),
        ] {
            assert_eq!(
                outcome(host, origin, allowed, false),
                expected,
                "{host} {origin} {allowed}"
            );
        }
        assert!(Origin::new(there).is_some());
    }
}
