//! Which of two slots starts, and how often a firmware on trial has tried.
//!
//! The form is that of ESP-IDF's `otadata` partition, which the bootloaders of the ESP32 chips read
//! (`bootloader_common.c`, `esp_flash_partitions.h` of ESP-IDF 5): two pages of 4 kB, at the beginning of
//! each an entry of 32 bytes:
//!
//! | bytes | |
//! |---|---|
//! | 0..4 | a number; of the entries that count, the one with the larger number says what starts: slot `(number - 1) % 2` |
//! | 4..24 | a label, which no bootloader looks at: here is the trial |
//! | 24..28 | state: 3 and 4 mean that the entry does not count |
//! | 28..32 | CRC-32 of the number; the entry counts if it is right |
//!
//! Without an entry that counts, slot 0 starts. These bootloaders know of no trial, so the firmware on
//! trial counts its starts itself, and takes its entry back by itself:
//!
//! | bytes of the label | |
//! |---|---|
//! | 0..4 | `Qtry` |
//! | 4, 5, 6 | cleared, one at each start |
//! | 7 | cleared when the firmware has confirmed itself |
//! | 8..14 | its version |
//! | 14..20 | erased |
//!
//! Every change is one word, written over erased or partly cleared bits, so that nothing has to be erased
//! to count, to confirm or to go back. A new entry is written into the page of the one that is not in
//! force, its CRC last, which puts it in force all at once.

use super::Version;
use heapless::Vec;

/// Bytes of an entry.
pub const ENTRY: usize = 32;
/// Distance of the two entries, and bytes that are erased at a time.
pub const PAGE: u32 = 4096;
/// Starts that a firmware on trial has to confirm itself.
pub const STARTS: u8 = 3;

const TRIAL: [u8; 4] = *b"Qtry";
const ERASED: u32 = u32::MAX;
const INVALID: u32 = 3;
const ABORTED: u32 = 4;
const STATE_AT: u32 = 24;
const CRC_AT: u32 = 28;
const MARKS_AT: u32 = 8;

/// One of the two slots for firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// `ota_0`.
    First,
    /// `ota_1`.
    Second,
}

impl Slot {
    /// The one that is not this one.
    pub const fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

/// One thing to be done to the flash of the boot choice, a word or a page; addresses count from its
/// beginning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// Erase a page.
    Erase {
        /// Where it begins.
        page: u32,
    },
    /// Write a word; it only clears bits.
    Write {
        /// Where.
        at: u32,
        /// What.
        word: [u8; 4],
    },
}

/// Steps of a change, in order; one that is cut short anywhere is as good as not begun.
pub type Steps = Vec<Step, 10>;

/// How the firmware that starts stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Nothing is to be proved.
    Settled,
    /// On trial.
    Trial {
        /// Starts so far, this one included, from 1.
        starts: u8,
    },
    /// Another one was tried here last, did not confirm itself, and this one is back.
    Back {
        /// The other one's version.
        from: Version,
    },
}

/// What has to be done at a start, before anything that may fail.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Start {
    /// Nothing.
    GoOn(Standing),
    /// Write this word, then go on.
    Count(Step, Standing),
    /// Write this word, and start again: the other slot's firmware is back then.
    GoBack(Step),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Entry {
    number: u32,
    label: [u8; 20],
    state: u32,
    crc: u32,
}

impl Entry {
    fn read(bytes: &[u8; ENTRY]) -> Self {
        let mut words = bytes.chunks_exact(4).map(|word| match *word {
            [a, b, c, d] => u32::from_le_bytes([a, b, c, d]),
            _ => ERASED,
        });
        let mut label = [0xff; 20];
        let number = words.next().unwrap_or(ERASED);
        for (place, word) in label.chunks_exact_mut(4).zip(words.by_ref().take(5)) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        Self {
            number,
            label,
            state: words.next().unwrap_or(ERASED),
            crc: words.next().unwrap_or(ERASED),
        }
    }

    fn is_whole(&self) -> bool {
        self.number != ERASED && self.crc == crc(self.number)
    }

    /// Whether the bootloader takes notice of it.
    fn counts(&self) -> bool {
        self.is_whole() && !matches!(self.state, INVALID | ABORTED)
    }

    const fn slot(&self) -> Slot {
        match self.number.wrapping_sub(1) % 2 {
            0 => Slot::First,
            _ => Slot::Second,
        }
    }

    /// Marks and version, if it is one of ours.
    fn trial(&self) -> Option<([u8; 4], Version)> {
        match self.label {
            [q, t, r, y, m0, m1, m2, m3, a, b, c, d, e, f, ..] if [q, t, r, y] == TRIAL => {
                Some(([m0, m1, m2, m3], Version::from_bytes([a, b, c, d, e, f])))
            }
            _ => None,
        }
    }

    /// Marks, if it is on trial.
    fn marks_on_trial(&self) -> Option<[u8; 4]> {
        match self.trial() {
            // Cleared in part is cleared: the power failed while it was being cleared.
            Some((marks @ [.., 0xff], _)) => Some(marks),
            _ => None,
        }
    }
}

/// What is in the flash of the boot choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BootChoice {
    entries: [Entry; 2],
}

