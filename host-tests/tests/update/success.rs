//! Good updates.

use crate::machine::{Machine, WORLD, choice, flash, slot};
use embassy_time::{Duration, Instant};
use host_tests::scripted::release::{IMAGE, MANIFEST, Release, address};
use host_tests::scripted::server::{Answer, HOST, PORT, Server};
use host_tests::scripted::slots::{OLD, SLOT};
use protocol_core::update::{Rejection, Slot, Standing, Version};

const NEW: Version = Version::new(9, 0, 0);

#[test]
fn a_good_update_is_written_and_starts_on_trial() {
    // Sizes around words, pieces and pages, up to the whole slot.
    for size in [1, 3, 4, 5, 1023, 1024, 1025, 4096, 5001, SLOT - 1, SLOT] {
        let release = Release::of(size);
        let (flash, server) = (flash(), release.served());
        let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
        assert_eq!(machine.update(), Ok(NEW), "{size} bytes");
        assert_eq!(machine.told(), "starting 9.0.0");
        assert!(!machine.restarted.get(), "the reply has to leave first");
        let restarted = machine.restarted.clone();
        assert!(machine.pass(Duration::from_secs(2), || restarted.get()));
        assert_eq!(slot(&flash, Slot::Second)[..size], release.image);
        assert_eq!(slot(&flash, Slot::First)[..OLD.len()], *OLD);
        let machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
        assert_eq!(machine.standing, Standing::Trial { starts: 1 });
    }
}

#[test]
fn a_manifest_that_was_made_elsewhere_is_good() {
    // By Python's `hashlib` and `cryptography`, with the development key.
    let server = Server::default();
    server.put(MANIFEST, Answer::file(include_bytes!("elsewhere.txt")));
    server.put(IMAGE, Answer::file(b"made without this project's code\n"));
    let flash = flash();
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    assert_eq!(machine.update(), Ok(NEW));
}

#[test]
fn the_server_is_asked_in_the_plainest_way() {
    let release = Release::of(100);
    let (flash, server) = (flash(), release.served());
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    machine.update().unwrap();
    let request = |path| {
        format!(
            "GET {path} HTTP/1.1\r\nHost: {HOST}:{PORT}\r\nUser-Agent: Quill\r\n\
             Accept-Encoding: identity\r\nConnection: close\r\n\r\n"
        )
    };
    assert_eq!(server.asked(), [request(MANIFEST), request(IMAGE)]);
}

#[test]
fn a_slow_server_is_good_enough_and_progress_is_told() {
    let release = Release::of(10_000);
    let (flash, server) = (flash(), release.served());
    let slow = Answer::file(&release.image).paced(100, Duration::from_secs(2));
    server.put(IMAGE, slow);
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    let outcome = machine.ask();
    let mut told = Vec::new();
    for _ in 0..300 {
        machine.pass(Duration::from_secs(1), || false);
        told.push(machine.told());
        if outcome.borrow().is_some() {
            break;
        }
    }
    told.dedup();
    assert_eq!(*outcome.borrow(), Some(Ok(NEW)));
    // Piece by piece of 1024 bytes.
    let expected: Vec<String> = (0..10)
        .map(|piece| format!("loading 9.0.0, {} %", piece * 1024 * 100 / 10_000))
        .collect();
    assert_eq!(told[..10], expected);
    assert_eq!(told.last().unwrap(), "starting 9.0.0");
}

#[test]
fn nothing_is_written_before_the_arm_rests_with_its_pen_up() {
    let release = Release::of(100);
    let (flash, server) = (flash(), release.served());
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    machine.move_to(1500, 0, 0);
    let before = flash.work();
    let outcome = machine.ask();
    machine.pass(Duration::from_secs(30), || false);
    assert_eq!(machine.told(), "9.0.0 waits for the arm");
    assert_eq!((flash.work(), outcome.take()), (before, None));
    machine.move_to(1500, 0, 1000);
    let done = || outcome.borrow().is_some();
    assert!(machine.pass(Duration::from_secs(5), done));
    assert_eq!(outcome.take(), Some(Ok(NEW)));
}

#[test]
fn moves_wait_until_the_update_has_ended() {
    let release = Release::of(3000);
    let (flash, server) = (flash(), release.served());
    let short = Answer::file(&release.image).paced(100, Duration::from_secs(1));
    server.put(
        IMAGE,
        short.cut(1500, host_tests::scripted::server::End::Close),
    );
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    let outcome = machine.ask();
    machine.pass(Duration::from_secs(3), || false);
    machine.move_to(1500, 0, 1000);
    machine.pass(Duration::from_secs(3), || false);
    let place = |machine: &Machine| machine.house.arm.with(|arm| arm.position().x.rounded());
    assert_eq!(place(&machine), 1000);
    machine.pass(Duration::from_secs(20), || false);
    assert!(matches!(
        *outcome.borrow(),
        Some(Err(Rejection::Truncated { .. }))
    ));
    assert_eq!(place(&machine), 1500);
}

#[test]
fn there_is_one_update_at_a_time() {
    let release = Release::of(100);
    let (flash, server) = (flash(), release.served());
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    let (first, second) = (machine.ask(), machine.ask());
    let began = Instant::now();
    machine.pass(Duration::from_millis(10), || false);
    assert_eq!(second.take(), Some(Err(Rejection::UnderWay)));
    machine.pass(Duration::from_secs(5), || first.borrow().is_some());
    assert_eq!(first.take(), Some(Ok(NEW)));
    assert!(Instant::now() - began < Duration::from_secs(5));
}

#[test]
fn updates_take_turns_in_the_slots() {
    let (flash, mut from) = (flash(), Slot::First);
    for major in 7..10 {
        let release = Release {
            version: format!("{major}.0.0"),
            image: vec![major; 100],
            ..Release::of(0)
        };
        let server = release.served();
        let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
        // Standing trial takes ten seconds.
        machine.pass(Duration::from_secs(20), || false);
        assert_eq!(machine.update(), Ok(Version::new(major.into(), 0, 0)));
        assert_eq!(choice(&flash).slot(), from.other());
        assert_eq!(slot(&flash, from.other())[..100], release.image);
        from = from.other();
    }
}
