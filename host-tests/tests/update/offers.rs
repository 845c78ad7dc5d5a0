//! Updates from a file that is handed over: the same checks, without a server.

use crate::machine::{Machine, WORLD, choice, flash, slot};
use embassy_time::Duration;
use host_tests::scripted::release::{Release, SigningKey, address, sign};
use host_tests::scripted::server::Server;
use host_tests::scripted::slots::{OLD, SLOT};
use protocol_core::update::{Rejection, Slot, Version};

/// Longer than a page, and not whole words.
const SIZE: usize = 5003;
const NEW: Version = Version::new(9, 0, 0);

/// Hands over a manifest and so much of an image; gives the outcome, and the text of M122 after it.
fn handed_over(
    manifest: &str,
    length: usize,
    image: &[u8],
) -> (Result<Version, Rejection>, String) {
    let flash = flash();
    let mut machine = Machine::start(&flash, &Server::default(), "", WORLD).unwrap();
    let outcome = machine.hand_over(manifest, length, image, false);
    let done = || outcome.borrow().is_some();
    assert!(machine.pass(Duration::from_secs(400), done), "no answer");
    let outcome = outcome.take().unwrap();
    if let Err(rejection) = outcome {
        assert_eq!(choice(&flash).slot(), Slot::First, "{rejection}");
        assert_eq!(slot(&flash, Slot::First)[..OLD.len()], *OLD, "{rejection}");
    } else {
        assert_eq!(slot(&flash, Slot::Second)[..image.len()], *image);
        assert!(choice(&flash).slot() == Slot::Second && choice(&flash).is_on_trial());
    }
    (outcome, machine.told())
}

#[test]
fn a_good_file_starts() {
    for size in [1, 511, 512, 1024, SIZE, SLOT] {
        let release = Release::of(size);
        let (outcome, told) = handed_over(&release.manifest(), size, &release.image);
        assert_eq!((outcome, &*told), (Ok(NEW), "starting 9.0.0"), "{size}");
    }
}

#[test]
fn what_is_refused() {
    let good = Release::of(SIZE);
    let text = good.manifest();
    let refused = |manifest: &str, length: usize, image: &[u8]| {
        let (outcome, told) = handed_over(manifest, length, image);
        let rejection = outcome.unwrap_err();
        assert_eq!(told, format!("refused: {rejection}"));
        rejection
    };
    let other = Release {
        board: "esp32c3".into(),
        ..good.clone()
    };
    let rejection = refused(&other.manifest(), SIZE, &good.image);
    assert_eq!(rejection, Rejection::OtherBoard);
    let stranger = sign(&good.signed_part(), &SigningKey::from_bytes(&[7; 32]));
    let rejection = refused(&stranger, SIZE, &good.image);
    assert_eq!(rejection, Rejection::WrongSignature);
    let old = Release {
        version: "0.0.1".into(),
        ..good.clone()
    };
    let rejection = refused(&old.manifest(), SIZE, &good.image);
    assert_eq!(rejection, Rejection::Older(Version::new(0, 0, 1)));
    let large = Release::of(SLOT + 1);
    let rejection = refused(&large.manifest(), SLOT + 1, &large.image);
    assert!(matches!(rejection, Rejection::WrongSize { .. }));
    for length in [0, SIZE - 1, SIZE + 1] {
        let expected = Rejection::WrongLength {
            offered: length as u32,
            expected: SIZE as u32,
        };
        assert_eq!(refused(&text, length, &good.image), expected);
    }
    let mut changed = good.image.clone();
    changed[SIZE - 1] ^= 1;
    assert_eq!(refused(&text, SIZE, &changed), Rejection::WrongHash);
    for (text, line) in [
        ("", 1),
        ("Quill update 1\n", 2),
        (&text[..text.len() - 1], 7),
    ] {
        assert_eq!(
            refused(text, 0, b""),
            Rejection::BadManifest(line),
            "{text}"
        );
    }
    assert_eq!(refused(&"x".repeat(600), 0, b""), Rejection::BadManifest(1));
    // It says nothing more.
    let rejection = refused(&text, SIZE, &good.image[..2000]);
    assert_eq!(rejection, Rejection::Silent);
}

#[test]
fn whoever_hands_over_goes_away() {
    let release = Release::of(SIZE);
    for received in [0, 1, 700, 2000, SIZE - 1] {
        let flash = flash();
        let mut machine = Machine::start(&flash, &Server::default(), "", WORLD).unwrap();
        let image = &release.image[..received];
        machine.hand_over(&release.manifest(), SIZE, image, true);
        machine.pass(Duration::from_secs(9), || false);
        // Nothing is waited for that cannot come.
        let expected = Rejection::Truncated {
            received: received as u32,
            expected: SIZE as u32,
        };
        assert_eq!(machine.told(), format!("refused: {expected}"));
        // The next one is none the worse for it.
        let outcome = machine.hand_over(&release.manifest(), SIZE, &release.image, false);
        machine.pass(Duration::from_secs(30), || outcome.borrow().is_some());
        assert_eq!(outcome.take(), Some(Ok(NEW)), "{received}");
    }
}

#[test]
fn one_at_a_time_wherever_it_comes_from() {
    let release = Release::of(SIZE);
    let flash = flash();
    let server = release.served();
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    let text = release.manifest();
    let first = machine.hand_over(&text, SIZE, &release.image, false);
    machine.pass(Duration::from_secs(2), || false);
    let second = machine.hand_over(&text, SIZE, &release.image, false);
    assert_eq!(machine.update(), Err(Rejection::UnderWay));
    assert_eq!(second.take(), Some(Err(Rejection::UnderWay)));
    machine.pass(Duration::from_secs(30), || first.borrow().is_some());
    assert_eq!(first.take(), Some(Ok(NEW)));
}

#[test]
fn nothing_is_taken_before_the_arm_rests() {
    let release = Release::of(SIZE);
    let flash = flash();
    let mut machine = Machine::start(&flash, &Server::default(), "", WORLD).unwrap();
    machine.move_to(1500, 0, 0);
    let before = flash.work();
    let outcome = machine.hand_over(&release.manifest(), SIZE, &release.image, false);
    machine.pass(Duration::from_secs(59), || false);
    assert_eq!(machine.told(), "9.0.0 waits for the arm");
    machine.pass(Duration::from_secs(2), || false);
    assert_eq!(outcome.take(), Some(Err(Rejection::Drawing)));
    assert_eq!(flash.work(), before);
}
