//! Drawings in flash: the power fails at every byte of random histories, once and twice; damage; wear.

use crate::chip::{Chip, State, Tear, Wear};
use crate::dice::Dice;
use crate::long_run;
use embassy_futures::block_on;
use firmware::services::drawings::{Album, AlbumError};
use protocol_core::drawings::Slot;
use std::collections::BTreeMap;

const PAGE: usize = 256;
type Small = Chip<PAGE>;
/// Bytes that all sheets of the chip hold.
const ROOM: usize = crate::chip::PAGES * Album::<Small>::ROOM;

/// What is stored: drawings by the number of their slots.
type Drawings = BTreeMap<u8, Vec<u8>>;

/// What an owner does.
#[derive(Clone, Debug)]
enum Deed {
    Record(u8, Vec<u8>),
    /// Recorded, and then the connection is lost.
    Lose(u8, Vec<u8>),
    Delete(u8),
}

impl Deed {
    fn slot(&self) -> u8 {
        match self {
            Self::Record(slot, _) | Self::Lose(slot, _) | Self::Delete(slot) => *slot,
        }
    }

    /// Something that is possible with what is stored now, and what is stored then.
    fn any(now: &Drawings, dice: &mut Dice) -> (Self, Drawings) {
        let mut after = now.clone();
        // Few slots, so that they are replaced often.
        let slot = [1, 2, 3, 32][dice.below(4)];
        if dice.below(4) == 0 && now.contains_key(&slot) {
            after.remove(&slot);
            return (Self::Delete(slot), after);
        }
        let text = drawing(dice);
        let sheets: usize = now.values().map(|old| sheets(old)).sum();
        if dice.below(6) == 0 || sheets + self::sheets(&text) > crate::chip::PAGES {
            return (Self::Lose(slot, text), after);
        }
        after.insert(slot, text.clone());
        (Self::Record(slot, text), after)
    }

    fn perform(&self, album: &mut Album<Small>) -> Result<(), AlbumError> {
        let slot = Slot::new(self.slot()).expect("a slot");
        match self {
            Self::Record(_, text) => {
                album.begin(slot);
                write(album, text)?;
                block_on(album.commit())
            }
            Self::Lose(_, text) => {
                album.begin(slot);
                // There may be no room for it.
                let _ = write(album, text);
                album.abandon();
                Ok(())
            }
            Self::Delete(_) => block_on(album.delete(slot)),
        }
    }
}

fn write(album: &mut Album<Small>, text: &[u8]) -> Result<(), AlbumError> {
    text.chunks(100)
        .try_for_each(|part| block_on(album.append(part)))
}

fn sheets(text: &[u8]) -> usize {
    text.len().div_ceil(Album::<Small>::ROOM)
}

/// A text as long as three sheets, or shorter.
fn drawing(dice: &mut Dice) -> Vec<u8> {
    let length = match dice.below(4) {
        0 => Album::<Small>::ROOM * (1 + dice.below(3)),
        _ => 1 + dice.below(3 * Album::<Small>::ROOM),
    };
    dice.bytes(length)
}

/// Starts a machine; `None` if the power fails before it knows its drawings.
fn boot(chip: &Small) -> Option<Album<Small>> {
    let mut album = Album::new(chip.clone(), 0..Small::SIZE as u32).expect("whole pages");
    block_on(album.open());
    chip.is_powered().then_some(album)
}

/// Everything that is stored, read in pieces of any length.
fn read_all(album: &mut Album<Small>) -> Result<Drawings, AlbumError> {
    let contents = album.contents();
    let mut found = Drawings::new();
    for (slot, length) in contents.iter() {
        let sequence = album.sequence_of(slot).expect("it is there");
        let mut text = Vec::new();
        let mut piece = [0; 77];
        loop {
            let at = text.len() as u32;
            match block_on(album.read(slot, sequence, at, &mut piece))? {
                0 => break,
                length => text.extend_from_slice(&piece[..length]),
            }
        }
        assert_eq!(text.len() as u32, length);
        found.insert(slot.number(), text);
    }
    // Nothing else takes room.
    let used: usize = found.values().map(|text| sheets(text)).sum();
    assert_eq!(
        album.space().used as usize,
        used * Album::<Small>::ROOM,
        "sheets that belong to no drawing"
    );
    Ok(found)
}

fn found(chip: &Small) -> Drawings {
    read_all(&mut boot(chip).expect("it starts")).expect("it can be read")
}

/// What was tried.
#[derive(Default)]
struct Figures {
    operations: u32,
    cuts: u64,
    second_cuts: u64,
}

/// A deed, and what is stored before and after it.
struct Step<'a> {
    chip: &'a State,
    old: &'a Drawings,
    deed: &'a Deed,
    new: &'a Drawings,
    place: String,
}

