//! Leaving the emulator with an exit status.
#![allow(unsafe_code)]

use crate::boards::virt::{map, mmio::Register};

// SAFETY: address of the power-off device of the virt machine.
const POWER: Register = unsafe { Register::at(map::POWER) };

/// Exit status after a panic or a processor exception.
pub const PANIC_STATUS: u16 = 101;

/// Exit status of a firmware that wants to be started again: whoever drives the emulator does it.
pub const RESTART_STATUS: u16 = 102;

/// Ends QEMU with `status`.
pub fn exit(status: u16) -> ! {
    POWER.write(if status == 0 {
        0x5555
    } else {
        u32::from(status) << 16 | 0x3333
    });
    // QEMU stops the machine a moment after the write.
    loop {
        riscv::asm::wfi();
    }
}
