//! Light and button.

use crate::board::{Colour, Light};
use crate::log::warning;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer};
use embedded_hal_async::digital::Wait;

/// What the light says (`reference/line-us.md`, section 6).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lamp {
    /// White: starting.
    Starting,
    /// Blue, flashing: looking for the network.
    Searching,
    /// Blue: in the network.
    Connected,
    /// Red, flashing: the setup network is open.
    Setup,
    /// Red and white in turn: something does not work.
    Error,
}

impl Lamp {
    /// The two colours it changes between; the same twice for a steady light.
    pub const fn colours(self) -> [Colour; 2] {
        const OFF: Colour = colour(0, 0, 0);
        const RED: Colour = colour(64, 0, 0);
        const BLUE: Colour = colour(0, 0, 64);
        const WHITE: Colour = colour(40, 40, 40);
        match self {
            Self::Starting => [WHITE, WHITE],
            Self::Searching => [BLUE, OFF],
            Self::Connected => [BLUE, BLUE],
            Self::Setup => [RED, OFF],
            Self::Error => [RED, WHITE],
        }
    }
}

const fn colour(red: u8, green: u8, blue: u8) -> Colour {
    Colour { red, green, blue }
}

/// Half a flash.
pub const FLASH: Duration = Duration::from_millis(500);
/// A button that bounces is quiet again after this.
pub const BOUNCE: Duration = Duration::from_millis(30);

/// The way of the other services to light and button.
#[derive(Default)]
pub struct Panel {
    lamp: Signal<CriticalSectionRawMutex, Lamp>,
    press: Signal<CriticalSectionRawMutex, ()>,
}

impl Panel {
    /// With nothing to show.
    pub const fn new() -> Self {
        Self {
            lamp: Signal::new(),
            press: Signal::new(),
        }
    }

    /// Shows something from now on.
    pub fn show(&self, lamp: Lamp) {
        self.lamp.signal(lamp);
    }

    /// Waits for a press of the button.
    pub async fn pressed(&self) {
        self.press.wait().await;
    }

    /// A press before now is not meant for what comes next.
    pub fn forget_press(&self) {
        self.press.reset();
    }

    /// The light, for ever.
    pub async fn shine(&self, mut light: impl Light) -> ! {
        let mut lamp = Lamp::Starting;
        loop {
            let [on, off] = lamp.colours();
            light.show(on);
            if on == off {
                lamp = self.lamp.wait().await;
                continue;
            }
            if let Either::First(next) = select(self.lamp.wait(), Timer::after(FLASH)).await {
                lamp = next;
                continue;
            }
            light.show(off);
            if let Either::First(next) = select(self.lamp.wait(), Timer::after(FLASH)).await {
                lamp = next;
            }
        }
    }

    /// The button, low while it is pressed, for ever.
    pub async fn watch(&self, mut button: impl Wait) -> ! {
        loop {
            let press = async {
                button.wait_for_low().await?;
                self.press.signal(());
                Timer::after(BOUNCE).await;
                button.wait_for_high().await
            };
            if press.await.is_err() {
                warning!("the button does not work");
                Timer::after_secs(1).await;
            }
            Timer::after(BOUNCE).await;
        }
    }
}
