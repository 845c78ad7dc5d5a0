//! Door, chiller and power of a laser cutter, where a board has them.

use super::data::{BOARD, InputPort};
use super::pins::pin;
use crate::board;
use core::future::pending;
use embassy_futures::select::select3;
use esp_hal::gpio::{Input, InputConfig, Pull};
use protocol_core::lasaur::Sensors;

/// The inputs, each pulled towards what needs no wire.
pub struct Inputs {
    door: Option<Line>,
    chiller: Option<Line>,
    power: Option<Line>,
}

struct Line {
    input: Input<'static>,
    set_when_high: bool,
}

impl Inputs {
    pub(super) fn open() -> Self {
        Self {
            door: BOARD.door_open.as_ref().map(Line::open),
            chiller: BOARD.chiller_off.as_ref().map(Line::open),
            power: BOARD.power_off.as_ref().map(Line::open),
        }
    }
}

impl Line {
    fn open(port: &InputPort) -> Self {
        let pull = if port.set_when_high {
            Pull::Down
        } else {
            Pull::Up
        };
        let config = InputConfig::default().with_pull(pull);
        Self {
            input: Input::new(pin(port.pin), config),
            set_when_high: port.set_when_high,
        }
    }

    fn is_set(&self) -> bool {
        self.input.is_high() == self.set_when_high
    }
}

/// Waits until the line is other than it was; one that is not there never changes.
async fn change(line: &mut Option<Line>) {
    match line {
        Some(line) => line.input.wait_for_any_edge().await,
        None => pending().await,
    }
}

impl board::Inputs for Inputs {
    fn sense(&self) -> Sensors {
        let is_set = |line: &Option<Line>| line.as_ref().is_some_and(Line::is_set);
        Sensors {
            door_open: is_set(&self.door),
            chiller_off: is_set(&self.chiller),
            power_off: is_set(&self.power),
            ..Sensors::default()
        }
    }

    async fn changed(&mut self) {
        select3(
            change(&mut self.door),
            change(&mut self.chiller),
            change(&mut self.power),
        )
        .await;
    }
}
