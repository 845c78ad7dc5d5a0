//! What the emulated arm recorded: servo frames and changes of its light.

use anyhow::{Result, bail};
use protocol_core::machine::SetPoint;
use protocol_core::motion::{Coordinate, Micros, Position, PulseWidth};

/// One record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Record {
    /// A servo frame.
    Frame(Frame),
    /// The light shows another colour: red, green, blue.
    Light {
        /// When, since the start.
        time: Micros,
        /// Red, green, blue.
        colour: [u8; 3],
    },
    /// So many records were lost since the start, before this place.
    Lost(u32),
}

/// A servo frame as the board wrote it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Of the servo clock.
    pub time: Micros,
    /// What the servos were told.
    pub set_point: SetPoint,
    /// How long after its time the frame was written, in microseconds.
    pub late: u32,
    /// The tick found the processor asleep: its lateness is the emulator's, which oversleeps.
    pub from_sleep: bool,
}

/// Splits the recorded bytes into records; what is not yet whole at the end is left in `bytes`.
pub fn take(bytes: &mut Vec<u8>) -> Result<Vec<Record>> {
    let mut records = Vec::new();
    let mut rest = bytes.as_slice();
    while let Some((record, after)) = next(rest)? {
        records.push(record);
        rest = after;
    }
    let used = bytes.len() - rest.len();
    bytes.drain(..used);
    Ok(records)
}

fn next(bytes: &[u8]) -> Result<Option<(Record, &[u8])>> {
    let Some((letter, mut rest)) = bytes.split_first() else {
        return Ok(None);
    };
    let mut fields = || -> Option<Record> {
        Some(match letter {
            b'S' => {
                let time = Micros::new(u64::from_le_bytes(field(&mut rest)?));
                let mut signed =
                    || Some(Coordinate::from_bits(i32::from_le_bytes(field(&mut rest)?)));
                let position = Position {
                    x: signed()?,
                    y: signed()?,
                    z: signed()?,
                };
                let mut unsigned = || Some(u32::from_le_bytes(field(&mut rest)?));
                let pulses = [unsigned()?, unsigned()?, unsigned()?].map(PulseWidth::new);
                let late = unsigned()?;
                let [flags] = field(&mut rest)?;
                let set_point = SetPoint {
                    position,
                    pulses,
                    held: flags & 1 != 0,
                    moving: flags & 2 != 0,
                    outputs: [8, 16, 32].map(|output| flags & output != 0),
                };
                Record::Frame(Frame {
                    time,
                    set_point,
                    late,
                    from_sleep: flags & 4 != 0,
                })
            }
            b'L' => Record::Light {
                time: Micros::new(u64::from_le_bytes(field(&mut rest)?)),
                colour: field(&mut rest)?,
            },
            b'X' => Record::Lost(u32::from_le_bytes(field(&mut rest)?)),
            _ => return None,
        })
    };
    if !matches!(letter, b'S' | b'L' | b'X') {
        bail!("the record begins with {letter:#04x}");
    }
    Ok(fields().map(|record| (record, rest)))
}

fn field<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (field, after) = rest.split_first_chunk()?;
    *rest = after;
    Some(*field)
}
