//! What a board brings where the ecosystem has no trait for it.
//!
//! Network: edge-nal's `TcpAccept` and `UdpBind`. Memory: embedded-storage-async's `NorFlash`. Button:
//! embedded-hal-async's `Wait`. Time: an embassy-time driver. The rest is here.

use embedded_storage_async::nor_flash::{MultiwriteNorFlash, NorFlash};
use heapless::Vec;
use protocol_core::lasaur::Sensors;
use protocol_core::machine::SetPoint;
use protocol_core::motion::Micros;
pub use protocol_core::panel::Colour;
use protocol_core::update::Slot;
use protocol_core::wifi::{Heard, Joined, Network};

/// The three servos.
pub trait Servos {
    /// Takes over the set-point of the frame at `time`, counted from the start of the servo clock.
    ///
    /// Called once each frame; it must not wait for anything.
    fn write(&mut self, time: Micros, set_point: &SetPoint);
}

/// When the servos begin a new frame.
#[expect(
    async_fn_in_trait,
    reason = "awaited in place by the servo tick alone, so no bound is missing"
)]
pub trait Frames {
    /// Waits for the next frame.
    async fn next(&mut self);
}

/// The light.
pub trait Light {
    /// Shows a colour until the next one; must not wait.
    fn show(&mut self, colour: Colour);
}

/// The radio does not work: no memory, or a fault of its driver. Ask again later.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RadioFault;

/// The radio, for the network policy alone.
///
/// Only the link is dealt with here; addresses belong to the network stack, see [`Address`]. Station
/// and access point may exclude each other: switching one on may drop the other.
#[expect(
    async_fn_in_trait,
    reason = "awaited in place by the network service alone, so no bound is missing"
)]
pub trait Radio {
    /// Listens on all channels, strongest first; what does not fit `heard` is left out. Takes some
    /// seconds.
    ///
    /// # Errors
    /// [`RadioFault`] when the radio could not listen.
    async fn scan<const N: usize>(&mut self, heard: &mut Vec<Heard, N>) -> Result<(), RadioFault>;

    /// Leaves the joined network, if any, and tries this one once. Ends by itself within half a minute. Whoever
    /// drops it before that calls [`Self::leave`].
    async fn join(&mut self, network: &Network) -> Joined;

    /// Leaves the joined network; nothing happens if there is none.
    async fn leave(&mut self);

    /// Switches the access point on.
    ///
    /// # Errors
    /// [`RadioFault`] when the radio could not.
    async fn open_access_point(&mut self, network: &Network) -> Result<(), RadioFault>;

    /// Switches the access point off; nothing happens if it is off.
    ///
    /// # Errors
    /// [`RadioFault`] when the radio could not.
    async fn close_access_point(&mut self) -> Result<(), RadioFault>;

    /// Whether a network is joined at this moment.
    fn is_joined(&self) -> bool;

    /// Waits until the joined network is lost. Nothing is retried by itself. May be dropped and called
    /// again at any time.
    async fn lost(&mut self);
}

/// The network stack's address.
#[expect(
    async_fn_in_trait,
    reason = "awaited in place by the network service alone, so no bound is missing"
)]
pub trait Address {
    /// Asks the joined network for an address.
    fn ask(&self);

    /// Takes 192.168.4.1, the address of the machine on its own network, and gives its guests
    /// addresses, for ever.
    async fn serve_guests(&self) -> !;
}

/// The two places in flash for firmware, and the choice between them.
#[expect(
    async_fn_in_trait,
    reason = "awaited in place by the update service alone, so no bound is missing"
)]
pub trait FirmwareSlots {
    /// The flash of a slot.
    type Slot: NorFlash;
    /// The flash of the boot choice, two pages of 4 kB.
    type Choice: MultiwriteNorFlash;

    /// What manifests call this board.
    fn board(&self) -> &'static str;

    /// The slot that runs.
    fn running(&self) -> Slot;

    /// The flash of the other slot; addresses count from its beginning.
    fn other(&mut self) -> &mut Self::Slot;

    /// The flash of the boot choice; addresses count from its beginning.
    fn choice(&mut self) -> &mut Self::Choice;

    /// Starts the firmware of the slot that is chosen now.
    async fn restart(&mut self) -> !;
}

/// What a plotter's controller senses: door, chiller, power, limit switches. An input that a board does
/// not have is never set.
#[expect(
    async_fn_in_trait,
    reason = "awaited in place by the serial service alone, so no bound is missing"
)]
pub trait Inputs {
    /// The inputs now; must not wait.
    fn sense(&self) -> Sensors;

    /// Waits until one of them has changed. May be dropped and called again at any time.
    async fn changed(&mut self);
}

/// A board without inputs.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoInputs;

impl Inputs for NoInputs {
    fn sense(&self) -> Sensors {
        Sensors::default()
    }

    async fn changed(&mut self) {
        core::future::pending::<()>().await;
    }
}

/// What a board knows about itself, for diagnostics.
#[derive(Clone, Copy, Debug)]
pub struct Vitals {
    /// Free memory in bytes.
    pub free_memory: fn() -> u32,
    /// Why the firmware started.
    pub reset_reason: &'static str,
    /// The last words of a firmware that panicked before this start; empty if there was none.
    pub last_panic: &'static str,
}
