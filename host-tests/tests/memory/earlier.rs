//! The memory of firmware before 0.1.0: name, calibration and network, each by itself, under a key, in
//! one map over the whole flash.

use crate::chip::{Chip, PAGES, Tear};
use crate::dice::Dice;
use crate::owner::{self, Habits};
use embassy_futures::block_on;
use protocol_core::settings::Settings;
use sequential_storage::cache::Cache;
use sequential_storage::map::{MapConfig, MapStorage};

/// Version of those forms.
const VERSION: u8 = 1;

/// What such firmware stored.
#[derive(Clone, Default)]
struct Parts([Option<Vec<u8>>; 3]);

/// Stores under a key; whether it has been stored is what the power says.
fn put<const PAGE: usize>(chip: &Chip<PAGE>, key: u8, value: &[u8]) {
    let config = MapConfig::new(0..Chip::<PAGE>::SIZE as u32);
    let mut map = MapStorage::<u8, _, _>::new(chip.clone(), config, Cache::new_uncached());
    let stored = block_on(map.store_item(&mut [0; 256], &key, &value));
    assert_eq!(stored.is_ok(), chip.is_powered(), "key {key}");
}

/// What such firmware finds when it starts; repairs are made to a copy of the chip.
fn read<const PAGE: usize>(chip: &Chip<PAGE>) -> Option<Parts> {
    let copy = Chip::<PAGE>::with(chip.state().cells);
    let config = MapConfig::new(0..Chip::<PAGE>::SIZE as u32);
    let mut map = MapStorage::<u8, _, _>::new(copy, config, Cache::new_uncached());
    let mut parts = Parts::default();
    for (key, part) in (1..).zip(&mut parts.0) {
        let mut buffer = [0; 256];
        let found = block_on(map.fetch_item::<&[u8]>(&mut buffer, &key)).ok()?;
        *part = found.map(<[u8]>::to_vec);
    }
    Some(parts)
}

/// A change of the owner, as bytes under a key.
fn change(settings: &mut Settings, dice: &mut Dice) -> (u8, Vec<u8>) {
    match dice.below(3) {
        0 => {
            settings.name = owner::name(dice);
            (1, settings.name.as_str().as_bytes().to_vec())
        }
        1 => {
            settings.calibration = owner::calibration(dice);
            let offsets = settings.calibration.offsets.to_array();
            (2, offsets.map(|angle| angle.get().to_le_bytes()).concat())
        }
        _ => {
            let network = owner::network(dice, Habits::MODEST.lengths);
            let ssid = network.ssid.as_bytes();
            let mut bytes = vec![ssid.len() as u8];
            bytes.extend(ssid);
            bytes.extend(network.password.iter().flat_map(|phrase| phrase.as_bytes()));
            // It remembered one.
            settings.networks.clear();
            settings.networks.put(network).expect("there is room");
            (3, bytes)
        }
    }
}

/// The page that is in use, which is marked at its beginning and not at its end, and how many bytes are
/// left in it.
fn in_use<const PAGE: usize>(chip: &Chip<PAGE>) -> (usize, usize) {
    let cells = chip.state().cells;
    let mut pages = cells.chunks(PAGE).enumerate();
    let (index, page) = pages
        .find(|(_, page)| page[0] == 0 && page[PAGE - 1] == 0xff)
        .expect("something was stored");
    let free = page.iter().rev().take_while(|byte| **byte == 0xff);
    (index, free.count())
}

/// Lives with such firmware for a while, and gives the settings that it has in the end. The last store
/// may have been cut.
pub fn live<const PAGE: usize>(chip: &Chip<PAGE>, dice: &mut Dice) -> Settings {
    let mut settings = Settings::default();
    let (stores, until) = (1 + dice.below(PAGE / 2), dice.below(4));
    for number in 0.. {
        // Half of them until there is hardly any room left, in any page or in the last one.
        let goes_on = number == 0
            || match (until, in_use(chip)) {
                (0, (_, room)) => room > 60,
                (1, (page, room)) => room > 60 || page < PAGES - 1,
                _ => number < stores,
            };
        if !goes_on {
            break;
        }
        let (key, mut value) = change(&mut settings, dice);
        value.insert(0, VERSION);
        put(chip, key, &value);
    }
    if dice.below(2) == 0 {
        let before = (chip.state(), read(chip).expect("it is whole"));
        let (key, mut value) = change(&mut settings.clone(), dice);
        value.insert(0, VERSION);
        chip.fail_after(dice.number() % 120, Tear::Prefix);
        put(chip, key, &value);
        chip.power_on();
        // What that firmware itself lost is not ours to find.
        let kept = read(chip).is_some_and(|parts| parts.0 == before.1.0);
        if !kept {
            chip.restore(&before.0);
        }
    }
    settings
}
