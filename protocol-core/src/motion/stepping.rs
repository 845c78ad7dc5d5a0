//! Moves as functions of time (`spec 1.0.4a, G00, G01, G94`).

use super::area::{closest, contains, line_leaves};
use super::units::{Coordinate, Microdegrees, Micros, PEN_DOWN_BELOW, Position, WideCoordinate};
use crate::arm::{Angles, PenLift, forward, inverse};

/// One step of an interpolated move takes this long, in microseconds. The original takes 10 to 20 ms
/// (`reference/line-us.md`, section 4).
pub const STEP_TIME: u32 = 10_000;

/// The largest step of an interpolated move along any axis, in 1/2^24 drawing units: finer than
/// coordinates, because a move has thousands of steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct StepSize(u32);

impl StepSize {
    /// Fraction bits of the representation.
    pub const FRACTION_BITS: u32 = 24;

    /// A whole number of drawing units, at least 1.
    pub const fn from_units(units: u8) -> Self {
        Self(if units == 0 { 1 } else { units as u32 } << Self::FRACTION_BITS)
    }

    /// In 1/2^24 units.
    pub const fn bits(self) -> u32 {
        self.0
    }
}

/// What a step size may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepRange {
    /// Least, in drawing units.
    pub least: u8,
    /// Largest, in drawing units.
    pub most: u8,
}

impl StepRange {
    /// With the pen down: 1..=30 (`spec 1.0.4a, G94`).
    pub const PEN_DOWN: Self = Self { least: 1, most: 30 };
    /// With the pen up: 1..=100 (`reference/line-us.md`, section 5).
    pub const PEN_UP: Self = Self {
        least: 1,
        most: 100,
    };

    /// A step size in 1/2^24 units, `None` when it is not in the range.
    pub fn step(self, bits: i64) -> Option<StepSize> {
        let range = i64::from(StepSize::from_units(self.least).0)
            ..=i64::from(StepSize::from_units(self.most).0);
        range.contains(&bits).then_some(StepSize(bits as u32))
    }
}

/// The drawing speed: it belongs to the arm, not to a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Steps {
    /// For moves that both start and end with the pen down.
    pub pen_down: StepSize,
    /// For every other move.
    pub pen_up: StepSize,
}

/// After power-on: 5 with the pen down, 15 with the pen up.
pub const DEFAULT_STEPS: Steps = Steps {
    pen_down: StepSize::from_units(5),
    pen_up: StepSize::from_units(15),
};

impl Steps {
    /// The step size for a move between two heights.
    const fn between(self, from: Coordinate, to: Coordinate) -> StepSize {
        if from.bits() < PEN_DOWN_BELOW.bits() && to.bits() < PEN_DOWN_BELOW.bits() {
            self.pen_down
        } else {
            self.pen_up
        }
    }
}

/// A straight line at a steady rate: G01, G28.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    from: Position,
    to: Position,
    /// Per axis, 1/65536 units a microsecond, in 1/2^32.
    rate: [i64; 3],
    steps: u32,
    leaves: bool,
}

impl Line {
    /// From one point of the area to another.
    pub(crate) fn new(from: Position, to: Position, sizes: Steps) -> Self {
        let travel = [to.x - from.x, to.y - from.y, to.z - from.z].map(Coordinate::bits);
        let [x, y, z] = travel.map(i32::unsigned_abs);
        let steps = step_count(x.max(y).max(z), sizes.between(from.z, to.z));
        let duration = i64::from(steps.max(1) * STEP_TIME);
        Self {
            from,
            to,

            rate: travel.map(|distance| rate(distance, duration)),
            steps,
            leaves: line_leaves((from.x, from.y), (to.x, to.y)),
        }
    }

    pub(crate) const fn leaves_the_area(&self) -> bool {
        self.leaves
    }

    pub(crate) const fn duration(&self) -> Micros {
        Micros::new(self.steps as u64 * STEP_TIME as u64)
    }

    pub(crate) const fn end(&self) -> Position {
        self.to
    }

