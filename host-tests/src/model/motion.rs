//! From a program to set-points (`reference/line-us.md`, section 4). Programs are taken to be valid: a line the model does
//! not know, or a value out of range, panics and names the line.

use super::arm::{HOME, forward, inverse, pulse};
use super::paper::Fitting;
use super::{area, gcode};

/// Time of one step.
pub const STEP_US: u64 = 10_000;
/// What a servo turns in one step of a G00: 600 degrees/s.
const RAPID_DEG: f64 = 6.0;
/// Pen down is Z < 500.
const PEN_DOWN_BELOW: f64 = 500.0;

/// Where the arm is at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Line of the move under way, from 1; 0 before the first.
    pub line: usize,
    pub time_us: u64,
    pub position: [f64; 3],
    /// Shoulder, elbow, pen, without the calibration.
    pub angles_deg: [f64; 3],
    /// With the calibration.
    pub pulses_us: [f64; 3],
    /// The way led outside the drawing area here; `position` is the closest point inside.
    pub held: bool,
}

/// What a command led to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    pub line: usize,
    /// Where the arm is after the command.
    pub target: [f64; 3],
    /// When the arm is there.
    pub end_us: u64,
    /// The target had to be moved into the drawing area, or the way there leads outside and is held at its edge.
    pub limited: bool,
}

/// The set-points of a program, one every 10 ms from time 0 (home, at rest) until the last move is complete.
pub fn steps(gcode: &str) -> impl Iterator<Item = Step> + '_ {
    frames(gcode, STEP_US)
}

/// The set-points at 0, `frame_us`, 2 `frame_us`, ... up to the first at which the last move is complete.
pub fn frames(gcode: &str, frame_us: u64) -> impl Iterator<Item = Step> + '_ {
    frames_fitted(gcode, frame_us, Fitting::NONE)
}

/// As [`frames`], of an arm that is built like this.
pub fn frames_fitted(
    gcode: &str,
    frame_us: u64,
    fitting: Fitting,
) -> impl Iterator<Item = Step> + '_ {
    assert!(frame_us > 0);
    let mut moves = Moves::new(gcode, fitting);
    let mut current = Move::rest(0, 0, HOME);
    let mut time = 0;
    std::iter::from_fn(move || {
        while current.end_us() < time {
            match moves.next() {
                Some(next) => current = next,
                None => break,
            }
        }
        // Only past the last move: one frame shows it complete, then it is over.
        if time >= current.end_us() + frame_us {
            return None;
        }
        let step = current.at(time, &fitting);
        time += frame_us;
        Some(step)
    })
}

/// One report for each command of a program, the settings G54 and G94 included.
pub fn reports(gcode: &str) -> impl Iterator<Item = Report> + '_ {
    reports_fitted(gcode, Fitting::NONE)
}

/// As [`reports`], of an arm that is built like this.
pub fn reports_fitted(gcode: &str, fitting: Fitting) -> impl Iterator<Item = Report> + '_ {
    Moves::new(gcode, fitting).map(|m| {
        let limited = m.target_limited || m.way_limited();
        Report {
            line: m.line,
            target: m.to,
            end_us: m.end_us(),
            limited,
        }
    })
}

/// Steps of a G01: the axis that moves most counts, not the length.
pub fn step_count(from: [f64; 3], to: [f64; 3], step: f64) -> u64 {
    whole_steps((0..3).map(|i| (to[i] - from[i]).abs()).fold(0.0, f64::max) / step)
}

/// Rounds up. Values are decimals as typed, which f64 holds inexactly: 8.3 - 3.3 is a hair more than 5, and must not cost
/// a step more. A billionth of a step is far above that noise and far below any distance one would type.
fn whole_steps(steps: f64) -> u64 {
    (steps - 1e-9).ceil().max(0.0) as u64
}

/// A planned command. A setting is a move of no steps.
#[derive(Debug, Clone, Copy)]
struct Move {
    line: usize,
    start_us: u64,
    from: [f64; 3],
    to: [f64; 3],
    /// G00: every servo at its own full speed.
    rapid: bool,
    count: u64,
    /// G4: how long it stays after its steps, of which it has none.
    dwell_us: u64,
    target_limited: bool,
}

impl Move {
    fn rest(line: usize, start_us: u64, at: [f64; 3]) -> Self {
        Move {
            line,
            start_us,
            from: at,
            to: at,
            rapid: false,
            count: 0,
            dwell_us: 0,
            target_limited: false,
        }
    }

    fn end_us(&self) -> u64 {
        self.start_us + self.count * STEP_US + self.dwell_us
    }

