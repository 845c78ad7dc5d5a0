//! Flash that holds something else, that has lost something, and that does not take what is written.

use crate::chip::{Chip, PAGES, Wear};
use crate::dice::Dice;
use crate::owner::{self, Habits};
use crate::{boot, store};
use embassy_futures::block_on;
use firmware::services::storage::{Memory, MemoryHealth, StoreError};
use protocol_core::settings::Settings;
use sequential_storage::cache::Cache;
use sequential_storage::map::{MapConfig, MapStorage};

const PAGE: usize = 256;
type Small = Chip<PAGE>;

/// A machine that has been in use for a while, and what it remembers.
fn used(seed: u64) -> (Small, Settings) {
    let mut dice = Dice::new(seed);
    let chip = Small::erased();
    let mut settings = Settings::default();
    let (mut memory, _, _) = boot(&chip).expect("it starts");
    for _ in 0..1 + dice.below(30) {
        settings = owner::change(&settings, &mut dice, Habits::MODEST);
        assert_eq!(store(&mut memory, &settings), Ok(()));
    }
    (chip, settings)
}

fn found(chip: &Small) -> (Settings, MemoryHealth) {
    let (_, settings, health) = boot(chip).expect("it starts");
    (settings, health)
}

/// Stores something new, and finds it again.
fn stores(chip: &Small, seed: u64) -> MemoryHealth {
    let (mut memory, before, _) = boot(chip).expect("it starts");
    let mut dice = Dice::new(seed);
    let mut after = before.clone();
    while after == before {
        after = owner::change(&before, &mut dice, Habits::MODEST);
    }
    assert_eq!(store(&mut memory, &after), Ok(()));
    let (settings, health) = found(chip);
    assert_eq!(settings, after);
    health
}

#[test]
fn a_new_flash_says_so_and_is_not_written() {
    let chip = Small::erased();
    assert_eq!(found(&chip), (Settings::default(), MemoryHealth::Fresh));
    assert_eq!(chip.work(), 0);
    let (mut memory, _, _) = boot(&chip).expect("it starts");
    assert_eq!(store(&mut memory, &Settings::default()), Ok(()));
    assert_eq!(memory.health(), MemoryHealth::Sound);
    assert_eq!(found(&chip), (Settings::default(), MemoryHealth::Sound));
}

#[test]
fn a_flash_of_something_else_starts_with_defaults_and_says_so() {
    let noise = (0..300).map(|seed| {
        let mut dice = Dice::new(seed);
        let mut cells = dice.bytes(Small::SIZE);
        // Some pages are erased.
        for page in cells.chunks_mut(PAGE) {
            if dice.below(4) == 0 {
                page.fill(0xff);
            }
        }
        cells[0] = 0;
        cells
    });
    let uniform = [0x00, 0x55, 0xaa, 0xfe].map(|byte| vec![byte; Small::SIZE]);
    for (number, cells) in noise.chain(uniform).enumerate() {
        let chip = Small::with(cells.clone());
        let foreign = (Settings::default(), MemoryHealth::Foreign);
        assert_eq!(found(&chip), foreign, "flash {number}");
        assert!(chip.state().cells == cells, "flash {number} was changed");
        assert_eq!(stores(&chip, 1), MemoryHealth::Sound, "flash {number}");
    }
}

#[test]
fn settings_of_later_firmware_stay_until_something_is_stored() {
    let chip = Small::erased();
    let config = MapConfig::new(0..(PAGES / 2 * PAGE) as u32);
    let mut map = MapStorage::<u8, _, _>::new(chip.clone(), config, Cache::new_uncached());
    // Sequence number 7, version 3, and what nobody knows yet.
    let record = [7, 0, 0, 0, 3, 77, 1, 1];
    block_on(map.store_item(&mut [0; 64], &b'Q', &record.as_slice())).expect("there is room");
    let before = chip.state().cells;
    let foreign = (Settings::default(), MemoryHealth::Foreign);
    assert_eq!(found(&chip), foreign);
    assert!(chip.state().cells == before);
    assert_eq!(stores(&chip, 1), MemoryHealth::Sound);
}

#[test]
fn a_wrong_byte_anywhere_loses_nothing() {
    let mut repaired = 0;
    for seed in 0..3 {
        let (chip, settings) = used(seed);
        let whole = chip.state();
        for at in 0..Small::SIZE {
            for wrong in [0xff, 1 << (at % 8)] {
                chip.restore(&whole);
                chip.set_byte(at, whole.cells[at] ^ wrong);
                let (now, health) = found(&chip);
                assert_eq!(now, settings, "byte {at} ^ {wrong:02x}");
                match health {
                    MemoryHealth::Sound => {}
                    MemoryHealth::Repaired => repaired += 1,
                    other => panic!("byte {at} ^ {wrong:02x}: {other}"),
                }
                stores(&chip, at as u64);
            }
        }
    }
    assert!(repaired > 0, "no wrong byte was ever noticed");
}

