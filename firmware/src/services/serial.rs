//! LasaurGrbl over a serial port, or over anything that bytes come from and go to.
//!
//! One task, which waits for everything at once: bytes, the sender's writer, room in the plan. So a stop
//! is done when its byte is read, whatever else waits, and a host that does not read its replies
//! delays nobody but itself.

use super::House;
use super::arm::Arm;
use crate::board::Inputs;
use core::future::pending;
use embassy_futures::select::{Either4, select4};
use embassy_futures::yield_now;
use embedded_io_async::{Read, Write};
use heapless::Vec;
use protocol_core::lasaur::{
    BANNER, Effect, Event, Facts, MAX_REPLY, READY, Reply, Sensors, Session, Step, Steps,
};
use protocol_core::machine::{Client, Machine, NotPlanned, StopReason};

/// Bytes taken from the port at a time.
const CHUNK: usize = 64;
/// Bytes of replies that wait for a host to read them. When the next reply might not fit, lines wait as
/// well, and what waits behind them fills the receive buffer.
pub const OUTBOX: usize = 512;

/// What it means when the port cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadError {
    /// The connection has ended.
    Ended,
    /// A byte was lost, as on a wire: the machine stops, and the next byte is read.
    ByteLost,
}

/// Serves one host until its connection has ended and everything received is executed; on a wire, for
/// ever. There is one serial port: nobody else may be served at the same time.
pub async fn serve<R: Read, W: Write>(
    mut from: R,
    mut to: W,
    on_error: ReadError,
    inputs: &mut impl Inputs,
    house: &House,
) {
    let arm = &house.arm;
    let mut port = Port::new(arm);
    let mut chunk = [0; CHUNK];
    let mut ended = false;
    loop {
        port.sense(inputs.sense());
        port.go_on();
        port.receive(&[]);
        if ended && port.session.is_idle() && port.outbox.is_empty() {
            break;
        }
        let wait = port.wait;
        // Replies first: they make room for what a burst of lines asks for.
        let happened = select4(
            port.outbox.write_to(&mut to),
            read(&mut from, &mut chunk, ended),
            wait.on(arm),
            inputs.changed(),
        );
        match happened.await {
            Either4::First(written) => port.outbox.written(written),
            Either4::Second(Ok(0)) => ended = true,
            Either4::Second(Ok(length)) => {
                port.receive(chunk.get(..length).unwrap_or_default());
                // A host that floods would else keep everybody waiting.
                if length == CHUNK {
                    yield_now().await;
                }
            }
            Either4::Second(Err(_)) if on_error == ReadError::ByteLost => port.lose_byte(),
            Either4::Second(Err(_)) => ended = true,
            Either4::Third(()) | Either4::Fourth(()) => {}
        }
    }
    arm.with(|machine| machine.client_gone(Client::SERIAL));
}

async fn read<R: Read>(from: &mut R, chunk: &mut [u8], ended: bool) -> Result<usize, R::Error> {
    if ended {
        return pending().await;
    }
    from.read(chunk).await
}

/// What a line that was begun waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wait {
    /// There is no such line, or the outbox has no room for its reply.
    Nothing,
    /// Room in the plan.
    Room,
    /// The end of the plan.
    Done,
}

impl Wait {
    async fn on(self, arm: &Arm) {
        match self {
            Self::Nothing => pending().await,
            Self::Room => arm.room().await,
            Self::Done => arm.plan_done().await,
        }
    }
}

/// A line under way.
struct Work {
    steps: Steps,
    /// Steps of it that have been done.
    done: usize,
}

impl Work {
    /// G30 is answered when the arm is there.
    fn is_homing(&self) -> bool {
        self.steps.contains(&Step::Home)
    }
}

struct Port<'a> {
    arm: &'a Arm,
    session: Session,
    sensors: Sensors,
    work: Option<Work>,
    wait: Wait,
    outbox: Outbox,
}

impl<'a> Port<'a> {
    fn new(arm: &'a Arm) -> Self {
        let mut outbox = Outbox::default();
        outbox.push(BANNER.as_bytes());
        Self {
            arm,
            session: Session::new(),
            sensors: Sensors::default(),
            work: None,
            wait: Wait::Nothing,
            outbox,
        }
    }

