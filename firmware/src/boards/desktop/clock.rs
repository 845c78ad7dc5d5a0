//! Time on a desktop: real, faster, or as fast as possible.
//!
//! An embassy time driver of our own, because the arm's time need not be the wall's. A thread waits
//! for the next alarm; where time is virtual, the executor jumps to it instead, as soon as it has
//! nothing else to do. Jumps are taken only while the arm moves: at rest nothing is to be hurried, and
//! the time that clients see stays near the wall's.

use core::task::Waker;
use embassy_executor::{Executor, Spawner};
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How fast the arm's time runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// This many times as fast as the wall's.
    Times(f64),
    /// As fast as the computer can.
    Max,
}

impl std::str::FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "max" {
            return Ok(Self::Max);
        }
        match text.parse() {
            Ok(factor) if (0.01..=1000.0).contains(&factor) => Ok(Self::Times(factor)),
            _ => Err("a factor of 0.01 to 1000, or 'max'".into()),
        }
    }
}

struct Clock {
    state: Mutex<State>,
    /// An alarm was set earlier than the thread knows.
    earlier: Condvar,
    /// The next alarm may be jumped to.
    hurry: AtomicBool,
}

struct State {
    start: Option<Instant>,
    factor: f64,
    virtual_time: bool,
    /// Microseconds jumped over.
    skipped: u64,
    alarms: Queue,
}

embassy_time_driver::time_driver_impl!(static CLOCK: Clock = Clock {
    state: Mutex::new(State {
        start: None,
        factor: 1.0,
        virtual_time: false,
        skipped: 0,
        alarms: Queue::new(),
    }),
    earlier: Condvar::new(),
    hurry: AtomicBool::new(false),
});

impl State {
    fn now(&mut self) -> u64 {
        let elapsed = self.start.get_or_insert_with(Instant::now).elapsed();
        (elapsed.as_secs_f64() * self.factor * 1e6) as u64 + self.skipped
    }

    /// Wakes what is due, and gives the time of the next alarm.
    fn fire(&mut self) -> u64 {
        let now = self.now();
        self.alarms.next_expiration(now)
    }
}

impl Clock {
    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing that holds it can leave it half done.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn ring(&self) -> ! {
        let mut state = self.lock();
        loop {
            let next = state.fire();
            let wait = if next == u64::MAX {
                Duration::from_secs(3600)
            } else {
                let ahead = next.saturating_sub(state.now()) as f64 / state.factor;
                Duration::from_secs_f64(ahead / 1e6)
            };
            let waited = self.earlier.wait_timeout(state, wait);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Jumps to the next alarm, if there is one and time may jump.
    fn jump(&self) {
        let mut state = self.lock();
        if !state.virtual_time || !self.hurry.load(Ordering::Relaxed) {
            return;
        }
        let next = state.fire();
        if next != u64::MAX {
            let ahead = next.saturating_sub(state.now());
            state.skipped += ahead;
            state.fire();
        }
    }
}

impl Driver for Clock {
    fn now(&self) -> u64 {
        self.lock().now()
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        if self.lock().alarms.schedule_wake(at, waker) {
            self.earlier.notify_one();
        }
    }
}

/// Says whether time may jump now: while the arm moves, or while nobody watches.
pub fn hurry(yes: bool) {
    CLOCK.hurry.store(yes, Ordering::Relaxed);
}

/// Runs tasks until `done` says so; to be called once in a program.
pub fn run(speed: Speed, spawn: impl FnOnce(Spawner), mut done: impl FnMut() -> bool) {
    {
        let mut state = CLOCK.lock();
        match speed {
            Speed::Times(factor) => state.factor = factor,
            Speed::Max => state.virtual_time = true,
        }
        state.now();
    }
    std::thread::spawn(|| CLOCK.ring());
    let executor: &'static mut Executor = Box::leak(Box::new(Executor::new()));
    executor.run_until(spawn, || {
        CLOCK.jump();
        done()
    });
}
