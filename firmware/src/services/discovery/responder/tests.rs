//! Machines on a network of the test's own, in virtual time. Messages are written by hand and read with
//! domain.

use super::super::messages::{MAX_MESSAGE, MAX_SENT};
use super::*;
use edge_mdns::domain::base::{Message as Read, ParsedName};
use edge_mdns::domain::rdata::AllRecordData;
use proptest::prelude::*;
use std::string::String;

const A: u16 = 1;
const PTR: u16 = 12;
const TXT: u16 = 16;
const AAAA: u16 = 28;
const SRV: u16 = 33;
const ANY: u16 = 255;

const PORTS: Ports = Ports {
    line_us: 1337,
    web: Some(80),
};

fn ms(millis: u64) -> Micros {
    Micros::new(millis * 1_000)
}

fn name(text: &str) -> MachineName {
    MachineName::new(text).unwrap()
}

fn place(last: u8) -> Option<Place> {
    Some(Place {
        connection: 1,
        address: Ipv4Addr::new(10, 0, 0, last),
    })
}

/// Machines that hear each other, and themselves.
struct Network {
    now: Micros,
    machines: Vec<Responder>,
    /// When, who, what.
    said: Vec<(Micros, usize, Vec<u8>)>,
}

impl Network {
    fn new() -> Self {
        Self {
            now: ms(1_000),
            machines: Vec::new(),
            said: Vec::new(),
        }
    }

    /// One machine that is called line-us and has told everything.
    fn settled() -> Self {
        let mut network = Self::new();
        network.add("line-us", 1);
        network.run(ms(6_000));
        assert_eq!(network.hosts(), ["line-us"]);
        network.said.clear();
        network
    }

    fn add(&mut self, called: &str, last: u8) {
        let mut machine = Responder::new(PORTS, u32::from(last) * 77_777);
        machine.set(&name(called), place(last), self.now);
        self.machines.push(machine);
    }

    fn run(&mut self, time: Micros) {
        let end = self.now + time;
        let mut buffer = [0; MAX_SENT];
        loop {
            while let Some((who, length)) = (0..self.machines.len()).find_map(|who| {
                let length = self.machines[who].say(self.now, &mut buffer)?;
                Some((who, length))
            }) {
                let message = buffer[..length].to_vec();
                self.hear(&message);
                self.said.push((self.now, who, message));
            }
            let next = self.machines.iter().filter_map(Responder::next).min();
            match next.filter(|next| *next <= end) {
                // Nobody says what is not due.
                Some(next) => self.now = next.max(self.now + Micros::new(1)),
                None => break,
            }
        }
        self.now = end;
    }

    /// Somebody says something to everybody.
    fn hear(&mut self, message: &[u8]) {
        for machine in &mut self.machines {
            let answer = machine.take(message, false, self.now, &mut [0; MAX_SENT]);
            assert_eq!(answer, None, "answers go to everybody");
        }
    }

    /// The names that machines have, without `.local`.
    fn hosts(&self) -> Vec<&str> {
        let hosts = self.machines.iter();
        hosts.map(|machine| machine.host().unwrap_or("")).collect()
    }

    /// What has been said since the last time, in words.
    fn heard(&mut self) -> Vec<String> {
        let said = std::mem::take(&mut self.said);
        said.iter().flat_map(|(_, _, it)| words(it)).collect()
    }

    fn times(&self, start: Micros) -> Vec<u64> {
        let times = self.said.iter();
        times
            .map(|(time, ..)| (*time - start).get() / 1_000)
            .collect()
    }
}

/// A message in words: questions, answers, claims and what goes with them.
fn words(message: &[u8]) -> Vec<String> {
    type Name<'a> = ParsedName<&'a [u8]>;
    let message = Read::from_octets(message).unwrap();
    let mut words = Vec::new();
    for question in message.question() {
        let question = question.unwrap();
        words.push(format!("{}? {}", question.qname(), question.qtype()));
    }
    let sections = [
        ("", message.answer()),
        ("claim ", message.authority()),
        ("and ", message.additional()),
    ];
    for (part, section) in sections {
        for record in section.unwrap() {
            let record = record.unwrap();
            let only = match record.class().to_int() {
                0x8001 => "only ",
                1 => "",
                other => panic!("class {other}"),
            };
            let record = record
                .into_record::<AllRecordData<_, Name<'_>>>()
                .unwrap()
                .unwrap();
            let (ttl, kind) = (record.ttl().as_secs(), record.rtype());
            words.push(format!(
                "{part}{only}{} {kind} {} {ttl} s",
                record.owner(),
                record.data()
            ));
        }
    }
    words
}

