//! Drawings that the arm keeps: where they lie, which one the button draws, how one is replayed.

/// Slots for drawings, numbered from 1 (`reference/line-us.md`, section 5, M28).
pub const MAX_DRAWINGS: u8 = 32;
const PLACES: usize = MAX_DRAWINGS as usize;

/// First line of every stored drawing: it is drawn with neither scale nor offset, whatever was drawn
/// before (`reference/line-us.md`, section 5).
pub const FIRST_LINE: &[u8] = b"G54 X0 Y0 S1\n";

/// A slot, 1 to [`MAX_DRAWINGS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Slot(u8);

impl Slot {
    /// The first one.
    pub const FIRST: Self = Self(1);

    /// The slot of that number; `None` if there is none.
    pub const fn new(number: u8) -> Option<Self> {
        match number {
            1..=MAX_DRAWINGS => Some(Self(number)),
            _ => None,
        }
    }

    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        (1..=MAX_DRAWINGS).map(Self)
    }

    /// 1 to [`MAX_DRAWINGS`].
    pub const fn number(self) -> u8 {
        self.0
    }

    /// Its place in a table of [`MAX_DRAWINGS`].
    pub const fn index(self) -> usize {
        self.0 as usize - 1
    }
}

/// Which drawings there are, and how long.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contents([u32; PLACES]);

impl Contents {
    /// None.
    pub const EMPTY: Self = Self([0; PLACES]);

    /// A drawing is in this slot now, of so many bytes and not empty; `None`: none is.
    pub fn set(&mut self, slot: Slot, bytes: Option<u32>) {
        if let Some(place) = self.0.get_mut(slot.index()) {
            *place = bytes.unwrap_or(0);
        }
    }

    /// Bytes of the drawing in this slot, if there is one.
    pub fn bytes(&self, slot: Slot) -> Option<u32> {
        self.0
            .get(slot.index())
            .copied()
            .filter(|bytes| *bytes != 0)
    }

    /// All drawings, by slot.
    pub fn iter(&self) -> impl Iterator<Item = (Slot, u32)> {
        Slot::all().filter_map(|slot| Some((slot, self.bytes(slot)?)))
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.iter().next().is_none()
    }
}

/// Room for drawings, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Space {
    /// All there is.
    pub total: u32,
    /// What drawings take of it, the one that is being recorded included.
    pub used: u32,
}

impl Space {
    /// What a new drawing can take.
    pub const fn free(self) -> u32 {
        self.total.saturating_sub(self.used)
    }

    /// Used, in whole percent, rounded down.
    pub const fn percent(self) -> u32 {
        // The area is far below 2^32 / 100 bytes; where it is not, precision goes.
        match self.total {
            0 => 0,
            total if total < u32::MAX / 100 => self.used * 100 / total,
            total => self.used / (total / 100),
        }
    }
}

/// What a short press of the button draws (`reference/line-us.md`, section 5, M23; what its numbers mean
/// is not public, and chosen here).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ButtonDraws {
    /// `S0`: nothing; a press is about the network alone.
    Nothing,
    /// `S1`: each time the next one that is stored.
    #[default]
    Next,
    /// `S2 K`: always this one.
    Always(Slot),
    /// `S3`: any of them.
    Any,
}

impl ButtonDraws {
    /// Behind the S of M23, and in memory.
    pub const fn number(self) -> u8 {
        match self {
            Self::Nothing => 0,
            Self::Next => 1,
            Self::Always(_) => 2,
            Self::Any => 3,
        }
    }

    /// The slot behind K.
    pub const fn slot(self) -> Option<Slot> {
        match self {
            Self::Always(slot) => Some(slot),
            _ => None,
        }
    }

    /// The choice of that number; `None` where there is none, or it lacks its slot.
    pub const fn new(number: u8, slot: Option<Slot>) -> Option<Self> {
        match (number, slot) {
            (0, None) => Some(Self::Nothing),
            (1, None) => Some(Self::Next),
            (2, Some(slot)) => Some(Self::Always(slot)),
            (3, None) => Some(Self::Any),
            _ => None,
        }
    }

    /// Bytes of its form in memory.
    pub const BYTES: usize = 2;

    /// Its form in memory: the number, and the slot or 0.
    pub const fn to_bytes(self) -> [u8; Self::BYTES] {
        let slot = match self.slot() {
            Some(slot) => slot.number(),
            None => 0,
        };
        [self.number(), slot]
    }

    /// Reads its form in memory.
    pub const fn from_bytes([number, slot]: [u8; Self::BYTES]) -> Option<Self> {
        match slot {
            0 => Self::new(number, None),
            _ => match Slot::new(slot) {
                Some(slot) => Self::new(number, Some(slot)),
                None => None,
            },
        }
    }

