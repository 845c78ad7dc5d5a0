extern crate std;

use super::*;
use proptest::prelude::*;
use std::vec;
use std::vec::Vec as StdVec;

const NEW: Version = Version::new(0, 2, 0);

/// An ESP-IDF bootloader, from its sources: which slot starts.
fn bootloader(flash: &Flash) -> Slot {
    let entry = |at: usize| {
        let word = |offset: usize| {
            u32::from_le_bytes(flash.0[at + offset..at + offset + 4].try_into().unwrap())
        };
        let (number, state, crc) = (word(0), word(24), word(28));
        let counts = number != u32::MAX
            && ![3, 4].contains(&state)
            && crc == crc32_of_the_rom(&number.to_le_bytes());
        counts.then_some(number)
    };
    match entry(0).max(entry(4096)) {
        Some(number) if number.wrapping_sub(1) % 2 == 1 => Slot::Second,
        _ => Slot::First,
    }
}

/// Byte by byte, where the code has it word by word.
fn crc32_of_the_rom(bytes: &[u8]) -> u32 {
    let mut crc = 0_u32;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 {
                crc >> 1 ^ 0xedb8_8320
            } else {
                crc >> 1
            };
        }
    }
    !crc
}

#[derive(Clone)]
struct Flash(StdVec<u8>);

impl Flash {
    fn erased() -> Self {
        Self(vec![0xff; 2 * PAGE as usize])
    }

    /// As an ESP-IDF bootloader leaves it at its first start: number 1, state valid.
    fn flashed() -> Self {
        let mut flash = Self::erased();
        flash.0[..4].copy_from_slice(&[1, 0, 0, 0]);
        flash.0[24..32].copy_from_slice(&[2, 0, 0, 0, 154, 152, 67, 71]);
        flash
    }

    fn choice(&self) -> BootChoice {
        let entry = |at: usize| self.0[at..at + ENTRY].try_into().unwrap();
        BootChoice::read(&entry(0), &entry(PAGE as usize))
    }

    fn perform(&mut self, step: &Step) {
        match step {
            Step::Erase { page } => self.0[*page as usize..][..PAGE as usize].fill(0xff),
            Step::Write { at, word } => {
                for (cell, byte) in self.0[*at as usize..].iter_mut().zip(word) {
                    *cell &= byte;
                }
            }
        }
    }

    /// Some of what the step would have done.
    fn tear(&mut self, step: &Step, chance: &mut impl FnMut() -> u8) {
        match step {
            Step::Erase { page } => {
                for cell in &mut self.0[*page as usize..][..PAGE as usize] {
                    *cell |= chance();
                }
            }
            Step::Write { at, word } => {
                for (cell, byte) in self.0[*at as usize..].iter_mut().zip(word) {
                    *cell &= byte | chance();
                }
            }
        }
    }

    fn switch_to(&mut self, slot: Slot) {
        for step in self.choice().switch_to(slot, NEW) {
            self.perform(&step);
        }
    }

    /// Starts what the bootloader chooses, until it runs or goes back.
    fn start(&mut self) -> (Slot, Standing) {
        for _ in 0..3 {
            let running = bootloader(self);
            match self.choice().start(running) {
                Start::GoOn(standing) => return (running, standing),
                Start::Count(step, standing) => {
                    self.perform(&step);
                    return (running, standing);
                }
                Start::GoBack(step) => self.perform(&step),
            }
        }
        panic!("it starts again and again");
    }
}

#[test]
fn the_crc_is_that_of_the_chips() {
    // From the tests of esp-bootloader-esp-idf 0.6, `ota.rs`.
    assert_eq!(crc(1).to_le_bytes(), [154, 152, 67, 71]);
    assert_eq!(crc(2).to_le_bytes(), [116, 55, 246, 85]);
}

