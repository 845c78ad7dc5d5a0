//! The arm as one value: it accepts moves, is told the time, and gives set-points.
//!
//! Moves follow one another without a gap: one is under way, others wait in the order they came, at
//! most one for each client. A move is answered when it begins, which is when the prior one has
//! completed; from rest at once (`reference/line-us.md`, section 4). Where a client leaves out a
//! coordinate, it is the one the arm has when the move begins.
//!
//! # Who may move
//!
//! Everybody takes turns, in the order they came; that is decided in [`Machine::advance`] alone. A turn
//! is one errand of a [`Client`], or a whole plan of the serial port ([`Machine::plan`]): the plan comes
//! when its first segment is added, and once its turn has come it keeps the arm until it has run
//! dry, its host has sent nothing more for [`STREAM_GAP`](crate::motion::STREAM_GAP), and the pen is
//! up. Errands wait meanwhile and are answered when they begin; a plan waits for the errands
//! that came before it. [`Errand::Rest`] begins when nothing moves and holds up errands and plan alike.
//!
//! A stopped machine ([`Machine::stop`]) moves for nobody: moves are refused, those that wait as well.
//!
//! Everything here takes a bounded number of instructions, so that it can run between two frames of
//! the servos.

mod data;
mod errand;
mod fitting;
mod motion;
mod plotter;

pub use data::{ArmData, SetPoint, nib_of, position_of};
pub use errand::{
    Bare, Client, Errand, Limited, MAX_ASKERS, MAX_CLIENTS, MAX_WEB_CLIENTS, Manner, Report, Target,
};
pub use plotter::{NotPlanned, StopReason};

use crate::arm::{Calibration, Compensation, Directions, Pulses};
use crate::motion::{
    DEFAULT_STEPS, HOME, Line, MOST_DWELL, Micros, PEN_UP, PlanEvent, Planner, Position, Rapid,
    Side, StepSize, Steps, Wave, closest, hold,
};
use heapless::Deque;
use motion::{Active, Motion};

/// Waits for the arm.
#[derive(Clone, Copy, Debug)]
enum Turn {
    Errand(Client, Errand),
    Plan,
}

impl Turn {
    fn is_errand_of(&self, client: Client) -> bool {
        matches!(self, Self::Errand(other, _) if *other == client)
    }
}

/// One errand of each asker, and the plan.
const MAX_TURNS: usize = MAX_ASKERS + 1;

/// The arm.
///
/// In the order written: what every set-point needs lies within the reach of one instruction, and the plan,
/// which is large, comes last. That saves four instructions in each set-point.
#[derive(Debug)]
#[repr(C)]
pub struct Machine {
    data: ArmData,
    calibration: Calibration,
    compensation: Compensation,
    /// Already in the ranges of `data`.
    directions: Directions,
    steps: Steps,
    /// Where the last move ended, or the one under way began.
    position: Position,
    /// The last move ended short of its target.
    short: bool,
    /// A move has ended short of its target since the last frame.
    passed_short: bool,
    /// Until when everything that happened is in the fields above.
    clock: Micros,
    active: Option<Active>,
    /// Who keeps the arm at rest.
    resting_for: Option<Client>,
    last_mover: Option<Client>,
    lift_at: Option<Micros>,
    stopped: Option<StopReason>,
    /// The side of the table that the plan would have left it over, until it is resumed.
    limit: Option<Side>,
    /// The last frame, and its set-point.
    frame: Micros,
    last: SetPoint,
    waiting: Deque<Turn, MAX_TURNS>,
    reports: Deque<(Client, Report), MAX_ASKERS>,
    plan: Planner,
}

impl Machine {
    /// An arm at home with the pen up.
    pub fn new(data: ArmData, calibration: Calibration) -> Self {
        let mut machine = Self {
            data,
            calibration,
            compensation: Compensation::default(),
            directions: Directions::default(),
            steps: DEFAULT_STEPS,
            position: HOME,
            short: false,
            passed_short: false,
            clock: Micros::default(),
            active: None,
            plan: Planner::new(&data.plan, data.lift, data.full_speed),
            waiting: Deque::new(),
            reports: Deque::new(),
            resting_for: None,
            last_mover: None,
            lift_at: None,
            stopped: None,
            limit: None,
            frame: Micros::default(),
            last: SetPoint {
                position: HOME,
                pulses: Pulses::default(),
                held: false,
                moving: false,
                outputs: [false; 3],
            },
        };
        machine.last.pulses = machine.pulses(HOME);
        machine
    }

    /// Takes an errand: `Some` with its report when it begins at once, else the report comes through
    /// [`Self::next_report`] later. A client's next errand replaces one of its own that waits.
    #[inline]
    pub fn take(&mut self, client: Client, errand: &Errand) -> Option<Report> {
        self.waiting.retain(|turn| !turn.is_errand_of(client));
        if self.stopped.is_some() && *errand != Errand::Rest {
            return Some(Report::Stopped);
        }
        // A move to where the arm is has ended when it began.
        self.advance(self.clock);
        let free = self.active.is_none() && !self.plan.has_the_arm() && self.resting_for.is_none();
        if free && self.waiting.is_empty() {
            return Some(self.begin(client, errand));
        }
        // One place for each client, and this client's was made free above.
        let _ = self.waiting.push_back(Turn::Errand(client, *errand));
        None
    }

