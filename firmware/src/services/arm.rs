//! The servo tick, and the way of everybody else to the arm.
//!
//! The machine is locked for the time of one of its methods only, all of which are short. A client
//! that waits for its move waits here, in its own task; the tick waits for nobody.

use crate::board::{Frames, Servos};
use core::array;
use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::{Mutex as Turns, MutexGuard as Turn};
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer};
use protocol_core::machine::{Client, Errand, MAX_ASKERS, Machine, Report, StopReason};
use protocol_core::motion::Micros;

/// The arm as its clients see it.
pub struct Arm {
    machine: Mutex<CriticalSectionRawMutex, RefCell<Machine>>,
    reports: [Signal<CriticalSectionRawMutex, Report>; MAX_ASKERS],
    /// Several services ask in the name of [`Client::HOUSE`], which has one errand at a time as well.
    house: Turns<CriticalSectionRawMutex, ()>,
    ticks: AtomicU32,
    /// For the serial port's task alone.
    plan_changed: Signal<CriticalSectionRawMutex, ()>,
}

impl Arm {
    /// Around a machine.
    pub fn new(machine: Machine) -> Self {
        Self {
            machine: Mutex::new(RefCell::new(machine)),
            reports: array::from_fn(|_| Signal::new()),
            house: Turns::new(()),
            ticks: AtomicU32::new(0),
            plan_changed: Signal::new(),
        }
    }

    /// Something short with the machine.
    pub fn with<T>(&self, f: impl FnOnce(&mut Machine) -> T) -> T {
        self.machine.lock(|machine| f(&mut machine.borrow_mut()))
    }

    /// Has an errand done and gives its report: at once from rest, else when its turn has come.
    pub async fn errand(&self, client: Client, errand: &Errand) -> Report {
        // Slots are below MAX_ASKERS by the type's own rule.
        let Some(signal) = self.reports.get(client.slot()) else {
            return Report::Resting;
        };
        signal.reset();
        match self.with(|machine| machine.take(client, errand)) {
            Some(report) => report,
            None => signal.wait().await,
        }
    }

    /// As [`Self::errand`], but where the errand has not begun when `cancel` ends, it is taken back, and
    /// there is no report.
    pub async fn errand_unless(
        &self,
        client: Client,
        errand: &Errand,
        cancel: impl Future<Output = ()>,
    ) -> Option<Report> {
        let signal = self.reports.get(client.slot())?;
        signal.reset();
        if let Some(report) = self.with(|machine| machine.take(client, errand)) {
            return Some(report);
        }
        if let Either::First(report) = select(signal.wait(), cancel).await {
            return Some(report);
        }
        // Between the two it may have begun.
        match self.with(|machine| machine.withdraw(client)) {
            true => None,
            false => Some(signal.wait().await),
        }
    }

    /// Waits until the arm rests, and keeps it at rest until the guard is dropped.
    pub async fn rest(&self, client: Client) -> Rest<'_> {
        let turn = match client == Client::HOUSE {
            true => Some(self.house.lock().await),
            false => None,
        };
        self.errand(client, &Errand::Rest).await;
        Rest {
            arm: self,
            client,
            _turn: turn,
        }
    }

    /// Begins a little wave if the arm has nothing to do and its pen is up; says whether it does.
    pub fn wave(&self) -> bool {
        self.with(|machine| {
            let idle = machine.is_idle() && !machine.position().pen_is_down();
            if idle {
                machine.take(Client::HOUSE, &Errand::Wave);
            }
            idle
        })
    }

    /// Counts frames that had their set-point: what stands still is dead.
    pub fn ticks(&self) -> u32 {
        self.ticks.load(Ordering::Relaxed)
    }

    /// Waits until the plan has room for a segment; a stop makes room.
    pub async fn room(&self) {
        self.until(|machine| machine.plan_room() > 0).await;
    }

    /// Waits until everything planned has been done, or forgotten in a stop.
    pub async fn plan_done(&self) {
        self.until(Machine::plan_is_done).await;
    }

    async fn until(&self, holds: impl Fn(&Machine) -> bool) {
        while !self.with(|machine| holds(machine)) {
            self.plan_changed.wait().await;
        }
    }

    /// Stops the arm, whoever moves it, and answers those who wait for a move.
    pub fn stop(&self, reason: StopReason) {
        self.with(|machine| machine.stop(reason));
        self.deliver();
    }

    /// Lets a stopped arm move again; says whether it was stopped.
    pub fn resume(&self) -> bool {
        self.with(|machine| {
            let stopped = machine.stopped().is_some();
            machine.resume();
            stopped
        })
    }

    /// The servo tick: one set-point in each of the servos' frames, which are `length` apart, for ever.
    ///
    /// The machine's time is the number of frames, so that a set-point is a function of the moves and
    /// not of how late a frame was. Moves that begin between two frames are answered there and then.
    pub async fn tick(
        &self,
        mut servos: impl Servos,
        mut frames: impl Frames,
        length: Duration,
    ) -> ! {
        let length = Micros::new(length.as_micros());
        let mut time = Micros::default();
        loop {
            frames.next().await;
            let began = Instant::now();
            let set_point = self.with(|machine| machine.tick(time));
            servos.write(time, &set_point);
            // The tick alone counts, so load and store need not be one step.
            self.ticks
                .store(self.ticks().wrapping_add(1), Ordering::Relaxed);
            self.deliver();
            while let Some(event) = self.with(|machine| machine.next_event()) {
                if event >= time + length {
                    break;
                }
                Timer::at(began + Duration::from_micros((event - time).get())).await;
                self.with(|machine| machine.advance(event));
                self.deliver();
            }
            time = time + length;
        }
    }

    fn deliver(&self) {
        while let Some((client, report)) = self.with(Machine::next_report) {
            if let Some(signal) = self.reports.get(client.slot()) {
                signal.signal(report);
            }
        }
        if self.with(Machine::plan_has_changed) {
            self.plan_changed.signal(());
        }
    }
}

/// Frames by the clock, for servos that have no frame of their own.
pub struct TimedFrames {
    due: Instant,
    length: Duration,
}

impl TimedFrames {
    /// The first frame begins now.
    pub fn every(length: Duration) -> Self {
        Self {
            due: Instant::now(),
            length,
        }
    }
}

impl Frames for TimedFrames {
    async fn next(&mut self) {
        Timer::at(self.due).await;
        // After a stall the arm goes on from where it was instead of catching up in a rush.
        self.due = (self.due + self.length).max(Instant::now());
    }
}

/// The arm rests as long as this lives.
pub struct Rest<'a> {
    arm: &'a Arm,
    client: Client,
    _turn: Option<Turn<'a, CriticalSectionRawMutex, ()>>,
}

impl Drop for Rest<'_> {
    fn drop(&mut self) {
        self.arm.with(|machine| machine.release(self.client));
    }
}