    /// The set-point at a time from the start on; after the end, the target.
    ///
    /// A straight way goes straight from step to step, each of them held at the edge where it lies outside; so between
    /// two of them it can still cut a corner of the area, and is held there as well.
    fn at(&self, time_us: u64, fitting: &Fitting) -> Step {
        let since = time_us - self.start_us;
        let (whole, rest) = (since / STEP_US, since % STEP_US);
        let (position, held) = if rest == 0 || whole >= self.count {
            self.step(whole)
        } else if self.rapid {
            inside(forward(self.rapid_angles(since as f64 / STEP_US as f64)))
        } else {
            let ((a, held_a), (b, held_b)) = (self.step(whole), self.step(whole + 1));
            let (position, held) = inside(between(a, b, rest as f64 / STEP_US as f64));
            (position, held || held_a || held_b)
        };
        let [x, y, z] = fitting.arm(position);
        let angles_deg = inverse(x, y, z);
        let pulses_us = fitting.told(position).map(pulse);
        Step {
            line: self.line,
            time_us,
            position,
            angles_deg,
            pulses_us,
            held,
        }
    }

    /// The position after `k` steps, and whether it is held at the edge.
    fn step(&self, k: u64) -> ([f64; 3], bool) {
        if k >= self.count {
            (self.to, false)
        } else if self.rapid {
            inside(forward(self.rapid_angles(k as f64)))
        } else {
            inside(between(self.from, self.to, k as f64 / self.count as f64))
        }
    }

    /// Whether the way is held at the edge: at a step of a G00; anywhere on the straight line of a G01, because set-points
    /// may be asked for between the steps as well.
    fn way_limited(&self) -> bool {
        if self.rapid {
            return (1..self.count).any(|k| self.step(k).1);
        }
        // Between two points of the area only the body's notch can be in the way: the line passes y = 0 where x < 700.
        let (a, b) = if self.from[1] >= self.to[1] {
            (self.from, self.to)
        } else {
            (self.to, self.from)
        };
        let at_zero = || a[0] + (b[0] - a[0]) * a[1] / (a[1] - b[1]);
        a[1] >= 0.0 && b[1] < 0.0 && at_zero() < area::BODY_RIGHT
    }

    /// The servos after `k` steps of a G00, each stopping where it has arrived.
    fn rapid_angles(&self, k: f64) -> [f64; 3] {
        let start = inverse(self.from[0], self.from[1], self.from[2]);
        let end = inverse(self.to[0], self.to[1], self.to[2]);
        let turned = RAPID_DEG * k;
        [0, 1, 2].map(|i| start[i] + (end[i] - start[i]).clamp(-turned, turned))
    }
}

/// The position itself, or the closest one of the drawing area and `true`.
fn inside(position: [f64; 3]) -> ([f64; 3], bool) {
    let [x, y, z] = position;
    let (near_x, near_y) = area::closest(x, y);
    ([near_x, near_y, z], !area::inside(x, y))
}

fn between(a: [f64; 3], b: [f64; 3], part: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * part)
}

/// Plans a program, command by command.
struct Moves<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    fitting: Fitting,
    time_us: u64,
    position: [f64; 3],
    /// G54: arm = value * scale + offset, for X and Y.
    scale: f64,
    offset: [f64; 2],
    /// G94.
    pen_down_step: f64,
    pen_up_step: f64,
}

impl<'a> Moves<'a> {
    fn new(gcode: &'a str, fitting: Fitting) -> Self {
        let lines = gcode.lines().enumerate();
        Moves {
            lines,
            fitting,
            time_us: 0,
            position: HOME,
            scale: 1.0,
            offset: [0.0; 2],
            pen_down_step: 5.0,
            pen_up_step: 15.0,
        }
    }

    fn plan(&mut self, line: usize, command: &gcode::Command) -> Move {
        let [x, y, z] = self.position;
        let word = |letter| command.word(letter);
        match command.code {
            0 | 1 => {
                let scaled = |value: f64, axis: usize| value * self.scale + self.offset[axis];
                let wanted = [
                    word('X').map_or(x, |v| scaled(v, 0)),
                    word('Y').map_or(y, |v| scaled(v, 1)),
                    word('Z').unwrap_or(z),
                ];
                self.go(line, wanted, command.code == 0)
            }
            4 => {
                let seconds = word('P').or(word('S')).unwrap_or(0.0);
                let mut dwell = Move::rest(line, self.time_us, self.position);
                dwell.dwell_us = (seconds * 1e6).round() as u64;
                dwell
            }
            40 => {
                let [keep_xy, keep_z] = ["XY", "Z"].map(|axes| command.usual == axes);
                let scaled = |value: f64, axis: usize| match keep_xy {
                    true => value * self.scale + self.offset[axis],
                    false => value,
                };
                let wanted = [
                    word('X').map(|v| scaled(v, 0)),
                    word('Y').map(|v| scaled(v, 1)),
                    word('Z'),
                ];
                self.go_bare(line, wanted, keep_xy, keep_z)
            }
            28 => self.go(line, HOME, false),
            54 => {
                self.offset = [
                    word('X').unwrap_or(self.offset[0]),
                    word('Y').unwrap_or(self.offset[1]),
                ];
                self.scale = word('S').unwrap_or(self.scale);
                assert!(self.scale != 0.0, "line {line}: a scale of zero");
                Move::rest(line, self.time_us, self.position)
            }
            94 => {
                self.pen_down_step = word('S').or(word('F')).unwrap_or(self.pen_down_step);
                self.pen_up_step = word('P').unwrap_or(self.pen_up_step);
                assert!(
                    (1.0..=30.0).contains(&self.pen_down_step),
                    "line {line}: pen-down step out of range"
                );
                assert!(
                    (1.0..=100.0).contains(&self.pen_up_step),
                    "line {line}: pen-up step out of range"
                );
                Move::rest(line, self.time_us, self.position)
            }
            code => unreachable!("gcode::read let G{code} through"),
        }
    }

