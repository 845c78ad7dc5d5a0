//! A serial session with a plan in place of a machine: moves stay in it until the test takes them out.

use protocol_core::lasaur::{Effect, Event, Facts, READY, Reply, Session, Step, Steps};
use protocol_core::machine::StopReason;
use protocol_core::motion::TablePoint;
use std::collections::VecDeque;

/// A session, and everything that came of it.
#[derive(Debug)]
pub struct Rig {
    session: Session,
    /// What the session is told.
    pub facts: Facts,
    /// Moves that are planned and not yet done.
    plan: VecDeque<TablePoint>,
    capacity: usize,
    /// Steps of the line that was begun.
    begun: Option<VecDeque<Step>>,
    /// Steps that were put into the plan, in order.
    pub taken: Vec<Step>,
    /// Replies, each with its newline.
    pub replies: Vec<Vec<u8>>,
    /// How often 0x12 was sent.
    pub ready: usize,
    /// Everything that was sent, in order.
    pub sent: Vec<u8>,
    /// Bytes that the receive buffer had no place for.
    pub lost: usize,
}

impl Rig {
    /// A new connection to a machine whose plan holds this many moves.
    pub fn new(capacity: usize) -> Self {
        Self {
            session: Session::new(),
            facts: Facts::default(),
            plan: VecDeque::new(),
            capacity,
            begun: None,
            taken: Vec::new(),
            replies: Vec::new(),
            ready: 0,
            sent: Vec::new(),
            lost: 0,
        }
    }

    /// A machine that is never full.
    pub fn roomy() -> Self {
        Self::new(usize::MAX)
    }

    /// Bytes from the host, in one piece.
    pub fn receive(&mut self, bytes: &[u8]) {
        let mut input = bytes;
        while let Some(event) = self.session.next_event(&mut input) {
            match event {
                Event::Ready => {
                    self.ready += 1;
                    self.sent.push(READY);
                }
                Event::Effect(effect) => {
                    self.lost += usize::from(effect == Effect::Stop(StopReason::ReceiveOverflow));
                    self.apply(effect);
                }
                Event::Line => {
                    let line = self.session.begin_line(&self.facts);
                    if let Some(reason) = line.stop {
                        self.apply(Effect::Stop(reason));
                    }
                    self.begin(line.steps);
                }
            }
            self.go_on();
        }
    }

    /// The machine does the first move of its plan, which makes room for another one.
    pub fn work(&mut self) {
        if let Some(point) = self.plan.pop_front() {
            self.facts.position = point;
        }
        self.go_on();
        self.receive(b"");
    }

    /// The machine does everything, also what the lines received go on to ask for.
    pub fn rest(&mut self) {
        while !self.plan.is_empty() {
            self.work();
        }
    }

    /// Something that no byte tells of: a limit, or a button.
    pub fn happens(&mut self, effect: Effect) {
        self.apply(effect);
        self.go_on();
        self.receive(b"");
    }

    fn apply(&mut self, effect: Effect) {
        match effect {
            Effect::Stop(reason) => {
                self.facts.stop = Some(reason);
                self.plan.clear();
                self.facts.planned = self.facts.position;
                // What the machine was asked for and did not take.
                if self.begun.as_ref().is_some_and(|steps| !steps.is_empty()) {
                    self.session.discard();
                }
            }
            Effect::Resume => self.facts.stop = None,
        }
    }

    fn begin(&mut self, steps: Steps) {
        assert!(self.begun.is_none(), "two lines at a time");
        self.begun = Some(steps.into_iter().collect());
    }

    fn go_on(&mut self) {
        let Some(mut steps) = self.begun.take() else {
            return;
        };
        while let Some(step) = steps.pop_front() {
            if self.session.is_void() {
                break;
            }
            assert_eq!(self.facts.stop, None, "{step:?} in stop mode");
            match step {
                Step::Move(_) if self.plan.len() >= self.capacity => {
                    steps.push_front(step);
                    self.begun = Some(steps);
                    return;
                }
                Step::Move(segment) => {
                    self.plan.push_back(segment.to);
                    self.facts.planned = segment.to;
                }
                Step::Home => {
                    self.plan.clear();
                    (self.facts.position, self.facts.planned) = Default::default();
                }
                Step::Dwell { .. } | Step::Output(..) => {}
            }
            self.taken.push(step);
        }
        let mut reply = Reply::new();
        let effect = self.session.reply(&self.facts, &mut reply);
        self.replies.push(reply.as_bytes().to_vec());
        self.sent.extend_from_slice(reply.as_bytes());
        if let Some(effect) = effect {
            self.apply(effect);
        }
    }
}
