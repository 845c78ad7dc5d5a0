//! The machine's records: which name says what, and for how long it may be remembered.

use core::net::Ipv4Addr;
use core::ops::{BitAnd, BitOr, BitOrAssign, Not};
use edge_mdns::NameSlice;
use edge_mdns::domain::base::iana::Rtype;
use heapless::{String, Vec};
use protocol_core::settings::MAX_NAME;

/// Longest name of the host, in bytes: the machine's, and a number behind it.
pub const MAX_HOST: usize = MAX_NAME + "-9999".len();
/// Services that are announced at most.
const MAX_SERVICES: usize = 2;
/// Records of one service.
const OF_A_SERVICE: usize = 4;
/// Records that there are at most.
pub const RECORDS: usize = 2 + MAX_SERVICES * OF_A_SERVICE;
/// Longest data of a record: the name of a service's instance.
pub const MAX_DATA: usize = 64;

/// How long records that contain the host's name or address are remembered, in seconds (RFC 6762,
/// section 10).
const TTL_HOST: u32 = 120;
/// The same for the other records, and the section's reason: they hold when the host has moved.
const TTL_OTHER: u32 = 75 * 60;

/// Where the services are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ports {
    /// G-code over TCP: `_lineus._tcp`.
    pub line_us: u16,
    /// The page: `_http._tcp`; `None` where there is none.
    pub web: Option<u16>,
}

/// A set of records, by their numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Set(u16);

impl Set {
    /// No record.
    pub const NONE: Self = Self(0);
    /// Every record.
    pub const ALL: Self = Self((1 << RECORDS) - 1);

    /// The set of one record.
    pub const fn of(number: usize) -> Self {
        Self(1 << number)
    }

    /// Whether the record is in it.
    pub const fn has(self, number: usize) -> bool {
        self.0 & 1 << number != 0
    }

    /// Whether nothing is in it.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The numbers in it.
    pub fn iter(self) -> impl Iterator<Item = usize> {
        (0..RECORDS).filter(move |number| self.has(*number))
    }
}

impl BitOr for Set {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Set {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl BitAnd for Set {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl Not for Set {
    type Output = Self;
    fn not(self) -> Self {
        Self(!self.0 & Self::ALL.0)
    }
}

/// Number of the host's address.
const ADDRESS: usize = 0;
/// Number of the record that says that the host has no other address, so that nobody waits for one of IPv6
/// (RFC 6762, section 6.1).
const NOTHING_ELSE: usize = 1;

/// What the machine says about itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Records {
    /// The host's name without `.local`, and that of its services' instances.
    pub host: String<MAX_HOST>,
    /// Its address.
    pub address: Ipv4Addr,
    /// Its services.
    pub ports: Ports,
}

/// One record.
pub struct Record<'a> {
    labels: Vec<&'a str, 4>,
    /// Its type.
    pub rtype: Rtype,
    /// How long it may be remembered, in seconds.
    pub ttl: u32,
    /// Its data, as on the wire and without compression.
    pub data: Vec<u8, MAX_DATA>,
}

impl Record<'_> {
    /// Whose record it is.
    pub fn owner(&self) -> NameSlice<'_> {
        NameSlice::new(&self.labels)
    }

    /// Whether nobody else has a record of this name and type. What kinds of services there are, and which
    /// instances, others say as well.
    pub fn is_unique(&self) -> bool {
        self.rtype != Rtype::PTR
    }
}