/// Cuts the power at each moment of a deed.
fn cut_everywhere(chip: &Small, step: &Step<'_>, dice: &mut Dice, figures: &mut Figures) {
    for tear in [Tear::Prefix, Tear::Mixture] {
        for moment in 0.. {
            chip.restore(step.chip);
            let mut album = boot(chip).expect("it starts");
            chip.fail_after(moment, tear);
            let outcome = step.deed.perform(&mut album);
            if chip.is_powered() {
                assert_eq!(outcome, Ok(()), "{}", step.place);
                break;
            }
            figures.cuts += 1;
            let place = format!("{}, cut at {moment} ({tear:?})", step.place);
            check_start(chip, step, &place, dice, figures);
        }
    }
}

/// Starts again after a cut, with another cut now and then.
fn check_start(chip: &Small, step: &Step<'_>, place: &str, dice: &mut Dice, figures: &mut Figures) {
    let torn = chip.state();
    chip.power_on();
    let before = chip.work();
    let mut album = boot(chip).expect("it starts");
    let repair = chip.work() - before;
    let found = read_all(&mut album).expect("it can be read");
    assert!(
        found == *step.old || found == *step.new,
        "{place}: {:?}, of {:?}",
        lengths(&found),
        lengths(step.old)
    );
    // What was found is found again.
    assert_eq!(self::found(chip), found, "{place}");
    // A drawing that is deleted now does not come back from the dead.
    let slot = step.deed.slot();
    if found.contains_key(&slot) {
        let slot = Slot::new(slot).expect("a slot");
        assert_eq!(block_on(album.delete(slot)), Ok(()), "{place}");
        let mut without = found.clone();
        without.remove(&slot.number());
        assert_eq!(self::found(chip), without, "{place}");
    }
    // The machine works.
    let mut album = boot(chip).expect("it starts");
    let text = drawing(dice);
    let fits = text.len() <= album.space().free() as usize;
    let outcome = Deed::Record(slot, text.clone()).perform(&mut album);
    let expected = if fits { Ok(()) } else { Err(AlbumError::Full) };
    assert_eq!(outcome, expected, "{place}");
    if fits {
        assert_eq!(self::found(chip).get(&slot), Some(&text), "{place}");
    }
    // A cut in the repair.
    for moment in 0..repair {
        chip.restore(&torn);
        chip.power_on();
        chip.fail_after(moment, [Tear::Prefix, Tear::Mixture][dice.below(2)]);
        assert!(boot(chip).is_none(), "{place}");
        chip.power_on();
        figures.second_cuts += 1;
        let after = self::found(chip);
        assert!(
            after == *step.old || after == *step.new,
            "{place}, and at {moment} of the repair"
        );
    }
    chip.restore(&torn);
    chip.power_on();
}

fn lengths(drawings: &Drawings) -> Vec<(u8, usize)> {
    let lengths = drawings.iter().map(|(slot, text)| (*slot, text.len()));
    lengths.collect()
}

/// A life up to somewhere, and then a few deeds with cuts everywhere.
fn live(history: u64, length: usize) -> Figures {
    let mut figures = Figures::default();
    let mut dice = Dice::new(history);
    let chip = Small::erased();
    let mut now = Drawings::new();
    let mut album = boot(&chip).expect("it starts");
    for _ in 0..dice.below(30) {
        let (deed, after) = Deed::any(&now, &mut dice);
        assert_eq!(deed.perform(&mut album), Ok(()), "{deed:?}");
        assert_eq!(read_all(&mut album).as_ref(), Ok(&after));
        // A start would find the same, and leaves nothing to repair.
        let copy = Small::with(chip.state().cells);
        assert_eq!(found(&copy), after);
        assert_eq!(copy.work(), 0, "{deed:?}");
        if dice.below(3) == 0 {
            album = boot(&chip).expect("it starts");
        }
        now = after;
    }
    for number in 0..length {
        let (deed, after) = Deed::any(&now, &mut dice);
        let before = chip.state();
        let step = Step {
            chip: &before,
            old: &now,
            deed: &deed,
            new: &after,
            place: format!("history {history}, deed {number}"),
        };
        cut_everywhere(&chip, &step, &mut dice, &mut figures);
        // The history goes on after a cut, at times, with what is found then.
        chip.restore(&before);
        let mut album = boot(&chip).expect("it starts");
        if dice.below(3) > 0 {
            chip.fail_after(dice.number() % 600, Tear::Mixture);
        }
        let _ = deed.perform(&mut album);
        chip.power_on();
        now = found(&chip);
        figures.operations += 1;
    }
    figures
}

