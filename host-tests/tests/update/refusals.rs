//! Updates that are refused: each with its reason, with what runs and what starts untouched.

use crate::machine::{Machine, WORLD, choice, flash, slot};
use embassy_time::Duration;
use host_tests::scripted::release::{
    IMAGE, MANIFEST, Release, SigningKey, address, development_key, sign,
};
use host_tests::scripted::server::{Answer, End, HOST, Server};
use host_tests::scripted::slots::{OLD, SLOT};
use protocol_core::motion::Micros;
use protocol_core::update::{Rejection, Slot, Standing, Version};

/// Longer than a page.
const SIZE: usize = 5000;
const LENGTH: u32 = SIZE as u32;

/// Asks for an update that has to be refused, and gives the reason.
fn refused(server: &Server, address: &str) -> Rejection {
    let flash = flash();
    let mut machine = Machine::start(&flash, server, address, WORLD).unwrap();
    let before = choice(&flash);
    let rejection = machine.update().unwrap_err();
    assert_eq!(machine.told(), format!("refused: {rejection}"));
    assert!(!machine.pass(Duration::from_secs(5), || machine_restarts(&flash)));
    assert!(!machine.restarted.get(), "{rejection}");
    assert_eq!(choice(&flash), before, "{rejection}");
    assert_eq!(slot(&flash, Slot::First)[..OLD.len()], *OLD, "{rejection}");
    assert!(
        slot(&flash, Slot::First)[OLD.len()..]
            .iter()
            .all(|byte| *byte == 0xff)
    );
    let machine = Machine::start(&flash, server, address, WORLD).unwrap();
    assert_eq!(machine.standing, Standing::Settled, "{rejection}");
    rejection
}

fn machine_restarts(flash: &crate::machine::Flash) -> bool {
    choice(flash).slot() != Slot::First
}

/// The reason, where the server has something else than it should.
fn refused_with(path: &str, answer: Answer) -> Rejection {
    let server = Release::of(SIZE).served();
    server.put(path, answer);
    refused(&server, &address())
}

/// The reason for another manifest, signed as it should be.
fn refused_release(release: &Release) -> Rejection {
    refused(&release.served(), &address())
}

#[test]
fn no_address() {
    assert_eq!(refused(&Server::default(), ""), Rejection::NoAddress);
}

#[test]
fn no_such_server() {
    let server = Release::of(SIZE).served();
    let with = |from: &str, to: &str| refused(&server, &address().replace(from, to));
    assert_eq!(with(HOST, "elsewhere.example"), Rejection::UnknownHost);
    assert_eq!(with(HOST, "slow.example"), Rejection::UnknownHost);
    assert_eq!(with("8000", "8001"), Rejection::NoServer);
    assert_eq!(with("scripted", "other"), Rejection::Status(404));
}

#[test]
fn a_server_that_vanishes() {
    let server = Release::of(SIZE).served();
    server.vanish();
    assert_eq!(refused(&server, &address()), Rejection::NoServer);

    // In the middle of the image.
    let release = Release::of(SIZE);
    let server = release.served();
    server.put(
        IMAGE,
        Answer::file(&release.image).paced(100, Duration::from_secs(1)),
    );
    let flash = flash();
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    let outcome = machine.ask();
    machine.pass(Duration::from_secs(20), || false);
    assert!(machine.told().starts_with("loading"), "{}", machine.told());
    server.vanish();
    machine.pass(Duration::from_secs(11), || false);
    assert_eq!(outcome.take(), Some(Err(Rejection::Silent)));
    assert_eq!(choice(&flash).slot(), Slot::First);
}

#[test]
fn another_board() {
    let release = Release {
        board: "esp32c3".into(),
        ..Release::of(SIZE)
    };
    assert_eq!(refused_release(&release), Rejection::OtherBoard);
}