#[test]
fn what_was_answered_is_in_both_halves() {
    for seed in 0..20 {
        let (chip, settings) = used(seed);
        let whole = chip.state();
        for half in 0..2 {
            for with in [0xff, 0x00, 0x5a] {
                chip.restore(&whole);
                for at in half * Small::SIZE / 2..(half + 1) * Small::SIZE / 2 {
                    chip.set_byte(at, with);
                }
                let place = format!("history {seed}, half {half} of {with:02x}");
                assert_eq!(
                    found(&chip),
                    (settings.clone(), MemoryHealth::Repaired),
                    "{place}"
                );
                assert_eq!(
                    found(&chip),
                    (settings.clone(), MemoryHealth::Sound),
                    "{place}"
                );
            }
        }
    }
}

#[test]
fn the_same_settings_again_write_nothing() {
    let (chip, settings) = used(3);
    let work = chip.work();
    let (mut memory, _, _) = boot(&chip).expect("it starts");
    for _ in 0..10 {
        assert_eq!(store(&mut memory, &settings), Ok(()));
    }
    assert_eq!(chip.work(), work);
}

/// Lives on with worn-out pages, and gives how the memory then is.
fn live_on(worn: std::ops::Range<usize>, wear: Wear) -> MemoryHealth {
    let place = format!("pages {worn:?} ({wear:?})");
    let (chip, mut settings) = used(worn.start as u64);
    let mut dice = Dice::new(worn.start as u64);
    worn.for_each(|page| chip.wear_out(page, wear));
    // The stores go round all pages.
    for _ in 0..40 {
        settings = owner::change(&settings, &mut dice, Habits::MODEST);
        let (mut memory, _, _) = boot(&chip).expect("it starts");
        assert_eq!(store(&mut memory, &settings), Ok(()), "{place}");
        let (now, health) = found(&chip);
        assert_eq!(now, settings, "{place}");
        assert_eq!(memory.health(), health, "{place}");
    }
    found(&chip).1
}

#[test]
fn a_worn_out_page_is_passed_over() {
    for wear in [Wear::Honest, Wear::Silent] {
        for page in 0..PAGES {
            assert_eq!(live_on(page..page + 1, wear), MemoryHealth::Sound);
        }
    }
}

#[test]
fn a_worn_out_half_leaves_one_copy_and_says_so() {
    for wear in [Wear::Honest, Wear::Silent] {
        for half in [0..PAGES / 2, PAGES / 2..PAGES] {
            assert_eq!(live_on(half, wear), MemoryHealth::Single);
        }
    }
}

#[test]
fn a_worn_out_flash_refuses_and_keeps_what_it_has() {
    for wear in [Wear::Honest, Wear::Silent] {
        let (chip, settings) = used(5);
        for page in 0..PAGES {
            chip.wear_out(page, wear);
        }
        let (mut memory, _, _) = boot(&chip).expect("it starts");
        let mut dice = Dice::new(1);
        let mut next = settings.clone();
        next.name = owner::name(&mut dice);
        assert_eq!(store(&mut memory, &next), Err(StoreError), "{wear:?}");
        assert_eq!(memory.health(), MemoryHealth::WornOut, "{wear:?}");
        assert_eq!(found(&chip).0, settings, "{wear:?}");

        // One that is worn out before anything was stored.
        let chip = Small::erased();
        for page in 0..PAGES {
            chip.wear_out(page, wear);
        }
        let (mut memory, start, _) = boot(&chip).expect("it starts");
        assert_eq!(start, Settings::default());
        assert_eq!(store(&mut memory, &next), Err(StoreError), "{wear:?}");
        assert_eq!(memory.health(), MemoryHealth::WornOut, "{wear:?}");
    }
}

#[test]
fn a_range_must_be_an_even_number_of_pages_and_four_at_least() {
    let page = PAGE as u32;
    let fits = |range| Memory::new(Small::erased(), range).is_some();
    assert!(fits(0..4 * page) && fits(page..7 * page));
    for range in [
        0..0,
        0..2 * page,
        0..5 * page,
        1..4 * page + 1,
        0..4 * page + 4,
        4 * page..0,
    ] {
        assert!(!fits(range.clone()), "{range:?}");
    }
}

#[test]
fn no_word_about_the_memory_has_a_double_quote() {
    for health in [
        MemoryHealth::Missing,
        MemoryHealth::Fresh,
        MemoryHealth::Sound,
        MemoryHealth::Foreign,
        MemoryHealth::Repaired,
        MemoryHealth::Single,
        MemoryHealth::WornOut,
    ] {
        let text = health.to_string();
        assert!(!text.contains('"') && text.len() <= 60, "{text}");
    }
}
