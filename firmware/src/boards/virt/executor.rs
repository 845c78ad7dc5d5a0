//! Two executors: one in thread mode for everything, one in the software interrupt for the servo tick.
//!
//! embassy has no interrupt executor for RISC-V. This is one: a wake-up of a task on it makes the CLINT's software interrupt
//! pending, and that interrupt polls it. So the servo tick runs the moment its alarm has fired, whatever a network task is
//! in the middle of; only critical sections and interrupt handlers delay it.
#![allow(unsafe_code)]

use core::sync::atomic::{AtomicBool, AtomicPtr, AtomicU32, Ordering};

use embassy_executor::{SendSpawner, Spawner, raw};
use riscv::register::minstret;
use static_cell::StaticCell;

use crate::boards::virt::clint;

/// What `__pender` is told by the servo's executor; the thread executor's context is null.
const SERVO_CONTEXT: *mut () = core::ptr::without_provenance_mut(1);

static THREAD: StaticCell<raw::Executor> = StaticCell::new();
static SERVO: StaticCell<raw::Executor> = StaticCell::new();
static SERVO_POLLED: AtomicPtr<raw::Executor> = AtomicPtr::new(core::ptr::null_mut());
static THREAD_HAS_WORK: AtomicBool = AtomicBool::new(false);
static ASLEEP: AtomicBool = AtomicBool::new(false);
/// Instructions that count for nobody: sleep, and the servo tick, which is measured by itself.
static LEFT_OUT: AtomicU32 = AtomicU32::new(0);

#[unsafe(export_name = "__pender")]
fn pender(context: *mut ()) {
    if context == SERVO_CONTEXT {
        clint::raise_software();
    } else {
        THREAD_HAS_WORK.store(true, Ordering::SeqCst);
    }
}

/// Starts the executor of the servo tick. Call once; tasks spawned on it must be short: they run with interrupts masked.
pub fn start_servo_executor() -> SendSpawner {
    let executor = SERVO.init_with(|| raw::Executor::new(SERVO_CONTEXT));
    SERVO_POLLED.store(core::ptr::from_ref(executor).cast_mut(), Ordering::Release);
    executor.spawner().make_send()
}

/// Software interrupt.
pub(crate) fn on_software_interrupt() {
    // Cleared before polling: a wake-up that arrives during the poll must raise it again.
    clint::clear_software();
    let executor = SERVO_POLLED.load(Ordering::Acquire);
    // SAFETY: null until it points to an executor that lives for ever; polled only here, and this interrupt does not nest.
    if let Some(executor) = unsafe { executor.as_ref() } {
        let before = minstret::read() as u32;
        // SAFETY: as above.
        unsafe { executor.poll() };
        leave_out(before);
    }
}

/// Runs the thread executor for ever; `start` spawns its first tasks.
pub fn run(start: impl FnOnce(Spawner)) -> ! {
    let executor: &'static raw::Executor =
        THREAD.init_with(|| raw::Executor::new(core::ptr::null_mut()));
    start(executor.spawner());
    loop {
        // SAFETY: polled only here, and this function never returns and can be entered once (`StaticCell`).
        unsafe { executor.poll() };
        critical_section::with(|_| {
            if THREAD_HAS_WORK.load(Ordering::SeqCst) {
                THREAD_HAS_WORK.store(false, Ordering::SeqCst);
            } else {
                ASLEEP.store(true, Ordering::Relaxed);
                // Masked interrupts still end `wfi`; so none can come between the question and the sleep.
                let before = minstret::read() as u32;
                riscv::asm::wfi();
                leave_out(before);
            }
        });
        // Here the interrupt that ended the sleep has run.
        ASLEEP.store(false, Ordering::Relaxed);
    }
}

/// Leaves out what was counted since `before`. Interrupts are masked.
fn leave_out(before: u32) {
    let spent = (minstret::read() as u32).wrapping_sub(before);
    LEFT_OUT.store(
        LEFT_OUT.load(Ordering::Relaxed).wrapping_add(spent),
        Ordering::Relaxed,
    );
}

/// Instructions executed since power-up, modulo 2^32, without sleep and servo ticks: the difference of
/// two readings under `-icount shift=0` is exact. QEMU's `minstret` goes on while the core sleeps.
pub fn instructions() -> u32 {
    critical_section::with(|_| {
        (minstret::read() as u32).wrapping_sub(LEFT_OUT.load(Ordering::Relaxed))
    })
}

/// Whether the interrupt that runs now found the core asleep. Then its delay is the emulator's own, which oversleeps by as
/// much as the host makes it, even under `-icount`; a delay with the core awake is this program's.
pub fn woken_from_sleep() -> bool {
    ASLEEP.load(Ordering::Relaxed)
}
