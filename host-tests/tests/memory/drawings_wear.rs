//! How long the drawings' flash lasts, and that all of it wears alike.

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use firmware::services::drawings::{Album, MAX_SHEETS};
use protocol_core::drawings::Slot;
use std::cell::RefCell;
use std::rc::Rc;

const PAGE: usize = 4096;
/// As many as the partition has.
const PAGES: usize = 360;
/// Far more than anybody does.
const RECORDINGS_A_DAY: u32 = 20;
const TEN_YEARS: u32 = 3653 * RECORDINGS_A_DAY;
/// What makers of flash chips promise for a page.
const ENDURANCE: u32 = 100_000;
/// A drawing like `examples/feather.gcode`.
const DRAWING: usize = 31_308;

/// A chip of the size of the partition that counts what is erased.
#[derive(Clone)]
struct Counted(Rc<RefCell<(Vec<u8>, Vec<u32>)>>);

impl Counted {
    fn new() -> Self {
        let cells = vec![0xff; PAGES * PAGE];
        Self(Rc::new(RefCell::new((cells, vec![0; PAGES]))))
    }

    fn erases(&self) -> Vec<u32> {
        self.0.borrow().1.clone()
    }
}

impl ErrorType for Counted {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Counted {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        bytes.copy_from_slice(&self.0.borrow().0[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        PAGES * PAGE
    }
}

impl NorFlash for Counted {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        let (cells, erases) = &mut *self.0.borrow_mut();
        cells[from as usize..to as usize].fill(0xff);
        for erases in &mut erases[from as usize / PAGE..to as usize / PAGE] {
            *erases += 1;
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let cells = &mut self.0.borrow_mut().0;
        for (cell, byte) in cells[offset as usize..].iter_mut().zip(bytes) {
            *cell &= byte;
        }
        Ok(())
    }
}

fn boot(chip: &Counted) -> Album<Counted> {
    let mut album = Album::new(chip.clone(), 0..(PAGES * PAGE) as u32).expect("whole pages");
    block_on(album.open());
    album
}

fn record(album: &mut Album<Counted>, number: u8, length: usize) {
    album.begin(Slot::new(number).expect("a slot"));
    let text = vec![b'x'; length];
    for part in text.chunks(1024) {
        assert_eq!(block_on(album.append(part)), Ok(()));
    }
    assert_eq!(block_on(album.commit()), Ok(()));
}

/// Erases of the pages that are used, least and most, in as many recordings into one slot, where `kept`
/// bytes of other drawings stay as they are. The arm is restarted now and then.
fn wear(kept: usize, recordings: u32) -> (u32, u32, usize) {
    let chip = Counted::new();
    let mut album = boot(&chip);
    if kept > 0 {
        record(&mut album, 32, kept);
    }
    let before = chip.erases();
    for number in 0..recordings {
        record(&mut album, 1, DRAWING);
        if number % 7 == 0 {
            album = boot(&chip);
        }
    }
    let worn = chip.erases().into_iter().zip(before);
    let worn: Vec<u32> = worn.map(|(after, before)| after - before).collect();
    let used: Vec<u32> = worn.into_iter().filter(|erases| *erases > 0).collect();
    let most = *used.iter().max().expect("something is erased");
    let least = *used.iter().min().expect("something is erased");
    (least, most, used.len())
}

#[test]
fn the_whole_area_wears_alike_and_for_ten_years() {
    assert_eq!(PAGES, MAX_SHEETS);
    let recordings = 1500;
    let room = Album::<Counted>::ROOM;
    for (name, kept) in [
        ("an empty area", 0),
        ("an area that is half full", 180 * room),
        ("an area with room for two such drawings", 344 * room),
    ] {
        let (least, most, pages) = wear(kept, recordings);
        let ten_years = (u64::from(most) * u64::from(TEN_YEARS)).div_ceil(recordings.into()) as u32;
        println!(
            "{name}: {pages} pages are erased {least} to {most} times by {recordings} recordings of \
             {DRAWING} bytes; {ten_years} times in ten years of {RECORDINGS_A_DAY} a day"
        );
        assert_eq!(pages, PAGES - kept / room, "{name}");
        assert!(most - least <= 1, "{name}: {least} to {most}");
        assert!(ten_years < ENDURANCE / 2, "{name}");
    }
}
