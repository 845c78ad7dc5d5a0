//! A line becomes a typed command here, once; nothing downstream sees text.

use super::refusal::Refusal;
use crate::machine::Manner;
use crate::motion::{Coordinate, MAX_COORDINATE, MAX_SCALE, StepRange, StepSize, Transform};
use crate::settings::{MAX_NAME, MachineName};
use crate::text::{Decimal, Words};

/// A valid command, its numbers as written: not yet scaled, not yet limited.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Comments and nothing else.
    Nothing,
    /// G00, G01: coordinates in 1/65536 units, within +-[`MAX_COORDINATE`].
    Move {
        /// Straight or rapid.
        manner: Manner,
        /// X as written.
        x: Option<i64>,
        /// Y as written.
        y: Option<i64>,
        /// Z as written.
        z: Option<i64>,
    },
    /// G28.
    Home,
    /// G54: offsets in 1/65536 units, scale in 1/2^32 and not zero.
    Transform {
        /// Offset of X.
        x: Option<i64>,
        /// Offset of Y.
        y: Option<i64>,
        /// Scale of X and Y.
        scale: Option<i64>,
    },
    /// G94.
    Speed {
        /// S, or its alias F.
        pen_down: Option<StepSize>,
        /// P.
        pen_up: Option<StepSize>,
    },
    /// M114.
    Position,
    /// `M114 S`.
    Angles,
    /// M115.
    Capabilities,
    /// M122.
    Diagnostics,
    /// M374.
    Calibrate,
    /// `M374 Sclear`.
    ClearCalibration,
    /// M550.
    Name,
    /// `M550 P`.
    Rename(MachineName),
}

/// Reads one line.
///
/// # Errors
/// A [`Refusal`] that names what is wrong with it.
pub fn parse(line: &str) -> Result<Command, Refusal<'_>> {
    let mut words = Words::new(line);
    let code = match words.code() {
        Ok(Some(code)) => code,
        Ok(None) => return Ok(Command::Nothing),
        Err(Ok(error)) => return Err(error.into()),
        Err(Err(text)) => return Err(Refusal::UnknownCommand(text)),
    };
    match code {
        (b'G', 1) => a_move(&mut words, Manner::Straight),
        (b'G', 0) => a_move(&mut words, Manner::Rapid),
        (b'G', 28) => without_parameters(&mut words, Command::Home),
        (b'G', 54) => transform(&mut words),
        (b'G', 94) => speed(&mut words),
        (b'M', 114) => position(&mut words),
        (b'M', 115) => without_parameters(&mut words, Command::Capabilities),
        (b'M', 122) => without_parameters(&mut words, Command::Diagnostics),
        (b'M', 374) => calibration(&mut words),
        (b'M', 550) => name(&mut words),
        (b'M', code @ (587 | 588 | 997)) => Err(Refusal::NotYet(code)),
        _ => {
            let text = line.trim_start_matches([' ', '\t']);
            let end = text.find([' ', '\t', ';', '(']).unwrap_or(text.len());
            Err(Refusal::UnknownCommand(text.get(..end).unwrap_or(text)))
        }
    }
}

/// Letters met so far on the line.
#[derive(Default)]
struct Letters(u32);

impl Letters {
    fn once<'a>(&mut self, letter: char) -> Result<(), Refusal<'a>> {
        let bit = 1 << (u32::from(letter) & 31);
        if self.0 & bit != 0 {
            return Err(Refusal::Repeated(letter));
        }
        self.0 |= bit;
        Ok(())
    }
}

fn a_move<'a>(words: &mut Words<'a>, manner: Manner) -> Result<Command, Refusal<'a>> {
    let mut letters = Letters::default();
    let (mut x, mut y, mut z) = (None, None, None);
    while let Some(letter) = words.letter()? {
        letters.once(letter)?;
        match letter {
            'X' => x = Some(coordinate(words, letter)?),
            'Y' => y = Some(coordinate(words, letter)?),
            'Z' => z = Some(coordinate(words, letter)?),
            // Feed rates of other machines: accepted, without a meaning here.
            'F' => {
                words.number(letter)?;
            }
            _ => return Err(Refusal::UnknownParameter(letter)),
        }
    }
    Ok(Command::Move { manner, x, y, z })
}