    /// To where the servos are told what those of an exact arm would be told for `wanted`.
    fn go_bare(&self, line: usize, wanted: [Option<f64>; 3], keep_xy: bool, keep_z: bool) -> Move {
        let fitting = &self.fitting;
        let [x, y, z] = wanted;
        let mut target = [0, 1, 2].map(|i| wanted[i].unwrap_or(self.position[i]));
        target[2] = target[2].clamp(0.0, 1000.0);
        let lift = match z {
            Some(z) if !keep_z => {
                let told = inverse(1000.0, 1000.0, z.clamp(0.0, 1000.0))[2];
                Some(1000.0 - (135.0 - (told - fitting.offsets_deg[2])) * 1000.0 / 45.0)
                    .map(|lift| lift.min(1000.0))
            }
            _ => None,
        };
        let mut limited = false;
        if !keep_xy && (x.is_some() || y.is_some()) {
            let now = forward(fitting.told(self.position));
            let (far_x, far_y) = (x.unwrap_or(now[0]), y.unwrap_or(now[1]));
            let (near_x, near_y) = area::closest(far_x, far_y);
            limited = !area::inside(far_x, far_y);
            let told = inverse(near_x, near_y, 1000.0);
            let [x, y, _] = fitting.arm_told(told);
            // The lift's height and the place depend on each other: as often as it takes.
            let mut nib = [x, y, target[2]];
            for _ in 0..20 {
                let lift = lift.unwrap_or(fitting.arm([nib[0], nib[1], target[2]])[2]);
                nib = fitting.nib([x, y, lift]);
            }
            (target[0], target[1]) = (nib[0], nib[1]);
        }
        if let Some(lift) = lift {
            let (x, y) = area::closest(target[0], target[1]);
            target[2] = fitting.z(x, y, lift);
        }
        if limited && target[2] < PEN_DOWN_BELOW {
            target[2] = 1000.0;
        }
        let mut planned = self.go(line, target, false);
        planned.target_limited |= limited;
        planned
    }

    fn go(&self, line: usize, wanted: [f64; 3], rapid: bool) -> Move {
        let from = self.position;
        let mut to = [wanted[0], wanted[1], wanted[2].clamp(0.0, 1000.0)];
        let target_limited = !area::inside(to[0], to[1]);
        if target_limited {
            let (x, y) = area::closest(to[0], to[1]);
            to = [
                x,
                y,
                if to[2] < PEN_DOWN_BELOW {
                    1000.0
                } else {
                    to[2]
                },
            ];
        }
        let count = if rapid {
            let (a, b) = (
                inverse(from[0], from[1], from[2]),
                inverse(to[0], to[1], to[2]),
            );
            whole_steps((0..3).map(|i| (b[i] - a[i]).abs()).fold(0.0, f64::max) / RAPID_DEG)
        } else {
            let pen_down = from[2] < PEN_DOWN_BELOW && to[2] < PEN_DOWN_BELOW;
            step_count(
                from,
                to,
                if pen_down {
                    self.pen_down_step
                } else {
                    self.pen_up_step
                },
            )
        };
        Move {
            line,
            start_us: self.time_us,
            from,
            to,
            rapid,
            count,
            dwell_us: 0,
            target_limited,
        }
    }
}

impl Iterator for Moves<'_> {
    type Item = Move;

    fn next(&mut self) -> Option<Move> {
        loop {
            let (index, text) = self.lines.next()?;
            let command = gcode::read(text)
                .unwrap_or_else(|why| panic!("line {}: {text:?}: {why}", index + 1));
            if let Some(command) = command {
                let planned = self.plan(index + 1, &command);
                self.time_us = planned.end_us();
                self.position = planned.to;
                return Some(planned);
            }
        }
    }
}

#[cfg(test)]
mod tests;
