//! A body becomes a typed command here, once; nothing downstream sees text.
//!
//! In two passes, as the original does it: all G and M words first, then the parameters, so that
//! `X1G20` is an inch. A body is accepted whole or refused whole.

use super::units::{BadNumber, Unit};
use super::words::Words;
use crate::motion::{Feed, Intensity, MOST_DWELL, Micros, Millimetres};
use crate::text::Decimal;

/// Why a body is refused; nothing has changed then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// `N`: a letter without a number, or a number that its word cannot have.
    BadNumber,
    /// `E`: something else where a word's letter should be.
    ExpectedLetter,
    /// `U`: a G or M word that there is not, or a kind of G10.
    Unsupported,
}

impl From<BadNumber> for Fault {
    fn from(_: BadNumber) -> Self {
        Self::BadNumber
    }
}

/// The two ways of moving.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Travel {
    /// G0: at the seek rate, laser off.
    Seek,
    /// G1: at the feed rate, at the intensity of S.
    Feed,
}

/// What X and Y of a move mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Distance {
    /// G90: from the offset in force.
    #[default]
    Absolute,
    /// G91: from where the plan ends.
    Relative,
}

/// The two offsets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Offset {
    /// G54, P0: of the table.
    #[default]
    Table,
    /// G55, P1: of the user.
    Custom,
}

/// What a line does, beside setting what is modal; of several, the last one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Action {
    /// Nothing.
    #[default]
    None,
    /// G0, G1.
    Move(Travel),
    /// G4.
    Dwell(Micros),
    /// G10 L2: the offset becomes what is given.
    SetOffset(Offset),
    /// G10 L20: the offset becomes where the plan ends.
    OffsetHere(Offset),
    /// G30.
    Home,
}

/// A valid body. What is `None` was not given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Command {
    /// G20, G21; X, Y and F below have been read by it.
    pub unit: Option<Unit>,
    /// G90, G91.
    pub distance: Option<Distance>,
    /// G54, G55.
    pub offset: Option<Offset>,
    /// The last of G0, G1, G4, G10, G30.
    pub action: Action,
    /// M80 to M85, in the order of [`crate::motion::Assist`].
    pub outputs: [Option<bool>; 3],
    /// As written.
    pub x: Option<Millimetres>,
    /// As written.
    pub y: Option<Millimetres>,
    /// F.
    pub feed: Option<Feed>,
    /// S.
    pub intensity: Option<Intensity>,
    /// The last of G0 and G1, which says what F is for from now on.
    pub travel: Option<Travel>,
}

/// Which of the words that act came last, before their parameters are known.
#[derive(Clone, Copy)]
enum Acting {
    No,
    Move(Travel),
    Dwell,
    SetOffset,
    Home,
}

/// Reads one body; `unit` is the one in force before it.
///
/// # Errors
/// The first [`Fault`] of the first pass, or else of the second.
pub fn parse(body: &[u8], unit: Unit) -> Result<Command, Fault> {
    let mut command = Command::default();
    let mut acting = Acting::No;
    for word in Words::new(body) {
        match word? {
            (b'G', number) => acting = preparatory(&mut command, acting, number)?,
            (b'M', number) => miscellaneous(&mut command, number)?,
            _ => {}
        }
    }
    let unit = command.unit.unwrap_or(unit);
    let (mut seconds, mut selector, mut qualifier) = (None, None, None);
    for word in Words::new(body) {
        let (letter, number) = word?;
        match letter {
            b'X' => command.x = Some(unit.coordinate(number)?),
            b'Y' => command.y = Some(unit.coordinate(number)?),
            b'F' => command.feed = Some(unit.feed(number)?),
            b'S' => command.intensity = Some(intensity(number)?),
            b'P' if matches!(acting, Acting::SetOffset) => selector = Some(number),
            b'P' => seconds = Some(number),
            b'L' => qualifier = Some(number),
            // Z too: the pen's height follows from the intensity.
            _ => {}
        }
    }
    command.action = match acting {
        Acting::No => Action::None,
        Acting::Move(travel) => Action::Move(travel),
        Acting::Dwell => Action::Dwell(seconds.map_or(Ok(Micros::default()), dwell)?),
        Acting::SetOffset => setting(selector, qualifier)?,
        Acting::Home => Action::Home,
    };
    Ok(command)
}

