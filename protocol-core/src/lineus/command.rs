//! A line becomes a typed command here, once; nothing downstream sees text.

mod fitting;

use super::refusal::Refusal;
use super::request::Request;
use crate::drawings::{ButtonDraws, MAX_DRAWINGS, Replay, Slot};
use crate::machine::{Bare, Manner};
use crate::motion::{Coordinate, MAX_COORDINATE, MAX_SCALE, StepRange, StepSize, Transform};
use crate::settings::{AccessPointName, MAX_NAME, MachineName, StartMode};
use crate::text::{Text, Words};
use crate::update::{MAX_ADDRESS, ManifestAddress};
use crate::wifi::{MAX_PASSWORD, MAX_SSID, Password, Ssid};

/// A valid command, its numbers as written: not yet scaled, not yet limited.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Comments and nothing else.
    Nothing,
    /// G00, G01.
    Move(Manner, Axes),
    /// G54: offsets in 1/65536 units, scale in 1/2^32 and not zero.
    Transform {
        /// Offset of X.
        x: Option<i64>,
        /// Offset of Y.
        y: Option<i64>,
        /// Scale of X and Y.
        scale: Option<i64>,
    },
    /// G40.
    Uncalibrated(Axes, Bare),
    /// Everything else: scale and origin of the connection have no part in it.
    Ask(Request),
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
    let request = match code {
        (b'G', 40) => return fitting::uncalibrated(&mut words),
        (b'G', 54) => return transform(&mut words),
        (b'G', 4) => fitting::dwell(&mut words),
        (b'G', 28) => without_parameters(&mut words, Request::HOME),
        (b'G', 31) => fitting::compensation(&mut words),
        (b'G', 94) => speed(&mut words),
        (b'M', 20) => without_parameters(&mut words, Request::Drawings),
        (b'M', 23) => button(&mut words),
        (b'M', 28) => Ok(Request::BeginRecording(one_slot(&mut words)?)),
        (b'M', 29) => without_parameters(&mut words, Request::EndRecording),
        (b'M', 30) => Ok(Request::Delete(one_slot(&mut words)?)),
        (b'M', 39) => without_parameters(&mut words, Request::Space),
        (b'M', 85) => replay(&mut words),
        (b'M', 114) => position(&mut words),
        (b'M', 115) => without_parameters(&mut words, Request::Capabilities),
        (b'M', 122) => without_parameters(&mut words, Request::Diagnostics),
        (b'M', number @ (170 | 172)) => Err(Refusal::Reserved(number)),
        (b'M', 171) => fitting::factory_reset(&mut words),
        (b'M', 280) => fitting::directions(&mut words),
        (b'M', 374) => calibration(&mut words),
        (b'M', 550) => name(&mut words),
        (b'M', 291) => waves(&mut words),
        (b'M', 552) => start(&mut words),
        (b'M', 587) => network(&mut words),
        (b'M', 588) => forget(&mut words),
        (b'M', 589) => own_network(&mut words),
        (b'M', 997) => update(&mut words),
        _ => Err(Words::new(line).unknown().into()),
    };
    request.map(Command::Ask)
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

fn speed<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
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
    Ok(Request::SetSpeed { pen_down, pen_up })
}

