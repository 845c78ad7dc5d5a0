//! The arm's surroundings, within reach of a test on the host: two virtio consoles.
//!
//! Into the one with the lower slot go records ([`record`]): each servo frame and each change of the light, into a file that
//! keeps them whether or not somebody reads. Out of the other come lines of text, `button down` and `button up`,
//! `door open` and its like ([`inputs`]), `instructions`, `panic` and `hang`; the log goes
//! into it, so that a person at a terminal sees the one and types the other.

pub mod button;
mod console_queue;
pub mod inputs;
pub mod light;
mod lines;
pub mod record;
mod recorder;
pub mod servos;

use crate::boards::virt::executor;
pub use {lines::Lines, recorder::Recorder};

/// Acts on one line from the host.
fn on_line(line: &[u8]) {
    match line {
        b"button down" => button::set(true),
        b"button up" => button::set(false),
        b"door open" => inputs::change(|sensors| sensors.door_open = true),
        b"door closed" => inputs::change(|sensors| sensors.door_open = false),
        b"chiller off" => inputs::change(|sensors| sensors.chiller_off = true),
        b"chiller on" => inputs::change(|sensors| sensors.chiller_off = false),
        b"power off" => inputs::change(|sensors| sensors.power_off = true),
        b"power on" => inputs::change(|sensors| sensors.power_off = false),
        b"instructions" => log::info!("instructions {}", executor::instructions()),
        b"hang" => {
            log::info!("the host asked for a hang");
            // The servo tick as well: what a watchdog is for.
            riscv::interrupt::disable();
            loop {
                core::hint::spin_loop();
            }
        }
        b"panic" => panic!("the host asked for a panic"),
        _ => log::warn!("unknown line {}", line.escape_ascii()),
    }
}
