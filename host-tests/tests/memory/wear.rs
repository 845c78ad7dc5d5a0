//! How long the flash lasts.

use crate::chip::Chip;
use crate::dice::Dice;
use crate::owner::{self, Habits};
use crate::{boot, store};
use protocol_core::settings::Settings;
use protocol_core::wifi::MAX_NETWORKS;

/// Far more than anybody does.
const CHANGES_A_DAY: u32 = 20;
const TEN_YEARS: u32 = 3653 * CHANGES_A_DAY;
/// What makers of flash chips promise for a page.
const ENDURANCE: u32 = 100_000;

/// Erases of the most worn page in ten years, from as many stores as `count` says.
fn ten_years(chip: &Chip<4096>, mut settings: Settings, count: u32) -> u32 {
    let mut dice = Dice::new(1);
    let (mut memory, _, _) = boot(chip).expect("it starts");
    let before = chip.state().erases;
    for _ in 0..count {
        settings.name = owner::name(&mut dice);
        assert_eq!(store(&mut memory, &settings), Ok(()));
    }
    let after = chip.state().erases;
    let most = (0..after.len())
        .map(|page| after[page] - before[page])
        .max();
    most.expect("there are pages") * TEN_YEARS.div_ceil(count)
}

#[test]
fn ten_years_are_far_from_what_a_page_endures() {
    // As few settings as there are, and as many.
    let empty = Settings::default();
    let mut full = Settings::default();
    let mut dice = Dice::new(2);
    while full.networks.len() < MAX_NETWORKS {
        let (_, password) = Habits::ANY.lengths;
        let mut network = owner::network(&mut dice, Habits::ANY.lengths);
        network.ssid = protocol_core::wifi::Ssid::new(&dice.bytes(32)).expect("32 bytes");
        network.password = protocol_core::wifi::Password::new(&dice.bytes(password));
        full.networks.put(network).expect("there is room");
    }
    let mut cycles = Vec::new();
    for (settings, stores) in [(empty, 4000), (full, 1000)] {
        cycles.push(ten_years(&Chip::erased(), settings, stores));
    }
    println!(
        "{CHANGES_A_DAY} changes a day for ten years: {} erases of the most worn page with no network, \
         {} with {MAX_NETWORKS}",
        cycles[0], cycles[1]
    );
    assert!(
        cycles
            .iter()
            .all(|cycles| (1..ENDURANCE / 10).contains(cycles))
    );
}
