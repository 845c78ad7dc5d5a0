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
    Steps, WideCoordinate, closest, contains,
};
use heapless::Deque;

/// Clients that may be connected at once; the next one is told so and closed.
pub const MAX_CLIENTS: usize = 4;

/// One of the connected clients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Client(u8);

impl Client {
    /// The client in a slot, `None` beyond [`MAX_CLIENTS`].
    pub const fn new(slot: u8) -> Option<Self> {
        if (slot as usize) < MAX_CLIENTS {
            Some(Self(slot))
        } else {
            None
        }
    }

    /// Its slot, below [`MAX_CLIENTS`].
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
    /// Come to rest and stay there until [`Machine::release`]: for what must not be done in motion.
    Rest,
}

/// In what way a move differs from what was asked for.
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
}

impl Motion {
    const fn duration(&self) -> Micros {
        match self {
            Self::Line(line) => line.duration(),
            Self::Rapid(rapid) => rapid.duration(),
        }
    }

    const fn end(&self) -> Position {
        match self {
            Self::Line(line) => line.end(),
            Self::Rapid(rapid) => rapid.end(),
        }
    }

    const fn leaves_the_area(&self) -> bool {
        match self {
            Self::Line(line) => line.leaves_the_area(),
            Self::Rapid(rapid) => rapid.leaves_the_area(),
        }
    }

