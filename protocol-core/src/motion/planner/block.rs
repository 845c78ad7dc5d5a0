//! One segment in the plan: where it leads, and how fast it may be.

use super::super::table::{Side, TablePoint};
use super::super::units::{Coordinate, Micros};
use super::assist::Switches;
use super::feed::{Acceleration, Feed, servo_limit};
use super::pen::Intensity;

/// A straight way on the table (G0, G1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Where it ends, from physical home, all offsets included.
    pub to: TablePoint,
    /// How fast it is to be.
    pub feed: Feed,
    /// Off for a seek, and for a feed with S0.
    pub intensity: Intensity,
}

/// Longest dwell, an hour; what is longer is this.
pub const MOST_DWELL: Micros = Micros::from_secs(3600);

/// A place on the paper.
pub(super) type Place = (Coordinate, Coordinate);

/// A segment, a dwell, or both at once with its length or its dwell zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) from: Place,
    pub(super) to: Place,
    /// The way's direction, in 1/2^30.
    pub(super) unit: [i32; 2],
    pub(super) length: u32,
    pub(super) feed: Feed,
    /// The feed, or what the servos allow.
    pub(super) nominal: u32,
    /// Largest square of the speed at its start, by nominal speeds and the junction.
    pub(super) most_entry: u64,
    /// Square of the speed at its start.
    pub(super) entry: u64,
    /// By how much the square of the speed can change over its length.
    pub(super) energy: u64,
    pub(super) intensity: Intensity,
    pub(super) dwell: Micros,
    /// It ends where its way leaves the table.
    pub(super) leaves: Option<Side>,
    /// What is switched when it has been done.
    pub(super) then: Switches,
}

/// What limits the speed of all blocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) acceleration: Acceleration,
    /// Acceleration times deviation, a square of a speed.
    pub(super) junction: u64,
    pub(super) degrees_per_second: u16,
}

impl Block {
    pub(super) fn segment(
        from: Place,
        to: Place,
        feed: Feed,
        intensity: Intensity,
        limits: &Limits,
    ) -> Self {
        let (start, end) = (bits(from), bits(to));
        let way = [0, 1].map(|axis: usize| {
            let of = |place: [i32; 2]| i64::from(*place.get(axis).unwrap_or(&0));
            of(end) - of(start)
        });
        let [x, y] = way;
        let length = (x * x + y * y).cast_unsigned().isqrt() as u32;
        let unit = |along: i64| ((along << 30) / i64::from(length.max(1))) as i32;
        Self {
            from,
            to,
            unit: way.map(unit),
            length,
            feed,
            nominal: feed
                .speed()
                .min(servo_limit(start, end, limits.degrees_per_second)),
            most_entry: 0,
            entry: 0,
            energy: limits.acceleration.energy(length),
            intensity,
            dwell: Micros::default(),
            leaves: None,
            then: Switches::default(),
        }
    }

    pub(super) fn dwell(at: Place, dwell: Micros, intensity: Intensity) -> Self {
        Self {
            from: at,
            to: at,
            unit: [0; 2],
            length: 0,
            feed: Feed::DEFAULT,
            nominal: 0,
            most_entry: 0,
            entry: 0,
            energy: 0,
            intensity,
            dwell: dwell.min(MOST_DWELL),
            leaves: None,
            then: Switches::default(),
        }
    }

    /// The same segment from somewhere else.
    pub(super) fn begun_at(self, from: Place, limits: &Limits) -> Self {
        Self {
            dwell: self.dwell,
            leaves: self.leaves,
            then: self.then,
            ..Self::segment(from, self.to, self.feed, self.intensity, limits)
        }
    }

    pub(super) const fn is_nothing(&self) -> bool {
        self.length == 0 && self.dwell.get() == 0
    }

    /// Square of the speed at which the way may go over from `prior` into this block.
    pub(super) fn junction_with(&self, prior: &Self, limits: &Limits) -> u64 {
        // The pen comes down or up in between, or something rests there.
        let stops = self.intensity.is_off() != prior.intensity.is_off()
            || prior.dwell.get() > 0
            || self.length == 0
            || prior.length == 0;
        if stops {
            return 0;
        }
        let nominal = u64::from(self.nominal.min(prior.nominal));
        let junction = junction_speed(prior.unit, self.unit, limits.junction);
        (nominal * nominal).min(junction)
    }
}

