//! Platform-level interrupt controller: hands the devices' interrupts to machine mode of hart 0.
#![allow(unsafe_code)]

use crate::boards::virt::{map, mmio::Register};

// SAFETY: enable word 0 of context 0; sources 0..=31 are all that this board uses.
const ENABLE: Register = unsafe { Register::at(map::PLIC + 0x2000) };
// SAFETY: priority threshold of context 0.
const THRESHOLD: Register = unsafe { Register::at(map::PLIC + 0x20_0000) };
// SAFETY: claim/complete register of context 0.
const CLAIM: Register = unsafe { Register::at(map::PLIC + 0x20_0004) };

/// Lets `source` (1..=31) interrupt. All sources have the same priority: handlers only move bytes and wake tasks.
pub fn enable(source: u32) {
    assert!((1..32).contains(&source));
    // SAFETY: priority register of a source that exists.
    let priority = unsafe { Register::at(map::PLIC + 4 * source as usize) };
    priority.write(1);
    THRESHOLD.write(0);
    critical_section::with(|_| ENABLE.write(ENABLE.read() | 1 << source));
}

/// Calls `handle` with each source that is pending, until none is.
pub fn dispatch(handle: impl Fn(u32)) {
    loop {
        let source = CLAIM.read();
        if source == 0 {
            return;
        }
        handle(source);
        CLAIM.write(source);
    }
}