    /// Takes back an errand that waits; says whether there was one. What has begun goes on, and its
    /// report comes.
    pub fn withdraw(&mut self, client: Client) -> bool {
        let before = self.waiting.len();
        self.waiting.retain(|turn| !turn.is_errand_of(client));
        self.waiting.len() < before
    }

    /// The next report of an errand that had to wait.
    pub fn next_report(&mut self) -> Option<(Client, Report)> {
        self.reports.pop_front()
    }

    /// Ends the rest that [`Errand::Rest`] asked for.
    pub fn release(&mut self, client: Client) {
        if self.resting_for == Some(client) {
            self.resting_for = None;
        }
    }

    /// The client's connection has ended: its errands are forgotten, and if it was the last to move
    /// the arm and left the pen down, the pen is lifted after a while.
    pub fn client_gone(&mut self, client: Client) {
        self.waiting.retain(|turn| !turn.is_errand_of(client));
        self.reports.retain(|(other, _)| *other != client);
        self.release(client);
        if self.last_mover == Some(client) {
            self.lift_at = Some(self.frame + self.data.lift_after);
            // Whoever has the same place next has not moved the arm.
            self.last_mover = None;
        }
    }

    /// Lets everything happen that happens until `now`; cheap, and harmless at any time.
    pub fn advance(&mut self, now: Micros) {
        loop {
            match &self.active {
                Some(active) if active.ends <= now => {
                    self.clock = active.ends;
                    self.position = active.motion.end();
                    self.short = active.short;
                    self.passed_short |= active.short;
                    self.active = None;
                }
                Some(_) => return,
                None if self.plan.has_the_arm() => match self.plan.advance(now) {
                    Some(event) => self.plan_came_to(event),
                    None => return,
                },
                None => {
                    if self.resting_for.is_some() {
                        return;
                    }
                    match self.waiting.pop_front() {
                        None => return,
                        Some(Turn::Plan) => self.begin_plan(),
                        Some(Turn::Errand(client, errand)) => {
                            let report = self.begin(client, &errand);
                            // A client has one errand at a time, so one report at a time as well.
                            let _ = self.reports.push_back((client, report));
                        }
                    }
                }
            }
        }
    }

    /// The set-point of the servo frame at `now`; the time never goes back.
    // Never part of its caller, which is compiled for size on chips.
    #[inline(never)]
    pub fn tick(&mut self, now: Micros) -> SetPoint {
        let was_moving = self.is_moving();
        if self.active.is_some() || !self.plan.lasts_beyond(now) {
            self.advance(now);
        }
        let (position, held) = match &self.active {
            Some(Active {
                motion: Motion::Dwell(position, _),
                ..
            }) => {
                let position = *position;
                // The end of a dwell need not be waited for: nobody draws in it.
                self.lift_abandoned_pen(now);
                (position, false)
            }
            Some(active) => {
                // A move takes less than 2^32 us.
                let elapsed = (now - active.begun).get() as u32;
                let (position, held) = active.motion.at(elapsed);
                let (position, outside) = hold(position);
                (position, held || outside)
            }
            None if self.plan.has_the_arm() => hold(self.plan.at(now)),
            None => {
                self.clock = now;
                self.lift_abandoned_pen(now);
                (self.position, self.short && self.active.is_none())
            }
        };
        self.frame = now;
        let pulses = self.pulses(position);
        self.last = SetPoint {
            position,
            pulses,
            held: held || self.passed_short,
            // A move that ended between two frames shows by the pulses alone.
            moving: was_moving || self.is_moving() || pulses != self.last.pulses,
            outputs: self.plan.outputs(),
        };
        self.passed_short = false;
        self.last
    }

    /// When the move under way completes: something may begin then. Of a plan it is the last motion
    /// that counts, because what comes before it happens in frames alone.
    pub fn next_event(&self) -> Option<Micros> {
        match &self.active {
            Some(active) => Some(active.ends),
            None => self.plan.ends(),
        }
    }

    /// Whether a move or a plan is under way or waits, or the servos have not been told its end.
    pub fn is_busy(&self) -> bool {
        self.is_moving() || !self.waiting.is_empty() || self.last.position != self.position
    }

    /// Whether a move or a plan has the arm.
    const fn is_moving(&self) -> bool {
        self.active.is_some() || self.plan.has_the_arm()
    }

    /// Whether a wave is under way.
    pub fn is_waving(&self) -> bool {
        let waves = |active: &Active| matches!(active.motion, Motion::Wave(_));
        self.active.as_ref().is_some_and(waves)
    }

