//! New firmware on trial.

use crate::machine::{Flash, Machine, WORLD, World, choice, flash};
use embassy_time::Duration;
use host_tests::scripted::release::{Release, address};
use host_tests::scripted::server::Server;
use protocol_core::update::{Rejection, Slot, Standing, Version};

fn updated() -> (Flash, Server) {
    let (flash, server) = (flash(), Release::of(100).served());
    let mut machine = Machine::start(&flash, &server, &address(), WORLD).unwrap();
    machine.update().unwrap();
    (flash, server)
}

fn start(flash: &Flash, server: &Server, world: World) -> Option<Machine> {
    Machine::start(flash, server, &address(), world)
}

#[test]
fn a_firmware_that_works_confirms_itself_after_ten_seconds() {
    let (flash, server) = updated();
    let mut machine = start(&flash, &server, WORLD).unwrap();
    machine.pass(Duration::from_secs(9), || false);
    assert_eq!(machine.told(), "on trial, start 1 of 3");
    assert!(choice(&flash).is_on_trial());
    machine.pass(Duration::from_secs(4), || false);
    assert_eq!(machine.told(), "none");
    assert!(!choice(&flash).is_on_trial());
    assert!(!machine.restarted.get());
    for _ in 0..5 {
        let machine = start(&flash, &server, WORLD).unwrap();
        assert_eq!(machine.standing, Standing::Settled);
    }
}

#[test]
fn a_firmware_that_does_not_reach_its_tenth_second_is_gone_at_the_fourth_start() {
    let (flash, server) = updated();
    for starts in 1..=3 {
        let mut machine = start(&flash, &server, WORLD).unwrap();
        assert_eq!(machine.standing, Standing::Trial { starts });
        // Here it hangs, and the watchdog restarts it.
        machine.pass(Duration::from_secs(9), || false);
    }
    assert!(start(&flash, &server, WORLD).is_none());
    assert_eq!(choice(&flash).slot(), Slot::First);
    let mut machine = start(&flash, &server, WORLD).unwrap();
    machine.pass(Duration::from_secs(1), || false);
    assert_eq!(
        machine.told(),
        "9.0.0 did not confirm itself, back to this one"
    );
    // It can be had again.
    assert_eq!(machine.update(), Ok(Version::new(9, 0, 0)));
}

#[test]
fn a_firmware_without_network_or_servos_restarts_after_three_minutes() {
    for dead in [
        World {
            network: false,
            ..WORLD
        },
        World {
            tick: false,
            ..WORLD
        },
    ] {
        let (flash, server) = updated();
        let mut machine = start(&flash, &server, dead).unwrap();
        let restarted = machine.restarted.clone();
        assert!(!machine.pass(Duration::from_secs(179), || restarted.get()));
        assert!(machine.pass(Duration::from_secs(2), || restarted.get()));
        assert!(choice(&flash).is_on_trial());
    }
}

#[test]
fn a_firmware_on_trial_keeps_what_it_would_come_back_to() {
    let (flash, server) = updated();
    let mut machine = start(&flash, &server, WORLD).unwrap();
    machine.pass(Duration::from_secs(1), || false);
    let before = flash.state().cells;
    assert_eq!(machine.update(), Err(Rejection::OnTrial));
    assert_eq!(flash.state().cells, before);
}
