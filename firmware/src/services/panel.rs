//! Light and button.

use super::House;
use crate::board::Light;
use crate::log::{info, warning};
use core::cell::Cell;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer};
use embedded_hal::digital::InputPin;
use embedded_hal_async::digital::Wait;
use protocol_core::motion::Micros;
use protocol_core::panel::{Button, Gesture, LONG_PRESS, Lamp, POWER_ON, VERY_LONG_PRESS};
use protocol_core::settings::StartMode;

/// How long the light tells that everything could not be forgotten.
const COMPLAINT: Duration = Duration::from_secs(5);

#[derive(Clone, Copy, PartialEq, Eq)]
struct Shown {
    /// What the machine does.
    lamp: Lamp,
    /// What a person has to see before that.
    first: Option<Lamp>,
}

/// The way of the other services to the light.
pub struct Panel {
    shown: Mutex<CriticalSectionRawMutex, Cell<Shown>>,
    changed: Signal<CriticalSectionRawMutex, ()>,
}

impl Default for Panel {
    fn default() -> Self {
        Self::new()
    }
}

impl Panel {
    /// At the start.
    pub const fn new() -> Self {
        Self {
            shown: Mutex::new(Cell::new(Shown {
                lamp: Lamp::Starting,
                first: None,
            })),
            changed: Signal::new(),
        }
    }

    /// Shows something from now on.
    pub fn show(&self, lamp: Lamp) {
        self.change(|shown| Shown { lamp, ..shown });
    }

    /// What is shown.
    pub fn lamp(&self) -> Lamp {
        let shown = self.shown.lock(Cell::get);
        shown.first.unwrap_or(shown.lamp)
    }

    /// Shows something instead, until it is told `None`.
    pub(super) fn show_first(&self, first: Option<Lamp>) {
        self.change(|shown| Shown { first, ..shown });
    }

    fn change(&self, f: impl FnOnce(Shown) -> Shown) {
        let differs = self.shown.lock(|shown| {
            let after = f(shown.get());
            shown.replace(after) != after
        });
        // The same again does not disturb the rhythm.
        if differs {
            self.changed.signal(());
        }
    }

    /// The light, for ever. White lasts as long as a press means a factory reset.
    pub async fn shine(&self, mut light: impl Light) -> ! {
        let white_until = Instant::now() + duration(POWER_ON);
        loop {
            let shown = self.shown.lock(Cell::get);
            let lamp = match shown.first {
                Some(first) => first,
                None if Instant::now() < white_until => Lamp::Starting,
                None => shown.lamp,
            };
            for flash in lamp.pattern() {
                light.show(flash.colour);
                let time = Timer::after_millis(flash.millis.into());
                if let Either::First(()) = select(self.changed.wait(), time).await {
                    break;
                }
            }
        }
    }
}

/// The button, low while it is pressed, for ever.
pub async fn watch(house: &House, mut pin: impl Wait + InputPin) -> ! {
    let mut button = Button::new(now());
    loop {
        let long = house.settings(|settings| match settings.start {
            StartMode::StationLongPress => VERY_LONG_PRESS,
            _ => LONG_PRESS,
        });
        let Ok(pressed) = pin.is_low() else {
            warning!("the button does not work");
            Timer::after_secs(1).await;
            continue;
        };
        if let Some(gesture) = button.update(pressed, long, now()) {
            act(house, gesture).await;
            continue;
        }
        let change = async {
            // By level: a change between looking and waiting is not missed.
            let changed = match pressed {
                true => pin.wait_for_high().await,
                false => pin.wait_for_low().await,
            };
            if changed.is_err() {
                Timer::after_secs(1).await;
            }
        };
        match button.next_look(long) {
            Some(look) => {
                let look = Timer::at(Instant::from_micros(look.get()));
                select(change, look).await;
            }
            None => change.await,
        }
    }
}

async fn act(house: &House, gesture: Gesture) {
    match gesture {
        // What a person wants first of a machine that is stopped.
        Gesture::Short if house.arm.resume() => info!("resumed by the button"),
        // Whatever the network is doing.
        Gesture::Short if house.drawer.stop() => {}
        Gesture::Short | Gesture::Long => house.wifi.press(gesture),
        Gesture::ResetWarning => house.panel.show_first(Some(Lamp::ResetWarning)),
        Gesture::ResetCancelled => house.panel.show_first(None),
        Gesture::Reset => {
            if house.forget_everything().await.is_err() {
                warning!("the settings could not be forgotten");
                house.panel.show_first(Some(Lamp::Error));
                Timer::after(COMPLAINT).await;
            } else {
                info!("everything is forgotten");
            }
            house.panel.show_first(None);
        }
    }
}

fn now() -> Micros {
    Micros::new(Instant::now().as_micros())
}

const fn duration(micros: Micros) -> Duration {
    Duration::from_micros(micros.get())
}