#[test]
fn a_drawing_is_old_new_or_absent_wherever_the_power_fails() {
    let histories = long_run().unwrap_or(12);
    let mut total = Figures::default();
    for history in 0..histories {
        let figures = live(history, 4);
        total.operations += figures.operations;
        total.cuts += figures.cuts;
        total.second_cuts += figures.second_cuts;
    }
    println!(
        "drawings: {histories} histories, {} deeds, {} cuts, {} second cuts, none lost",
        total.operations, total.cuts, total.second_cuts
    );
    assert!(total.cuts > 10_000 && total.second_cuts > 0);
}

#[test]
fn one_drawing_takes_all_there_is_and_not_more() {
    let chip = Small::erased();
    let mut album = boot(&chip).expect("it starts");
    assert_eq!(album.space().free() as usize, ROOM);
    let text = Dice::new(1).bytes(ROOM);
    let whole = Deed::Record(7, text.clone());
    assert_eq!(whole.perform(&mut album), Ok(()));
    assert_eq!(album.space().free(), 0);
    assert_eq!(found(&chip), Drawings::from([(7, text.clone())]));
    // It can be deleted, although there is no room for anything.
    assert_eq!(
        Deed::Record(8, vec![1]).perform(&mut album),
        Err(AlbumError::Full)
    );
    assert_eq!(
        Deed::Record(7, vec![1]).perform(&mut album),
        Err(AlbumError::Full)
    );
    assert_eq!(found(&chip), Drawings::from([(7, text)]));
    assert_eq!(Deed::Delete(7).perform(&mut album), Ok(()));
    assert_eq!(album.space().free() as usize, ROOM);
    let longer = Dice::new(2).bytes(ROOM + 1);
    assert_eq!(
        Deed::Record(7, longer).perform(&mut album),
        Err(AlbumError::Full)
    );
    assert_eq!(found(&chip), Drawings::new());
    assert_eq!(album.space().free() as usize, ROOM);
}

#[test]
fn noise_is_no_drawing() {
    for seed in 0..200 {
        let chip = Small::with(Dice::new(seed).bytes(Small::SIZE));
        assert_eq!(found(&chip), Drawings::new());
        let mut album = boot(&chip).expect("it starts");
        let text = drawing(&mut Dice::new(seed));
        assert_eq!(Deed::Record(3, text.clone()).perform(&mut album), Ok(()));
        assert_eq!(found(&chip), Drawings::from([(3, text)]));
    }
}

#[test]
fn worn_pages_are_passed_over_and_promise_nothing() {
    for wear in [Wear::Honest, Wear::Silent] {
        for page in 0..crate::chip::PAGES {
            let chip = Small::erased();
            let mut dice = Dice::new(page as u64);
            let mut album = boot(&chip).expect("it starts");
            let old = drawing(&mut dice);
            assert_eq!(Deed::Record(1, old.clone()).perform(&mut album), Ok(()));
            chip.wear_out(page, wear);
            let mut kept = Drawings::from([(1, old)]);
            for slot in 2..=9 {
                let text = drawing(&mut dice);
                match Deed::Record(slot, text.clone()).perform(&mut album) {
                    Ok(()) => assert_eq!(kept.insert(slot, text), None),
                    Err(error) => assert!(matches!(error, AlbumError::Full | AlbumError::Worn)),
                }
                assert_eq!(found_with_wear(&chip), kept, "{wear:?} {page} {slot}");
            }
            assert!(kept.len() > 2, "the other pages are well");
        }
    }
}

/// As [`found`], where a page that does not take anything is still free after a start.
fn found_with_wear(chip: &Small) -> Drawings {
    read_all(&mut boot(chip).expect("it starts")).expect("it can be read")
}

#[test]
fn what_was_replaced_does_not_come_back_when_the_new_one_is_deleted() {
    let chip = Small::erased();
    let mut album = boot(&chip).expect("it starts");
    for text in [vec![1; 300], vec![2; 300], vec![3; 300]] {
        assert_eq!(Deed::Record(5, text).perform(&mut album), Ok(()));
    }
    assert_eq!(Deed::Delete(5).perform(&mut album), Ok(()));
    assert_eq!(found(&chip), Drawings::new());
}

#[test]
fn what_is_replaced_while_it_is_read_is_gone() {
    let chip = Small::erased();
    let mut album = boot(&chip).expect("it starts");
    let slot = Slot::new(5).expect("a slot");
    assert_eq!(Deed::Record(5, vec![1; 500]).perform(&mut album), Ok(()));
    let sequence = album.sequence_of(slot).expect("it is there");
    let mut piece = [0; 64];
    let read = block_on(album.read(slot, sequence, 0, &mut piece));
    assert_eq!(read, Ok(64));
    assert_eq!(Deed::Record(5, vec![2; 500]).perform(&mut album), Ok(()));
    let read = block_on(album.read(slot, sequence, 64, &mut piece));
    assert_eq!(read, Err(AlbumError::Gone));
}
