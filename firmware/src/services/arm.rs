//! The servo tick, and the way of everybody else to the arm.
//!
//! The machine is locked for the time of one of its methods only, all of which are short. A client
//! that waits for its move waits here, in its own task; the tick waits for nobody.

use crate::board::Servos;
use core::array;
use core::cell::RefCell;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer};
use protocol_core::machine::{Client, Errand, MAX_CLIENTS, Machine, Report};
use protocol_core::motion::Micros;

/// The arm as its clients see it.
pub struct Arm {
    machine: Mutex<CriticalSectionRawMutex, RefCell<Machine>>,
    reports: [Signal<CriticalSectionRawMutex, Report>; MAX_CLIENTS],
}

impl Arm {
    /// Around a machine.
    pub fn new(machine: Machine) -> Self {
        Self {
            machine: Mutex::new(RefCell::new(machine)),
            reports: array::from_fn(|_| Signal::new()),
        }
    }

    /// Something short with the machine.
    pub fn with<T>(&self, f: impl FnOnce(&mut Machine) -> T) -> T {
        self.machine.lock(|machine| f(&mut machine.borrow_mut()))
    }

    /// Has an errand done and gives its report: at once from rest, else when its turn has come.
    pub async fn errand(&self, client: Client, errand: Errand) -> Report {
        // Slots are below MAX_CLIENTS by the type's own rule.
        let Some(signal) = self.reports.get(client.slot()) else {
            return Report::Resting;
        };
        signal.reset();
        match self.with(|machine| machine.take(client, errand)) {
            Some(report) => report,
            None => signal.wait().await,
        }
    }

    /// Waits until the arm rests, and keeps it at rest until the guard is dropped.
    pub async fn rest(&self, client: Client) -> Rest<'_> {
        self.errand(client, Errand::Rest).await;
        Rest { arm: self, client }
    }

    /// The servo tick: one set-point each `frame`, for ever.
    ///
    /// The machine's time is the number of frames, so that a set-point is a function of the moves and
    /// not of how late a frame was. Moves that begin between two frames are answered there and then.
    pub async fn tick(&self, mut servos: impl Servos, frame: Duration) -> ! {
        let mut time = Micros::default();
        let mut due = Instant::now();
        loop {
            let event = self.with(|machine| machine.next_event());
            if let Some(event) = event.filter(|event| *event < time) {
                Timer::at(due - Duration::from_micros((time - event).get())).await;
                self.with(|machine| machine.advance(event));
                self.deliver();
                continue;
            }
            Timer::at(due).await;
            let set_point = self.with(|machine| machine.tick(time));
            servos.write(time, &set_point);
            self.deliver();
            time = time + Micros::new(frame.as_micros());
            // After a stall the arm goes on from where it was instead of catching up in a rush.
            due = (due + frame).max(Instant::now());
        }
    }

    fn deliver(&self) {
        while let Some((client, report)) = self.with(Machine::next_report) {
            if let Some(signal) = self.reports.get(client.slot()) {
                signal.signal(report);
            }
        }
    }
}

/// The arm rests as long as this lives.
pub struct Rest<'a> {
    arm: &'a Arm,
    client: Client,
}

impl Drop for Rest<'_> {
    fn drop(&mut self) {
        self.arm.with(|machine| machine.release(self.client));
    }
}
