//! The power fails at every byte of random histories, once and twice.

use crate::chip::{Chip, PAGES, State, Tear, Wear};
use crate::dice::Dice;
use crate::earlier;
use crate::owner::{self, Habits};
use crate::{boot, long_run, store};
use protocol_core::settings::Settings;

/// What was tried.
#[derive(Default)]
struct Figures {
    histories: u32,
    operations: u32,
    cuts: u64,
    second_cuts: u64,
    /// The first of them, in words.
    losses: Vec<String>,
}

impl Figures {
    fn lose(&mut self, what: impl FnOnce() -> String) {
        self.losses.push(what());
    }

    fn add(&mut self, other: Self) {
        self.histories += other.histories;
        self.operations += other.operations;
        self.cuts += other.cuts;
        self.second_cuts += other.second_cuts;
        self.losses.extend(other.losses);
    }

    /// Prints what was tried.
    ///
    /// # Panics
    /// With the first loss, if there is one.
    fn report(&self, name: &str) {
        println!(
            "{name}: {} histories, {} operations, {} cuts, {} second cuts, {} losses",
            self.histories,
            self.operations,
            self.cuts,
            self.second_cuts,
            self.losses.len()
        );
        assert!(self.losses.is_empty(), "{}", self.losses[0]);
    }
}

/// A step of a history, and what the chip was before it.
struct Step<'a> {
    before: &'a State,
    old: &'a Settings,
    new: &'a Settings,
    place: String,
}

/// Cuts the power at each moment of a store, and of a start.
fn cut_everywhere<const PAGE: usize>(
    chip: &Chip<PAGE>,
    step: &Step<'_>,
    dice: &mut Dice,
    figures: &mut Figures,
) {
    for tear in [Tear::Prefix, Tear::Mixture] {
        for moment in 0.. {
            chip.restore(step.before);
            chip.fail_after(moment, tear);
            let stored = boot(chip).map(|(mut memory, _, _)| store(&mut memory, step.new));
            if chip.is_powered() {
                // Beyond its end.
                assert_eq!(stored, Some(Ok(())), "{}", step.place);
                break;
            }
            figures.cuts += 1;
            let place = || format!("{}, cut at {moment} ({tear:?})", step.place);
            check_start(chip, step, &place, dice, figures);
        }
    }
}

/// Starts again after a cut, with another cut now and then.
fn check_start<const PAGE: usize>(
    chip: &Chip<PAGE>,
    step: &Step<'_>,
    place: &dyn Fn() -> String,
    dice: &mut Dice,
    figures: &mut Figures,
) {
    let torn = chip.state();
    chip.power_on();
    let work_before = chip.work();
    let Some((mut memory, found, health)) = boot(chip) else {
        return figures.lose(|| format!("{}: does not start", place()));
    };
    let repair = chip.work() - work_before;
    if found != *step.old && found != *step.new {
        return figures.lose(|| format!("{}: {found:?} ({health})", place()));
    }
    // The machine works.
    let next = owner::change(&found, dice, Habits::MODEST);
    let outcome = store(&mut memory, &next);
    let again = boot(chip).map(|(_, settings, _)| settings);
    if outcome != Ok(()) || again.as_ref() != Some(&next) {
        return figures.lose(|| format!("{}: {outcome:?}, then {again:?}", place()));
    }
    // Once more, with a cut in what was just done: the start, or the store behind it.
    let whole = chip.work() - work_before;
    for range in [0..repair, repair..whole] {
        if range.is_empty() {
            continue;
        }
        let moment = range.start + dice.number() % (range.end - range.start);
        let tear = [Tear::Prefix, Tear::Mixture][dice.below(2)];
        chip.restore(&torn);
        chip.power_on();
        chip.fail_after(moment, tear);
        let reached = boot(chip).map(|(mut memory, _, _)| store(&mut memory, &next));
        assert!(!chip.is_powered(), "{}: {reached:?}", place());
        chip.power_on();
        figures.second_cuts += 1;
        let after = boot(chip).map(|(_, settings, _)| settings);
        let allowed = [Some(&found), Some(&next)];
        if !allowed.contains(&after.as_ref()) {
            figures.lose(|| format!("{}, again at {moment} ({tear:?}): {after:?}", place()));
            continue;
        }
        let Some((mut memory, _, _)) = boot(chip) else {
            continue;
        };
        let outcome = store(&mut memory, step.new);
        let last = boot(chip).map(|(_, settings, _)| settings);
        if outcome != Ok(()) || last.as_ref() != Some(step.new) {
            figures.lose(|| {
                format!(
                    "{}, again at {moment} ({tear:?}): {outcome:?}, then {last:?}",
                    place()
                )
            });
        }
    }
}