    /// What a press draws now, after `last` was drawn; `random` is any number.
    pub fn choose(self, stored: &Contents, last: Option<Slot>, random: u32) -> Option<Slot> {
        let slots = || stored.iter().map(|(slot, _)| slot);
        match self {
            Self::Nothing => None,
            Self::Next => slots()
                .find(|slot| last.is_none_or(|last| *slot > last))
                .or_else(|| slots().next()),
            Self::Always(slot) => stored.bytes(slot).map(|_| slot),
            Self::Any => {
                let count = slots().count() as u32;
                let place = random.checked_rem(count)?;
                slots().nth(place as usize)
            }
        }
    }
}

/// A drawing's beginning, drawn again and again with the pen up (`reference/line-us.md`, section 5, M85).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Replay {
    /// The drawing.
    pub slot: Slot,
    /// How long it is drawn, in seconds, 1 to [`Self::MAX_SECONDS`].
    pub seconds: u16,
    /// From one beginning to the next, in seconds, 1 to [`Self::MAX_SECONDS`]; where this is less than
    /// `seconds`, the next one begins at once.
    pub every: u16,
}

impl Replay {
    /// Longest replay, and longest time from one to the next: an hour.
    pub const MAX_SECONDS: u16 = 3600;
    /// How long it is drawn where nothing is said, in seconds.
    pub const DEFAULT_SECONDS: u16 = 30;
    /// How often where nothing is said, in seconds.
    pub const DEFAULT_EVERY: u16 = 300;
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    fn slot(number: u8) -> Slot {
        Slot::new(number).unwrap()
    }

    fn stored(numbers: &[u8]) -> Contents {
        let mut contents = Contents::EMPTY;
        for number in numbers {
            contents.set(slot(*number), Some(100 + u32::from(*number)));
        }
        contents
    }

    #[test]
    fn slots_are_1_to_32() {
        assert_eq!(Slot::new(0), None);
        assert_eq!(Slot::new(33), None);
        let numbers: Vec<u8> = Slot::all().map(Slot::number).collect();
        assert_eq!(numbers, (1..=32).collect::<Vec<u8>>());
        assert!(Slot::all().all(|slot| Slot::new(slot.number()) == Some(slot)));
    }

    #[test]
    fn what_is_stored_is_listed_by_slot() {
        let mut contents = stored(&[32, 5, 1]);
        let list: Vec<_> = contents.iter().collect();
        assert_eq!(list, [(slot(1), 101), (slot(5), 105), (slot(32), 132)]);
        contents.set(slot(5), None);
        assert_eq!(contents.bytes(slot(5)), None);
        assert!(!contents.is_empty());
        assert!(stored(&[]).is_empty());
    }

    #[test]
    fn percent_of_the_room() {
        for (used, total, percent) in [
            (0, 0, 0),
            (0, 1000, 0),
            (356_922, 1_562_625, 22),
            (999, 1000, 99),
            (1000, 1000, 100),
            (3_000_000_000, 4_000_000_000, 75),
        ] {
            assert_eq!(
                Space { total, used }.percent(),
                percent,
                "{used} of {total}"
            );
        }
        assert_eq!(Space { total: 10, used: 4 }.free(), 6);
    }

    #[test]
    fn the_next_one_comes_round() {
        let three = stored(&[2, 7, 32]);
        let next = |last: Option<u8>| ButtonDraws::Next.choose(&three, last.map(slot), 0);
        assert_eq!(next(None), Some(slot(2)));
        assert_eq!(next(Some(2)), Some(slot(7)));
        // One that is no longer stored.
        assert_eq!(next(Some(5)), Some(slot(7)));
        assert_eq!(next(Some(7)), Some(slot(32)));
        assert_eq!(next(Some(32)), Some(slot(2)));
        assert_eq!(ButtonDraws::Next.choose(&stored(&[]), None, 0), None);
    }

    #[test]
    fn always_the_same_nothing_or_any() {
        let three = stored(&[2, 7, 32]);
        assert_eq!(ButtonDraws::Nothing.choose(&three, None, 0), None);
        let always = |number| ButtonDraws::Always(slot(number)).choose(&three, None, 0);
        assert_eq!(always(7), Some(slot(7)));
        assert_eq!(always(8), None);
        for random in 0..9 {
            let expected = [2, 7, 32][random as usize % 3];
            assert_eq!(
                ButtonDraws::Any.choose(&three, None, random),
                Some(slot(expected))
            );
        }
        assert_eq!(ButtonDraws::Any.choose(&stored(&[]), None, 5), None);
    }

    #[test]
    fn choices_survive_their_bytes() {
        for choice in [
            ButtonDraws::Nothing,
            ButtonDraws::Next,
            ButtonDraws::Always(slot(32)),
            ButtonDraws::Any,
        ] {
            assert_eq!(ButtonDraws::from_bytes(choice.to_bytes()), Some(choice));
        }
        for bytes in [[0, 1], [1, 1], [2, 0], [2, 33], [3, 1], [4, 0]] {
            assert_eq!(ButtonDraws::from_bytes(bytes), None, "{bytes:?}");
        }
    }
}
