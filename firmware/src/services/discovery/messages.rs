//! Messages of multicast DNS: what others ask and say, and what the machine does (RFC 6762, section 18).

use super::records::{MAX_DATA, Record, Records, Set};
use core::cmp::Ordering;
use edge_mdns::domain::base::iana::{Class, Opcode, Rcode, Rtype};
use edge_mdns::domain::base::message_builder::PushError;
use edge_mdns::domain::base::rdata::ComposeRecordData;
use edge_mdns::domain::base::record::ParsedRecord;
use edge_mdns::domain::base::{self, MessageBuilder, ParsedName, Question, ToName, Ttl};
use edge_mdns::domain::base::{UnknownRecordData, message::RecordSection};
use edge_mdns::domain::rdata::{Ptr, Srv};
use edge_mdns::{Buf, NameSlice, set_header};
use heapless::Vec;

/// Longest message that the machine takes: what fits a frame of Ethernet (RFC 6762, section 17).
pub const MAX_MESSAGE: usize = 1472;
/// Longest message that the machine sends. Everything there is to tell fits; what repeats many questions and
/// does not is not sent.
pub const MAX_SENT: usize = 1024;
/// Questions and records that are looked at in each part of a message; more are not.
pub const MAX_ENTRIES: usize = 32;
/// Records of one name that are compared when two machines claim it at once; more are not.
const MAX_CLAIMED: usize = 4;
/// The class Internet, with which all of these records are.
const INTERNET: u16 = 1;
/// Beside the class of a record: forget others of this name and type. Beside that of a question: answer me
/// alone, which the machine never does, since others on the same computer may share the port.
const FLAG: u16 = 1 << 15;
/// Longest time that a resolver that knows nothing of multicast may remember a record, in seconds (RFC 6762,
/// section 6.7).
const TTL_ONE_SHOT: u32 = 10;

/// A message that was received.
#[derive(Clone, Copy)]
pub struct Message<'a>(base::Message<&'a [u8]>);

/// What a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Somebody asks.
    Query,
    /// Somebody tells.
    Response,
}

type Entry<'a> = ParsedRecord<'a, &'a [u8]>;

impl<'a> Message<'a> {
    /// A message, and what it is; `None` if it is not one of these.
    pub fn read(bytes: &'a [u8]) -> Option<(Kind, Self)> {
        let message = base::Message::from_octets(bytes).ok()?;
        let header = message.header();
        let kind = match header.qr() {
            false => Kind::Query,
            true => Kind::Response,
        };
        let valid = header.opcode() == Opcode::QUERY && header.rcode() == Rcode::NOERROR;
        valid.then_some((kind, Self(message)))
    }

    /// The machine's records that are asked for and not known already.
    pub fn asked(&self, records: &Records) -> Set {
        let mut asked = Set::NONE;
        for question in self.0.question().take(MAX_ENTRIES) {
            let Ok(question) = question else {
                break;
            };
            if is_internet(question.qclass()) || question.qclass() == Class::ANY {
                asked |= records.asked_for(|name| question.qname().name_eq(name), question.qtype());
            }
        }
        for known in entries(self.0.answer().ok()) {
            for (number, record) in records.iter() {
                // Half of the time is still to come (RFC 6762, section 7.1).
                let fresh = known.ttl().as_secs() >= record.ttl / 2;
                if fresh && asked.has(number) && is_same(&known, &record) {
                    asked = asked & !Set::of(number);
                }
            }
        }
        asked
    }

    /// Whether somebody claims names with this query.
    pub fn is_claim(&self) -> bool {
        self.0.header_counts().nscount() > 0
    }

    /// Whether somebody says something else about a name that the machine alone may say: about any type of
    /// record of that name while the machine only claims it, and later about those that it has.
    pub fn contradicts(&self, records: &Records, claiming: bool) -> bool {
        let said = entries(self.0.answer().ok()).chain(entries(self.0.additional().ok()));
        said.filter(|said| is_internet(said.class()) && said.ttl().as_secs() > 0)
            .any(|said| {
                let mut others = records.iter().map(|(_, record)| record);
                let same_name = |record: &Record<'_>| said.owner().name_eq(&record.owner());
                let contradicted = others.any(|record| {
                    let rivals = claiming || said.rtype() == record.rtype;
                    record.is_unique() && rivals && same_name(&record)
                });
                contradicted && !records.iter().any(|(_, record)| is_same(&said, &record))
            })
    }

    /// Whether somebody who claims one of the machine's names at the same time goes first (RFC 6762,
    /// section 8.2).
    pub fn goes_first(&self, records: &Records) -> bool {
        records.claimed().any(|name| {
            let owner = name.owner();
            let mut ours = Vec::new();
            for record in records.claimed() {
                if record.owner().name_eq(&owner) {
                    insert(&mut ours, (record.rtype.to_int(), record.data));
                }
            }
            let mut theirs = Vec::new();
            for claimed in entries(self.0.authority().ok()) {
                if is_internet(claimed.class()) && claimed.owner().name_eq(&owner) {
                    let data = plain(&claimed).unwrap_or_default();
                    insert(&mut theirs, (claimed.rtype().to_int(), data));
                }
            }
            theirs.cmp(&ours) == Ordering::Greater
        })
    }
}

