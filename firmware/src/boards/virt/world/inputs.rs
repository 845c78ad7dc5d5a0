//! What a plotter's controller senses, set by the host: `door open`, `chiller off`, `power off`.

use crate::board;
use core::cell::Cell;
use critical_section::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use protocol_core::lasaur::Sensors;

static SENSORS: Mutex<Cell<Sensors>> = Mutex::new(Cell::new(Sensors {
    door_open: false,
    chiller_off: false,
    power_off: false,
    limits: [false; 4],
}));
static CHANGED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// The host changes something.
pub(super) fn change(change: impl FnOnce(&mut Sensors)) {
    critical_section::with(|cs| {
        let cell = SENSORS.borrow(cs);
        let mut sensors = cell.get();
        change(&mut sensors);
        cell.set(sensors);
    });
    CHANGED.signal(());
}

/// The inputs; for one task.
#[derive(Default)]
pub struct Inputs;

impl board::Inputs for Inputs {
    fn sense(&self) -> Sensors {
        critical_section::with(|cs| SENSORS.borrow(cs).get())
    }

    async fn changed(&mut self) {
        CHANGED.wait().await;
    }
}