fn preparatory(command: &mut Command, before: Acting, number: Decimal) -> Result<Acting, Fault> {
    match number.whole() {
        Some(0) => return Ok(travel(command, Travel::Seek)),
        Some(1) => return Ok(travel(command, Travel::Feed)),
        Some(4) => return Ok(Acting::Dwell),
        Some(10) => return Ok(Acting::SetOffset),
        Some(30) => return Ok(Acting::Home),
        Some(20) => command.unit = Some(Unit::Inch),
        Some(21) => command.unit = Some(Unit::Millimetre),
        Some(54) => command.offset = Some(Offset::Table),
        Some(55) => command.offset = Some(Offset::Custom),
        Some(90) => command.distance = Some(Distance::Absolute),
        Some(91) => command.distance = Some(Distance::Relative),
        _ => return Err(Fault::Unsupported),
    }
    Ok(before)
}

fn travel(command: &mut Command, travel: Travel) -> Acting {
    command.travel = Some(travel);
    Acting::Move(travel)
}

fn miscellaneous(command: &mut Command, number: Decimal) -> Result<(), Fault> {
    let [air, aux1, aux2] = &mut command.outputs;
    let (output, on) = match number.whole() {
        Some(80) => (air, true),
        Some(81) => (air, false),
        Some(82) => (aux1, true),
        Some(83) => (aux1, false),
        Some(84) => (aux2, true),
        Some(85) => (aux2, false),
        _ => return Err(Fault::Unsupported),
    };
    *output = Some(on);
    Ok(())
}

/// S in 0..=255; a fraction is dropped, as the original does it.
fn intensity(number: Decimal) -> Result<Intensity, BadNumber> {
    const BITS: u32 = 16;
    let bits = number.to_fixed(BITS, u8::MAX.into())?;
    let whole = u8::try_from(bits >> BITS).map_err(|_| BadNumber)?;
    Ok(Intensity(whole))
}

/// P in seconds, at most [`MOST_DWELL`].
fn dwell(seconds: Decimal) -> Result<Micros, BadNumber> {
    const BITS: u32 = 24;
    const MOST: u32 = (MOST_DWELL.get() / 1_000_000) as u32;
    // Below 2^36, times a million below 2^56.
    let bits = u64::try_from(seconds.to_fixed(BITS, MOST)?).map_err(|_| BadNumber)?;
    Ok(Micros::new((bits * 1_000_000 + (1 << (BITS - 1))) >> BITS))
}

