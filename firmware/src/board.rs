//! What a board brings where the ecosystem has no trait for it.
//!
//! Network: edge-nal's `TcpAccept`. Memory: embedded-storage-async's `NorFlash`. Time: an
//! embassy-time driver. The rest is here.

use protocol_core::machine::SetPoint;
use protocol_core::motion::Micros;

/// The three servos.
pub trait Servos {
    /// Takes over the set-point of the frame at `time`, counted from the start of the servo clock.
    ///
    /// Called once each frame; it must not wait for anything.
    fn write(&mut self, time: Micros, set_point: &SetPoint);
}

/// What a board knows about itself, for diagnostics.
#[derive(Clone, Copy, Debug)]
pub struct Vitals {
    /// Free memory in bytes.
    pub free_memory: fn() -> u32,
    /// Why the firmware started.
    pub reset_reason: &'static str,
}
