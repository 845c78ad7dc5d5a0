//! What starts a firmware on trial again when it hangs, panics or ends with an error.
//!
//! Until it has confirmed itself: a program that people use is left to them. What it does at rest is seen by
//! the rounds of its executor, of which each servo frame is one at least.

use super::bootloader::{Reset, Running};
use super::clock::Speed;
use crate::services::update::Update;
use protocol_core::update::Standing;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;
use std::{panic, process, thread};

/// A firmware hangs when its executor has made no round for so long, of the arm's time: no servo frame is
/// longer than a second of it.
const PATIENCE: Duration = Duration::from_secs(10);
/// But a computer that is busy with something else gets so long, of the wall's time.
const LEAST: Duration = Duration::from_secs(1);
/// Looks in that time. They are counted, so that a computer that slept has taken no time.
const LOOKS: u32 = 10;

/// A trial lasts.
static LASTS: AtomicBool = AtomicBool::new(false);
static ROUNDS: AtomicU32 = AtomicU32::new(0);

/// How long nothing may happen at a speed.
fn patience(speed: Speed) -> Duration {
    match speed {
        Speed::Times(factor) => PATIENCE.div_f64(factor).max(LEAST),
        Speed::Max => PATIENCE,
    }
}

/// Begins a trial. Hanging is seen from [`observe`] on.
pub fn begin(running: &Running) {
    LASTS.store(true, Ordering::Relaxed);
    let told = panic::take_hook();
    let after_panic = running.clone();
    panic::set_hook(Box::new(move |what| {
        told(what);
        if lasts() {
            give_up(&after_panic, Reset::Panic);
        }
    }));
}

/// Watches a firmware on trial from now on.
pub fn observe(running: &Running, speed: Speed) {
    let running = running.clone();
    thread::spawn(move || watch(&running, patience(speed) / LOOKS));
}

/// Whether the trial lasts.
pub fn lasts() -> bool {
    LASTS.load(Ordering::Relaxed)
}

/// The executor has made a round; with the firmware confirmed, the trial is over.
pub fn round(update: &Update) {
    ROUNDS.fetch_add(1, Ordering::Relaxed);
    if lasts() && !matches!(update.status().standing, Standing::Trial { .. }) {
        end();
    }
}

/// Ends the trial, whatever came of it.
pub fn end() {
    LASTS.store(false, Ordering::Relaxed);
}

/// Says nothing: who hangs may hold the output.
fn watch(running: &Running, between: Duration) {
    let (mut rounds, mut silent) = (0, 0);
    while silent < LOOKS {
        thread::sleep(between);
        if !lasts() {
            return;
        }
        let now = ROUNDS.load(Ordering::Relaxed);
        silent = if now == rounds { silent + 1 } else { 0 };
        rounds = now;
    }
    give_up(running, Reset::Watchdog);
}

fn give_up(running: &Running, why: Reset) -> ! {
    let _ = running.restart(why);
    // There is nothing that could be started.
    process::abort()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_arm_is_not_taken_for_one_that_hangs() {
        // The longest frame, of the slowest arm.
        let frame = Duration::from_secs(1).div_f64(0.01);
        assert!(patience(Speed::Times(0.01)) >= 10 * frame);
        assert_eq!(patience(Speed::Times(1.0)), Duration::from_secs(10));
        assert_eq!(patience(Speed::Times(1000.0)), Duration::from_secs(1));
        assert_eq!(patience(Speed::Max), Duration::from_secs(10));
    }
}