    /// Whether the arm rests, may move, and nobody wants it to do either.
    pub fn is_idle(&self) -> bool {
        !self.is_busy() && self.resting_for.is_none() && self.stopped.is_none()
    }

    /// Where the nib is now: the position of the last set-point, or where the arm rests.
    pub const fn position(&self) -> Position {
        if self.is_moving() {
            self.last.position
        } else {
            self.position
        }
    }

    /// What the board says about the arm, with the servos' directions in it.
    pub const fn data(&self) -> &ArmData {
        &self.data
    }

    /// The drawing speed.
    pub const fn steps(&self) -> Steps {
        self.steps
    }

    /// Sets the drawing speed of the moves that begin from now on.
    pub const fn set_steps(&mut self, steps: Steps) {
        self.steps = steps;
    }

    /// The same, of which what is not given stays (`spec 1.0.4a, G94`).
    pub fn change_steps(&mut self, pen_down: Option<StepSize>, pen_up: Option<StepSize>) {
        self.steps.pen_down = pen_down.unwrap_or(self.steps.pen_down);
        self.steps.pen_up = pen_up.unwrap_or(self.steps.pen_up);
    }

    #[inline]
    fn begin(&mut self, client: Client, errand: &Errand) -> Report {
        match errand {
            Errand::Move(manner, target) => {
                self.last_mover = Some(client);
                self.lift_at = None;
                self.start(*manner, target)
            }
            Errand::Uncalibrated(target, bare) => {
                self.last_mover = Some(client);
                self.lift_at = None;
                let (target, limited) = self.without_offsets(target, *bare);
                self.start_limited(Manner::Straight, &target, limited)
            }
            Errand::Dwell(duration) => self.dwell_for(*duration),
            Errand::Wave => self.wave(),
            Errand::Rest => {
                self.resting_for = Some(client);
                Report::Resting
            }
        }
    }

    fn wave(&mut self) -> Report {
        if !self.position.pen_is_down() {
            let motion = Motion::Wave(Wave::new(self.position));
            self.active = Some(Active {
                begun: self.clock,
                ends: self.clock + motion.duration(),
                short: false,
                motion,
            });
        }
        Report::Moving {
            end: self.position,
            limited: None,
        }
    }

    fn dwell_for(&mut self, duration: Micros) -> Report {
        let duration = duration.min(MOST_DWELL);
        self.active = Some(Active {
            begun: self.clock,
            ends: self.clock + duration,
            short: self.short,
            motion: Motion::Dwell(self.position, duration),
        });
        Report::Moving {
            end: self.position,
            limited: None,
        }
    }

    fn start(&mut self, manner: Manner, target: &Target) -> Report {
        self.start_limited(manner, target, None)
    }

    /// Starts a move whose target has been limited before.
    fn start_limited(
        &mut self,
        manner: Manner,
        target: &Target,
        before: Option<Limited>,
    ) -> Report {
        let (end, limited) = self.reachable(target);
        let mut limited = before.or(limited);
        let motion = match manner {
            Manner::Straight => Motion::Line(Line::new(self.position, end, self.steps)),
            Manner::Rapid => Motion::Rapid(Rapid::new(
                self.position,
                end,
                self.data.lift,
                self.data.full_speed,
            )),
        };
        if motion.leaves_the_area() && limited.is_none() {
            limited = Some(Limited::Way);
        }
        self.active = Some(Active {
            begun: self.clock,
            ends: self.clock + motion.duration(),
            short: matches!(limited, Some(Limited::Target { .. })),
            motion,
        });
        Report::Moving { end, limited }
    }

    /// The target itself with Z limited, or the closest point of the drawing area with the pen up.
    #[inline]
    fn reachable(&self, target: &Target) -> (Position, Option<Limited>) {
        let x = target.x.unwrap_or(self.position.x.into());
        let y = target.y.unwrap_or(self.position.y.into());
        let z = target.z.map_or(self.position.z, fitting::within_lift);
        let (near_x, near_y) = closest(x, y);
        let mut end = Position {
            x: near_x,
            y: near_y,
            z,
        };
        if x == near_x.into() && y == near_y.into() {
            return (end, None);
        }
        let lifted = end.pen_is_down();
        if lifted {
            end.z = PEN_UP;
        }
        (end, Some(Limited::Target { lifted }))
    }

    fn lift_abandoned_pen(&mut self, now: Micros) {
        let idle = self.resting_for.is_none() && self.lift_at.is_some_and(|at| at <= now);
        if !idle {
            return;
        }
        self.lift_at = None;
        if self.position.pen_is_down() {
            self.clock = now;
            self.start(Manner::Straight, &Target::PEN_UP);
        }
    }

    #[inline]
    fn pulses(&self, position: Position) -> Pulses {
        let told = self.calibration.apply(self.angles_at(position));
        let [shoulder, elbow, pen] = &self.data.servos;
        [
            shoulder.pulse(told.shoulder),
            elbow.pulse(told.elbow),
            pen.pulse(told.pen),
        ]
    }
}

#[cfg(test)]
mod tests;