#[test]
fn a_new_firmware_starts_three_times_and_then_the_old_one_is_back() {
    for mut flash in [Flash::erased(), Flash::flashed()] {
        assert_eq!(flash.start(), (Slot::First, Standing::Settled));
        flash.switch_to(Slot::Second);
        for starts in 1..=3 {
            assert_eq!(flash.start(), (Slot::Second, Standing::Trial { starts }));
        }
        for _ in 0..3 {
            let back = Standing::Back { from: NEW };
            assert_eq!(flash.start(), (Slot::First, back));
        }
    }
}

#[test]
fn a_new_firmware_that_confirms_itself_stays() {
    let mut flash = Flash::flashed();
    flash.switch_to(Slot::Second);
    flash.start();
    flash.start();
    assert!(flash.choice().is_on_trial());
    let confirm = flash.choice().confirm().unwrap();
    flash.perform(&confirm);
    assert!(!flash.choice().is_on_trial());
    assert_eq!(flash.choice().confirm(), None);
    for _ in 0..5 {
        assert_eq!(flash.start(), (Slot::Second, Standing::Settled));
    }
}

#[test]
fn an_update_after_one_that_was_taken_back_is_tried_again() {
    let mut flash = Flash::flashed();
    for _ in 0..5 {
        flash.switch_to(Slot::Second);
        for starts in 1..=3 {
            assert_eq!(flash.start(), (Slot::Second, Standing::Trial { starts }));
        }
        let back = Standing::Back { from: NEW };
        assert_eq!(flash.start(), (Slot::First, back));
    }
}

/// The erase of a page may reach the state before the number and its CRC.
#[test]
fn an_entry_that_was_taken_back_does_not_count_while_its_page_is_erased() {
    let mut flash = Flash::flashed();
    flash.switch_to(Slot::Second);
    for _ in 0..4 {
        flash.start();
    }
    assert_eq!(bootloader(&flash), Slot::First);
    let mut erases = 0;
    for step in flash.choice().switch_to(Slot::Second, NEW) {
        if let Step::Erase { page } = step {
            erases += 1;
            let mut torn = flash.clone();
            torn.0[page as usize + 24..][..4].fill(0xff);
            assert_eq!(bootloader(&torn), Slot::First);
            torn.0[page as usize + 4..][..24].fill(0xff);
            assert_eq!(bootloader(&torn), Slot::First);
        }
        flash.perform(&step);
    }
    assert_eq!((erases, bootloader(&flash)), (1, Slot::Second));
}

#[test]
fn slots_take_turns() {
    let mut flash = Flash::flashed();
    let mut slot = Slot::First;
    for _ in 0..6 {
        slot = slot.other();
        flash.switch_to(slot);
        assert_eq!(flash.start(), (slot, Standing::Trial { starts: 1 }));
        let confirm = flash.choice().confirm().unwrap();
        flash.perform(&confirm);
        assert_eq!(flash.start(), (slot, Standing::Settled));
    }
}

#[test]
fn a_choice_that_the_bootloader_does_not_follow_is_taken_back() {
    let mut flash = Flash::flashed();
    flash.switch_to(Slot::Second);
    // The image is damaged, and the bootloader takes the other one.
    let back = Standing::Back { from: NEW };
    let start = flash.choice().start(Slot::First);
    let Start::Count(step, standing) = start else {
        panic!("{start:?}");
    };
    assert_eq!(standing, back);
    flash.perform(&step);
    assert_eq!(flash.start(), (Slot::First, back));
}

#[test]
fn what_another_tool_chose_is_not_on_trial() {
    let mut flash = Flash::flashed();
    // As `espflash` or ESP-IDF's own update writes it.
    flash.0[4096..4100].copy_from_slice(&[2, 0, 0, 0]);
    flash.0[4096 + 28..4096 + 32].copy_from_slice(&[116, 55, 246, 85]);
    for _ in 0..5 {
        assert_eq!(flash.start(), (Slot::Second, Standing::Settled));
    }
}

