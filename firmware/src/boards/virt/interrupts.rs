//! The three interrupts of the machine and what each one does.
//!
//! They share one level: a handler is not interrupted by another. When several are pending the core takes external, then
//! software, then timer (RISC-V privileged specification, 3.1.9). Handlers are a few hundred instructions, except the
//! software interrupt, which runs the servo tick.
#![allow(unsafe_code)]

use riscv::interrupt::Interrupt;

use crate::boards::virt::{clint, executor, map, plic, time, uart, virtio};

/// Turns the interrupts on. Call once, when every device that may interrupt has been set up.
pub fn enable() {
    clint::set_alarm(u64::MAX);
    clint::clear_software();
    // SAFETY: every handler below is in place; critical sections mask `mstatus.MIE`, not single sources, so they stay whole.
    unsafe {
        riscv::register::mie::set_mtimer();
        riscv::register::mie::set_msoft();
        riscv::register::mie::set_mext();
        riscv::interrupt::enable();
    }
}

#[riscv_rt::core_interrupt(Interrupt::MachineTimer)]
fn timer() {
    time::on_alarm();
}

#[riscv_rt::core_interrupt(Interrupt::MachineSoft)]
fn software() {
    executor::on_software_interrupt();
}

#[riscv_rt::core_interrupt(Interrupt::MachineExternal)]
fn external() {
    plic::dispatch(|source| match source {
        map::UART_SOURCE => uart::on_interrupt(),
        _ => virtio::on_interrupt(source),
    });
}