    /// The set-point after `elapsed` microseconds, and whether it was held at the area's edge.
    #[inline]
    pub(crate) fn at(&self, elapsed: u32) -> (Position, bool) {
        if self.leaves {
            return self.held_at(elapsed);
        }
        (self.straight(elapsed), false)
    }

    #[inline]
    fn straight(&self, elapsed: u32) -> Position {
        let [x, y, z] = self.rate.map(|rate| {
            // The product is at most the travel in 1/2^32: 60 bits.
            Coordinate::from_bits(((rate * i64::from(elapsed) + HALF) >> 32) as i32)
        });
        Position {
            x: self.from.x + x,
            y: self.from.y + y,
            z: self.from.z + z,
        }
    }

    /// Every step that leaves the area is held at its edge, and between steps the set-point moves
    /// straight from one to the next; where that cuts the edge's corner, it is held as well.
    fn held_at(&self, elapsed: u32) -> (Position, bool) {
        let (step, within) = (elapsed / STEP_TIME, elapsed % STEP_TIME);
        let (before, held_before) = hold(self.straight(step * STEP_TIME));
        if within == 0 {
            return (before, held_before);
        }
        let next = (step + 1).min(self.steps);
        let (after, held_after) = hold(self.straight(next * STEP_TIME));
        let between = |from: Coordinate, to: Coordinate| {
            let part =
                i64::from(to.bits() - from.bits()) * i64::from(within) / i64::from(STEP_TIME);
            Coordinate::from_bits(from.bits() + part as i32)
        };
        let (point, held) = hold(Position {
            x: between(before.x, after.x),
            y: between(before.y, after.y),
            z: between(before.z, after.z),
        });
        (point, held || held_before || held_after)
    }
}

/// `ceil(distance / size)`, of the numbers as they were typed: 3.6 units in steps of 1.2 are three steps,
/// although neither is exact in binary. Both ends may be half a unit in the last place off, and so may
/// each step that is no whole number.
fn step_count(distance: u32, size: StepSize) -> u32 {
    const FINER: u32 = StepSize::FRACTION_BITS - Coordinate::FRACTION_BITS;
    let whole_units = size.bits().trailing_zeros() >= StepSize::FRACTION_BITS;
    let (count, rest, lost) = if whole_units {
        // In 32 bits, which the chip divides by itself.
        let size = size.bits() >> FINER;
        (distance / size, distance % size, 1)
    } else {
        let (distance, size) = (u64::from(distance) << FINER, u64::from(size.bits()));
        let count = (distance / size) as u32;
        (count, (distance % size) as u32, (1 << FINER) + count / 2)
    };
    if count == 0 {
        return u32::from(distance > 0);
    }
    count + u32::from(rest > lost)
}

const HALF: i64 = 1 << 31;

fn rate(distance: i32, duration: i64) -> i64 {
    (i64::from(distance) << 32) / duration
}

/// The position itself, or the closest point of the drawing area and `true`.
#[inline]
pub(crate) fn hold(position: Position) -> (Position, bool) {
    if contains(position.x, position.y) {
        return (position, false);
    }
    let (x, y) = closest(
        WideCoordinate::from(position.x),
        WideCoordinate::from(position.y),
    );
    (Position { x, y, ..position }, true)
}

/// Every servo straight to its target at its own full speed, not coordinated: G00.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rapid {
    from: Angles,
    to: Angles,
    end: Position,
    lift: PenLift,
    /// Degrees a second, that is microdegrees a microsecond.
    speed: u16,
    duration: Micros,
    leaves: bool,
}

impl Rapid {
    /// From one point of the area to another.
    pub(crate) fn new(from: Position, to: Position, lift: PenLift, speed: u16) -> Self {
        let (from, end) = (inverse(from, lift), to);
        let to = inverse(to, lift);
        let slowest = from
            .zip(to, |from, to| {
                Microdegrees::new((to.get() - from.get()).abs())
            })
            .to_array()
            .into_iter()
            .max()
            .unwrap_or_default();
        // Whole steps, so that the moves that follow stay on the grid of step times.
        let steps = slowest
            .get()
            .unsigned_abs()
            .div_ceil(u32::from(speed) * STEP_TIME);
        let mut rapid = Self {
            from,
            to,
            end,
            lift,
            speed,
            duration: Micros::new(u64::from(steps * STEP_TIME)),
            leaves: false,
        };
        rapid.leaves = (1..steps).any(|step| {
            let point = forward(rapid.angles_at(step * STEP_TIME), lift);
            !contains(point.x, point.y)
        });
        rapid
    }