/// Histories of an arm: each number is what happens next.
fn grown(history: &[u8]) -> Flash {
    let mut flash = Flash::flashed();
    for event in history {
        match event % 3 {
            0 => {
                if !flash.choice().is_on_trial() {
                    let slot = flash.choice().slot().other();
                    flash.switch_to(slot);
                }
            }
            1 => drop(flash.start()),
            _ => {
                if let Some(step) = flash.choice().confirm() {
                    flash.perform(&step);
                }
            }
        }
    }
    flash
}

proptest! {
    #[test]
    fn the_choice_is_what_the_bootloader_makes_of_it(bytes in any::<[u8; 64]>(), whole in any::<[bool; 2]>()) {
        let mut flash = Flash::erased();
        for (entry, whole) in whole.into_iter().enumerate() {
            let at = entry * PAGE as usize;
            flash.0[at..at + ENTRY].copy_from_slice(&bytes[entry * ENTRY..][..ENTRY]);
            if whole {
                let crc = crc32_of_the_rom(&bytes[entry * ENTRY..][..4]);
                flash.0[at + 28..at + 32].copy_from_slice(&crc.to_le_bytes());
            }
        }
        prop_assert_eq!(flash.choice().slot(), bootloader(&flash));
    }

    /// Cut anywhere, a switch has happened as a whole or not at all.
    #[test]
    fn a_switch_cut_short_leaves_the_old_choice(
        history in prop::collection::vec(any::<u8>(), 0..20),
        cut in 0..8usize,
        chances in prop::collection::vec(any::<u8>(), 64),
    ) {
        let mut flash = grown(&history);
        while let Some(step) = flash.choice().confirm() {
            flash.perform(&step);
        }
        let old = bootloader(&flash);
        let steps = flash.choice().switch_to(old.other(), NEW);
        for step in steps.iter().take(cut) {
            flash.perform(step);
        }
        if let Some(torn) = steps.get(cut) {
            let mut chances = chances.iter().copied().cycle();
            flash.tear(torn, &mut || chances.next().unwrap());
        }
        let new = bootloader(&flash);
        if new == old {
            prop_assert!(!flash.choice().is_on_trial());
            // And it can be done again.
            flash.switch_to(old.other());
        }
        prop_assert_eq!(flash.start(), (old.other(), Standing::Trial { starts: 1 }));
    }

    /// Whatever word at a start is cut short, at most four starts later the old firmware is back.
    #[test]
    fn a_firmware_that_never_confirms_goes_whatever_is_cut(
        history in prop::collection::vec(any::<u8>(), 0..20),
        cuts in prop::collection::vec(any::<Option<u8>>(), 8),
    ) {
        let mut flash = grown(&history);
        while let Some(step) = flash.choice().confirm() {
            flash.perform(&step);
        }
        let old = bootloader(&flash);
        flash.switch_to(old.other());
        let mut whole_starts = 0;
        for cut in cuts {
            let running = bootloader(&flash);
            if running == old {
                break;
            }
            match (flash.choice().start(running), cut) {
                (Start::Count(step, _) | Start::GoBack(step), Some(kept)) => {
                    flash.tear(&step, &mut || kept);
                }
                (Start::Count(step, _), None) => {
                    flash.perform(&step);
                    whole_starts += 1;
                }
                (Start::GoBack(step), None) => flash.perform(&step),
                (Start::GoOn(standing), _) => panic!("{standing:?}"),
            }
        }
        prop_assert!(whole_starts <= 3);
        for _ in 0..4 {
            flash.start();
        }
        prop_assert_eq!(flash.start(), (old, Standing::Back { from: NEW }));
    }

    #[test]
    fn a_torn_confirmation_confirms_or_leaves_the_trial(kept in any::<u8>()) {
        let mut flash = Flash::flashed();
        flash.switch_to(Slot::Second);
        flash.start();
        let step = flash.choice().confirm().unwrap();
        flash.tear(&step, &mut || kept);
        prop_assert_eq!(bootloader(&flash), Slot::Second);
        if flash.choice().is_on_trial() {
            let step = flash.choice().confirm().unwrap();
            flash.perform(&step);
        }
        prop_assert_eq!(flash.start(), (Slot::Second, Standing::Settled));
    }
}