/// G10 by its P, which may be left out for the table's, and its L.
fn setting(selector: Option<Decimal>, qualifier: Option<Decimal>) -> Result<Action, Fault> {
    let offset = match selector.map_or(Some(0), Decimal::whole) {
        Some(0) => Offset::Table,
        Some(1) => Offset::Custom,
        _ => return Err(Fault::Unsupported),
    };
    match qualifier.and_then(Decimal::whole) {
        Some(2) => Ok(Action::SetOffset(offset)),
        Some(20) => Ok(Action::OffsetHere(offset)),
        _ => Err(Fault::Unsupported),
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;

    fn millimetres(body: &str) -> Result<Command, Fault> {
        parse(body.as_bytes(), Unit::Millimetre)
    }

    fn with(change: impl FnOnce(&mut Command)) -> Command {
        let mut command = Command::default();
        change(&mut command);
        command
    }

    #[test]
    fn every_code_there_is() {
        let mm = |value| Some(Millimetres::new(value));
        for (body, expected) in [
            ("", Command::default()),
            ("G20", with(|it| it.unit = Some(Unit::Inch))),
            ("G21", with(|it| it.unit = Some(Unit::Millimetre))),
            ("G54", with(|it| it.offset = Some(Offset::Table))),
            ("G55", with(|it| it.offset = Some(Offset::Custom))),
            ("G90", with(|it| it.distance = Some(Distance::Absolute))),
            ("G91", with(|it| it.distance = Some(Distance::Relative))),
            ("G30", with(|it| it.action = Action::Home)),
            ("M80", with(|it| it.outputs = [Some(true), None, None])),
            ("M81", with(|it| it.outputs = [Some(false), None, None])),
            ("M82", with(|it| it.outputs = [None, Some(true), None])),
            ("M83", with(|it| it.outputs = [None, Some(false), None])),
            ("M84", with(|it| it.outputs = [None, None, Some(true)])),
            ("M85", with(|it| it.outputs = [None, None, Some(false)])),
            ("S0", with(|it| it.intensity = Some(Intensity(0)))),
            ("S255", with(|it| it.intensity = Some(Intensity(255)))),
            ("F2000", with(|it| it.feed = Some(Feed::new(2000)))),
            ("X120Y150", with(|it| (it.x, it.y) = (mm(120), mm(150)))),
            (
                "G4P0.5",
                with(|it| it.action = Action::Dwell(Micros::new(500_000))),
            ),
            ("G4", with(|it| it.action = Action::Dwell(Micros::new(0)))),
            (
                "G10L20P0",
                with(|it| it.action = Action::OffsetHere(Offset::Table)),
            ),
            (
                "G10L20P1",
                with(|it| it.action = Action::OffsetHere(Offset::Custom)),
            ),
            (
                "G10L20",
                with(|it| it.action = Action::OffsetHere(Offset::Table)),
            ),
            (
                "G10L2P0X20Y20",
                with(|it| {
                    it.action = Action::SetOffset(Offset::Table);
                    (it.x, it.y) = (mm(20), mm(20));
                }),
            ),
            (
                "G10L2P1X220Y140",
                with(|it| {
                    it.action = Action::SetOffset(Offset::Custom);
                    (it.x, it.y) = (mm(220), mm(140));
                }),
            ),
            (
                "G0X120Y150",
                with(|it| {
                    it.action = Action::Move(Travel::Seek);
                    it.travel = Some(Travel::Seek);
                    (it.x, it.y) = (mm(120), mm(150));
                }),
            ),
            (
                "G1F2000",
                with(|it| {
                    it.action = Action::Move(Travel::Feed);
                    it.travel = Some(Travel::Feed);
                    it.feed = Some(Feed::new(2000));
                }),
            ),
        ] {
            assert_eq!(millimetres(body), Ok(expected), "{body}");
        }
    }

    #[test]
    fn a_code_may_be_written_in_several_ways() {
        for (body, plain) in [
            ("G00X5", "G0X5"),
            ("G01X5", "G1X5"),
            ("G+1X5", "G1X5"),
            ("G1.X5", "G1X5"),
            ("G1.0X5", "G1X5"),
            ("G3E1", "G30"),
            ("X5G1", "G1X5"),
            ("G1X+5", "G1X5"),
            ("G1X5.", "G1X5"),
            ("G1X.5E1", "G1X5"),
        ] {
            assert_eq!(millimetres(body), millimetres(plain), "{body}");
            assert!(millimetres(body).is_ok(), "{body}");
        }
    }

    #[test]
    fn letters_without_a_meaning_are_ignored() {
        for body in [
            "N10G1X5",
            "G1X5T3",
            "G1X5I7J8",
            "G1Z-3X5",
            "G1X5Z1E99",
            "A1B2G1X5",
        ] {
            assert_eq!(millimetres(body), millimetres("G1X5"), "{body}");
        }
    }

    #[test]
    fn all_g_and_m_words_first_then_the_parameters() {
        let inch = millimetres("X1G20").unwrap();
        assert_eq!(inch.x.map(Millimetres::bits), Some(254 * 65536 / 10));
        assert_eq!(parse(b"X1", Unit::Inch).unwrap().x, inch.x);
        assert_eq!(
            parse(b"X1G21", Unit::Inch).unwrap().x,
            Some(Millimetres::new(1))
        );
        assert_eq!(
            millimetres("P1L2X7G10").unwrap().action,
            Action::SetOffset(Offset::Custom)
        );
        assert_eq!(millimetres("X5F100G1"), millimetres("G1X5F100"));
    }

    #[test]
    fn the_last_of_several_counts() {
        assert_eq!(millimetres("G0G1X5"), millimetres("G1X5"));
        assert_eq!(millimetres("X1X5G1"), millimetres("G1X5"));
        assert_eq!(millimetres("G20G21X5"), millimetres("G21X5"));
        assert_eq!(millimetres("M80M81"), millimetres("M81"));
        // What does not exclude one another is done together.
        let both = millimetres("G90M80M85").unwrap();
        assert_eq!(both.distance, Some(Distance::Absolute));
        assert_eq!(both.outputs, [Some(true), None, Some(false)]);
    }

    #[test]
    fn intensity_is_in_whole_steps_and_does_not_wrap() {
        for (body, expected) in [
            ("S127.9", Ok(127)),
            ("S0.9", Ok(0)),
            ("S+255.0", Ok(255)),
            ("S255.1", Err(Fault::BadNumber)),
            ("S256", Err(Fault::BadNumber)),
            ("S-1", Err(Fault::BadNumber)),
            ("S1E9", Err(Fault::BadNumber)),
        ] {
            let found = millimetres(body).map(|command| command.intensity.unwrap().0);
            assert_eq!(found, expected, "{body}");
        }
    }

    #[test]
    fn dwell_in_seconds() {
        for (body, expected) in [
            ("G4P0", Ok(0)),
            ("G4P0.000001", Ok(1)),
            ("G4P3600", Ok(3_600_000_000)),
            ("G20G4P2", Ok(2_000_000)),
            ("G4P3600.1", Err(Fault::BadNumber)),
            ("G4P-1", Err(Fault::BadNumber)),
        ] {
            let found = millimetres(body).map(|command| command.action);
            let expected = expected.map(|micros| Action::Dwell(Micros::new(micros)));
            assert_eq!(found, expected, "{body}");
        }
    }

    #[test]
    fn what_is_refused_and_as_what() {
        use Fault::{BadNumber, ExpectedLetter, Unsupported};
        for (body, fault) in [
            // Numbers.
            ("G", BadNumber),
            ("GX5", BadNumber),
            ("G1X", BadNumber),
            ("G1X--5", BadNumber),
            ("F0", BadNumber),
            ("G1F-100", BadNumber),
            ("G1XY", BadNumber),
            ("X10000.001", BadNumber),
            ("Y-1E30", BadNumber),
            ("TX", BadNumber),
            // Letters.
            ("g1x5", ExpectedLetter),
            ("version", ExpectedLetter),
            ("$fb", ExpectedLetter),
            ("%", ExpectedLetter),
            ("(home)", ExpectedLetter),
            (";home", ExpectedLetter),
            ("G1X5;", ExpectedLetter),
            ("1", ExpectedLetter),
            // Words.
            ("G2X5", Unsupported),
            ("G28", Unsupported),
            ("G92", Unsupported),
            ("M115", Unsupported),
            ("M3", Unsupported),
            ("G-1", Unsupported),
            ("G54.1", Unsupported),
            ("G1.5X5", Unsupported),
            ("G1E9", Unsupported),
            ("G10", Unsupported),
            ("G10P1", Unsupported),
            ("G10L3P1", Unsupported),
            ("G10L2P2", Unsupported),
            ("G10L2P-1", Unsupported),
            // The first pass before the second, each from left to right.
            ("F0G99", Unsupported),
            ("G99X", Unsupported),
            ("XG99", BadNumber),
            ("G99$", Unsupported),
            ("$G99", ExpectedLetter),
            ("F0$", ExpectedLetter),
        ] {
            assert_eq!(millimetres(body), Err(fault), "{body}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_command_or_refused(body: std::vec::Vec<u8>) {
            for unit in [Unit::Millimetre, Unit::Inch] {
                let _ = parse(&body, unit);
            }
        }

        #[test]
        fn the_order_of_different_words_does_not_matter(
            words in Just(["G1", "G91", "G20", "M80", "X1.5", "Y-2", "F300", "S9"]).prop_shuffle()
        ) {
            prop_assert_eq!(millimetres(&words.concat()), millimetres("G1G91G20M80X1.5Y-2F300S9"));
        }
    }
}