fn push_name(message: &mut Vec<u8>, name: &str) {
    for label in name.split('.') {
        message.push(u8::try_from(label.len()).unwrap());
        message.extend(label.as_bytes());
    }
    message.push(0);
}

fn wire(name: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    push_name(&mut bytes, name);
    bytes
}

/// A record: name, type, seconds, data.
type Entry<'a> = (&'a str, u16, u32, &'a [u8]);

fn message(
    flags: u8,
    questions: &[(&str, u16)],
    answers: &[Entry<'_>],
    claims: &[Entry<'_>],
) -> Vec<u8> {
    let count = |n: usize| u8::try_from(n).unwrap();
    let mut message = vec![0, 0, flags, 0, 0, count(questions.len())];
    message.extend([0, count(answers.len()), 0, count(claims.len()), 0, 0]);
    for (name, kind) in questions {
        push_name(&mut message, name);
        message.extend(kind.to_be_bytes());
        message.extend([0, 1]);
    }
    for (name, kind, ttl, data) in answers.iter().chain(claims) {
        push_name(&mut message, name);
        message.extend(kind.to_be_bytes());
        message.extend([0x80, 1]);
        message.extend(ttl.to_be_bytes());
        message.extend([0, count(data.len())]);
        message.extend(*data);
    }
    message
}

fn query(questions: &[(&str, u16)]) -> Vec<u8> {
    message(0, questions, &[], &[])
}

fn response(answers: &[Entry<'_>]) -> Vec<u8> {
    message(0x84, &[], answers, &[])
}

const EVERYTHING: [&str; 10] = [
    "only line-us.local A 10.0.0.1 120 s",
    "only line-us.local NSEC line-us.local. A 120 s",
    "_lineus._tcp.local PTR line-us._lineus._tcp.local. 4500 s",
    "only line-us._lineus._tcp.local SRV 0 0 1337 line-us.local 120 s",
    "only line-us._lineus._tcp.local TXT \"\" 4500 s",
    "_services._dns-sd._udp.local PTR _lineus._tcp.local. 4500 s",
    "_http._tcp.local PTR line-us._http._tcp.local. 4500 s",
    "only line-us._http._tcp.local SRV 0 0 80 line-us.local 120 s",
    "only line-us._http._tcp.local TXT \"\" 4500 s",
    "_services._dns-sd._udp.local PTR _http._tcp.local. 4500 s",
];

#[test]
fn a_machine_claims_its_names_and_then_tells_what_it_has() {
    let mut network = Network::new();
    let start = network.now;
    network.add("line-us", 1);
    network.run(ms(749));
    assert_eq!(network.hosts(), [""], "before it has claimed three times");
    network.run(ms(20_000));
    let times = network.times(start);
    let first = times[0];
    assert!(first < 250, "{times:?}");
    let after: Vec<_> = times.iter().map(|time| time - first).collect();
    assert_eq!(after, [0, 250, 500, 750, 1_750, 3_750]);
    let claim = [
        "line-us.local? ANY",
        "line-us._lineus._tcp.local? ANY",
        "line-us._http._tcp.local? ANY",
        "claim line-us.local A 10.0.0.1 120 s",
        "claim line-us._lineus._tcp.local SRV 0 0 1337 line-us.local 120 s",
        "claim line-us._lineus._tcp.local TXT \"\" 4500 s",
        "claim line-us._http._tcp.local SRV 0 0 80 line-us.local 120 s",
        "claim line-us._http._tcp.local TXT \"\" 4500 s",
    ];
    for (_, _, message) in &network.said[..3] {
        assert_eq!(words(message), claim);
    }
    for (_, _, message) in &network.said[3..] {
        assert_eq!(words(message), EVERYTHING);
        assert_eq!(message[2..4], [0x84, 0], "an answer, from who knows");
    }
    assert_eq!(network.hosts(), ["line-us"]);
}

#[test]
fn questions_and_their_answers() {
    let address = &EVERYTHING[0..2];
    let and = |record: &str| format!("and {record}");
    let with_address = |record: &str| {
        let rest = address.iter().map(|record| and(record));
        std::iter::once(record.to_string()).chain(rest).collect()
    };
    let of_a_service = |number: usize| -> Vec<String> {
        let mut records: Vec<String> = with_address(EVERYTHING[number]);
        records.extend([and(EVERYTHING[number + 1]), and(EVERYTHING[number + 2])]);
        records
    };
    let texts = |records: &[&str]| records.iter().map(ToString::to_string).collect();
    let cases: [(&str, u16, Vec<String>); 13] = [
        ("line-us.local", A, vec![address[0].into(), and(address[1])]),
        ("LINE-US.Local", A, vec![address[0].into(), and(address[1])]),
        // Nobody waits for an address that there is not.
        ("line-us.local", AAAA, texts(&address[1..])),
        ("line-us.local", ANY, texts(address)),
        ("_lineus._tcp.local", PTR, of_a_service(2)),
        ("_http._tcp.local", PTR, of_a_service(6)),
        (
            "line-us._lineus._tcp.local",
            SRV,
            with_address(EVERYTHING[3]),
        ),
        ("line-us._lineus._tcp.local", TXT, texts(&EVERYTHING[4..5])),
        (
            "_services._dns-sd._udp.local",
            PTR,
            texts(&[EVERYTHING[5], EVERYTHING[9]]),
        ),
        ("line-us-2.local", A, vec![]),
        ("_printer._tcp.local", PTR, vec![]),
        ("local", ANY, vec![]),
        ("_lineus._tcp.local", A, vec![]),
    ];
    for (name, kind, answers) in cases {
        let mut network = Network::settled();
        network.hear(&query(&[(name, kind)]));
        network.run(ms(200));
        assert_eq!(network.heard(), answers, "{name} {kind}");
    }
}

#[test]
fn what_only_this_machine_knows_is_answered_at_once_and_the_rest_a_little_later() {
    let mut network = Network::settled();
    let start = network.now;
    network.hear(&query(&[("line-us.local", A)]));
    network.run(ms(2_000));
    assert_eq!(network.times(start), [0]);
    let mut delays = Vec::new();
    for _ in 0..20 {
        network.said.clear();
        let start = network.now;
        network.hear(&query(&[("_lineus._tcp.local", PTR)]));
        network.run(ms(2_000));
        delays.extend(network.times(start));
    }
    assert_eq!(delays.len(), 20);
    assert!(
        delays.iter().all(|delay| (20..120).contains(delay)),
        "{delays:?}"
    );
    delays.dedup();
    assert!(delays.len() > 10, "not the same each time: {delays:?}");
}

#[test]
fn what_the_asker_knows_is_not_told() {
    let instance = wire("line-us._lineus._tcp.local");
    for (ttl, told) in [(4_500, false), (2_250, false), (2_249, true), (0, true)] {
        let mut network = Network::settled();
        let known: Entry<'_> = ("_lineus._tcp.local", PTR, ttl, &instance);
        network.hear(&message(0, &[("_lineus._tcp.local", PTR)], &[known], &[]));
        network.run(ms(2_000));
        assert_eq!(!network.said.is_empty(), told, "{ttl} s");
    }
    // Somebody else's instance is something else.
    let mut network = Network::settled();
    let other = wire("other._lineus._tcp.local");
    let known: Entry<'_> = ("_lineus._tcp.local", PTR, 4_500, &other);
    network.hear(&message(0, &[("_lineus._tcp.local", PTR)], &[known], &[]));
    network.run(ms(2_000));
    assert_eq!(network.said.len(), 1);
}

#[test]
fn data_that_came_compressed_is_the_same() {
    let mut network = Network::settled();
    let mut known = message(0, &[("_lineus._tcp.local", PTR)], &[], &[]);
    known[7] = 1;
    // The owner is the question's name, at 12, and the instance ends with it.
    known.extend([0xc0, 12, 0, 12, 0, 1, 0, 0, 0x11, 0x94, 0, 10, 7]);
    known.extend(b"line-us");
    known.extend([0xc0, 12]);
    network.hear(&known);
    network.run(ms(2_000));
    assert!(network.said.is_empty(), "{:?}", network.heard());
}

#[test]
fn who_does_not_know_multicast_gets_an_answer_of_its_own() {
    let mut network = Network::settled();
    let mut asked = query(&[("line-us.local", A), ("example.com", A)]);
    asked[..2].copy_from_slice(&[0xab, 0xcd]);
    let mut buffer = [0; MAX_SENT];
    let now = network.now;
    let length = network.machines[0].take(&asked, true, now, &mut buffer);
    let answer = &buffer[..length.unwrap()];
    assert_eq!(answer[..2], [0xab, 0xcd]);
    assert_eq!(
        words(answer),
        [
            "line-us.local? A",
            "example.com? A",
            "line-us.local A 10.0.0.1 10 s",
            "and line-us.local NSEC line-us.local. A 10 s"
        ]
    );
    network.run(ms(2_000));
    assert!(network.said.is_empty(), "and nobody else hears of it");
    let stranger = query(&[("example.com", A)]);
    assert_eq!(
        network.machines[0].take(&stranger, true, now, &mut buffer),
        None
    );
}

#[test]
fn a_flood_of_questions_gets_one_answer_a_second_and_the_last_one_is_heard() {
    let mut network = Network::settled();
    let start = network.now;
    for _ in 0..500 {
        network.hear(&query(&[("line-us.local", A)]));
        network.run(ms(10));
    }
    network.run(ms(2_000));
    assert_eq!(network.times(start), [0, 1_000, 2_000, 3_000, 4_000, 5_000]);
}

#[test]
fn a_renamed_machine_withdraws_its_old_names_at_once() {
    let mut network = Network::settled();
    let now = network.now;
    network.machines[0].set(&name("robs-lineus"), place(1), now);
    network.run(ms(1_500));
    assert_eq!(network.hosts(), ["robs-lineus"]);
    let times = network.times(now);
    assert_eq!(times[0], 0);
    // Which kinds of services there are, others say as well.
    let withdrawn: Vec<_> = EVERYTHING
        .iter()
        .filter(|record| !record.starts_with("_services"))
        .map(|record| {
            let record = record.strip_prefix("only ").unwrap_or(record);
            let (record, _) = record.rsplit_once(' ').unwrap();
            let (record, _) = record.rsplit_once(' ').unwrap();
            format!("{record} 0 s")
        })
        .collect();
    assert_eq!(words(&network.said[0].2), withdrawn);
    let told = words(&network.said[4].2);
    assert_eq!(told[0], "only robs-lineus.local A 10.0.0.1 120 s");
    network.run(ms(5_000));
    network.said.clear();
    network.hear(&query(&[("line-us.local", A)]));
    network.run(ms(500));
    assert!(network.said.is_empty());
}

#[test]
fn a_name_that_somebody_has_gets_a_number() {
    let mut network = Network::settled();
    network.add("line-us", 2);
    network.run(ms(6_000));
    assert_eq!(network.hosts(), ["line-us", "line-us-2"]);
    network.add("Line-US", 3);
    network.run(ms(6_000));
    assert_eq!(network.hosts(), ["line-us", "line-us-2", "Line-US-3"]);
    // The services have the host's name.
    network.said.clear();
    network.hear(&query(&[("_lineus._tcp.local", PTR)]));
    network.run(ms(500));
    let heard = network.heard();
    for record in [
        "_lineus._tcp.local PTR line-us-2._lineus._tcp.local. 4500 s",
        "and only line-us-2._lineus._tcp.local SRV 0 0 1337 line-us-2.local 120 s",
    ] {
        assert!(heard.iter().any(|heard| heard == record), "{heard:#?}");
    }
}

#[test]
fn any_record_of_a_claimed_name_means_that_it_is_taken() {
    for taken in [
        response(&[("line-us.local", AAAA, 120, &[0xfe; 16])]),
        response(&[("line-us.local", A, 120, &[10, 0, 0, 9])]),
        response(&[("line-us._http._tcp.local", TXT, 4_500, b"\x03a=b")]),
    ] {
        let mut network = Network::new();
        network.add("line-us", 1);
        network.run(ms(400));
        network.hear(&taken);
        network.run(ms(2_000));
        assert_eq!(network.hosts(), ["line-us-2"], "{:?}", words(&taken));
    }
}

#[test]
fn what_is_no_contradiction() {
    let machine = wire("line-us.local");
    let mut place_of = vec![0, 0, 0, 0, 0x05, 0x39];
    place_of.extend(&machine);
    let other_instance = wire("other._lineus._tcp.local");
    for claiming in [true, false] {
        for said in [
            // Its own words.
            response(&[("line-us.local", A, 120, &[10, 0, 0, 1])]),
            response(&[("line-us._lineus._tcp.local", SRV, 120, &place_of)]),
            // Somebody says goodbye.
            response(&[("line-us.local", A, 0, &[10, 0, 0, 9])]),
            // What others say as well.
            response(&[("_lineus._tcp.local", PTR, 4_500, &other_instance)]),
            response(&[("line-us-2.local", A, 120, &[10, 0, 0, 9])]),
            // No data that can be read, of somebody else.
            response(&[("x.local", SRV, 120, &[1, 2])]),
        ] {
            let mut network = match claiming {
                true => Network::new(),
                false => Network::settled(),
            };
            if claiming {
                network.add("line-us", 1);
                network.run(ms(400));
            }
            network.hear(&said);
            assert_eq!(network.hosts(), [if claiming { "" } else { "line-us" }]);
            network.run(ms(1_000));
            assert_eq!(network.hosts(), ["line-us"], "{:?}", words(&said));
        }
    }
}

#[test]
fn a_name_is_defended() {
    let mut network = Network::settled();
    let start = network.now;
    let claim: Entry<'_> = ("line-us.local", A, 120, &[10, 0, 0, 9]);
    // Told just now, and yet at once.
    network.hear(&query(&[("line-us.local", A)]));
    network.run(ms(300));
    network.hear(&message(0, &[("line-us.local", ANY)], &[], &[claim]));
    network.run(ms(100));
    assert_eq!(network.times(start), [0, 300]);
    assert_eq!(network.heard()[2..], EVERYTHING[..2]);
}

#[test]
fn of_two_that_claim_at_once_the_later_data_goes_first() {
    for (theirs, waits) in [([10, 0, 0, 0], false), ([10, 0, 0, 2], true)] {
        let mut network = Network::new();
        network.add("line-us", 1);
        network.run(ms(400));
        let claim: Entry<'_> = ("line-us.local", A, 120, &theirs);
        network.hear(&message(0, &[("line-us.local", ANY)], &[], &[claim]));
        network.run(ms(800));
        assert_eq!(network.hosts(), [if waits { "" } else { "line-us" }]);
        network.run(ms(1_200));
        // The other one has not come back.
        assert_eq!(network.hosts(), ["line-us"]);
    }
}

#[test]
fn machines_that_meet_later_find_names() {
    let mut one = Network::settled();
    let mut other = Network::new();
    other.add("line-us", 2);
    other.run(ms(6_000));
    one.machines.append(&mut other.machines);
    // Nobody notices until somebody speaks.
    one.hear(&query(&[("line-us.local", A)]));
    one.run(ms(10_000));
    let mut hosts = one.hosts();
    hosts.sort_unstable();
    assert_eq!(hosts, ["line-us", "line-us-2"]);
}

#[test]
fn another_network_is_another_beginning() {
    let mut network = Network::settled();
    network.add("line-us", 2);
    network.run(ms(6_000));
    network.said.clear();
    assert_eq!(network.hosts()[1], "line-us-2");
    // Gone: silent, and nothing to withdraw where nobody hears it.
    let now = network.now;
    network.machines[1].set(&name("line-us"), None, now);
    network.machines.remove(0);
    assert_eq!(network.hosts(), [""]);
    network.hear(&query(&[("_lineus._tcp.local", PTR)]));
    network.run(ms(5_000));
    assert!(network.said.is_empty());
    assert_eq!(network.machines[0].next(), None);
    // The same address, joined once more.
    let now = network.now;
    let again = Place {
        connection: 2,
        address: Ipv4Addr::new(10, 0, 0, 2),
    };
    network.machines[0].set(&name("line-us"), Some(again), now);
    network.run(ms(6_000));
    assert_eq!(network.hosts(), ["line-us"]);
    assert_eq!(network.said.len(), 6, "claimed and told");
}

#[test]
fn whoever_takes_every_name_slows_the_machine_down() {
    let mut network = Network::new();
    network.add("line-us", 1);
    let mut answered = 0;
    for _ in 0..600 {
        network.run(ms(100));
        for (_, _, claim) in std::mem::take(&mut network.said) {
            let claim = words(&claim);
            let (taken, _) = claim[0].split_once('?').unwrap();
            network.hear(&response(&[(taken, A, 120, &[10, 0, 0, 9])]));
            answered += 1;
        }
    }
    // Fifteen at once, and then one in five seconds.
    assert!((20..=30).contains(&answered), "{answered} in a minute");
    network.run(ms(10_000));
    assert!(network.hosts()[0].starts_with("line-us-"));
}

fn any_message() -> impl Strategy<Value = Vec<u8>> {
    let name = prop::sample::select(vec![
        "line-us.local",
        "_lineus._tcp.local",
        "line-us._lineus._tcp.local",
        "line-us-2.local",
        "x",
    ]);
    let kind = prop::sample::select(vec![A, PTR, TXT, AAAA, SRV, 47, ANY]);
    let data = prop::collection::vec(any::<u8>(), 0..80);
    let entry = (name.clone(), kind.clone(), any::<u32>(), data);
    let entries = prop::collection::vec(entry, 0..4);
    let questions = prop::collection::vec((name, kind), 0..6);
    let damage = prop::option::of((any::<prop::sample::Index>(), any::<u8>()));
    let flags = prop::sample::select(vec![0, 0x84, 2, 0x28]);
    (flags, questions, entries.clone(), entries, damage).prop_map(
        |(flags, questions, answers, claims, damage)| {
            fn entries<'a>(list: &'a [(&'static str, u16, u32, Vec<u8>)]) -> Vec<Entry<'a>> {
                let entries = list.iter();
                entries
                    .map(|(name, kind, ttl, data)| (*name, *kind, *ttl, &data[..]))
                    .collect()
            }
            let mut bytes = message(flags, &questions, &entries(&answers), &entries(&claims));
            if let Some((at, value)) = damage {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            bytes
        },
    )
}

proptest! {
    #[test]
    fn machines_of_one_name_find_different_ones(
        starts in prop::collection::vec(0_u64..3_000, 2..6),
        dice: u32,
    ) {
        let mut network = Network::new();
        for (number, start) in starts.iter().enumerate() {
            let at = network.now + ms(*start);
            let number = u8::try_from(number).unwrap();
            let mut machine = Responder::new(PORTS, dice.wrapping_mul(u32::from(number) + 1));
            machine.set(&name("line-us"), place(number + 1), at);
            network.machines.push(machine);
        }
        network.run(ms(60_000));
        let mut hosts = network.hosts();
        hosts.sort_unstable();
        prop_assert_eq!(hosts[0], "line-us");
        hosts.dedup();
        prop_assert_eq!(hosts.len(), starts.len());
        // And then there is silence.
        network.said.clear();
        network.run(ms(3_600_000));
        prop_assert!(network.said.is_empty());
    }

    #[test]
    fn any_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..MAX_MESSAGE), one_shot: bool) {
        let mut network = Network::settled();
        let now = network.now;
        network.machines[0].take(&bytes, one_shot, now, &mut [0; MAX_SENT]);
        network.run(ms(10_000));
    }

    #[test]
    fn nearly_right_messages_do_no_harm(
        messages in prop::collection::vec((any_message(), any::<bool>(), 0_u64..400), 1..20),
    ) {
        let mut network = Network::new();
        network.add("line-us", 1);
        for (message, one_shot, pause) in messages {
            let now = network.now;
            network.machines[0].take(&message, one_shot, now, &mut [0; MAX_SENT]);
            network.run(ms(pause));
        }
        // Whatever was said, it is found in the end.
        network.run(ms(60_000));
        let host = network.hosts()[0];
        prop_assert!(host == "line-us" || host.starts_with("line-us-"), "{}", host);
        // It says no more than is allowed, all messages can be read, and they fit a frame.
        for (_, _, message) in &network.said {
            prop_assert!(message.len() <= MAX_SENT);
            words(message);
        }
    }
}

#[test]
fn all_there_is_to_tell_fits_a_message() {
    let mut network = Network::new();
    network.add(&"a".repeat(32), 1);
    let mut renamed = network.machines.remove(0);
    // The longest number, too.
    renamed.number = MAX_NUMBER;
    let start = network.now;
    renamed.begin(start);
    network.machines.push(renamed);
    network.run(ms(6_000));
    assert_eq!(network.hosts(), ["a".repeat(32) + "-9999"]);
    assert_eq!(network.said.len(), 6);
    // Claims and tellings, whole.
    assert_eq!(network.heard().len(), 3 * 8 + 3 * 10);
}

#[test]
fn a_message_of_nothing_but_questions_is_looked_at_in_part() {
    let mut network = Network::settled();
    let mut asked = query(&[("x.local", A); 200]);
    network.hear(&asked);
    asked = query(&[("line-us.local", A)]);
    network.hear(&asked);
    network.run(ms(100));
    assert_eq!(network.said.len(), 1);
    // The same name many times is answered once; the answer repeats what was looked at.
    let many = query(&[("line-us.local", A); 90]);
    let mut buffer = [0; MAX_SENT];
    let now = network.now;
    let answer = network.machines[0].take(&many, true, now, &mut buffer);
    assert_eq!(words(&buffer[..answer.unwrap()]).len(), 32 + 2);
}
