//! Core-local interruptor: the clock, one alarm, and one interrupt that software raises.
//!
//! The crate `riscv-peripheral` has the same registers, but reads the 64-bit `mtime` in one access; on a 32-bit core that is
//! two loads with nothing that keeps a carry from slipping between them.
#![allow(unsafe_code)]

use crate::boards::virt::{map, mmio::Register};

// SAFETY: addresses of the CLINT of the virt machine.
const MSIP: Register = unsafe { Register::at(map::CLINT) };
// SAFETY: as above.
const MTIMECMP: [Register; 2] = unsafe {
    [
        Register::at(map::CLINT + 0x4000),
        Register::at(map::CLINT + 0x4004),
    ]
};
// SAFETY: as above.
const MTIME: [Register; 2] = unsafe {
    [
        Register::at(map::CLINT + 0xbff8),
        Register::at(map::CLINT + 0xbffc),
    ]
};

/// Ticks of [`map::MTIME_HZ`] since power-up.
pub fn mtime() -> u64 {
    loop {
        let high = MTIME[1].read();
        let low = MTIME[0].read();
        if MTIME[1].read() == high {
            return u64::from(high) << 32 | u64::from(low);
        }
    }
}

/// Sets the alarm; the timer interrupt is pending while `mtime` is at or past it. `u64::MAX` is never.
pub fn set_alarm(at: u64) {
    // The high half goes to its maximum first, so that no mixture of old and new halves fires early.
    MTIMECMP[1].write(u32::MAX);
    MTIMECMP[0].write(at as u32);
    MTIMECMP[1].write((at >> 32) as u32);
}

/// Makes the software interrupt pending.
pub fn raise_software() {
    MSIP.write(1);
}

/// Takes the software interrupt back.
pub fn clear_software() {
    MSIP.write(0);
}
