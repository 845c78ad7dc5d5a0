//! Feeds and accelerations, and how fast the servos let the nib go.
//!
//! Inside the planner, a speed is a `u32` in 1/2^32 units a microsecond, its square a `u64` in 1/2^64
//! of the unit's square, a length a `u32` in a coordinate's last places, and an acceleration a `u32` in
//! 1/2^48 units a microsecond squared: twice acceleration times length is a square of a speed without
//! a shift.

use crate::motion::table::UNITS_PER_MILLIMETRE;

/// A feed or seek rate in 1/65536 mm a minute, always within [`LEAST_FEED`] and [`MOST_FEED`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Feed(u32);

/// The slowest feed, in mm a minute; what is slower is this. The longest way takes half an hour.
pub const LEAST_FEED: u16 = 6;
/// The fastest feed, in mm a minute; what is faster is this. Long before it, the servos' own speed
/// limits the arm.
pub const MOST_FEED: u16 = 30_000;

impl Feed {
    /// Until a host says something else, for seeking and feeding (`reference/lasaurgrbl.md`, section 5).
    pub const DEFAULT: Self = Self::new(8000);

    /// In mm a minute, limited.
    pub const fn new(mm_per_minute: u16) -> Self {
        Self::from_bits((mm_per_minute as i64) << 16)
    }

    /// In 1/65536 mm a minute, limited.
    pub const fn from_bits(bits: i64) -> Self {
        let (least, most) = ((LEAST_FEED as i64) << 16, (MOST_FEED as i64) << 16);
        Self(if bits < least {
            least as u32
        } else if bits > most {
            most as u32
        } else {
            bits as u32
        })
    }

    /// In 1/65536 mm a minute.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// In 1/2^32 units a microsecond.
    pub(super) const fn speed(self) -> u32 {
        const MICROSECONDS: u64 = 60_000_000;
        let rate = (self.0 as u64) << (32 - 16);
        (rate * UNITS_PER_MILLIMETRE as u64 / MICROSECONDS) as u32
    }
}

/// Along the way, in mm a second squared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Acceleration(u32);

impl Acceleration {
    /// Least, in mm a second squared: a ramp then takes ten seconds at most.
    pub const LEAST: u16 = 50;
    /// Most, in mm a second squared.
    pub const MOST: u16 = 10_000;

    /// In mm a second squared, limited to [`Self::LEAST`] and [`Self::MOST`].
    pub const fn new(mm_per_second_squared: u16) -> Self {
        let limited = if mm_per_second_squared < Self::LEAST {
            Self::LEAST
        } else if mm_per_second_squared > Self::MOST {
            Self::MOST
        } else {
            mm_per_second_squared
        };
        let units = limited as u128 * UNITS_PER_MILLIMETRE as u128;
        Self(((units << 48) / 1_000_000_000_000) as u32)
    }

    /// In 1/2^48 units a microsecond squared.
    pub(super) const fn bits(self) -> u32 {
        self.0
    }

    /// Twice the acceleration times a length: by how much the square of the speed can change over it.
    pub(super) const fn energy(self, length: u32) -> u64 {
        2 * self.0 as u64 * length as u64
    }
}