    /// Takes over the inputs; without power the arm stops, and stays so.
    fn sense(&mut self, sensors: Sensors) {
        let fails = sensors.power_off && !self.sensors.power_off;
        self.sensors = sensors;
        let goes_on = || self.arm.with(|machine| machine.stopped().is_none());
        if fails || (sensors.power_off && goes_on()) {
            self.arm.stop(StopReason::Power);
        }
    }

    fn receive(&mut self, bytes: &[u8]) {
        let mut input = bytes;
        while let Some(event) = self.session.next_event(&mut input) {
            match event {
                Event::Effect(effect) => self.happen(effect),
                Event::Ready => self.outbox.ready = true,
                Event::Line => self.begin(),
            }
            self.go_on();
        }
    }

    fn lose_byte(&mut self) {
        let effect = self.session.lose_byte();
        self.happen(effect);
    }

    fn happen(&mut self, effect: Effect) {
        match effect {
            Effect::Stop(reason) => self.arm.stop(reason),
            Effect::Resume if self.sensors.power_off => {}
            Effect::Resume => {
                self.arm.resume();
            }
        }
    }

    fn facts(&self) -> Facts {
        self.arm.with(|machine| Facts::of(machine, self.sensors))
    }

    fn begin(&mut self) {
        let line = self.session.begin_line(&self.facts());
        if let Some(reason) = line.stop {
            self.arm.stop(reason);
        }
        self.work = Some(Work {
            steps: line.steps,
            done: 0,
        });
    }

    /// Does as much of the line under way as can be done now, up to its reply.
    fn go_on(&mut self) {
        self.wait = Wait::Nothing;
        let Some(work) = &mut self.work else {
            return;
        };
        while let Some(step) = work.steps.get(work.done)
            && !self.session.is_void()
        {
            match self.arm.with(|machine| take(machine, step)) {
                Ok(()) => work.done += 1,
                Err(NotPlanned::Full) => {
                    self.wait = Wait::Room;
                    return;
                }
                Err(NotPlanned::Stopped) => self.session.discard(),
            }
        }
        let homing = work.is_homing() && !self.session.is_void();
        if homing && !self.arm.with(|machine| machine.plan_is_done()) {
            self.wait = Wait::Done;
            return;
        }
        if !self.outbox.has_room() {
            return;
        }
        self.work = None;
        let mut reply = Reply::new();
        let effect = self.session.reply(&self.facts(), &mut reply);
        self.outbox.push(reply.as_bytes());
        if let Some(effect) = effect {
            self.happen(effect);
        }
    }
}

fn take(machine: &mut Machine, step: &Step) -> Result<(), NotPlanned> {
    match step {
        Step::Move(segment) => machine.plan(segment),
        Step::Dwell { time, intensity } => machine.dwell(*time, *intensity),
        Step::Home => machine.home(),
        Step::Output(assist, on) => machine.switch(*assist, *on),
    }
}

/// What is to be sent.
#[derive(Default)]
struct Outbox {
    bytes: Vec<u8, OUTBOX>,
    /// [`READY`] goes out before everything else, also in the middle of a reply.
    ready: bool,
    /// Nobody reads any more.
    gone: bool,
}

/// What became of a write.
enum Written {
    Ready,
    Bytes(usize),
    Gone,
}

impl Outbox {
    fn has_room(&self) -> bool {
        self.bytes.len() + MAX_REPLY <= OUTBOX
    }

    fn is_empty(&self) -> bool {
        self.bytes.is_empty() && !self.ready
    }

    /// Callers see to it that there is room.
    fn push(&mut self, bytes: &[u8]) {
        if !self.gone {
            let _ = self.bytes.extend_from_slice(bytes);
        }
    }

    async fn write_to<W: Write>(&self, to: &mut W) -> Written {
        if self.is_empty() {
            return pending().await;
        }
        let bytes = if self.ready {
            &[READY]
        } else {
            self.bytes.as_slice()
        };
        match to.write(bytes).await {
            Ok(0) | Err(_) => Written::Gone,
            Ok(_) if self.ready => Written::Ready,
            Ok(count) => Written::Bytes(count),
        }
    }

    fn written(&mut self, written: Written) {
        match written {
            Written::Ready => self.ready = false,
            Written::Bytes(count) => drop(self.bytes.drain(..count.min(self.bytes.len()))),
            Written::Gone => {
                self.gone = true;
                self.bytes.clear();
                self.ready = false;
            }
        }
    }
}
