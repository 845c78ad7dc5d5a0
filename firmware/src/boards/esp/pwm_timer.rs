//! The LEDC timer that makes the servo frames: its settings and its overflow interrupt, both of
//! which esp-hal does not offer (its driver stops at 14 bits on all but the first ESP32, and has no
//! interrupts).

use super::pulse_clock::PulseClock;
use crate::board::Frames;
use core::future::poll_fn;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Poll;
use embassy_sync::waitqueue::AtomicWaker;
use esp_hal::handler;
use esp_hal::interrupt::{self, Priority};
use esp_hal::ledc::timer::Number;
use esp_hal::peripherals::{Interrupt, LEDC};

/// The servo timer. Timer 1 belongs to the light.
pub const SERVO_TIMER: Number = Number::Timer0;
const SERVO: u8 = SERVO_TIMER as u8;

/// Width of the chip's LEDC counters (ESP-IDF: `SOC_LEDC_TIMER_BIT_WIDTH`).
pub const COUNTER_BITS: u8 = if cfg!(any(feature = "esp32", feature = "esp32c6")) {
    20
} else {
    14
};

/// Clock of the LEDC timers: APB, or the PLL's 80 MHz output on chips without a fixed APB clock.
/// Both come from the crystal, as does the system timer: frames never drift against it.
pub const SOURCE_HZ: u32 = 80_000_000;

/// Frames that have begun.
static BEGUN: AtomicU32 = AtomicU32::new(0);
/// Frames that got a set-point of their own.
static SERVED: AtomicU32 = AtomicU32::new(0);
static FRAME_BEGAN: AtomicWaker = AtomicWaker::new();

/// The frames of the servo timer. One exists, see [`super::servos::ServoPorts`].
pub struct OverflowFrames {
    seen: u32,
}

impl OverflowFrames {
    /// Binds the overflow interrupt of the servo timer, at the highest priority.
    pub(super) fn listen() -> Self {
        clear();
        enable();
        interrupt::bind_handler(Interrupt::LEDC, frame_began);
        Self {
            seen: BEGUN.load(Ordering::Relaxed),
        }
    }
}

impl Frames for OverflowFrames {
    /// Where the caller was late, the frames meanwhile have repeated the last pulses and are over.
    async fn next(&mut self) {
        poll_fn(|context| {
            FRAME_BEGAN.register(context.waker());
            let now = BEGUN.load(Ordering::Relaxed);
            if now == self.seen {
                return Poll::Pending;
            }
            self.seen = now;
            Poll::Ready(())
        })
        .await;
        // Nobody else writes it, so no atomic addition is needed, which the C3 does not have.
        SERVED.store(
            SERVED.load(Ordering::Relaxed).wrapping_add(1),
            Ordering::Relaxed,
        );
    }
}

/// How many frames have begun, and how many of them got a set-point of their own; both wrap around.
pub fn frames() -> (u32, u32) {
    let served = SERVED.load(Ordering::Relaxed);
    (BEGUN.load(Ordering::Relaxed), served)
}

#[handler(priority = Priority::max())]
fn frame_began() {
    clear();
    BEGUN.store(
        BEGUN.load(Ordering::Relaxed).wrapping_add(1),
        Ordering::Relaxed,
    );
    FRAME_BEGAN.wake();
}

#[cfg(not(feature = "esp32"))]
fn clear() {
    LEDC::regs()
        .int_clr()
        .write(|w| w.timer_ovf(SERVO).clear_bit_by_one());
}

#[cfg(not(feature = "esp32"))]
fn enable() {
    LEDC::regs()
        .int_ena()
        .modify(|_, w| w.timer_ovf(SERVO).set_bit());
}

#[cfg(feature = "esp32")]
fn clear() {
    LEDC::regs()
        .int_clr()
        .write(|w| w.lstimer_ovf(SERVO).clear_bit_by_one());
}

#[cfg(feature = "esp32")]
fn enable() {
    LEDC::regs()
        .int_ena()
        .modify(|_, w| w.lstimer_ovf(SERVO).set_bit());
}

/// Sets counter width and divider of the servo timer; they hold from its next overflow on.
#[cfg(not(feature = "esp32"))]
#[expect(
    unsafe_code,
    reason = "register fields without a safe setter, see SAFETY"
)]
pub(super) fn set(clock: &PulseClock) {
    let timer = LEDC::regs().timer(SERVO as usize);
    timer.conf().modify(|_, w| {
        // SAFETY: `PulseClock::finest` was asked for at most COUNTER_BITS bits, which the field
        // holds, and gives dividers of at most 18 bits and at least 1.0, all of them valid.
        unsafe {
            w.duty_res().bits(clock.bits());
            w.clk_div().bits(clock.divider())
        }
    });
    timer.conf().modify(|_, w| w.para_up().set_bit());
}

/// Sets counter width and divider of the servo timer; they hold from its next overflow on.
#[cfg(feature = "esp32")]
#[expect(
    unsafe_code,
    reason = "register fields without a safe setter, see SAFETY"
)]
pub(super) fn set(clock: &PulseClock) {
    let timer = LEDC::regs().lstimer(SERVO as usize);
    timer.conf().modify(|_, w| {
        // SAFETY: as above.
        unsafe {
            w.duty_res().bits(clock.bits());
            w.div_num().bits(clock.divider())
        }
    });
    timer.conf().modify(|_, w| w.para_up().set_bit());
}
