//! One connection: its bytes take effect at once or become lines, and each line is answered once.

use super::command::{Fault, parse};
use super::modal::{Modal, Steps};
use super::receive::{Effect, Receiver};
use super::redundancy::{Group, Verdict};
use super::reply::{Answer, Reply, Sensors};
use crate::machine::{Machine, StopReason};
use crate::motion::{Side, TablePoint};

/// What the machine is like at this moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// It is in stop mode, and why.
    pub stop: Option<StopReason>,
    /// What it senses.
    pub sensors: Sensors,
    /// Where the arm is.
    pub position: TablePoint,
    /// Where the arm will be when everything in its plan is done.
    pub planned: TablePoint,
}

impl Facts {
    /// Of the arm, with what else the board senses.
    pub fn of(machine: &Machine, mut sensors: Sensors) -> Self {
        if let Some(side) = machine.limit() {
            let [x1, x2, y1, y2] = &mut sensors.limits;
            *match side {
                Side::X1 => x1,
                Side::X2 => x2,
                Side::Y1 => y1,
                Side::Y2 => y2,
            } = true;
        }
        Self {
            stop: machine.stopped(),
            sensors,
            position: machine.table_position(),
            planned: machine.planned_position(),
        }
    }
}

/// What is to be done next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// At once, before anything else.
    Effect(Effect),
    /// Send [`super::READY`], wherever the reply that is being sent has got to.
    Ready,
    /// A line is complete: [`Session::begin_line`].
    Line,
}

/// What a line asks for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// Stop the machine, before the reply.
    pub stop: Option<StopReason>,
    /// To be put into the plan, in order.
    pub steps: Steps,
}

/// What belongs to one connection.
#[derive(Debug)]
pub struct Session {
    receiver: Receiver,
    group: Group,
    modal: Modal,
    /// The line that was begun: how it will be answered, and the modal state after it.
    begun: Option<(Answer, Modal)>,
    /// The last cause of a stop.
    cause: StopReason,
}

impl Default for Session {
    fn default() -> Self {
        Self::new()
    }
}

impl Session {
    /// A new connection.
    pub const fn new() -> Self {
        Self {
            receiver: Receiver::new(),
            group: Group::new(),
            modal: Modal::DEFAULT,
            begun: None,
            cause: StopReason::Requested,
        }
    }

    /// Takes bytes off the front of `input` up to the next thing to do; `None` when `input` is used up
    /// first.
    ///
    /// While a line is being executed there is no other line here, and the bytes of lines are kept; so
    /// this can be called with whatever has been received at any time.
    pub fn next_event(&mut self, input: &mut &[u8]) -> Option<Event> {
        loop {
            if self.receiver.take_ready() {
                return Some(Event::Ready);
            }
            if self.begun.is_none() && self.receiver.line().is_some() {
                return Some(Event::Line);
            }
            let (byte, rest) = input.split_first()?;
            *input = rest;
            if let Some(effect) = self.receiver.receive(*byte) {
                self.note(effect);
                return Some(Event::Effect(effect));
            }
        }
    }

    /// A byte has been lost before it got here: what [`super::RECEIVE_BUFFER`] bytes too many do as well.
    #[must_use]
    pub fn lose_byte(&mut self) -> Effect {
        let effect = self.receiver.lose_byte();
        self.note(effect);
        effect
    }

    /// Whether nothing waits to be executed or answered.
    pub fn is_idle(&self) -> bool {
        self.begun.is_none() && self.receiver.line().is_none()
    }

    /// Begins the complete line, and gives what it asks for. It ends with [`Self::reply`].
    pub fn begin_line(&mut self, facts: &Facts) -> Line {
        self.look(facts);
        let Some(line) = self.receiver.line() else {
            return Line::default();
        };
        let (mut asked, mut modal) = (Line::default(), self.modal);
        let answer = if self.receiver.is_void() {
            Answer::Stopped(self.cause)
        } else {
            match self.group.judge(line) {
                Verdict::Execute([b'?', ..]) => Answer::Status(facts.position),
                Verdict::Execute(body) => match execute(body, self.modal, facts.planned) {
                    Ok(changed) => {
                        (modal, asked.steps) = changed;
                        Answer::Bare
                    }
                    Err(fault) => Answer::Refused(fault),
                },
                Verdict::Skip => Answer::Bare,
                Verdict::Wrong => Answer::Wrong,
                Verdict::Failed => Answer::Failed,
                Verdict::NoChecksum => Answer::NoChecksum,
            }
        };
        if matches!(answer, Answer::Failed | Answer::NoChecksum) {
            asked.stop = Some(StopReason::Transmission);
            self.note(Effect::Stop(StopReason::Transmission));
            self.receiver.stop();
        }
        self.begun = Some((answer, modal));
        asked
    }

    /// Whether the line that was begun must not be executed any further, because a stop came.
    pub const fn is_void(&self) -> bool {
        self.receiver.is_void()
    }

    /// The line that was begun is not executed, because the machine did not take it: it was stopped.
    pub const fn discard(&mut self) {
        self.receiver.discard_line();
    }

    /// Ends the line that was begun and writes its reply. The next line may overflow at once, which is
    /// the effect.
    #[must_use]
    pub fn reply(&mut self, facts: &Facts, reply: &mut Reply) -> Option<Effect> {
        let (answer, modal) = self.begun?;
        self.look(facts);
        let answer = match answer {
            Answer::Failed | Answer::NoChecksum => answer,
            _ if self.receiver.is_void() => Answer::Stopped(self.cause),
            // Where it is now: it may have taken a while.
            Answer::Status(_) => Answer::Status(facts.position),
            _ => {
                self.modal = modal;
                answer
            }
        };
        let line = self.receiver.line().unwrap_or_default();
        reply.compose(answer, line, facts.sensors);
        self.begun = None;
        let effect = self.receiver.finish_line()?;
        self.note(effect);
        Some(effect)
    }

    /// A stop of which no byte tells, or its end.
    fn look(&mut self, facts: &Facts) {
        if let Some(reason) = facts.stop {
            self.note(Effect::Stop(reason));
        }
        self.receiver.set_stopped(facts.stop.is_some());
    }

    const fn note(&mut self, effect: Effect) {
        if let Effect::Stop(reason) = effect {
            self.cause = reason;
            self.group.end();
        }
    }
}

fn execute(body: &[u8], modal: Modal, planned: TablePoint) -> Result<(Modal, Steps), Fault> {
    let command = parse(body, modal.unit())?;
    modal.after(&command, planned)
}

#[cfg(test)]
mod tests;
