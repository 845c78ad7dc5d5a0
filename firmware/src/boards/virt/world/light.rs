//! The arm's light: changes are recorded.

use super::record::{Record, record};
use crate::board::{self, Colour};
use embassy_time::Instant;

/// The red, green and blue light, dark at first.
#[derive(Default)]
pub struct Light {
    shown: Colour,
}

impl board::Light for Light {
    fn show(&mut self, colour: Colour) {
        if colour != self.shown {
            self.shown = colour;
            record(Record::Light {
                time_us: Instant::now().as_micros(),
                rgb: [colour.red, colour.green, colour.blue],
            });
        }
    }
}