#[test]
fn an_older_version_and_the_same() {
    let version = |version: &str| Release {
        version: version.into(),
        ..Release::of(SIZE)
    };
    assert_eq!(
        refused_release(&version("0.0.1")),
        Rejection::Older(Version::new(0, 0, 1))
    );
    let own = Version::FIRMWARE;
    assert_eq!(
        refused_release(&version(&own.to_string())),
        Rejection::Same(own)
    );
}

#[test]
fn an_image_larger_than_the_slot_or_empty() {
    for size in [0, SLOT + 1] {
        let expected = Rejection::WrongSize {
            image: size as u32,
            slot: SLOT as u32,
        };
        assert_eq!(refused_release(&Release::of(size)), expected);
    }
}

#[test]
fn a_wrong_signature() {
    let signed = |key: &SigningKey| {
        let text = sign(&Release::of(SIZE).signed_part(), key);
        refused_with(MANIFEST, Answer::file(text.as_bytes()))
    };
    let other = SigningKey::from_bytes(&[7; 32]);
    assert_eq!(signed(&other), Rejection::WrongSignature);

    // Signed, and changed afterwards.
    let good = Release::of(SIZE).manifest();
    for (from, to) in [
        ("9.0.0", "9.0.1"),
        ("size: 5", "size: 4"),
        ("new.bin", "old.bin"),
    ] {
        let changed = good.replacen(from, to, 1);
        assert_ne!(changed, good);
        let rejection = refused_with(MANIFEST, Answer::file(changed.as_bytes()));
        assert_eq!(rejection, Rejection::WrongSignature, "{to}");
    }

    // No signature at all: a point of small order, which signs everything where it is not refused.
    let zeros = format!(
        "{}signature: {}\n",
        Release::of(SIZE).signed_part(),
        "0".repeat(128)
    );
    let rejection = refused_with(MANIFEST, Answer::file(zeros.as_bytes()));
    assert_eq!(rejection, Rejection::WrongSignature);
}

#[test]
fn no_manifest() {
    for (text, line) in [("", 1), ("<html>", 1), ("Quill update 1\nboard: x\n", 3)] {
        let rejection = refused_with(MANIFEST, Answer::file(text.as_bytes()));
        assert_eq!(rejection, Rejection::BadManifest(line), "{text}");
    }
    let text = sign("Quill update 2\n", &development_key());
    let rejection = refused_with(MANIFEST, Answer::file(text.as_bytes()));
    assert_eq!(rejection, Rejection::BadManifest(1));
    let rejection = refused_with(MANIFEST, Answer::file(&[b'x'; 513]));
    assert_eq!(rejection, Rejection::LongManifest(513));
}

#[test]
fn a_wrong_hash() {
    let mut image = Release::of(SIZE).image;
    image[SIZE - 1] ^= 1;
    let rejection = refused_with(IMAGE, Answer::file(&image));
    assert_eq!(rejection, Rejection::WrongHash);
}

#[test]
fn a_wrong_length() {
    for served in [SIZE - 1, SIZE + 1] {
        let rejection = refused_with(IMAGE, Answer::file(&vec![0; served]));
        let expected = Rejection::WrongLength {
            offered: served as u32,
            expected: LENGTH,
        };
        assert_eq!(rejection, expected);
    }
}

#[test]
fn a_truncated_download() {
    let image = Answer::file(&Release::of(SIZE).image);
    let head = image.bytes.len() - SIZE;
    for received in [0, 1, 1024, SIZE - 1] {
        for end in [End::Close, End::Break] {
            let rejection = refused_with(IMAGE, image.clone().cut(head + received, end));
            let expected = Rejection::Truncated {
                received: received as u32,
                expected: LENGTH,
            };
            assert_eq!(rejection, expected, "{end:?}");
        }
    }
    for length in [0, 1, head - 1] {
        let rejection = refused_with(IMAGE, image.clone().cut(length, End::Close));
        assert_eq!(rejection, Rejection::NoAnswer, "{length}");
    }
}

