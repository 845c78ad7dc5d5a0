//! What all ESP32 boards share. The chip's name appears in features, never in these files, except where
//! the registers of the first ESP32 are called differently ([`pwm_timer`]).

// Linked for its defmt logger, which writes to USB-Serial-JTAG.
use esp_println as _;

pub mod data;
pub mod flash;
pub mod inputs;
pub mod interface;
pub mod last_panic;
pub mod light;
pub mod net;
pub mod pins;
pub mod pulse_clock;
pub mod pwm_timer;
pub mod radio;
pub mod serial;
pub mod servos;
pub mod start;
pub mod system;

/// The button: low is pressed.
pub type Button = esp_hal::gpio::Input<'static>;
