//! The boot choice in flash.

use crate::board::FirmwareSlots;
use embedded_storage_async::nor_flash::{MultiwriteNorFlash, NorFlash, ReadNorFlash};
use protocol_core::update::{
    BootChoice, ENTRY, PAGE, Rejection, STARTS, Slot, Standing, Start, Step, Version,
};

/// Memory of the words that flashes are made of.
#[repr(align(4))]
struct Words<const N: usize>([u8; N]);

/// What is in the flash of the boot choice.
///
/// # Errors
/// When it cannot be read.
pub async fn choice<F: ReadNorFlash>(flash: &mut F) -> Result<BootChoice, F::Error> {
    let (mut first, mut second) = (Words([0; ENTRY]), Words([0; ENTRY]));
    flash.read(0, &mut first.0).await?;
    flash.read(PAGE, &mut second.0).await?;
    Ok(BootChoice::read(&first.0, &second.0))
}

/// Counts the start of a firmware on trial. To be called at the start, before anything that may fail, with
/// the watchdog running. `None` when the other firmware has to start instead: restart.
///
/// Where the flash fails, the firmware goes on: it may be the only one that can.
pub async fn at_start<F: MultiwriteNorFlash>(flash: &mut F, running: Slot) -> Option<Standing> {
    let Ok(choice) = choice(flash).await else {
        return Some(Standing::Settled);
    };
    match choice.start(running) {
        Start::GoOn(standing) => Some(standing),
        Start::Count(step, standing) => {
            let _ = perform(flash, &step).await;
            Some(standing)
        }
        Start::GoBack(step) => match perform(flash, &step).await {
            Ok(()) => None,
            Err(_) => Some(Standing::Trial { starts: STARTS }),
        },
    }
}

/// Puts the slot that does not run in force.
pub async fn switch<S: FirmwareSlots>(slots: &mut S, version: Version) -> Result<(), Rejection> {
    let target = slots.running().other();
    let flash = slots.choice();
    let before = choice(flash).await.map_err(|_| Rejection::FlashFails)?;
    for step in before.switch_to(target, version) {
        let done = perform(flash, &step).await;
        done.map_err(|_| Rejection::FlashFails)?;
    }
    let after = choice(flash).await.map_err(|_| Rejection::FlashFails)?;
    match after.slot() == target && after.is_on_trial() {
        true => Ok(()),
        false => Err(Rejection::FlashDiffers),
    }
}

/// Confirms the firmware that runs, if it is on trial; says whether it has nothing more to prove.
pub async fn confirm<F: MultiwriteNorFlash>(flash: &mut F) -> bool {
    let step = choice(flash).await.map(|choice| choice.confirm());
    if let Ok(Some(step)) = step {
        let _ = perform(flash, &step).await;
    }
    choice(flash)
        .await
        .is_ok_and(|choice| !choice.is_on_trial())
}

async fn perform<F: MultiwriteNorFlash>(flash: &mut F, step: &Step) -> Result<(), F::Error> {
    match step {
        Step::Erase { page } => NorFlash::erase(flash, *page, page + PAGE).await,
        Step::Write { at, word } => flash.write(*at, &Words(*word).0).await,
    }
}
