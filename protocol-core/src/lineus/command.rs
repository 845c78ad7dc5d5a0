//! A line becomes a typed command here, once; nothing downstream sees text.

use super::refusal::Refusal;
use crate::machine::Manner;
use crate::motion::{Coordinate, MAX_COORDINATE, MAX_SCALE, StepRange, StepSize, Transform};
use crate::settings::{AccessPointName, MAX_NAME, MachineName, StartMode};
use crate::text::Words;
use crate::update::{MAX_ADDRESS, ManifestAddress};
use crate::wifi::{MAX_PASSWORD, MAX_SSID, Password, Ssid};

/// A valid command, its numbers as written: not yet scaled, not yet limited.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Comments and nothing else.
    Nothing,
    /// G00, G01.
    Move(Manner, Axes),
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
    /// M552.
    Start,
    /// `M552 S P`.
    SetStart {
        /// What the machine is after power-on.
        mode: Option<StartMode>,
        /// How its own network is called.
        name: Option<AccessPointName>,
    },
    /// M291.
    Waves,
    /// `M291 S1`, `M291 S2`.
    SetWaves(bool),
    /// M587.
    Networks,
    /// `M587 S P`.
    Remember {
        /// The network's name.
        ssid: Ssid,
        /// Its password; without one, the one that is remembered, or none.
        password: Option<Password>,
    },
    /// `M588 S`.
    Forget(Ssid),
    /// `M588 S*`.
    ForgetAll,
    /// M997.
    Update,
    /// `M997 S`: where to ask from now on; with an empty text, nowhere.
    SetUpdateAddress(Option<ManifestAddress>),
}

/// Coordinates of a move as written, in 1/65536 units, within +-[`MAX_COORDINATE`]; any of them may be
/// absent.
///
/// Not three `Option`s, because commands are moved about and those are twice as large.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Axes {
    values: [i64; 3],
    /// A bit for each axis, in the order X, Y, Z; the bit after them is of no meaning.
    given: u8,
}

impl Axes {
    /// X, Y and Z.
    pub fn to_array(self) -> [Option<i64>; 3] {
        let [x, y, z] = self.values;
        [(x, 1), (y, 2), (z, 4)].map(|(value, bit)| (self.given & bit != 0).then_some(value))
    }
}

/// Reads one line.
///
/// # Errors
/// A [`Refusal`] that names what is wrong with it.
#[inline]
pub fn parse(line: &[u8]) -> Result<Command, Refusal<'_>> {
    let mut words = Words::new(line);
    let manner = match words.code()? {
        None => return Ok(Command::Nothing),
        Some((b'G', 1)) => Manner::Straight,
        Some((b'G', 0)) => Manner::Rapid,
        Some(code) => return other_than_a_move(code, words, line),
    };
    a_move(words, manner)
}

fn other_than_a_move<'a>(
    code: (u8, u32),
    mut words: Words<'a>,
    line: &'a [u8],
) -> Result<Command, Refusal<'a>> {
    match code {
        (b'G', 28) => without_parameters(&mut words, Command::Home),
        (b'G', 54) => transform(&mut words),
        (b'G', 94) => speed(&mut words),
        (b'M', 114) => position(&mut words),
        (b'M', 115) => without_parameters(&mut words, Command::Capabilities),
        (b'M', 122) => without_parameters(&mut words, Command::Diagnostics),
        (b'M', 374) => calibration(&mut words),
        (b'M', 550) => name(&mut words),
        (b'M', 291) => waves(&mut words),
        (b'M', 552) => start(&mut words),
        (b'M', 587) => network(&mut words),
        (b'M', 588) => forget(&mut words),
        (b'M', 997) => update(&mut words),
        _ => Err(Words::new(line).unknown().into()),
    }
}

/// Letters met so far on the line.
#[derive(Default)]
struct Letters(u32);

impl Letters {
    #[inline(always)]
    fn once<'a>(&mut self, letter: char) -> Result<(), Refusal<'a>> {
        let bit = 1 << (u32::from(letter) & 31);
        if self.0 & bit != 0 {
            return Err(Refusal::Repeated(letter));
        }
        self.0 |= bit;
        Ok(())
    }
}

#[inline(always)]
fn a_move<'a>(mut words: Words<'a>, manner: Manner) -> Result<Command, Refusal<'a>> {
    let mut axes = Axes::default();
    let mut seen = 0;
    while let Some(letter) = words.letter()? {
        let (bit, value) = match letter {
            'X' => (1, 0),
            'Y' => (2, 1),
            'Z' => (4, 2),
            'F' => (8, 3),
            _ => return Err(Refusal::UnknownParameter(letter)),
        };
        if seen & bit != 0 {
            return Err(Refusal::Repeated(letter));
        }
        seen |= bit;
        match axes.values.get_mut(value) {
            Some(value) => *value = coordinate(&mut words, letter)?,
            // Feed rates of other machines: accepted, without a meaning here.
            None => {
                words.number(letter)?;
            }
        }
    }
    axes.given = seen;
    Ok(Command::Move(manner, axes))
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
                let factor = fixed(words, letter, Transform::SCALE_BITS, MAX_SCALE)?;
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
                .and_then(|name| MachineName::new(str::from_utf8(&name).ok()?))
                .ok_or(Refusal::BadName(text.raw()))?;
            without_parameters(words, Command::Rename(name))
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn waves<'a>(words: &mut Words<'a>) -> Result<Command, Refusal<'a>> {
    match words.letter()? {
        None => Ok(Command::Waves),
        Some('S') => {
            let on = choice(words, 'S', 2)? == 1;
            without_parameters(words, Command::SetWaves(on))
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn start<'a>(words: &mut Words<'a>) -> Result<Command, Refusal<'a>> {
    let mut letters = Letters::default();
    let (mut mode, mut name) = (None, None);
    while let Some(letter) = words.letter()? {
        letters.once(letter)?;
        match letter {
            'S' => mode = StartMode::from_number(choice(words, letter, 4)?),
            'P' => name = AccessPointName::from_number(choice(words, letter, 2)?),
            _ => return Err(Refusal::UnknownParameter(letter)),
        }
    }
    Ok(match (mode, name) {
        (None, None) => Command::Start,
        (mode, name) => Command::SetStart { mode, name },
    })
}

