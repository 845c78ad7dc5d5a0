//! QEMU's `virt` machine (`qemu-system-riscv32 -M virt`) as a board: the instruction set of the
//! ESP32-C3, standard devices, and everything around the arm within reach of a test on the host.
//!
//! A device that is missing or refuses is a mistake in the emulator's command line: there the board
//! panics, which the emulator reports.
#![allow(clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

mod clint;
pub mod console;
pub mod executor;
mod fatal;
pub mod flash;
pub mod interrupts;
pub mod map;
mod mmio;
pub mod net;
mod plic;
pub mod power;
pub mod slots;
mod time;
pub mod uart;
pub mod virtio;
pub mod world;

use crate::board::{Address, Vitals};
use virtio_drivers::transport::DeviceType;

/// What this board knows about itself.
pub const VITALS: Vitals = Vitals {
    free_memory,
    reset_reason: "power on",
    last_panic: "",
};

/// There is no heap: what is free is what lies between the variables and the stack.
#[allow(unsafe_code)]
fn free_memory() -> u32 {
    unsafe extern "C" {
        /// The end of the variables (`link.x`); only its address means something.
        static __ebss: u8;
    }
    // The stack grows down from the top; a local variable tells how far.
    let here = 0_u8;
    let stack = core::ptr::from_ref(&here).addr();
    stack.saturating_sub((&raw const __ebss).addr()) as u32
}

/// The devices of a complete machine.
pub struct Devices {
    /// Network card.
    pub card: net::VirtNet,
    /// Flash.
    pub disk: flash::Flash,
    /// Where the servo frames go.
    pub recorder: world::Recorder,
    /// Where the host's lines come from.
    pub lines: world::Lines,
    /// The two ends of the serial port.
    pub serial: (uart::Receiver, uart::Transmitter),
}

/// Finds the devices and lets them interrupt; call once, first of all. `None` when one is missing.
#[allow(unsafe_code)]
pub fn start() -> Option<Devices> {
    console::init();
    let (mut card, mut disk, mut recorder, mut lines) = (None, None, None, None);
    // SAFETY: called once, at the start of the program.
    for device in unsafe { virtio::devices() } {
        match device.kind() {
            DeviceType::Network => card = Some(net::VirtNet::new(device)),
            DeviceType::Block => disk = Some(flash::Flash::new(device)),
            DeviceType::Console if recorder.is_none() => {
                recorder = Some(world::Recorder::new(device));
            }
            DeviceType::Console => {
                console::attach(&device);
                lines = Some(world::Lines::new(device));
            }
            _ => {}
        }
    }
    let serial = uart::init();
    interrupts::enable();
    Some(Devices {
        card: card?,
        disk: disk?,
        recorder: recorder?,
        lines: lines?,
        serial,
    })
}

/// The address comes over the wire, whatever the radio does.
pub struct Wired;

impl Address for Wired {
    fn ask(&self) {}

    async fn serve_guests(&self) -> ! {
        core::future::pending().await
    }
}
