//! Commands about this arm and its paper, and two of motion: G4, G31, G40, M171, M280.

use super::{Axes, Command, Letters, Request, choice, coordinate, fixed, nothing_after};
use crate::arm::{NibShift, ZMap};
use crate::lineus::Refusal;
use crate::machine::{Bare, Errand};
use crate::motion::{MOST_DWELL, Micros};
use crate::text::Words;

/// P, or S, in seconds, at most [`MOST_DWELL`].
pub(super) fn dwell<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    const BITS: u32 = 24;
    const MOST: u32 = (MOST_DWELL.get() / 1_000_000) as u32;
    let mut duration = None;
    while let Some(letter) = words.letter()? {
        match letter {
            'P' | 'S' if duration.is_some() => return Err(Refusal::Repeated(letter)),
            'P' | 'S' => {
                let seconds = words.fixed(letter, BITS, MOST)?.ok();
                let seconds = seconds.and_then(|bits| u64::try_from(bits).ok());
                let seconds = seconds.ok_or(Refusal::OutOfRange {
                    letter,
                    least: 0,
                    most: MOST.cast_signed(),
                })?;
                // 12 bits of seconds, 24 of their fraction, and 20 of the microseconds.
                let micros = (seconds * 1_000_000 + (1 << (BITS - 1))) >> BITS;
                duration = Some(Micros::new(micros));
            }
            _ => return Err(Refusal::UnknownParameter(letter)),
        }
    }
    let dwell = |duration| Request::Errand(Errand::Dwell(duration));
    duration.map(dwell).ok_or(Refusal::Missing('P'))
}

/// S is the map, P the shift in millimetres.
pub(super) fn compensation<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    let mut letters = Letters::default();
    let (mut map, mut shift) = (None, None);
    while let Some(letter) = words.letter()? {
        letters.once(letter)?;
        match letter {
            'S' => map = Some(z_map(words)?),
            'P' => shift = Some(nib_shift(words)?),
            _ => return Err(Refusal::UnknownParameter(letter)),
        }
    }
    Ok(match (map, shift) {
        (None, None) => Request::Compensation,
        (map, shift) => Request::SetCompensation { map, shift },
    })
}

fn z_map<'a>(words: &mut Words<'a>) -> Result<ZMap, Refusal<'a>> {
    let text = words.list('S')?;
    if text.is("clear") {
        return Ok(ZMap::FLAT);
    }
    ZMap::parse(text.raw()).ok_or(Refusal::BadMap(text.raw()))
}

/// Rounded to hundredths of a millimetre.
fn nib_shift<'a>(words: &mut Words<'a>) -> Result<NibShift, Refusal<'a>> {
    const BITS: u32 = 16;
    let bits = fixed(words, 'P', BITS, NibShift::MOST.into())?;
    let hundredths = (bits * 100 + (1 << (BITS - 1))) >> BITS;
    NibShift::from_hundredths(hundredths as i16).ok_or(Refusal::OutOfRange {
        letter: 'P',
        least: -i32::from(NibShift::MOST),
        most: NibShift::MOST.into(),
    })
}

/// K names the axes that move as always.
pub(super) fn uncalibrated<'a>(words: &mut Words<'a>) -> Result<Command, Refusal<'a>> {
    let mut letters = Letters::default();
    let mut axes = Axes::default();
    let mut bare = Bare { xy: true, z: true };
    while let Some(letter) = words.letter()? {
        letters.once(letter)?;
        let axis = match letter {
            'X' => 0,
            'Y' => 1,
            'Z' => 2,
            'K' => {
                let text = words.text(letter)?;
                match (text.is("xy"), text.is("z")) {
                    (true, _) => bare.xy = false,
                    (_, true) => bare.z = false,
                    _ => return Err(Refusal::BadText('K', text.raw(), "'xy' or 'z'")),
                }
                continue;
            }
            _ => return Err(Refusal::UnknownParameter(letter)),
        };
        let value = coordinate(words, letter)?;
        if let Some(place) = axes.values.get_mut(axis) {
            *place = value;
            axes.given |= 1 << axis;
        }
    }
    Ok(Command::Uncalibrated(axes, bare))
}

/// Without the word nothing is forgotten by mistake.
pub(super) fn factory_reset<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    match words.letter()? {
        None => Err(Refusal::Missing('S')),
        Some('S') => {
            let text = words.text('S')?;
            if !text.is("confirm") {
                return Err(Refusal::BadText('S', text.raw(), "'confirm'"));
            }
            nothing_after('S', words, Request::FactoryReset)
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

/// S, E and P, the servos as M114 names them: 1 as the board says, 2 the other way.
pub(super) fn directions<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    let mut letters = Letters::default();
    let [mut shoulder, mut elbow, mut pen] = [None; 3];
    while let Some(letter) = words.letter()? {
        letters.once(letter)?;
        let servo = match letter {
            'S' => &mut shoulder,
            'E' => &mut elbow,
            'P' => &mut pen,
            _ => return Err(Refusal::UnknownParameter(letter)),
        };
        *servo = Some(choice(words, letter, 2)? == 2);
    }
    Ok(match [shoulder, elbow, pen] {
        [None, None, None] => Request::Directions,
        servos => Request::SetDirections(servos),
    })
}
