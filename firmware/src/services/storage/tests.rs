//! The memory as the other services meet it; what it does with its flash is tested in `host-tests`.

use super::*;
use crate::boards::desktop::flash::{FileFlash, SIZE};
use crate::boards::desktop::{IDENTITY, VITALS};
use crate::services::House;
use embassy_embedded_hal::adapter::BlockingAsync;
use embassy_futures::select::{Either, select};
use embassy_futures::{block_on, poll_once};
use protocol_core::arm::Calibration;
use protocol_core::machine::{ArmData, Client};
use protocol_core::settings::MachineName;
use std::pin::pin;
use std::task::Poll;

fn memory() -> Memory<BlockingAsync<FileFlash>> {
    Memory::new(BlockingAsync::new(FileFlash::in_memory(SIZE)), 0..SIZE).unwrap()
}

fn house() -> House {
    House::new(ArmData::default(), Settings::default(), IDENTITY, VITALS)
}

fn named(name: &str) -> Settings {
    Settings {
        name: MachineName::new(name).unwrap(),
        ..Settings::default()
    }
}

/// Does something while a service runs.
fn beside<T>(
    service: impl Future<Output = core::convert::Infallible>,
    work: impl Future<Output = T>,
) -> T {
    match block_on(select(service, work)) {
        Either::First(never) => match never {},
        Either::Second(done) => done,
    }
}

#[test]
fn a_change_is_in_force_when_it_is_stored() {
    let house = house();
    let service = async { house.store.run(memory()).await };
    let answer = beside(service, async {
        assert_eq!(house.store.health(), MemoryHealth::Fresh);
        let name = MachineName::new("first").unwrap();
        house
            .change(Client::HOUSE, |settings| {
                settings.name = name;
                settings.waves = false;
                7
            })
            .await
    });
    assert_eq!(answer, Ok(7));
    assert_eq!(house.name().as_str(), "first");
    assert!(!house.settings(|settings| settings.waves));
    assert_eq!(house.store.health(), MemoryHealth::Sound);
}

#[test]
fn what_is_not_stored_is_not_in_force() {
    let house = house();
    let refused = beside(async { house.store.refuse().await }, async {
        house
            .change(Client::HOUSE, |settings| {
                settings.name = named("first").name;
            })
            .await
    });
    assert_eq!(refused, Err(StoreError));
    assert_eq!(house.name(), MachineName::default());
    assert_eq!(house.store.health(), MemoryHealth::Missing);
    // The arm does not rest for ever.
    let moved = block_on(house.arm.rest(Client::SERIAL));
    drop(moved);
}

#[test]
fn a_calibration_is_in_force_in_the_arm_as_well() {
    let house = house();
    let calibration = Calibration::from_bytes([1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]);
    let stored = beside(async { house.store.run(memory()).await }, async {
        house
            .change(Client::HOUSE, |settings| settings.calibration = calibration)
            .await
    });
    assert_eq!(stored, Ok(()));
    assert_eq!(house.arm.with(|machine| machine.calibration()), calibration);
}

#[test]
fn whoever_gives_up_leaves_no_outcome_to_the_next() {
    let store = Store::new();
    {
        // Asked for, and not waited for.
        let mut abandoned = pin!(store.save(named("abandoned")));
        assert_eq!(poll_once(abandoned.as_mut()), Poll::Pending);
        let mut service = pin!(store.refuse());
        assert!(poll_once(service.as_mut()).is_pending());
    }
    let service = async { store.run(memory()).await };
    assert_eq!(beside(service, store.save(named("next"))), Ok(()));
}