    #[inline]
    fn at(&self, elapsed: u32) -> (Position, bool) {
        match self {
            Self::Line(line) => line.at(elapsed),
            Self::Rapid(rapid) => rapid.at(elapsed),
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
    waiting: Deque<(Client, Errand), MAX_CLIENTS>,
    reports: Deque<(Client, Report), MAX_CLIENTS>,
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
                if contains(position.x, position.y) {
                    (position, held)
                } else {
                    let (x, y) = closest(position.x.into(), position.y.into());
                    (Position { x, y, ..position }, true)
                }
            }
            None => {
                self.clock = now;
                (self.position, self.short)
            }
        };
        self.frame = now;
        self.last = SetPoint {
            position,
            pulses: self.pulses(position),
            held: held || self.passed_short,
            // A move that ended between two frames shows by the place alone.
            moving: was_moving || self.active.is_some() || position != self.last.position,
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

    /// Where the nib is now: the position of the last set-point.
    pub const fn position(&self) -> Position {
        self.last.position
    }

    /// Where the servos are now, in the model's angles.
    pub fn angles(&self) -> Angles {
        inverse(self.last.position, self.data.lift)
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
    /// what they now mean; where that is outside the drawing area, the arm moves to its edge.
    pub fn set_calibration(&mut self, calibration: Calibration) {
        let model = calibration.remove(self.told());
        self.calibration = calibration;
        let position = if model == HOME_ANGLES {
            HOME
        } else {
            forward(model, self.data.lift)
        };
        let (x, y) = closest(position.x.into(), position.y.into());
        self.position = Position { x, y, ..position };
        self.active = None;
        self.last.position = self.position;
        self.last.pulses = self.pulses(self.position);
    }

    /// What the servos were told last, or at rest will have been told at the next frame, calibration
    /// included.
    fn told(&self) -> Angles {
        let position = match self.active {
            Some(_) => self.last.position,
            None => self.position,
        };
        self.calibration.apply(inverse(position, self.data.lift))
    }

    #[inline]
    fn begin(&mut self, client: Client, errand: &Errand) -> Report {
        match errand {
            Errand::Move(manner, target) => {
                self.last_mover = Some(client);
                self.lift_at = None;
                self.start(*manner, target)
            }
            Errand::Rest => {
                self.resting_for = Some(client);
                Report::Resting
            }
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
mod tests {
    use super::*;

    const A: Client = Client(0);
    const B: Client = Client(1);

    fn arm() -> Machine {
        Machine::new(ArmData::default(), Calibration::default())
    }

    fn line(x: i16, y: i16, z: i16) -> Errand {
        Errand::Move(Manner::Straight, Target::at(Position::from_units(x, y, z)))
    }

    fn moving(x: i16, y: i16, z: i16) -> Report {
        Report::Moving {
            end: Position::from_units(x, y, z),
            limited: None,
        }
    }

    /// Ticks each 10 ms up to and with `until`, in milliseconds, and gives the last set-point.
    fn run(machine: &mut Machine, from: u64, until: u64) -> SetPoint {
        let mut last = machine.last;
        for at in (from..=until).step_by(10) {
            last = machine.tick(Micros::new(at * 1000));
        }
        last
    }

    #[test]
    fn a_move_from_rest_is_answered_at_once() {
        let mut machine = arm();
        assert_eq!(
            machine.take(A, &line(1000, 1000, 0)),
            Some(moving(1000, 1000, 0))
        );
    }

    #[test]
    fn a_move_in_motion_is_answered_when_the_prior_one_has_completed() {
        let mut machine = arm();
        // 100 units with the pen up: 7 steps, 70 ms.
        machine.take(A, &line(1100, 1000, 1000));
        assert_eq!(machine.take(A, &line(1100, 900, 1000)), None);
        run(&mut machine, 0, 60);
        assert_eq!(machine.next_report(), None);
        run(&mut machine, 70, 70);
        assert_eq!(machine.next_report(), Some((A, moving(1100, 900, 1000))));
        assert_eq!(
            run(&mut machine, 80, 140).position,
            Position::from_units(1100, 900, 1000)
        );
        assert!(!machine.is_busy());
    }

    #[test]
    fn moves_follow_one_another_without_a_gap_whatever_the_frame() {
        for frame in [1_000, 3_003, 10_000, 20_000, 200_000] {
            let mut machine = arm();
            machine.take(A, &line(1015, 1000, 1000));
            machine.take(A, &line(1015, 985, 1000));
            machine.take(B, &line(1000, 985, 1000));
            let mut now = 0;
            while machine.is_busy() {
                now += frame;
                machine.tick(Micros::new(now));
            }
            // Three steps of 10 ms, seen at the first frame from then on.
            assert_eq!(
                machine.clock.max(Micros::new(30_000)),
                Micros::new(now),
                "{frame}"
            );
            assert_eq!(now, 30_000_u64.div_ceil(frame) * frame);
        }
    }

    #[test]
    fn a_move_to_where_the_arm_is_takes_no_time() {
        let mut machine = arm();
        for _ in 0..3 {
            assert_eq!(
                machine.take(A, &line(1000, 1000, 1000)),
                Some(moving(1000, 1000, 1000))
            );
        }
    }

    #[test]
    fn corners_are_reached_exactly() {
        let mut machine = arm();
        machine.take(A, &line(1100, 1000, 1000));
        machine.take(A, &line(1100, 900, 1000));
        assert_eq!(
            run(&mut machine, 0, 70).position,
            Position::from_units(1100, 1000, 1000)
        );
    }

    #[test]
    fn clients_take_turns_in_the_order_they_came() {
        let mut machine = arm();
        machine.take(A, &line(1015, 1000, 1000));
        machine.take(B, &line(1030, 1000, 1000));
        machine.take(A, &line(1045, 1000, 1000));
        run(&mut machine, 0, 10);
        assert_eq!(machine.next_report(), Some((B, moving(1030, 1000, 1000))));
        run(&mut machine, 20, 20);
        assert_eq!(machine.next_report(), Some((A, moving(1045, 1000, 1000))));
    }

    #[test]
    fn an_omitted_coordinate_is_the_arms_when_the_move_begins() {
        let mut machine = arm();
        machine.take(A, &line(1100, 1000, 1000));
        let lower = Target {
            z: Some(WideCoordinate::from_bits(0)),
            ..Target::default()
        };
        machine.take(B, &Errand::Move(Manner::Straight, lower));
        run(&mut machine, 0, 70);
        assert_eq!(machine.next_report(), Some((B, moving(1100, 1000, 0))));
    }

    #[test]
    fn out_of_reach_goes_to_the_closest_point_with_the_pen_up() {
        let mut machine = arm();
        let Some(Report::Moving { end, limited }) = machine.take(A, &line(2500, 0, 0)) else {
            unreachable!("the arm rests");
        };
        assert_eq!((end.x.rounded(), end.y.rounded(), end.z), (1950, 0, PEN_UP));
        assert_eq!(limited, Some(Limited::Target { lifted: true }));
        let last = run(&mut machine, 0, 2000);
        assert!(last.held && last.position == end);
    }

    #[test]
    fn a_short_end_is_marked_also_when_the_next_move_follows_at_once() {
        let mut machine = arm();
        machine.take(A, &line(2500, 1000, 1000));
        machine.take(A, &line(1000, 1000, 1000));
        let marked = (0..400)
            .filter(|at| machine.tick(Micros::new(at * 10_000)).held)
            .count();
        assert_eq!(marked, 1);
    }

    #[test]
    fn z_is_limited_without_a_word() {
        let mut machine = arm();
        assert_eq!(
            machine.take(A, &line(1000, 1000, -20)),
            Some(moving(1000, 1000, 0))
        );
        run(&mut machine, 0, 1000);
        assert_eq!(
            machine.take(A, &line(1000, 1000, 2000)),
            Some(moving(1000, 1000, 1000))
        );
    }

    #[test]
    fn a_way_over_the_body_is_held_at_the_edge() {
        let mut machine = arm();
        machine.take(A, &line(510, 300, 1000));
        run(&mut machine, 0, 1000);
        let over = line(720, -300, 1000);
        let Some(Report::Moving { limited, .. }) = machine.take(A, &over) else {
            unreachable!("the arm rests");
        };
        assert_eq!(limited, Some(Limited::Way));
        let mut held = 0;
        for at in 101..=200 {
            let set_point = machine.tick(Micros::new(at * 10_000));
            assert!(contains(set_point.position.x, set_point.position.y));
            held += u32::from(set_point.held);
        }
        assert!(held > 5, "{held}");
        assert_eq!(machine.position(), Position::from_units(720, -300, 1000));
    }

    #[test]
    fn a_rapid_way_over_the_body_is_held_and_told() {
        let mut machine = arm();
        machine.take(A, &line(510, 300, 1000));
        run(&mut machine, 0, 1000);
        let over = Errand::Move(
            Manner::Rapid,
            Target::at(Position::from_units(700, -900, 1000)),
        );
        let report = machine.take(A, &over);
        let mut held = false;
        for at in 1001..=1400 {
            let set_point = machine.tick(Micros::new(at * 1_000));
            assert!(
                contains(set_point.position.x, set_point.position.y),
                "{set_point:?}"
            );
            held |= set_point.held;
        }
        let Some(Report::Moving { limited, .. }) = report else {
            unreachable!("the arm rests")
        };
        assert_eq!((held, limited), (true, Some(Limited::Way)));
    }

    #[test]
    fn an_abandoned_pen_is_lifted_after_five_seconds() {
        let mut machine = arm();
        machine.take(A, &line(1000, 1000, 0));
        run(&mut machine, 0, 1000);
        machine.client_gone(A);
        assert!(run(&mut machine, 1010, 5990).position.pen_is_down());
        assert_eq!(run(&mut machine, 6000, 7000).position, HOME);
    }

    #[test]
    fn another_clients_drawing_keeps_the_pen_down() {
        let mut machine = arm();
        machine.take(A, &line(1000, 1000, 0));
        run(&mut machine, 0, 1000);
        machine.client_gone(A);
        machine.take(B, &line(1100, 1000, 0));
        assert!(run(&mut machine, 1010, 9000).position.pen_is_down());
    }

    #[test]
    fn a_listener_that_leaves_does_not_lift_the_drawers_pen() {
        let mut machine = arm();
        machine.take(A, &line(1000, 1000, 0));
        machine.client_gone(B);
        assert!(run(&mut machine, 0, 9000).position.pen_is_down());
    }

    #[test]
    fn a_rest_is_kept_until_it_is_released() {
        let mut machine = arm();
        machine.take(A, &line(1015, 1000, 1000));
        assert_eq!(machine.take(A, &Errand::Rest), None);
        assert_eq!(machine.take(B, &line(1030, 1000, 1000)), None);
        run(&mut machine, 0, 10);
        assert_eq!(machine.next_report(), Some((A, Report::Resting)));
        assert_eq!(
            run(&mut machine, 20, 500).position.x,
            Coordinate::from_units(1015)
        );
        machine.release(B);
        assert_eq!(
            run(&mut machine, 510, 600).position.x,
            Coordinate::from_units(1015)
        );
        machine.release(A);
        run(&mut machine, 610, 610);
        assert_eq!(machine.next_report(), Some((B, moving(1030, 1000, 1000))));
        assert_eq!(
            run(&mut machine, 620, 620).position.x,
            Coordinate::from_units(1030)
        );
    }

    #[test]
    fn calibrating_keeps_the_servos_and_makes_their_place_home() {
        let mut machine = arm();
        machine.take(A, &line(1020, 990, 950));
        let before = run(&mut machine, 0, 1000);
        let calibration = machine.calibration_here();
        machine.set_calibration(calibration);
        let after = machine.tick(Micros::new(1_010_000));
        assert_eq!(after.position, HOME);
        for (before, after) in before.pulses.iter().zip(after.pulses) {
            // Within what the tables differ from the exact angles at home.
            assert!(
                before.get().abs_diff(after.get()) <= 50,
                "{before:?} {after:?}"
            );
        }
        machine.set_calibration(Calibration::default());
        let cleared = machine.tick(Micros::new(1_020_000));
        assert_eq!(
            (cleared.position.x.rounded(), cleared.position.y.rounded()),
            (1020, 990)
        );
        assert_eq!(cleared.position.z.rounded(), 950);
    }

    #[test]
    fn pictures_see_what_the_pulses_say() {
        let mut machine = arm();
        machine.take(A, &line(1400, -300, 0));
        let last = run(&mut machine, 0, 2000);
        let seen = position_of(last.pulses, machine.data());
        assert!((seen.x.to_f64() - 1400.0).abs() < 0.05 && (seen.y.to_f64() + 300.0).abs() < 0.05);
        assert!(seen.z.to_f64() < 0.01);
    }
}
