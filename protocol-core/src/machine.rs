//! The arm as one value: it accepts moves, is told the time, and gives set-points.
//!
//! Moves follow one another without a gap: one is under way, others wait in the order they came, at
//! most one for each client. A move is answered when it begins, which is when the prior one has
//! completed; from rest at once (`reference/line-us.md`, section 4). Where a client leaves out a
//! coordinate, it is the one the arm has when the move begins.
//!
//! Everything here takes a bounded number of instructions, so that it can run between two frames of
//! the servos.

use crate::arm::{Angles, Calibration, HOME_ANGLES, PenLift, Pulses, ServoRange, forward, inverse};
use crate::motion::{
    Coordinate, DEFAULT_STEPS, HOME, Line, Microdegrees, Micros, PEN_DOWN, PEN_UP, Position, Rapid,
    Steps, Wave, WideCoordinate, closest, hold,
};
use heapless::Deque;

/// Clients that may be connected at once; the next one is told so and closed.
pub const MAX_CLIENTS: usize = 4;

/// Connections of the web interface that may be served at once; the next one is told so and closed.
pub const MAX_WEB_CLIENTS: usize = 4;

/// Everybody who may ask something of the arm: network clients, the serial port, the firmware itself,
/// the drawing that it holds, web clients.
pub const MAX_ASKERS: usize = MAX_CLIENTS + 3 + MAX_WEB_CLIENTS;

/// One of those who may ask something of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Client(u8);

impl Client {
    /// The serial port.
    pub const SERIAL: Self = Self(MAX_CLIENTS as u8);
    /// The firmware itself: waves, and settings that nobody on a connection asked to store.
    pub const HOUSE: Self = Self(MAX_CLIENTS as u8 + 1);
    /// The drawing that the machine holds.
    pub const JOB: Self = Self(MAX_CLIENTS as u8 + 2);

    /// The network client in a slot, `None` beyond [`MAX_CLIENTS`].
    pub const fn new(slot: u8) -> Option<Self> {
        if (slot as usize) < MAX_CLIENTS {
            Some(Self(slot))
        } else {
            None
        }
    }

    /// The client of the web interface in a slot, `None` beyond [`MAX_WEB_CLIENTS`].
    pub const fn web(slot: u8) -> Option<Self> {
        if (slot as usize) < MAX_WEB_CLIENTS {
            Some(Self(MAX_CLIENTS as u8 + 3 + slot))
        } else {
            None
        }
    }

    /// Its slot, below [`MAX_ASKERS`].
    pub const fn slot(self) -> usize {
        self.0 as usize
    }
}

/// What a board says about its arm.
#[derive(Clone, Copy, Debug)]
pub struct ArmData {
    /// Pulse ranges of shoulder, elbow and pen.
    pub servos: [ServoRange; 3],
    /// How the pen servo follows Z.
    pub lift: PenLift,
    /// Full speed of every servo for G00, in degrees a second.
    pub full_speed: u16,
    /// How long the pen stays down after the connection that lowered it has ended.
    pub lift_after: Micros,
}

impl Default for ArmData {
    /// 500..2500 us over 180 degrees, 600 degrees a second, 5 s (`reference/arm.md`).
    fn default() -> Self {
        Self {
            servos: [ServoRange::default(); 3],
            lift: PenLift::default(),
            full_speed: 600,
            lift_after: Micros::from_secs(5),
        }
    }
}

/// What the servos are told in one frame, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetPoint {
    /// Where the nib is to be.
    pub position: Position,
    /// The pulses that put it there.
    pub pulses: Pulses,
    /// The position is not what was asked for: it is held at the edge of the drawing area.
    pub held: bool,
    /// A move is under way, or this is where it ended.
    pub moving: bool,
}

/// Where to go; a coordinate left out stays as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Target {
    /// In arm coordinates.
    pub x: Option<WideCoordinate>,
    /// In arm coordinates.
    pub y: Option<WideCoordinate>,
    /// Limited to 0..=1000.
    pub z: Option<WideCoordinate>,
}

impl Target {
    /// Home (`spec 1.0.4a, G28`).
    pub const HOME: Self = Self::at(HOME);

    /// A place inside the arm's reach.
    pub const fn at(position: Position) -> Self {
        Self {
            x: Some(WideCoordinate::from_bits(position.x.bits() as i64)),
            y: Some(WideCoordinate::from_bits(position.y.bits() as i64)),
            z: Some(WideCoordinate::from_bits(position.z.bits() as i64)),
        }
    }
}

/// How to go there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Manner {
    /// In a straight line (G01).
    Straight,
    /// Every servo at its own full speed (G00).
    Rapid,
}