#[test]
fn a_server_that_goes_silent() {
    let image = Answer::file(&Release::of(SIZE).image);
    for length in [0, 10, 3000] {
        let rejection = refused_with(IMAGE, image.clone().cut(length, End::Silence));
        assert_eq!(rejection, Rejection::Silent, "{length}");
    }
}

#[test]
fn a_slow_download() {
    let image = Answer::file(&Release::of(SIZE).image);
    // Never silent for long: a byte every nine seconds once the head has come.
    let slow = image.paced(90, Duration::from_secs(9));
    assert_eq!(
        refused_with(IMAGE, slow),
        Rejection::Slow(Micros::from_secs(300))
    );
    let manifest = Answer::file(Release::of(SIZE).manifest().as_bytes());
    let slow = manifest.paced(40, Duration::from_secs(4));
    let rejection = refused_with(MANIFEST, slow);
    assert_eq!(rejection, Rejection::Slow(Micros::from_secs(20)));
}

#[test]
fn an_endless_answer() {
    let endless = |answer: Answer| Answer {
        end: End::Endless,
        ..answer
    };
    // An endless head.
    let head = endless(Answer::raw(b"HTTP/1.1 200 OK\r\nX: "));
    assert_eq!(refused_with(MANIFEST, head), Rejection::NotHttp);
    // Endless, and honest about it.
    let chunked = Answer::with("200 OK", &[("Transfer-Encoding", "chunked")], b"");
    assert_eq!(refused_with(IMAGE, endless(chunked)), Rejection::NoLength);
    let until_the_end = Answer::with("200 OK", &[], b"");
    let rejection = refused_with(IMAGE, endless(until_the_end));
    assert_eq!(rejection, Rejection::NoLength);
    // Longer than any.
    let huge = Answer::with("200 OK", &[("Content-Length", "4294967295")], b"");
    let rejection = refused_with(MANIFEST, endless(huge.clone()));
    assert_eq!(rejection, Rejection::LongManifest(u32::MAX));
    let rejection = refused_with(IMAGE, endless(huge));
    let expected = Rejection::WrongLength {
        offered: u32::MAX,
        expected: LENGTH,
    };
    assert_eq!(rejection, expected);
    // More than it said: what is beyond is never read.
    let release = Release::of(SIZE);
    let server = release.served();
    server.put(IMAGE, endless(Answer::file(&release.image)));
    let flash = flash();
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    assert_eq!(machine.update(), Ok(Version::new(9, 0, 0)));
}

#[test]
fn a_redirect() {
    let there = [
        ("Location", "http://evil.example/"),
        ("Content-Length", "0"),
    ];
    for (status, text) in [(301, "301 Moved"), (302, "302 Found"), (308, "308 Moved")] {
        for path in [MANIFEST, IMAGE] {
            let rejection = refused_with(path, Answer::with(text, &there, b""));
            assert_eq!(rejection, Rejection::Redirect(status), "{path}");
        }
    }
}

#[test]
fn what_is_not_http() {
    for garbage in [
        &b"SSH-2.0-OpenSSH_9.6\r\n\r\n"[..],
        b"\x16\x03\x01\x00\r\n\r\n",
        b"HTTP/1.1 2x0 OK\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nno colon\r\n\r\n",
    ] {
        let rejection = refused_with(MANIFEST, Answer::raw(garbage));
        assert_eq!(rejection, Rejection::NotHttp, "{}", garbage.escape_ascii());
    }
    let length = [("Content-Length", "-1")];
    let rejection = refused_with(MANIFEST, Answer::with("200 OK", &length, b""));
    assert_eq!(rejection, Rejection::NoLength);
}

#[test]
fn an_arm_that_does_not_stop_drawing() {
    let server = Release::of(SIZE).served();
    let flash = flash();
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    machine.move_to(1500, 0, 0);
    assert_eq!(machine.update(), Err(Rejection::Drawing));
    // And when it has stopped, it goes.
    machine.move_to(1500, 0, 1000);
    assert_eq!(machine.update(), Ok(Version::new(9, 0, 0)));
}