fn bits((x, y): Place) -> [i32; 2] {
    [x.bits(), y.bits()]
}

/// Square of the speed at which a corner may be passed, so that an arc that is touched by both ways and
/// stays within the junction deviation of the corner would be driven at the acceleration: with s
/// the sine of half the angle between the ways, acceleration * deviation * s / (1 - s).
fn junction_speed(prior: [i32; 2], next: [i32; 2], acceleration_times_deviation: u64) -> u64 {
    let ([ax, ay], [bx, by]) = (prior.map(i64::from), next.map(i64::from));
    // The cosine of the turn, in 1/2^30; -1 turns back.
    let cosine = ((ax * bx + ay * by) >> 30).clamp(-(1 << 30), 1 << 30);
    let sine = (((1 << 30) + cosine).cast_unsigned() << 29).isqrt();
    // In 1/2^24: the product stays within 64 bits.
    let sine = sine >> 6;
    match (1u64 << 24).saturating_sub(sine) {
        0 => u64::MAX,
        rest => acceleration_times_deviation.saturating_mul(sine) / rest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits {
        acceleration: Acceleration::new(500),
        // 0.006 mm are 0.12 units.
        junction: Acceleration::new(500).energy(7_864) / 2,
        degrees_per_second: 600,
    };

    fn place(x: f64, y: f64) -> Place {
        let bits = |value: f64| Coordinate::from_bits((value * 65536.0).round() as i32);
        (bits(x), bits(y))
    }

    fn block(from: Place, to: Place) -> Block {
        Block::segment(from, to, Feed::DEFAULT, Intensity(255), &LIMITS)
    }

    fn mm_per_second(square: u64) -> f64 {
        (square as f64).sqrt() / 85_899.345_92
    }

    #[test]
    fn corners_have_their_speeds() {
        let corner = place(1200.0, 0.0);
        let first = block(place(1000.0, 0.0), corner);
        for (name, to, expected) in [
            ("straight on", place(1400.0, 0.0), 133.333),
            // sqrt(500 * 0.006 * s / (1 - s)) with s = cos(turn / 2).
            ("a quarter turn", place(1200.0, 200.0), 2.6912),
            ("to the other side", place(1200.0, -200.0), 2.6912),
            ("60 degrees", place(1300.0, 173.205), 4.4028),
            ("back", place(1000.0, 0.0), 0.0),
        ] {
            let found = mm_per_second(block(corner, to).junction_with(&first, &LIMITS));
            assert!(
                (found - expected).abs() < 0.003,
                "{name}: {found}, not {expected}"
            );
        }
    }

    #[test]
    fn the_pen_and_dwells_need_a_stop() {
        let (a, b, c) = (place(1000.0, 0.0), place(1100.0, 0.0), place(1200.0, 0.0));
        let (first, mut second) = (block(a, b), block(b, c));
        assert!(second.junction_with(&first, &LIMITS) > 0);
        assert_eq!(
            second.junction_with(&Block::dwell(b, Micros::new(1), Intensity(255)), &LIMITS),
            0
        );
        second.intensity = Intensity(3);
        assert!(second.junction_with(&first, &LIMITS) > 0);
        second.intensity = Intensity::OFF;
        assert_eq!(second.junction_with(&first, &LIMITS), 0);
    }

    proptest! {
        #[test]
        fn a_turn_is_as_fast_as_its_arc(turn in 0.02..3.1f64, left: bool, direction in 0.0..6.2f64) {
            let unit = |angle: f64| [angle.cos(), angle.sin()].map(|part| (part * (1i64 << 30) as f64) as i32);
            let sign = if left { 1.0 } else { -1.0 };
            let found = mm_per_second(junction_speed(unit(direction), unit(direction + sign * turn), LIMITS.junction));
            let s = (turn / 2.0).cos();
            let expected = (500.0 * 0.006 * s / (1.0 - s)).sqrt();
            prop_assert!((found / expected - 1.0).abs() < 0.002, "{found}, not {expected}");
        }
    }
}
