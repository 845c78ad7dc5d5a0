//! Time driver of embassy on the CLINT.
//!
//! The tick is 1 us although the clock counts 100 ns: it is embassy's default and what esp-rtos uses, so a duration is rounded
//! the same way on every board, the servo records are in microseconds anyway, and the network stack asks for microseconds
//! more often than anything else asks for the time. The division by ten is a multiplication by a constant.
//!
//! Under `-icount shift=0` an instruction takes 1 ns of this time: a tick is 1000 instructions, exactly and repeatably.

use core::{cell::RefCell, task::Waker};

use critical_section::Mutex;
use embassy_time_driver::{Driver, TICK_HZ, time_driver_impl};
use embassy_time_queue_utils::Queue;

use crate::boards::virt::{clint, map};

const MTIME_PER_TICK: u64 = map::MTIME_HZ / TICK_HZ;
const _: () = assert!(map::MTIME_HZ.is_multiple_of(TICK_HZ));

struct ClintDriver {
    queue: Mutex<RefCell<Queue>>,
}

time_driver_impl!(static DRIVER: ClintDriver = ClintDriver {
    queue: Mutex::new(RefCell::new(Queue::new())),
});

impl Driver for ClintDriver {
    fn now(&self) -> u64 {
        clint::mtime() / MTIME_PER_TICK
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|cs| {
            let mut queue = self.queue.borrow_ref_mut(cs);
            if queue.schedule_wake(at, waker) {
                self.arm(&mut queue);
            }
        });
    }
}

impl ClintDriver {
    /// Wakes what is due and sets the alarm to what is next. An alarm that is already past interrupts at once.
    fn arm(&self, queue: &mut Queue) {
        let next = queue.next_expiration(self.now());
        clint::set_alarm(next.saturating_mul(MTIME_PER_TICK));
    }
}

/// Timer interrupt.
pub(crate) fn on_alarm() {
    critical_section::with(|cs| DRIVER.arm(&mut DRIVER.queue.borrow_ref_mut(cs)));
}