impl BootChoice {
    /// From the two entries, which are at 0 and at [`PAGE`].
    pub fn read(first: &[u8; ENTRY], second: &[u8; ENTRY]) -> Self {
        Self {
            entries: [Entry::read(first), Entry::read(second)],
        }
    }

    /// The slot that starts.
    pub fn slot(&self) -> Slot {
        self.in_force()
            .map_or(Slot::First, |(_, entry)| entry.slot())
    }

    /// What has to be done now that the firmware in `running` starts, before anything else.
    ///
    /// A bootloader that finds the chosen slot's image damaged starts the other one; then the choice is
    /// taken back.
    pub fn start(&self, running: Slot) -> Start {
        let Some((at, marks)) = self.on_trial() else {
            return Start::GoOn(self.settled());
        };
        let give_up = mark(at + STATE_AT, INVALID.to_le_bytes());
        if self.slot() != running {
            return Start::Count(give_up, self.without(at).settled());
        }
        let starts = marks.into_iter().take(STARTS.into());
        let before = starts.filter(|mark| *mark != 0xff).count() as u8;
        if before < STARTS {
            let mut counted = marks;
            let next = counted.iter_mut().find(|mark| **mark == 0xff);
            next.into_iter().for_each(|mark| *mark = 0);
            let starts = before + 1;
            return Start::Count(mark(at + MARKS_AT, counted), Standing::Trial { starts });
        }
        // Where nothing else would start there is nothing to go back to.
        match self.without(at).slot() == running {
            true => Start::GoOn(Standing::Trial { starts: STARTS }),
            false => Start::GoBack(give_up),
        }
    }

    /// Whether the firmware that starts has to confirm itself.
    pub fn is_on_trial(&self) -> bool {
        self.on_trial().is_some()
    }

    /// The word that confirms the firmware that starts; `None` if it is not on trial.
    pub fn confirm(&self) -> Option<Step> {
        let (at, [a, b, c, _]) = self.on_trial()?;
        Some(mark(at + MARKS_AT, [a, b, c, 0]))
    }

    /// What puts a slot in force, on trial; its firmware must be there already.
    pub fn switch_to(&self, slot: Slot, version: Version) -> Steps {
        // Without an entry that counts, slot 0 runs, and the second entry is as good as any.
        let page = match self.in_force() {
            Some((PAGE, _)) => 0,
            _ => PAGE,
        };
        let largest = self.entries.iter().filter(|entry| entry.is_whole());
        let largest = largest.map(|entry| entry.number).max().unwrap_or(0);
        let mut number = largest.saturating_add(1);
        if Entry::numbered(number).slot() != slot {
            number = number.saturating_add(1);
        }
        let [a, b, c, d, e, f] = version.to_bytes();
        let mut steps = Steps::new();
        let mut step = |step| {
            // There is room for all of them.
            let _ = steps.push(step);
        };
        // An entry that was taken back must not come to count again while its page is being erased.
        step(mark(page + CRC_AT, [0; 4]));
        step(Step::Erase { page });
        step(mark(page + 4, TRIAL));
        step(mark(page + 12, [a, b, c, d]));
        step(mark(page + 16, [e, f, 0xff, 0xff]));
        step(mark(page, number.to_le_bytes()));
        step(mark(page + CRC_AT, crc(number).to_le_bytes()));
        steps
    }

    fn in_force(&self) -> Option<(u32, &Entry)> {
        let [first, second] = &self.entries;
        let counting = [(0, first), (PAGE, second)].into_iter();
        counting
            .filter(|(_, entry)| entry.counts())
            .max_by_key(|(_, entry)| entry.number)
    }

    /// Where the entry in force begins, and its marks, if it is on trial.
    fn on_trial(&self) -> Option<(u32, [u8; 4])> {
        let (at, entry) = self.in_force()?;
        Some((at, entry.marks_on_trial()?))
    }

    fn settled(&self) -> Standing {
        let newest = self.entries.iter().filter(|entry| entry.is_whole());
        let newest = newest.max_by_key(|entry| entry.number);
        let taken_back = newest.filter(|entry| !entry.counts() && entry.marks_on_trial().is_some());
        match taken_back.and_then(Entry::trial) {
            Some((_, from)) => Standing::Back { from },
            None => Standing::Settled,
        }
    }

    fn without(mut self, at: u32) -> Self {
        let [first, second] = &mut self.entries;
        let entry = if at == 0 { first } else { second };
        entry.state = INVALID;
        self
    }
}

impl Entry {
    const fn numbered(number: u32) -> Self {
        Self {
            number,
            label: [0xff; 20],
            state: ERASED,
            crc: ERASED,
        }
    }
}

const fn mark(at: u32, word: [u8; 4]) -> Step {
    Step::Write { at, word }
}

/// CRC-32 as the chips' ROM computes it when it is given all ones to begin with, bit by bit: there are four
/// bytes.
const fn crc(number: u32) -> u32 {
    let mut crc = number;
    let mut bit = 0;
    while bit < 32 {
        crc = crc >> 1 ^ if crc & 1 != 0 { 0xedb8_8320 } else { 0 };
        bit += 1;
    }
    !crc
}

#[cfg(test)]
mod tests;