/// What a client asks of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Errand {
    /// Go somewhere.
    Move(Manner, Target),
    /// Make a little wave and be back: nothing happens while the pen is down.
    Wave,
    /// Come to rest and stay there until [`Machine::release`]: for what must not be done in motion.
    Rest,
}

/// In what way a move differs from what was asked for; [`Self::text`] has it in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limited {
    /// The target is out of reach: the arm goes to the closest point.
    Target {
        /// The pen was to be down and is lifted instead.
        lifted: bool,
    },
    /// The way there leaves the drawing area: it is held at the edge.
    Way,
}

impl Limited {
    /// For people, without a double quote.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Target { lifted: true } => "out of reach: going to the closest point, pen lifted",
            Self::Target { lifted: false } => "out of reach: going to the closest point",
            Self::Way => "the way leaves the drawing area: held at its edge",
        }
    }
}

/// How an errand turned out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Report {
    /// The move has begun.
    Moving {
        /// Where it ends, in arm coordinates.
        end: Position,
        /// What is different from what was asked for.
        limited: Option<Limited>,
    },
    /// The arm is at rest and waits for [`Machine::release`].
    Resting,
}

#[derive(Clone, Copy, Debug)]
enum Motion {
    Line(Line),
    Rapid(Rapid),
    Wave(Wave),
}

impl Motion {
    const fn duration(&self) -> Micros {
        match self {
            Self::Line(line) => line.duration(),
            Self::Rapid(rapid) => rapid.duration(),
            Self::Wave(_) => Wave::DURATION,
        }
    }

    const fn end(&self) -> Position {
        match self {
            Self::Line(line) => line.end(),
            Self::Rapid(rapid) => rapid.end(),
            Self::Wave(wave) => wave.end(),
        }
    }

    const fn leaves_the_area(&self) -> bool {
        match self {
            Self::Line(line) => line.leaves_the_area(),
            Self::Rapid(rapid) => rapid.leaves_the_area(),
            // Held at the edge where it would.
            Self::Wave(_) => false,
        }
    }