/// The speed up to which neither arm servo turns faster than `degrees_per_second` on the straight way
/// from `from` to `to`, in 1/65536 units.
///
/// With v the speed, phi turns at most v / r and `h = acos(r / 2000)` at most `v / sqrt(2000^2 - r^2)`, the
/// first for motion across, the second for motion along the radius; both servos turn by their sum or
/// difference, which for any direction is at most v times the root of the sum of their squares. Least
/// and largest r of the whole way are put in.
pub(super) fn servo_limit(from: [i32; 2], to: [i32; 2], degrees_per_second: u16) -> u32 {
    // In 1/16 units: squares are below 2^31.
    let [from, to] = [from, to].map(|point| point.map(|bits| i64::from(bits >> 12)));
    let dot = |a: [i64; 2], b: [i64; 2]| {
        let ([ax, ay], [bx, by]) = (a, b);
        ax * bx + ay * by
    };
    let way = {
        let ([ax, ay], [bx, by]) = (from, to);
        [bx - ax, by - ay]
    };
    let (square_from, square_to, square_way) = (dot(from, from), dot(to, to), dot(way, way));
    let nearest = if dot(from, way) < 0 && dot(to, way) > 0 {
        let ([ax, ay], [bx, by]) = (from, to);
        let across = (ax * by - ay * bx).unsigned_abs();
        across * across / square_way.unsigned_abs().max(1)
    } else {
        square_from.min(square_to).unsigned_abs()
    };
    let farthest = square_from.max(square_to).unsigned_abs();
    /// Of the square of a radius below 2000 units that is off by two sixteenths of one.
    const ROUNDING: u64 = 2 * 2 * 2000 * 16;
    const REACH: u64 = 2000 * 2000 * 256;
    let across = nearest.saturating_sub(ROUNDING).max(1);
    let along = REACH.saturating_sub(farthest + ROUNDING).max(1);
    // 1 / (1 / across + 1 / along), the square of a length in 1/16 units; 30 bits each.
    let square = across * along / (across + along);
    let length = (square << 24).isqrt();
    // `length` is in 1/2^16 units, a degree a second in 1/2^52 radians a microsecond.
    const DEGREE: u64 = (core::f64::consts::PI / 180e6 * (1u64 << 52) as f64) as u64;
    let limit = ((length * DEGREE) >> 16) * u64::from(degrees_per_second);
    (limit >> 20).min(u32::MAX.into()) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// 1/2^32 units a microsecond in mm a second.
    fn mm_per_second(speed: u32) -> f64 {
        f64::from(speed) / 4_294_967_296.0 * 1e6 / 20.0
    }

    #[test]
    fn feeds_are_speeds_and_are_limited() {
        for (feed, expected) in [
            (Feed::new(8000), 133.333_333),
            (Feed::from_bits(98_304_000), 25.0),
            (Feed::from_bits(0), 0.1),
            (Feed::from_bits(i64::MIN), 0.1),
            (Feed::from_bits(i64::MAX), 500.0),
        ] {
            let speed = mm_per_second(feed.speed());
            assert!(
                (speed - expected).abs() < expected * 2e-4,
                "{feed:?}: {speed}"
            );
        }
    }

    #[test]
    fn a_ramp_has_the_square_of_its_speed() {
        // 100 mm/s after 10 mm at 500 mm/s2, within the last places of both.
        let square = Acceleration::new(500).energy(200 << 16);
        let speed = mm_per_second(square.isqrt() as u32);
        assert!((speed - 100.0).abs() < 0.001, "{speed}");
    }

    proptest! {
        #[test]
        fn no_servo_is_faster_than_its_limit(
            from in (710.0..1710.0f64, -900.0..900.0f64), to in (710.0..1710.0f64, -900.0..900.0f64), t in 0.0..0.99,
        ) {
            let bits = |(x, y): (f64, f64)| [(x * 65536.0) as i32, (y * 65536.0) as i32];
            let length = (to.0 - from.0).hypot(to.1 - from.1);
            prop_assume!(length > 1.0);
            let speed = f64::from(servo_limit(bits(from), bits(to), 600)) / 4_294.967_296;
            let angles = |t: f64| {
                let (x, y) = (from.0 + (to.0 - from.0) * t, from.1 + (to.1 - from.1) * t);
                let (phi, h) = (y.atan2(x), (x.hypot(y) / 2000.0).acos());
                [(phi + h).to_degrees(), (phi - h).to_degrees()]
            };
            let (a, b, seconds) = (angles(t), angles(t + 0.01), 0.01 * length / speed);
            for (a, b) in a.iter().zip(b) {
                prop_assert!((a - b).abs() / seconds <= 600.0, "{} deg/s", (a - b).abs() / seconds);
            }
        }
    }

    #[test]
    fn a_short_way_is_limited_by_where_it_is() {
        // r = 1000: phi turns v / 1000, h turns v / sqrt(3e6).
        let point = |x: f64| [(x * 65536.0) as i32, 0];
        let speed = f64::from(servo_limit(point(1000.0), point(1000.01), 600)) / 4_294.967_296;
        let exact = 600f64.to_radians() / (1e-6 + 1.0 / 3e6_f64).sqrt();
        assert!((speed / exact - 1.0).abs() < 0.001, "{speed}, not {exact}");
    }
}