fn position<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    match words.letter()? {
        None => Ok(Request::Position),
        Some('S') => {
            words.no_value('S')?;
            nothing_after('S', words, Request::Angles)
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn calibration<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    match words.letter()? {
        None => Ok(Request::Calibrate),
        Some('S') => {
            let text = words.text('S')?;
            if !text.is("clear") {
                return Err(Refusal::BadText('S', text.raw(), "'clear'"));
            }
            nothing_after('S', words, Request::ClearCalibration)
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn name<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    match words.letter()? {
        None => Ok(Request::Name),
        Some('P') => {
            let text = words.text('P')?;
            let name = text
                .unescape::<MAX_NAME>()
                .and_then(|name| MachineName::new(str::from_utf8(&name).ok()?))
                .ok_or(Refusal::BadName(text.raw()))?;
            nothing_after('P', words, Request::Rename(name))
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn waves<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    match words.letter()? {
        None => Ok(Request::Waves),
        Some('S') => {
            let on = choice(words, 'S', 2)? == 1;
            nothing_after('S', words, Request::SetWaves(on))
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn start<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
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
        (None, None) => Request::Start,
        (mode, name) => Request::SetStart { mode, name },
    })
}

fn network<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    let mut letters = Letters::default();
    let (mut ssid, mut password) = (None, None);
    while let Some(letter) = words.letter()? {
        letters.once(letter)?;
        match letter {
            'S' => ssid = Some(network_name(words)?),
            'P' => password = Some(network_password(&words.text(letter)?)?),
            _ => return Err(Refusal::UnknownParameter(letter)),
        }
    }
    match (ssid, password) {
        (Some(ssid), password) => Ok(Request::Remember { ssid, password }),
        (None, Some(_)) => Err(Refusal::Missing('S')),
        (None, None) => Ok(Request::Networks),
    }
}

fn forget<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    match words.letter()? {
        None => Err(Refusal::Missing('S')),
        Some('S') => {
            let ssid = network_name(words)?;
            let command = match ssid.as_bytes() {
                b"*" => Request::ForgetAll,
                _ => Request::Forget(ssid),
            };
            nothing_after('S', words, command)
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn update<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    match words.letter()? {
        None => Ok(Request::Update),
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
            nothing_after('S', words, Request::SetUpdateAddress(address))
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

/// M589 is where RepRap firmware has the password of a machine's own network.
fn own_network<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    match words.letter()? {
        None => Ok(Request::OwnNetwork),
        Some('P') => {
            let text = words.text('P')?;
            let password = match text.raw() {
                [] => None,
                _ => Some(network_password(&text)?),
            };
            nothing_after('P', words, Request::ProtectOwnNetwork(password))
        }
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn network_password<'a>(text: &Text<'a>) -> Result<Password, Refusal<'a>> {
    text.unescape::<MAX_PASSWORD>()
        .and_then(|phrase| Password::new(&phrase))
        .ok_or(Refusal::BadPassword)
}

fn network_name<'a>(words: &mut Words<'a>) -> Result<Ssid, Refusal<'a>> {
    let text = words.text('S')?;
    text.unescape::<MAX_SSID>()
        .and_then(|name| Ssid::new(&name))
        .ok_or(Refusal::BadText('S', text.raw(), "1 to 32 bytes"))
}

fn button<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    let mut letters = Letters::default();
    let (mut number, mut place) = (None, None);
    while let Some(letter) = words.letter()? {
        letters.once(letter)?;
        match letter {
            'S' => number = Some(whole(words, letter, 0, 3)? as u8),
            'K' => place = Some(whole(words, letter, 0, MAX_DRAWINGS.into())? as u8),
            _ => return Err(Refusal::UnknownParameter(letter)),
        }
    }
    let Some(number) = number else {
        return Ok(match place.map(Slot::new) {
            None => Request::Button,
            Some(Some(slot)) => Request::Draw(slot),
            Some(None) => Request::StopDrawing,
        });
    };
    match (ButtonDraws::new(number, place.and_then(Slot::new)), place) {
        (Some(choice), _) => Ok(Request::SetButton(choice)),
        (None, None) => Err(Refusal::Missing('K')),
        (None, Some(0)) => Err(Refusal::NotWhole {
            letter: 'K',
            least: 1,
            most: MAX_DRAWINGS.into(),
        }),
        (None, Some(_)) => Err(Refusal::OnlyWith('K', "S2")),
    }
}

/// `S` with a slot, and nothing more.
fn one_slot<'a>(words: &mut Words<'a>) -> Result<Slot, Refusal<'a>> {
    match words.letter()? {
        None => return Err(Refusal::Missing('S')),
        Some('S') => {}
        Some(letter) => return Err(Refusal::UnknownParameter(letter)),
    }
    let slot = slot(words, 'S')?;
    match words.letter()? {
        None => Ok(slot),
        Some('S') => Err(Refusal::Repeated('S')),
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

fn slot<'a>(words: &mut Words<'a>, letter: char) -> Result<Slot, Refusal<'a>> {
    let number = whole(words, letter, 1, MAX_DRAWINGS.into())?;
    Ok(Slot::new(number as u8).unwrap_or(Slot::FIRST))
}

fn replay<'a>(words: &mut Words<'a>) -> Result<Request, Refusal<'a>> {
    let mut letters = Letters::default();
    let (mut seconds, mut every, mut place) = (None, None, None);
    while let Some(letter) = words.letter()? {
        letters.once(letter)?;
        match letter {
            'S' => seconds = Some(whole(words, letter, 0, Replay::MAX_SECONDS)?),
            'P' => every = Some(whole(words, letter, 1, Replay::MAX_SECONDS)?),
            'K' => place = Some(slot(words, letter)?),
            _ => return Err(Refusal::UnknownParameter(letter)),
        }
    }
    Ok(match (seconds, every, place) {
        (None, None, None) => Request::Replaying,
        (Some(0), ..) => Request::SetReplay(None),
        _ => Request::SetReplay(Some(Replay {
            slot: place.unwrap_or(Slot::FIRST),
            seconds: seconds.unwrap_or(Replay::DEFAULT_SECONDS),
            every: every.unwrap_or(Replay::DEFAULT_EVERY),
        })),
    })
}

/// A whole number from `least` to `most`.
fn whole<'a>(
    words: &mut Words<'a>,
    letter: char,
    least: u16,
    most: u16,
) -> Result<u16, Refusal<'a>> {
    const BITS: u32 = 16;
    let value = words.fixed(letter, BITS, most.into())?;
    let number = value
        .ok()
        .filter(|bits| bits % (1 << BITS) == 0)
        .and_then(|bits| u16::try_from(bits >> BITS).ok());
    number
        .filter(|number| (least..=most).contains(number))
        .ok_or(Refusal::NotWhole {
            letter,
            least,
            most,
        })
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
fn without_parameters<'a>(words: &mut Words<'a>, request: Request) -> Result<Request, Refusal<'a>> {
    match words.letter()? {
        None => Ok(request),
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
    }
}

/// The command, if nothing more follows the only letter that it has.
fn nothing_after<'a>(
    only: char,
    words: &mut Words<'a>,
    request: Request,
) -> Result<Request, Refusal<'a>> {
    match words.letter()? {
        Some(letter) if letter == only => Err(Refusal::Repeated(letter)),
        Some(letter) => Err(Refusal::UnknownParameter(letter)),
        None => Ok(request),
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
