//! Panics and processor exceptions: say it, then end with a status that a script can test.
#![allow(unsafe_code)]

use core::panic::PanicInfo;

use crate::boards::virt::{console, power};

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    // The console below is written without interrupts or locks: nothing must preempt the message.
    riscv::interrupt::disable();
    console::write_unlocked(format_args!("{info}\n"));
    power::exit(power::PANIC_STATUS)
}

/// riscv-rt calls this for each exception that has no handler of its own; its default is a silent endless loop.
#[unsafe(export_name = "ExceptionHandler")]
fn exception(frame: &riscv_rt::TrapFrame) -> ! {
    panic!(
        "exception {} at {:#010x}, value {:#010x}, ra {:#010x}",
        riscv::register::mcause::read().code(),
        riscv::register::mepc::read(),
        riscv::register::mtval::read(),
        frame.ra
    )
}