/// Type and data of a record that is claimed.
type Claimed = (u16, Vec<u8, MAX_DATA>);

/// Puts a record where it belongs in the order. (The library's sort would be 5 kB of a chip's flash, for these few.)
fn insert(sorted: &mut Vec<Claimed, MAX_CLAIMED>, new: Claimed) {
    let after = sorted.iter().position(|other| *other > new);
    // More than that are not compared.
    let _ = sorted.insert(after.unwrap_or(sorted.len()), new);
}

fn is_internet(class: Class) -> bool {
    class.to_int() & !FLAG == INTERNET
}

/// The records of a part of a message, up to the first that cannot be read.
fn entries<'a>(section: Option<RecordSection<'a, &'a [u8]>>) -> impl Iterator<Item = Entry<'a>> {
    let section = section.into_iter().flatten().take(MAX_ENTRIES);
    section.map_while(Result::ok)
}

fn is_same(said: &Entry<'_>, ours: &Record<'_>) -> bool {
    said.rtype() == ours.rtype
        && is_internet(said.class())
        && said.owner().name_eq(&ours.owner())
        && plain(said).is_some_and(|data| data == ours.data)
}

/// A record's data without compression; `None` if it cannot be read, or is longer than any of the machine's.
fn plain(record: &Entry<'_>) -> Option<Vec<u8, MAX_DATA>> {
    type Name<'a> = ParsedName<&'a [u8]>;
    let mut bytes = [0; MAX_DATA];
    let mut plain = Buf::new(&mut bytes);
    match record.rtype() {
        Rtype::PTR => {
            let pointer = record.to_record::<Ptr<Name<'_>>>().ok()??;
            pointer.data().compose_rdata(&mut plain).ok()?;
        }
        Rtype::SRV => {
            let place = record.to_record::<Srv<Name<'_>>>().ok()??;
            place.data().compose_rdata(&mut plain).ok()?;
        }
        _ => {
            let other = record.to_record::<UnknownRecordData<&[u8]>>().ok()??;
            other.data().compose_rdata(&mut plain).ok()?;
        }
    }
    Vec::from_slice(plain.as_ref()).ok()
}

/// Asks whether somebody has the machine's names, and says what it means to say about them.
pub fn claim(records: &Records, buffer: &mut [u8]) -> Option<usize> {
    let mut message = MessageBuilder::from_target(Buf::new(buffer)).ok()?;
    set_header(&mut message, 0, false);
    let mut questions = message.question();
    let names = records.claimed().filter(|it| it.rtype != Rtype::TXT);
    for name in names {
        let question = Question::new(name.owner(), Rtype::ANY, Class::IN);
        questions.push(question).ok()?;
    }
    let mut claims = questions.authority();
    for record in records.claimed() {
        // Without the flag: nobody is to forget anything yet.
        push(&record, record.ttl, Class::IN, |it| claims.push(it))?;
    }
    Some(claims.finish().as_ref().len())
}

/// How something is told.
#[derive(Clone, Copy)]
pub enum Manner<'a> {
    /// To everybody.
    Told,
    /// To everybody: it is no longer so.
    Withdrawn,
    /// To the one alone who has asked, and does not know multicast.
    OneShot(Message<'a>),
}

/// Tells records, and `more` that nobody asked for.
pub fn tell(
    records: &Records,
    answers: Set,
    more: Set,
    manner: Manner<'_>,
    buffer: &mut [u8],
) -> Option<usize> {
    let mut message = MessageBuilder::from_target(Buf::new(buffer)).ok()?;
    set_header(&mut message, 0, true);
    let mut questions = message.question();
    if let Manner::OneShot(Message(asked)) = manner {
        questions.header_mut().set_id(asked.header().id());
        for question in asked.question().take(MAX_ENTRIES) {
            questions.push(question.ok()?).ok()?;
        }
    }
    let shape = |record: &Record<'_>| match manner {
        Manner::OneShot(_) => (record.ttl.min(TTL_ONE_SHOT), Class::IN),
        Manner::Told if record.is_unique() => (record.ttl, Class::from_int(INTERNET | FLAG)),
        Manner::Told => (record.ttl, Class::IN),
        Manner::Withdrawn => (0, Class::IN),
    };
    let mut part = questions.answer();
    for record in answers.iter().filter_map(|number| records.get(number)) {
        let (ttl, class) = shape(&record);
        push(&record, ttl, class, |it| part.push(it))?;
    }
    let mut part = part.additional();
    for record in more.iter().filter_map(|number| records.get(number)) {
        let (ttl, class) = shape(&record);
        push(&record, ttl, class, |it| part.push(it))?;
    }
    Some(part.finish().as_ref().len())
}

type Written<'a> = base::Record<NameSlice<'a>, UnknownRecordData<&'a [u8]>>;

fn push(
    record: &Record<'_>,
    ttl: u32,
    class: Class,
    to: impl FnOnce(Written<'_>) -> Result<(), PushError>,
) -> Option<()> {
    let data = UnknownRecordData::from_octets(record.rtype, record.data.as_slice()).ok()?;
    to(base::Record::new(
        record.owner(),
        class,
        Ttl::from_secs(ttl),
        data,
    ))
    .ok()
}
