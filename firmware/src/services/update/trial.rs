//! A firmware on trial confirms itself, or starts again.

use super::{boot, now};
use crate::board::FirmwareSlots;
use crate::log::{info, warning};
use crate::services::House;
use crate::services::storage::MemoryHealth;
use embassy_time::{Duration, Ticker};
use protocol_core::machine::Client;
use protocol_core::update::{Probation, Signs, Verdict};
use protocol_core::wifi::Phase;

/// Returns when the firmware has confirmed itself.
pub async fn stand<S: FirmwareSlots>(house: &House, slots: &mut S) {
    let mut probation = Probation::new(now());
    let mut ticker = Ticker::every(Duration::from_secs(1));
    let mut ticks_before = house.arm.ticks();
    loop {
        ticker.next().await;
        let ticks = house.arm.ticks();
        let signs = Signs {
            tick: ticks != ticks_before,
            settings: house.store.health() != MemoryHealth::Missing,
            network: matches!(
                house.wifi.status().phase,
                Phase::Connected(_) | Phase::Setup
            ),
        };
        ticks_before = ticks;
        match probation.look(now(), signs) {
            Verdict::Wait => {}
            Verdict::Confirm => {
                let _rest = house.arm.rest(Client::HOUSE).await;
                if boot::confirm(slots.choice()).await {
                    info!("the new firmware has confirmed itself");
                    return;
                }
                warning!("the new firmware could not confirm itself");
            }
            Verdict::Restart => {
                warning!("the new firmware does not confirm itself and starts again");
                let _rest = house.arm.rest(Client::HOUSE).await;
                slots.restart().await;
            }
        }
    }
}
