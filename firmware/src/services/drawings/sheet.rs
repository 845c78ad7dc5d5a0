//! The head of a sheet, which is a page of flash that holds a part of a drawing.
//!
//! | word | |
//! |---|---|
//! | 0 | `QDr1` |
//! | 1 | the drawing's sequence number: that of no other one |
//! | 2 | the slot, and from bit 16 on the sheet's place in the drawing |
//! | 3 | checksum of the words before |
//! | 4 | on the first sheet: length of the drawing in bytes |
//! | 5 | checksum of the drawing |
//! | 6 | checksum of the words before |
//! | 7 | all ones; something else where the drawing is struck |
//!
//! Words are little-endian, checksums CRC-32 (ISO-HDLC). Words 0 to 3 are written when the sheet is begun;
//! 4 to 6, the seal, when the drawing is complete, and 7 when it is deleted or replaced. Each word is
//! written once between two erases.

use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};
use protocol_core::drawings::Slot;

/// Bytes of a head; what follows is the drawing.
pub(super) const HEAD: usize = 32;
/// Where the seal is.
pub(super) const SEAL: u32 = 16;
/// Where the strike is.
pub(super) const STRIKE: u32 = 28;
/// What it is made of.
pub(super) const STRUCK: [u8; 4] = [0; 4];

const MAGIC: u32 = u32::from_le_bytes(*b"QDr1");

/// The checksum of everything here.
pub(super) static SUM: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);
/// A checksum on its way.
pub(super) type Adding = Digest<'static, u32, Table<1>>;

/// What a sheet belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    pub(super) sequence: u32,
    pub(super) slot: Slot,
    /// 0 for the first sheet of the drawing.
    pub(super) index: u16,
}

/// What is known of a complete drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seal {
    /// Bytes of it.
    pub(super) length: u32,
    /// Its checksum.
    pub(super) sum: u32,
}

impl Head {
    const fn words(self) -> [u32; 3] {
        let place = self.slot.number() as u32 | (self.index as u32) << 16;
        [MAGIC, self.sequence, place]
    }

    /// What is written when the sheet is begun.
    pub(super) fn to_bytes(self) -> [u8; 16] {
        let [a, b, c] = self.words();
        bytes([a, b, c, sum(&self.words())])
    }

    /// What is written when the drawing is complete.
    pub(super) fn seal(self, Seal { length, sum: of_it }: Seal) -> [u8; 12] {
        let [a, b, c] = self.words();
        bytes([length, of_it, sum(&[a, b, c, length, of_it])])
    }

    /// Reads it; `None` where there is none.
    pub(super) fn read(head: &[u8; HEAD]) -> Option<Self> {
        let [magic, sequence, place, check, ..] = words(head);
        let found = Self {
            sequence,
            slot: Slot::new(place as u8)?,
            index: (place >> 16) as u16,
        };
        let whole = magic == MAGIC && found.words() == [magic, sequence, place];
        (whole && check == sum(&found.words())).then_some(found)
    }

    /// Reads the seal; `None` where the drawing was never complete.
    pub(super) fn read_seal(self, head: &[u8; HEAD]) -> Option<Seal> {
        let [a, b, c] = self.words();
        let [.., length, of_it, check, _] = words(head);
        let whole = self.index == 0 && check == sum(&[a, b, c, length, of_it]);
        whole.then_some(Seal { length, sum: of_it })
    }
}

/// The strike of a sheet: none, or one, or one that was not finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Strike {
    None,
    Torn,
    Done,
}

impl Strike {
    pub(super) fn read(head: &[u8; HEAD]) -> Self {
        let [.., strike] = words(head);
        match strike {
            u32::MAX => Self::None,
            0 => Self::Done,
            _ => Self::Torn,
        }
    }
}

fn sum(words: &[u32]) -> u32 {
    let mut adding = SUM.digest();
    words
        .iter()
        .for_each(|word| adding.update(&word.to_le_bytes()));
    adding.finalize()
}

fn words(head: &[u8; HEAD]) -> [u32; HEAD / 4] {
    let mut words = [0; HEAD / 4];
    let (chunks, _) = head.as_chunks::<4>();
    for (word, chunk) in words.iter_mut().zip(chunks) {
        *word = u32::from_le_bytes(*chunk);
    }
    words
}

fn bytes<const WORDS: usize, const BYTES: usize>(words: [u32; WORDS]) -> [u8; BYTES] {
    let mut bytes = [0; BYTES];
    let (chunks, _) = bytes.as_chunks_mut::<4>();
    for (chunk, word) in chunks.iter_mut().zip(words) {
        *chunk = word.to_le_bytes();
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: Head = Head {
        sequence: 0x0102_0304,
        slot: Slot::FIRST,
        index: 0,
    };

    fn written(head: Head, seal: Option<Seal>) -> [u8; HEAD] {
        let mut bytes = [0xff; HEAD];
        bytes[..16].copy_from_slice(&head.to_bytes());
        if let Some(seal) = seal {
            bytes[16..28].copy_from_slice(&head.seal(seal));
        }
        bytes
    }

    #[test]
    fn a_head_is_read_as_it_was_written() {
        for number in [1, 17, 32] {
            for index in [0, 1, 359, u16::MAX] {
                let head = Head {
                    slot: Slot::new(number).unwrap(),
                    index,
                    ..FIRST
                };
                let bytes = written(head, None);
                assert_eq!(Head::read(&bytes), Some(head));
                assert_eq!(head.read_seal(&bytes), None);
            }
        }
        assert_eq!(Head::read(&[0xff; HEAD]), None);
        assert_eq!(Head::read(&[0; HEAD]), None);
    }

    #[test]
    fn a_seal_counts_on_the_first_sheet_and_whole() {
        let seal = Seal {
            length: 1_463_040,
            sum: 0xdead_beef,
        };
        let bytes = written(FIRST, Some(seal));
        assert_eq!(FIRST.read_seal(&bytes), Some(seal));
        let second = Head { index: 1, ..FIRST };
        assert_eq!(second.read_seal(&written(second, Some(seal))), None);
        // A write that was cut short, at any byte, unless what is missing is all ones.
        for length in 16..28 {
            let mut torn = bytes;
            torn[length..].fill(0xff);
            if torn != bytes {
                assert_eq!(FIRST.read_seal(&torn), None, "{length}");
            }
        }
    }

    #[test]
    fn any_wrong_bit_is_noticed() {
        let seal = Seal {
            length: 1000,
            sum: 1,
        };
        let bytes = written(FIRST, Some(seal));
        for bit in 0..28 * 8 {
            let mut wrong = bytes;
            wrong[bit / 8] ^= 1 << (bit % 8);
            let read = Head::read(&wrong).map(|head| head.read_seal(&wrong));
            assert!(matches!(read, None | Some(None)), "bit {bit}");
        }
    }

    #[test]
    fn a_strike_is_none_torn_or_done() {
        let mut bytes = written(FIRST, None);
        assert_eq!(Strike::read(&bytes), Strike::None);
        bytes[28] = 0;
        assert_eq!(Strike::read(&bytes), Strike::Torn);
        bytes[28..].fill(0);
        assert_eq!(Strike::read(&bytes), Strike::Done);
        assert_eq!(STRUCK, bytes[28..]);
    }
}