impl Records {
    /// The record of this number, if there is one.
    pub fn get(&self, number: usize) -> Option<Record<'_>> {
        let host = [self.host.as_str(), "local"];
        match number {
            ADDRESS => {
                let address = data(&[&self.address.octets()]);
                record(&host, Rtype::A, TTL_HOST, address)
            }
            NOTHING_ELSE => {
                // The next name is its own, and of the first eight types it has one: A, which is 1.
                let only_an_address = data(&[&wire(&host), &[0, 1, 0x40]]);
                record(&host, Rtype::NSEC, TTL_HOST, only_an_address)
            }
            _ => {
                let number = number - NOTHING_ELSE - 1;
                let (kind, port) = self.service(number / OF_A_SERVICE)?;
                let service = [kind, "_tcp", "local"];
                let instance = [self.host.as_str(), kind, "_tcp", "local"];
                match number % OF_A_SERVICE {
                    0 => record(&service, Rtype::PTR, TTL_OTHER, wire(&instance)),
                    1 => {
                        // Priority and weight are 0: there is one such host.
                        let place = data(&[&[0; 4], &port.to_be_bytes(), &wire(&host)]);
                        record(&instance, Rtype::SRV, TTL_HOST, place)
                    }
                    // There has to be one, and it says nothing (RFC 6763, section 6.1).
                    2 => record(&instance, Rtype::TXT, TTL_OTHER, data(&[&[0]])),
                    // What kinds of services there are (RFC 6763, section 9).
                    _ => {
                        let kinds = ["_services", "_dns-sd", "_udp", "local"];
                        record(&kinds, Rtype::PTR, TTL_OTHER, wire(&service))
                    }
                }
            }
        }
    }

    fn service(&self, number: usize) -> Option<(&'static str, u16)> {
        match number {
            0 => Some(("_lineus", self.ports.line_us)),
            1 => self.ports.web.map(|port| ("_http", port)),
            _ => None,
        }
    }

    /// All records, with their numbers.
    pub fn iter(&self) -> impl Iterator<Item = (usize, Record<'_>)> {
        (0..RECORDS).filter_map(|number| Some((number, self.get(number)?)))
    }

    /// Records that are sent along, because whoever asked for `asked` will want them next (RFC 6763,
    /// section 12).
    pub fn that_go_with(&self, asked: Set) -> Set {
        let mut more = Set::NONE;
        for number in asked.iter() {
            if number == ADDRESS {
                more |= Set::of(NOTHING_ELSE);
                continue;
            }
            let Some(place) = number.checked_sub(NOTHING_ELSE + 1) else {
                continue;
            };
            let host = Set::of(ADDRESS) | Set::of(NOTHING_ELSE);
            match place % OF_A_SERVICE {
                0 => more |= host | Set::of(number + 1) | Set::of(number + 2),
                1 => more |= host,
                _ => {}
            }
        }
        more & !asked
    }

    /// What this machine alone says under its name. What kinds of services there are, others say as well.
    pub fn of_its_name(&self) -> Set {
        let mut its = Set::NONE;
        for (number, _) in self.iter() {
            let service = number.checked_sub(NOTHING_ELSE + 1);
            let is_kind = service.is_some_and(|it| it % OF_A_SERVICE == OF_A_SERVICE - 1);
            if !is_kind {
                its |= Set::of(number);
            }
        }
        its
    }

    /// What is asked for with this name and type; of the host's other types it says that there are none.
    pub fn asked_for(&self, is_name: impl Fn(&NameSlice<'_>) -> bool, rtype: Rtype) -> Set {
        let mut asked = Set::NONE;
        for (number, record) in self.iter() {
            let fits = rtype == record.rtype || rtype == Rtype::ANY;
            let denied = number == NOTHING_ELSE && rtype != Rtype::A;
            if (fits || denied) && is_name(&record.owner()) {
                asked |= Set::of(number);
            }
        }
        asked
    }

    /// Records that nobody else may have, and that are shown when the names are claimed.
    pub fn claimed(&self) -> impl Iterator<Item = Record<'_>> {
        self.iter()
            .map(|(_, record)| record)
            .filter(|record| record.is_unique() && record.rtype != Rtype::NSEC)
    }
}

fn record<'a>(
    labels: &[&'a str],
    rtype: Rtype,
    ttl: u32,
    data: Vec<u8, MAX_DATA>,
) -> Option<Record<'a>> {
    Some(Record {
        labels: Vec::from_slice(labels).ok()?,
        rtype,
        ttl,
        data,
    })
}

/// All parts, one after the other; they fit, see [`MAX_DATA`].
fn data(parts: &[&[u8]]) -> Vec<u8, MAX_DATA> {
    let mut data = Vec::new();
    for part in parts {
        let _ = data.extend_from_slice(part);
    }
    data
}

/// A name on the wire, without compression (RFC 1035, section 3.1).
fn wire(labels: &[&str]) -> Vec<u8, MAX_DATA> {
    let mut name = Vec::new();
    for label in labels {
        // No label is longer than 63 bytes.
        let _ = name.push(label.len() as u8);
        let _ = name.extend_from_slice(label.as_bytes());
    }
    let _ = name.push(0);
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    fn longest() -> Records {
        Records {
            host: "a".repeat(MAX_HOST).as_str().try_into().unwrap(),
            address: Ipv4Addr::new(192, 168, 100, 200),
            ports: Ports {
                line_us: 1337,
                web: Some(80),
            },
        }
    }

    #[test]
    fn the_longest_name_fits_everywhere() {
        let records = longest();
        let lengths: Vec<usize, RECORDS> = records.iter().map(|(_, it)| it.data.len()).collect();
        // Host: 1 + 37, local: 1 + 5, end: 1. Service: 1 + 7, 1 + 4; or 1 + 5, 1 + 4.
        let host = 38 + 6 + 1;
        let (line_us, web) = (8 + 5 + 6 + 1, 6 + 5 + 6 + 1);
        assert_eq!(
            lengths,
            [
                4,
                host + 3,
                38 + line_us,
                6 + host,
                1,
                line_us,
                38 + web,
                6 + host,
                1,
                web
            ]
        );
    }

    #[test]
    fn without_a_page_there_is_one_service() {
        let mut records = longest();
        records.ports.web = None;
        assert_eq!(records.iter().count(), 6);
    }

    #[test]
    fn a_record_brings_what_is_asked_for_next() {
        let records = longest();
        let set = |numbers: &[usize]| {
            let sets = numbers.iter().map(|number| Set::of(*number));
            sets.fold(Set::NONE, BitOr::bitor)
        };
        // The address alone: that there is no other.
        assert_eq!(records.that_go_with(set(&[0])), set(&[1]));
        // An instance's name: where it is, its text, the address of the host.
        assert_eq!(records.that_go_with(set(&[2])), set(&[0, 1, 3, 4]));
        assert_eq!(records.that_go_with(set(&[6])), set(&[0, 1, 7, 8]));
        // Where it is: the address.
        assert_eq!(records.that_go_with(set(&[3])), set(&[0, 1]));
        assert_eq!(records.that_go_with(set(&[4, 5])), Set::NONE);
        assert_eq!(records.that_go_with(Set::ALL), Set::NONE);
    }
}
