//! Where log lines and last words go: one store for each byte, synchronous, from any context.
//!
//! A virtio console takes bytes through its emergency-write register (virtio 1.2, 5.3.4) with no queue, interrupt or memory
//! behind it, so it works in a panic too. When there is no second virtio console the serial port is used; then a G-code client
//! on that port sees the log among its replies, hence the separate device.
#![allow(unsafe_code)]

use core::{
    fmt::{self, Write},
    sync::atomic::{AtomicUsize, Ordering},
};

use crate::boards::virt::{mmio::Register, uart, virtio::Device};

/// Offset of `emerg_wr` in the slot: configuration space, then 8.
const EMERGENCY_WRITE: usize = 0x108;

/// Address of the emergency-write register, or 0 for the serial port.
static REGISTER: AtomicUsize = AtomicUsize::new(0);

/// Makes this the destination of the `log` crate. Call once, before anything logs; until [`attach`] it is the serial port.
pub fn init() {
    // SAFETY: nothing else runs yet, and there is one core.
    let set = unsafe { log::set_logger_racy(&Console) };
    if set.is_ok() {
        // SAFETY: as above.
        unsafe { log::set_max_level_racy(log::LevelFilter::Info) };
    }
}

/// Sends everything from now on to `device`, a virtio console.
pub fn attach(device: &Device) {
    REGISTER.store(device.slot.base() + EMERGENCY_WRITE, Ordering::Relaxed);
}

/// Writes text at once. Lines written by an interrupt may fall into the middle of another.
pub fn write_unlocked(text: fmt::Arguments) {
    let _ = Console.write_fmt(text);
}

struct Console;

impl Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        match REGISTER.load(Ordering::Relaxed) {
            0 => uart::write_now(text.as_bytes()),
            address => {
                // SAFETY: the emergency-write register of a virtio console (`attach`).
                let register = unsafe { Register::at(address) };
                text.bytes().for_each(|byte| register.write(byte.into()));
            }
        }
        Ok(())
    }
}

impl log::Log for Console {
    fn enabled(&self, _metadata: &log::Metadata) -> bool {
        true
    }

    fn log(&self, record: &log::Record) {
        write_unlocked(format_args!("{:5} {}\n", record.level(), record.args()));
    }

    fn flush(&self) {}
}