    #[inline]
    fn at(&self, elapsed: u32) -> (Position, bool) {
        match self {
            Self::Line(line) => line.at(elapsed),
            Self::Rapid(rapid) => rapid.at(elapsed),
            Self::Wave(wave) => wave.at(elapsed),
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Active {
    motion: Motion,
    begun: Micros,
    ends: Micros,
    /// The target was out of reach: its end is marked in the set-points.
    short: bool,
}

/// The arm.
#[derive(Debug)]
pub struct Machine {
    data: ArmData,
    calibration: Calibration,
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
    waiting: Deque<(Client, Errand), MAX_ASKERS>,
    reports: Deque<(Client, Report), MAX_ASKERS>,
    /// Who keeps the arm at rest.
    resting_for: Option<Client>,
    last_mover: Option<Client>,
    lift_at: Option<Micros>,
    /// The last frame, and its set-point.
    frame: Micros,
    last: SetPoint,
}

impl Machine {
    /// An arm at home with the pen up.
    pub fn new(data: ArmData, calibration: Calibration) -> Self {
        let mut machine = Self {
            data,
            calibration,
            steps: DEFAULT_STEPS,
            position: HOME,
            short: false,
            passed_short: false,
            clock: Micros::default(),
            active: None,
            waiting: Deque::new(),
            reports: Deque::new(),
            resting_for: None,
            last_mover: None,
            lift_at: None,
            frame: Micros::default(),
            last: SetPoint {
                position: HOME,
                pulses: Pulses::default(),
                held: false,
                moving: false,
            },
        };
        machine.last.pulses = machine.pulses(HOME);
        machine
    }

    /// Takes an errand: `Some` with its report when it begins at once, else the report comes through
    /// [`Self::next_report`] later. A client's next errand replaces one of its own that waits.
    #[inline]
    pub fn take(&mut self, client: Client, errand: &Errand) -> Option<Report> {
        self.waiting.retain(|(other, _)| *other != client);
        // A move to where the arm is has ended when it began.
        self.advance(self.clock);
        if self.active.is_none() && self.waiting.is_empty() && self.resting_for.is_none() {
            return Some(self.begin(client, errand));
        }
        // One place for each client, and this client's was made free above.
        let _ = self.waiting.push_back((client, *errand));
        None
    }

    /// Takes back an errand that waits; says whether there was one. What has begun goes on, and its
    /// report comes.
    pub fn withdraw(&mut self, client: Client) -> bool {
        let before = self.waiting.len();
        self.waiting.retain(|(other, _)| *other != client);
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
        self.waiting.retain(|(other, _)| *other != client);
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
                None => {
                    if self.resting_for.is_some() {
                        return;
                    }
                    let Some((client, errand)) = self.waiting.pop_front() else {
                        return;
                    };
                    let report = self.begin(client, &errand);
                    // A client has one errand at a time, so one report at a time as well.
                    let _ = self.reports.push_back((client, report));
                }
            }
        }
    }

    /// The set-point of the servo frame at `now`; the time never goes back.
    #[inline]
    pub fn tick(&mut self, now: Micros) -> SetPoint {
        let was_moving = self.active.is_some();
        self.advance(now);
        if self.active.is_none() {
            self.lift_abandoned_pen(now);
        }
        let (position, held) = match &self.active {
            Some(active) => {
                // A move takes less than 2^32 us.
                let elapsed = (now - active.begun).get() as u32;
                let (position, held) = active.motion.at(elapsed);
                let (position, outside) = hold(position);
                (position, held || outside)
            }
            None => {
                self.clock = now;
                (self.position, self.short)
            }
        };
        self.frame = now;
        let pulses = self.pulses(position);
        self.last = SetPoint {
            position,
            pulses,
            held: held || self.passed_short,
            // A move that ended between two frames shows by the pulses alone.
            moving: was_moving || self.active.is_some() || pulses != self.last.pulses,
        };
        self.passed_short = false;
        self.last
    }

    /// When the move under way completes: something may begin then.
    pub fn next_event(&self) -> Option<Micros> {
        self.active.as_ref().map(|active| active.ends)
    }

    /// Whether a move is under way or waits, or the servos have not been told its end.
    pub fn is_busy(&self) -> bool {
        self.active.is_some() || !self.waiting.is_empty() || self.last.position != self.position
    }

    /// Whether the arm rests, nobody wants it to move, and nobody keeps it at rest.
    pub fn is_idle(&self) -> bool {
        !self.is_busy() && self.resting_for.is_none()
    }

    /// Where the nib is now: the position of the last set-point, or where the arm rests.
    pub const fn position(&self) -> Position {
        match self.active {
            Some(_) => self.last.position,
            None => self.position,
        }
    }

    /// Where the servos are now, in the model's angles.
    pub fn angles(&self) -> Angles {
        inverse(self.position(), self.data.lift)
    }

    /// What the board says about the arm.
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

    /// The calibration in force.
    pub const fn calibration(&self) -> Calibration {
        self.calibration
    }

    /// The calibration by which the servos, as they stand now, stand at the calibration point, which
    /// is home (`reference/arm.md`, calibration).
    pub fn calibration_here(&self) -> Calibration {
        Calibration::between(self.told(), HOME_ANGLES)
    }

    /// Puts a calibration in force. The servos stay where they are, and the arm's position becomes
    /// what they now mean; where that is outside the drawing area or its heights, they go to its edge in
    /// the next frame.
    pub fn set_calibration(&mut self, calibration: Calibration) {
        let model = calibration.remove(self.told());
        self.calibration = calibration;
        let position = if model == HOME_ANGLES {
            HOME
        } else {
            forward(model, self.data.lift)
        };
        (self.position, _) = hold(position);
        self.active = None;
    }

    /// What the servos were told last, or at rest will have been told at the next frame, calibration
    /// included.
    fn told(&self) -> Angles {
        self.calibration.apply(self.angles())
    }

    #[inline]
    fn begin(&mut self, client: Client, errand: &Errand) -> Report {
        match errand {
            Errand::Move(manner, target) => {
                self.last_mover = Some(client);
                self.lift_at = None;
                self.start(*manner, target)
            }
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

    fn start(&mut self, manner: Manner, target: &Target) -> Report {
        let (end, mut limited) = self.reachable(target);
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
        let z = target.z.map_or(self.position.z, |z| {
            let within = z.bits().clamp(PEN_DOWN.bits().into(), PEN_UP.bits().into());
            Coordinate::from_bits(within as i32)
        });
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
            let up = Position {
                z: PEN_UP,
                ..self.position
            };
            self.start(Manner::Straight, &Target::at(up));
        }
    }

    #[inline]
    fn pulses(&self, position: Position) -> Pulses {
        let told = self.calibration.apply(inverse(position, self.data.lift));
        let [shoulder, elbow, pen] = &self.data.servos;
        [
            shoulder.pulse(told.shoulder),
            elbow.pulse(told.elbow),
            pen.pulse(told.pen),
        ]
    }
}

/// Where the nib of an arm without offsets is when its servos are given `pulses`: forward kinematics,
/// for pictures of what the arm did.
pub fn position_of(pulses: Pulses, data: &ArmData) -> Position {
    let mut angles = [Microdegrees::default(); 3];
    for ((angle, servo), pulse) in angles.iter_mut().zip(&data.servos).zip(pulses) {
        *angle = servo.angle(pulse);
    }
    forward(Angles::from_array(angles), data.lift)
}

#[cfg(test)]
mod tests;
