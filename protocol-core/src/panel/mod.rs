//! Button and light: what a person presses, and what a person sees (`reference/line-us.md`, section 6).

mod button;
mod light;

pub use button::{BOUNCE, Button, Gesture, LONG_PRESS, POWER_ON, RESET_HOLD, VERY_LONG_PRESS};
pub use light::{Colour, Flash, Lamp};