fn network<'a>(words: &mut Words<'a>) -> Result<Command, Refusal<'a>> {
    let mut letters = Letters::default();
    let (mut ssid, mut password) = (None, None);
    while let Some(letter) = words.letter()? {
        letters.once(letter)?;
        match letter {
            'S' => ssid = Some(network_name(words)?),
            'P' => {
                let phrase = words.text(letter)?.unescape::<MAX_PASSWORD>();
                let phrase = phrase.and_then(|phrase| Password::new(&phrase));
                password = Some(phrase.ok_or(Refusal::BadPassword)?);
            }
            _ => return Err(Refusal::UnknownParameter(letter)),
        }
    }
    match (ssid, password) {
        (Some(ssid), password) => Ok(Command::Remember { ssid, password }),
        (None, Some(_)) => Err(Refusal::Missing('S')),
        (None, None) => Ok(Command::Networks),
    }
}

fn forget<'a>(words: &mut Words<'a>) -> Result<Command, Refusal<'a>> {
    match words.letter()? {
        None => Err(Refusal::Missing('S')),
        Some('S') => {
            let ssid = network_name(words)?;
            let command = match ssid.as_bytes() {
                b"*" => Command::ForgetAll,
                _ => Command::Forget(ssid),
            };
            without_parameters(words, command)
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn update<'a>(words: &mut Words<'a>) -> Result<Command, Refusal<'a>> {
    match words.letter()? {
        None => Ok(Command::Update),
        Some('S') => {
            let text = words.text('S')?;
            let address = match text.unescape::<MAX_ADDRESS>() {
                Some(bytes) if bytes.is_empty() => None,
                bytes => {
                    let address = bytes
                        .as_deref()
                        .and_then(|bytes| ManifestAddress::new(str::from_utf8(bytes).ok()?));
                    Some(address.ok_or(Refusal::BadAddress(text.raw()))?)
                }
            };
            without_parameters(words, Command::SetUpdateAddress(address))
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn network_name<'a>(words: &mut Words<'a>) -> Result<Ssid, Refusal<'a>> {
    let text = words.text('S')?;
    text.unescape::<MAX_SSID>()
        .and_then(|name| Ssid::new(&name))
        .ok_or(Refusal::BadText('S', text.raw(), "1 to 32 bytes"))
}

/// A whole number from 1 to `most`.
fn choice<'a>(words: &mut Words<'a>, letter: char, most: u8) -> Result<u8, Refusal<'a>> {
    const BITS: u32 = 16;
    let value = words.fixed(letter, BITS, most.into())?;
    let whole = value
        .ok()
        .filter(|bits| bits % (1 << BITS) == 0)
        .map(|bits| bits >> BITS);
    match whole.map(u8::try_from) {
        Some(Ok(number @ 1..)) => Ok(number),
        _ => Err(Refusal::NoChoice(letter, most)),
    }
}

/// The command, if nothing more follows.
fn without_parameters<'a>(words: &mut Words<'a>, command: Command) -> Result<Command, Refusal<'a>> {
    match words.letter()? {
        None => Ok(command),
        Some(letter @ ('S' | 'P'))
            if matches!(
                command,
                Command::Angles
                    | Command::ClearCalibration
                    | Command::Rename(_)
                    | Command::SetWaves(_)
                    | Command::Forget(_)
                    | Command::ForgetAll
                    | Command::SetUpdateAddress(_)
            ) =>
        {
            Err(Refusal::Repeated(letter))
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

#[inline(always)]
fn coordinate<'a>(words: &mut Words<'a>, letter: char) -> Result<i64, Refusal<'a>> {
    fixed(words, letter, Coordinate::FRACTION_BITS, MAX_COORDINATE)
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
        .fixed(letter, StepSize::FRACTION_BITS, range.most.into())?
        .ok()
        .and_then(|bits| range.step(bits))
        .ok_or(out_of_range)
}

#[inline(always)]
fn fixed<'a>(
    words: &mut Words<'a>,
    letter: char,
    bits: u32,
    limit: u32,
) -> Result<i64, Refusal<'a>> {
    words.fixed(letter, bits, limit)?.map_err(|_| {
        let most = limit.cast_signed();
        Refusal::OutOfRange {
            letter,
            least: -most,
            most,
        }
    })
}
