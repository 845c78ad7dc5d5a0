//! Time on a desktop: real, faster, or as fast as possible.
//!
//! An embassy time driver of our own, because the arm's time need not be the wall's. A thread waits
//! for the next alarm; where time is virtual, the executor jumps to it instead, as soon as it has
//! nothing else to do. Jumps are taken only while the arm moves: at rest nothing is to be hurried, and
//! the time that clients see stays near the wall's.
//!
//! A test may take the time of its thread into its own hands ([`HandTime`]): it stands still then, unless
//! it is moved.

use core::task::Waker;
use embassy_executor::{Executor, Spawner};
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;
use std::cell::RefCell;
use std::marker::PhantomData;
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
        HandTime::with(|hand| hand.now).unwrap_or_else(|| self.lock().now())
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        if HandTime::with(|hand| hand.alarms.schedule_wake(at, waker)).is_some() {
            return;
        }
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

struct Hand {
    now: u64,
    alarms: Queue,
}

thread_local! {
    static HAND: RefCell<Option<Hand>> = const { RefCell::new(None) };
}

/// As long as this lives, time in this thread begins at 0 and is what it is told to be.
#[derive(Debug)]
pub struct HandTime {
    /// Of this thread, so it stays there.
    thread: PhantomData<*const ()>,
}

impl HandTime {
    /// Takes the time of this thread into hand.
    pub fn take() -> Self {
        HAND.set(Some(Hand {
            now: 0,
            alarms: Queue::new(),
        }));
        Self {
            thread: PhantomData,
        }
    }

    fn with<T>(f: impl FnOnce(&mut Hand) -> T) -> Option<T> {
        HAND.with_borrow_mut(|hand| hand.as_mut().map(f))
    }

    /// When the next alarm is due, after those that are due now have been rung.
    pub fn next_alarm(&self) -> Option<embassy_time::Instant> {
        let next = Self::with(|hand| hand.alarms.next_expiration(hand.now))?;
        (next != u64::MAX).then(|| embassy_time::Instant::from_ticks(next))
    }

    /// Nobody waits for an alarm any more.
    pub fn forget_alarms(&self) {
        Self::with(|hand| hand.alarms = Queue::new());
    }

    /// Goes on to `time`, or stays where it is if that is past, and rings the alarms that are due.
    pub fn go_on_to(&self, time: embassy_time::Instant) {
        Self::with(|hand| {
            hand.now = hand.now.max(time.as_ticks());
            hand.alarms.next_expiration(hand.now)
        });
    }
}

impl Drop for HandTime {
    fn drop(&mut self) {
        HAND.set(None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_time::{Duration, Instant, Timer};
    use std::pin::pin;
    use std::sync::Arc;
    use std::sync::atomic::AtomicUsize;
    use std::task::{Context, Wake};

    struct Count(AtomicUsize);

    impl Wake for Count {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    #[test]
    fn time_in_hand_stands_still_unless_it_is_moved() {
        let hand = HandTime::take();
        assert_eq!(Instant::now(), Instant::MIN);
        let woken = Arc::new(Count(AtomicUsize::new(0)));
        let waker = Waker::from(woken.clone());
        let mut context = Context::from_waker(&waker);
        let mut timer = pin!(Timer::after(Duration::from_secs(5)));
        assert!(timer.as_mut().poll(&mut context).is_pending());
        assert_eq!(hand.next_alarm(), Some(Instant::from_secs(5)));
        hand.go_on_to(Instant::from_secs(4));
        assert_eq!(woken.0.load(Ordering::Relaxed), 0);
        hand.go_on_to(Instant::from_secs(5));
        assert_eq!(woken.0.load(Ordering::Relaxed), 1);
        assert!(timer.as_mut().poll(&mut context).is_ready());
        assert_eq!(hand.next_alarm(), None);
        hand.go_on_to(Instant::from_secs(1));
        assert_eq!(Instant::now(), Instant::from_secs(5));
        // Another thread has its own.
        std::thread::spawn(|| {
            let _hand = HandTime::take();
            assert_eq!(Instant::now(), Instant::MIN);
        })
        .join()
        .unwrap();
    }
}
