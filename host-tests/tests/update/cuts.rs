//! The power fails at any byte of an update, of a trial, of a confirmation and of the way back: what starts
//! next is a whole firmware, and the right one.

use crate::chip::Tear;
use crate::machine::{Flash, Machine, WORLD, World, choice, flash, slot};
use embassy_time::Duration;
use host_tests::scripted::release::{Release, address};
use host_tests::scripted::slots::OLD;
use protocol_core::update::{Slot, Standing};

/// More than a page, and not whole words.
const SIZE: usize = 4099;

/// What starts next, which is whole.
fn starts(flash: &Flash, release: &Release) -> Slot {
    let chosen = choice(flash).slot();
    let content = slot(flash, chosen);
    match chosen {
        Slot::First => assert_eq!(content[..OLD.len()], *OLD),
        Slot::Second => assert_eq!(content[..SIZE], release.image),
    }
    chosen
}

/// Plays `act` on the flash, cut after each piece of its work, in both ways; `look` sees what is left.
fn cut_everywhere(start: &Flash, act: impl Fn(&Flash), look: impl Fn(&Flash, bool)) -> u64 {
    let before = start.state();
    act(start);
    look(start, true);
    let work = start.work() - before.work;
    assert!(work > 0, "nothing is written");
    for tear in [Tear::Prefix, Tear::Mixture] {
        for cut in 0..work {
            start.restore(&before);
            start.fail_after(cut, tear);
            act(start);
            start.power_on();
            look(start, false);
        }
    }
    start.restore(&before);
    work
}

fn updated() -> (Flash, Release) {
    let (flash, release) = (flash(), Release::of(SIZE));
    let server = release.served();
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    machine.update().unwrap();
    (flash, release)
}

#[test]
fn in_an_update() {
    let release = Release::of(SIZE);
    let server = release.served();
    let act = |flash: &Flash| {
        if let Some(mut machine) = Machine::start(flash, &server, &address(), WORLD) {
            let _ = machine.update();
        }
    };
    let work = cut_everywhere(&flash(), act, |flash, whole| {
        let chosen = starts(flash, &release);
        assert!(!whole || chosen == Slot::Second);
        let running = Machine::start(flash, &server, &address(), WORLD).unwrap();
        let expected = match chosen {
            Slot::First => Standing::Settled,
            Slot::Second => Standing::Trial { starts: 1 },
        };
        assert_eq!(running.standing, expected);
    });
    println!("{work} bytes and steps, each cut twice");
}

#[test]
fn in_an_update_after_one_that_was_taken_back() {
    let (flash, release) = updated();
    let server = release.served();
    for _ in 0..4 {
        let _ = Machine::start(&flash, &server, &address(), WORLD);
    }
    assert_eq!(starts(&flash, &release), Slot::First);
    let act = |flash: &Flash| {
        if let Some(mut machine) = Machine::start(flash, &server, &address(), WORLD) {
            let _ = machine.update();
        }
    };
    cut_everywhere(&flash, act, |flash, whole| {
        let chosen = starts(flash, &release);
        assert!(!whole || chosen == Slot::Second);
        // Never without a trial.
        assert_eq!(choice(flash).is_on_trial(), chosen == Slot::Second);
    });
}

#[test]
fn in_the_starts_of_a_trial_and_the_way_back() {
    let (flash, release) = updated();
    let server = release.served();
    let start = |flash: &Flash| drop(Machine::start(flash, &server, &address(), WORLD));
    for starts_before in 0..=3 {
        cut_everywhere(&flash, start, |flash, _| {
            starts(flash, &release);
            // A firmware that never confirms itself is gone after four starts, however they end.
            let state = flash.state();
            for _ in starts_before..=3 {
                start(flash);
            }
            assert_eq!(starts(flash, &release), Slot::First, "{starts_before}");
            flash.restore(&state);
        });
        start(&flash);
    }
    let machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    assert!(matches!(machine.standing, Standing::Back { .. }));
}

#[test]
fn in_a_confirmation() {
    let (flash, release) = updated();
    let server = release.served();
    let confirm = |flash: &Flash| {
        if let Some(mut machine) = Machine::start(flash, &server, &address(), WORLD) {
            machine.pass(Duration::from_secs(20), || false);
        }
    };
    cut_everywhere(&flash, confirm, |flash, _| {
        assert_eq!(starts(flash, &release), Slot::Second);
        // Once more with power, and it stays.
        confirm(flash);
        assert!(!choice(flash).is_on_trial());
        for _ in 0..5 {
            let dead = World {
                network: false,
                tick: false,
            };
            drop(Machine::start(flash, &server, &address(), dead));
        }
        assert_eq!(starts(flash, &release), Slot::Second);
    });
}