fn transform<'a>(words: &mut Words<'a>) -> Result<Command, Refusal<'a>> {
    let mut letters = Letters::default();
    let (mut x, mut y, mut scale) = (None, None, None);
    while let Some(letter) = words.letter()? {
        letters.once(letter)?;
        match letter {
            'X' => x = Some(coordinate(words, letter)?),
            'Y' => y = Some(coordinate(words, letter)?),
            'S' => {
                let factor = fixed(
                    words.number(letter)?,
                    letter,
                    Transform::SCALE_BITS,
                    MAX_SCALE,
                )?;
                if factor == 0 {
                    return Err(Refusal::ZeroScale);
                }
                scale = Some(factor);
            }
            _ => return Err(Refusal::UnknownParameter(letter)),
        }
    }
    Ok(Command::Transform { x, y, scale })
}

fn speed<'a>(words: &mut Words<'a>) -> Result<Command, Refusal<'a>> {
    let mut letters = Letters::default();
    let (mut pen_down, mut pen_up) = (None, None);
    while let Some(letter) = words.letter()? {
        letters.once(letter)?;
        match letter {
            // The table's F is a leftover, the example's S is right (`reference/line-us.md`, section 4).
            'S' | 'F' if pen_down.is_some() => return Err(Refusal::Repeated(letter)),
            'S' | 'F' => pen_down = Some(step(words, letter, StepRange::PEN_DOWN)?),
            'P' => pen_up = Some(step(words, letter, StepRange::PEN_UP)?),
            _ => return Err(Refusal::UnknownParameter(letter)),
        }
    }
    Ok(Command::Speed { pen_down, pen_up })
}

fn position<'a>(words: &mut Words<'a>) -> Result<Command, Refusal<'a>> {
    match words.letter()? {
        None => Ok(Command::Position),
        Some('S') => {
            words.no_value('S')?;
            without_parameters(words, Command::Angles)
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn calibration<'a>(words: &mut Words<'a>) -> Result<Command, Refusal<'a>> {
    match words.letter()? {
        None => Ok(Command::Calibrate),
        Some('S') => {
            let text = words.text('S')?;
            if !text.is("clear") {
                return Err(Refusal::BadText('S', text.raw(), "'clear'"));
            }
            without_parameters(words, Command::ClearCalibration)
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn name<'a>(words: &mut Words<'a>) -> Result<Command, Refusal<'a>> {
    match words.letter()? {
        None => Ok(Command::Name),
        Some('P') => {
            let text = words.text('P')?;
            let name = text
                .unescape::<MAX_NAME>()
                .and_then(|name| MachineName::new(&name))
                .ok_or(Refusal::BadName(text.raw()))?;
            without_parameters(words, Command::Rename(name))
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

/// The command, if nothing more follows.
fn without_parameters<'a>(words: &mut Words<'a>, command: Command) -> Result<Command, Refusal<'a>> {
    match words.letter()? {
        None => Ok(command),
        Some(letter @ ('S' | 'P'))
            if matches!(
                command,
                Command::Angles | Command::ClearCalibration | Command::Rename(_)
            ) =>
        {
            Err(Refusal::Repeated(letter))
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn coordinate<'a>(words: &mut Words<'a>, letter: char) -> Result<i64, Refusal<'a>> {
    fixed(
        words.number(letter)?,
        letter,
        Coordinate::FRACTION_BITS,
        MAX_COORDINATE,
    )
}

fn step<'a>(
    words: &mut Words<'a>,
    letter: char,
    range: StepRange,
) -> Result<StepSize, Refusal<'a>> {
    let out_of_range = Refusal::OutOfRange {
        letter,
        least: range.least.into(),
        most: range.most.into(),
    };
    words
        .number(letter)?
        .to_fixed(Coordinate::FRACTION_BITS, range.most.into())
        .ok()
        .and_then(|bits| range.step(bits))
        .ok_or(out_of_range)
}

fn fixed<'a>(number: Decimal, letter: char, bits: u32, limit: u32) -> Result<i64, Refusal<'a>> {
    number.to_fixed(bits, limit).map_err(|_| {
        let most = limit.cast_signed();
        Refusal::OutOfRange {
            letter,
            least: -most,
            most,
        }
    })
}