/// A history: a machine's life up to somewhere, and then a few operations with cuts everywhere.
fn live<const PAGE: usize>(history: u64, length: usize, habits: Habits) -> Figures {
    let mut figures = Figures::default();
    let mut dice = Dice::new(history);
    let chip = Chip::<PAGE>::erased();
    let mut now = Settings::default();
    // The stores have been round all pages of the flash, or not yet.
    for _ in 0..dice.below(40) {
        now = owner::change(&now, &mut dice, habits);
        let (mut memory, _, _) = boot(&chip).expect("it starts");
        assert_eq!(store(&mut memory, &now), Ok(()));
    }
    for number in 0..length {
        let next = owner::change(&now, &mut dice, habits);
        let before = chip.state();
        let step = Step {
            before: &before,
            old: &now,
            new: &next,
            place: format!("history {history}, operation {number}"),
        };
        cut_everywhere(&chip, &step, &mut dice, &mut figures);
        // The history goes on after a cut, at times, with what is found then.
        chip.restore(&before);
        if dice.below(3) > 0 {
            chip.fail_after(dice.number() % 400, Tear::Mixture);
        }
        let _ = boot(&chip).map(|(mut memory, _, _)| store(&mut memory, &next));
        chip.power_on();
        let (_, found, _) = boot(&chip).expect("it starts");
        now = found;
        figures.operations += 1;
    }
    figures.histories += 1;
    figures
}

/// Machines with settings of earlier firmware, which are carried over, with cuts everywhere.
fn carry_over<const PAGE: usize>(history: u64) -> Figures {
    let mut figures = Figures::default();
    let mut dice = Dice::new(!history);
    let chip = Chip::<PAGE>::erased();
    let old = earlier::live(&chip, &mut dice);
    let new = owner::change(&old, &mut dice, Habits::MODEST);
    let before = chip.state();
    let step = Step {
        before: &before,
        old: &old,
        new: &new,
        place: format!("history {history}, carried over"),
    };
    cut_everywhere(&chip, &step, &mut dice, &mut figures);
    figures.operations += 1;
    figures.histories += 1;
    figures
}

/// Machines with one half of the flash worn out: there is one copy.
fn live_with_one_half<const PAGE: usize>(history: u64, length: usize) -> Figures {
    let mut figures = Figures::default();
    let mut dice = Dice::new(history);
    let chip = Chip::<PAGE>::erased();
    let mut now = Settings::default();
    let half = dice.below(2) * PAGES / 2;
    let wear = [Wear::Honest, Wear::Silent][dice.below(2)];
    let healthy = dice.below(10);
    for number in 0..healthy + dice.below(20) {
        if number == healthy {
            (half..half + PAGES / 2).for_each(|page| chip.wear_out(page, wear));
        }
        now = owner::change(&now, &mut dice, Habits::MODEST);
        let (mut memory, _, _) = boot(&chip).expect("it starts");
        assert_eq!(store(&mut memory, &now), Ok(()));
    }
    (half..half + PAGES / 2).for_each(|page| chip.wear_out(page, wear));
    for number in 0..length {
        let next = owner::change(&now, &mut dice, Habits::MODEST);
        let before = chip.state();
        let step = Step {
            before: &before,
            old: &now,
            new: &next,
            place: format!("history {history}, half worn out, operation {number}"),
        };
        cut_everywhere(&chip, &step, &mut dice, &mut figures);
        chip.restore(&before);
        let (mut memory, _, _) = boot(&chip).expect("it starts");
        assert_eq!(store(&mut memory, &next), Ok(()));
        now = next;
        figures.operations += 1;
    }
    figures.histories += 1;
    figures
}

/// Some histories, on all cores.
fn all(histories: u64, history: impl Fn(u64) -> Figures + Sync) -> Figures {
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
    let mut figures = Figures::default();
    std::thread::scope(|scope| {
        let history = &history;
        let workers: Vec<_> = (0..cores)
            .map(|core| {
                scope.spawn(move || {
                    let mut figures = Figures::default();
                    for number in (core as u64..histories).step_by(cores) {
                        figures.add(history(number));
                    }
                    figures
                })
            })
            .collect();
        for worker in workers {
            figures.add(worker.join().expect("its panic is above"));
        }
    });
    figures
}

#[test]
fn nothing_is_lost_wherever_the_power_fails() {
    let histories = long_run().unwrap_or(30);
    all(histories, |history| live::<256>(history, 6, Habits::MODEST)).report("pages of 256 bytes");
}

#[test]
fn nothing_is_lost_on_pages_of_the_real_size() {
    let histories = long_run().map_or(3, |many| many / 20);
    all(histories, |history| live::<4096>(history, 3, Habits::ANY)).report("pages of 4096 bytes");
}

#[test]
fn nothing_is_lost_when_settings_of_earlier_firmware_are_carried_over() {
    let histories = long_run().unwrap_or(20);
    let small = |history| carry_over::<512>(history);
    all(histories, small).report("carried over, pages of 512 bytes");
    let histories = histories / 10;
    let real = |history| carry_over::<4096>(history);
    all(histories, real).report("carried over, pages of 4096 bytes");
}

#[test]
fn one_copy_is_safe_as_well() {
    let histories = long_run().unwrap_or(12);
    all(histories, |history| live_with_one_half::<256>(history, 6)).report("one half worn out");
}