    pub(crate) const fn leaves_the_area(&self) -> bool {
        self.leaves
    }

    pub(crate) const fn duration(&self) -> Micros {
        self.duration
    }

    pub(crate) const fn end(&self) -> Position {
        self.end
    }

    /// The set-point after `elapsed` microseconds, and whether it was held at the area's edge.
    pub(crate) fn at(&self, elapsed: u32) -> (Position, bool) {
        hold(forward(self.angles_at(elapsed), self.lift))
    }

    fn angles_at(&self, elapsed: u32) -> Angles {
        let most = i32::try_from(elapsed.saturating_mul(u32::from(self.speed))).unwrap_or(i32::MAX);
        self.from.zip(self.to, |from, to| {
            let travel = to.get() - from.get();
            Microdegrees::new(from.get() + travel.clamp(-most, most))
        })
    }
}

/// A little wave: to the left, to the right and back, twice, at the pace of a move with the pen up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wave {
    at: Position,
}

impl Wave {
    /// From the middle to one side, in microseconds.
    const SWING: u32 = 100_000;
    /// 1/65536 units a microsecond: 15 units a step, 7.5 mm to each side.
    const PACE: i32 = 98;
    /// Four swings to and fro, twice.
    pub(crate) const DURATION: Micros = Micros::new(8 * Self::SWING as u64);

    /// Around a place.
    pub(crate) const fn new(at: Position) -> Self {
        Self { at }
    }

    pub(crate) const fn end(&self) -> Position {
        self.at
    }

    fn aside(elapsed: u32) -> Coordinate {
        let phase = elapsed % (4 * Self::SWING);
        let swung = match phase / Self::SWING {
            0 => phase.cast_signed(),
            1 | 2 => (2 * Self::SWING).cast_signed() - phase.cast_signed(),
            _ => phase.cast_signed() - (4 * Self::SWING).cast_signed(),
        };
        Coordinate::from_bits(swung * Self::PACE)
    }

    /// The set-point after `elapsed` microseconds; where it would leave the area it is held, which is
    /// no fault of a wave.
    pub(crate) fn at(&self, elapsed: u32) -> (Position, bool) {
        let swung = Position {
            y: self.at.y + Self::aside(elapsed),
            ..self.at
        };
        (hold(swung).0, false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn count(from: Position, to: Position, sizes: Steps) -> u32 {
        Line::new(from, to, sizes).steps
    }

    fn sizes(pen_down: u8, pen_up: u8) -> Steps {
        Steps {
            pen_down: StepSize::from_units(pen_down),
            pen_up: StepSize::from_units(pen_up),
        }
    }

    #[test]
    fn the_specifications_example_takes_34_steps() {
        let (from, to) = (
            Position::from_units(0, 0, 0),
            Position::from_units(100, 100, 0),
        );
        assert_eq!(count(from, to, sizes(3, 15)), 34);
    }

    #[test]
    fn the_largest_axis_counts_and_a_rest_makes_a_step() {
        let from = Position::from_units(1000, 0, 0);
        for (to, steps) in [
            ((1000, 0, 0), 0),
            ((1005, 0, 0), 1),
            ((1006, 0, 0), 2),
            ((1005, -10, 0), 2),
            ((1100, 0, 499), 100),
        ] {
            assert_eq!(
                count(from, Position::from_units(to.0, to.1, to.2), sizes(5, 15)),
                steps,
                "{to:?}"
            );
        }
    }

    #[test]
    fn steps_are_counted_in_numbers_as_typed() {
        let typed = |step: f64| StepSize((step * 16_777_216.0).round() as u32);
        let units = |distance: f64| (distance * 65_536.0).round() as u32;
        for (distance, step, count) in [
            (3.6, 1.2, 3),
            (3.6002, 1.2, 4),
            (11.1, 3.7, 3),
            (1999.81, 1.1, 1819),
            (3200.0, 1.0, 3200),
            (500.0003, 5.0, 101),
            (500.0, 5.0, 100),
            (0.00002, 1.2, 1),
        ] {
            let counted = step_count(units(distance), typed(step));
            assert_eq!(counted, count, "{distance} units in steps of {step}");
        }
    }

    #[test]
    fn the_pen_down_step_needs_both_ends_down() {
        let low = Position::from_units(1000, 0, 0);
        let high = Position::from_units(1000, 0, 500);
        assert_eq!(count(low, high, sizes(5, 10)), 50);
        assert_eq!(count(high, low, sizes(5, 10)), 50);
        assert_eq!(
            count(low, Position::from_units(1000, 0, 499), sizes(5, 10)),
            100
        );
    }

    #[test]
    fn step_sizes_have_their_ranges() {
        assert_eq!(
            StepRange::PEN_DOWN.step(1 << 24),
            Some(StepSize::from_units(1))
        );
        assert_eq!(
            StepRange::PEN_DOWN.step(30 << 24),
            Some(StepSize::from_units(30))
        );
        assert_eq!(StepRange::PEN_DOWN.step((30 << 24) + 1), None);
        assert_eq!(
            StepRange::PEN_UP.step(100 << 24),
            Some(StepSize::from_units(100))
        );
        assert_eq!(StepRange::PEN_UP.step((1 << 24) - 1), None);
    }

    #[test]
    fn a_rapid_move_runs_each_servo_at_full_speed() {
        let from = Position::from_units(1000, 1000, 1000);
        let to = Position::from_units(1400, 0, 0);
        let rapid = Rapid::new(from, to, PenLift::default(), 600);
        let start = inverse(from, PenLift::default());
        let at = rapid.angles_at(30_000);
        // 18 degrees in 30 ms, whatever the others do.
        assert_eq!(start.pen.get() - at.pen.get(), 18_000_000);
        assert_eq!((start.shoulder.get() - at.shoulder.get()).abs(), 18_000_000);
        assert_eq!(rapid.angles_at(rapid.duration().get() as u32), rapid.to);
    }

    prop_compose! {
        fn inside()(x in 700.0..1900.0, y in -1500.0..1500.0, z in 0.0..1000.0) -> Position {
            let bits = |value: f64| Coordinate::from_bits((value * 65536.0) as i32);
            let (position, _) = hold(Position { x: bits(x), y: bits(y), z: bits(z) });
            position
        }
    }

    proptest! {
        #[test]
        fn ends_are_exact_and_no_step_is_too_long(from in inside(), to in inside(), down in 1u8..=30, up in 1u8..=100) {
            let sizes = sizes(down, up);
            let line = Line::new(from, to, sizes);
            let size = sizes.between(from.z, to.z).bits() >> 8;
            prop_assert_eq!(line.straight(0), from);
            prop_assert_eq!(line.straight(line.steps * STEP_TIME), to);
            for step in 0..line.steps {
                let (a, b) = (line.straight(step * STEP_TIME), line.straight((step + 1) * STEP_TIME));
                for (a, b) in [(a.x, b.x), (a.y, b.y), (a.z, b.z)] {
                    // One unit in the last place for rounding the two ends, one for what typed numbers lose.
                    prop_assert!(a.bits().abs_diff(b.bits()) <= size + 2);
                }
            }
        }

        #[test]
        fn no_set_point_lies_outside(from in inside(), to in inside(), t in 0.0..1.0, rapid: bool) {
            let (duration, (point, _)) = if rapid {
                let rapid = Rapid::new(from, to, PenLift::default(), 600);
                let duration = rapid.duration().get();
                (duration, rapid.at((duration as f64 * t) as u32))
            } else {
                let line = Line::new(from, to, DEFAULT_STEPS);
                let duration = line.duration().get();
                (duration, line.at((duration as f64 * t) as u32))
            };
            let held = hold(point);
            // A rounded straight line may be a unit in the last place beyond; the machine holds it.
            prop_assert!(point.x.bits().abs_diff(held.0.x.bits()) <= 16, "{point:?} after {t} of {duration} us");
        }
    }
}
