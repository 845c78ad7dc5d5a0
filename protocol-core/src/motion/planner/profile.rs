//! The speed of one segment over time: it rises, cruises and falls.
//!
//! Times are in 1/256 us, and each part takes whole ones, rounded up; then the speed of the cruise is
//! chosen so that the parts add up to the length. So a segment ends exactly at its end, at the speed
//! with which the next one begins, and no ramp is steeper than the acceleration allows.

use super::feed::Acceleration;

/// A speed that changes steadily, away from the start for the rise, and seen from the end for the fall.
#[derive(Clone, Copy, Debug, Default)]
struct Ramp {
    /// Where it is slowest.
    speed: u32,
    /// In 1/2^48 units a microsecond squared.
    slope: u32,
}

impl Ramp {
    fn new(slow: u32, fast: u32, time: u32) -> Self {
        let gain = u64::from(fast.saturating_sub(slow));
        Self {
            speed: slow,
            // At most the acceleration, because times are rounded up.
            slope: ((gain << 24) / u64::from(time.max(1))) as u32,
        }
    }

    /// Distance and speed after a time.
    #[inline]
    fn at(self, time: u32) -> (u32, u32) {
        let gain = u64::from(self.slope) * u64::from(time);
        let mean = self.speed + (gain >> 25) as u32;
        let distance = (u64::from(mean) * u64::from(time)) >> 24;
        (distance as u32, self.speed + (gain >> 24) as u32)
    }
}

/// What a segment, or the rest of one, is to do.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task {
    /// How far of the segment lies behind already.
    pub(super) done: u32,
    /// Of the whole segment.
    pub(super) length: u32,
    /// Now.
    pub(super) entry: u32,
    /// Of the cruise.
    pub(super) nominal: u32,
    /// At the end.
    pub(super) exit: u32,
}

/// Distance and speed as functions of the time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Profile {
    length: u32,
    rise: Ramp,
    fall: Ramp,
    exit: u32,
    cruise: u32,
    /// Of the cruise, in 1/2^40 units a microsecond: it has to be good for half an hour.
    pace: u64,
    /// Distances: before the rise, after it.
    done: u32,
    risen: u32,
    /// Times: of the rise; until the fall; of all.
    rise_time: u32,
    fall_begins: u64,
    duration: u64,
}

impl Profile {
    /// The quickest one. The caller has made sure that entry and exit can be reached from one another;
    /// within the rounding of their squares, it does not matter.
    pub(super) fn new(task: Task, acceleration: Acceleration) -> Self {
        let Task {
            done,
            length,
            entry,
            nominal,
            exit,
        } = task;
        let rest = length.saturating_sub(done);
        let square = |speed: u32| u64::from(speed) * u64::from(speed);
        // Without a cruise the rise would end here.
        let highest = (square(entry) + square(exit) + acceleration.energy(rest)) / 2;
        let peak = (highest.isqrt() as u32).min(nominal).max(entry).max(exit);
        let ramp_time = |slow: u32| {
            let gain = u64::from(peak - slow) << 24;
            gain.div_ceil(acceleration.bits().into()) as u32
        };
        let (rise_time, fall_time) = (ramp_time(entry), ramp_time(exit));
        let ramps = (u64::from(entry) + u64::from(peak)) * u64::from(rise_time)
            + (u64::from(exit) + u64::from(peak)) * u64::from(fall_time);
        let left = (u64::from(rest) << 24).saturating_sub(ramps / 2);
        let cruise_time = left.div_ceil(peak.max(1).into());
        // Twice the length is (entry + cruise) * rise + 2 * cruise * time + (cruise + exit) * fall.
        let whole = u64::from(rise_time) + 2 * cruise_time + u64::from(fall_time);
        let ends = u64::from(entry) * u64::from(rise_time) + u64::from(exit) * u64::from(fall_time);
        let cruise = ((u64::from(rest) << 25).saturating_sub(ends) / whole.max(1)) as u32;
        let (rise, fall) = (
            Ramp::new(entry, cruise, rise_time),
            Ramp::new(exit, cruise, fall_time),
        );
        let risen = (done + rise.at(rise_time).0).min(length);
        let falls = length.saturating_sub(fall.at(fall_time).0).max(risen);
        let fall_begins = u64::from(rise_time) + cruise_time;
        Self {
            length,
            rise,
            fall,
            exit,
            cruise,
            pace: (u64::from(falls - risen) << 32) / cruise_time.max(1),
            done,
            risen,
            rise_time,
            fall_begins,
            duration: fall_begins + u64::from(fall_time),
        }
    }

    /// In 1/256 us.
    pub(super) const fn duration(&self) -> u64 {
        self.duration
    }

    /// How far of the segment lies behind, and the speed, after so many 1/256 us.
    #[inline]
    pub(super) fn at(&self, time: u64) -> (u32, u32) {
        if time >= self.duration {
            (self.length, self.exit)
        } else if time >= self.fall_begins {
            let (left, speed) = self.fall.at((self.duration - time) as u32);
            (self.length.saturating_sub(left), speed)
        } else if time >= self.rise_time.into() {
            // At most the length in 1/2^32.
            let along = self.pace.wrapping_mul(time - u64::from(self.rise_time)) >> 32;
            (self.risen + along as u32, self.cruise)
        } else {
            let (along, speed) = self.rise.at(time as u32);
            (self.done + along, speed)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::feed::Feed;
    use super::*;
    use proptest::prelude::*;

    const ACCELERATION: Acceleration = Acceleration::new(500);

    /// mm/s to 1/2^32 units a microsecond.
    fn speed(mm_per_second: f64) -> u32 {
        (mm_per_second * 20.0 * 4_294.967_296) as u32
    }

    fn seconds(time: u64) -> f64 {
        time as f64 / 256e6
    }

    fn millimetres(length: u32) -> f64 {
        f64::from(length) / 65536.0 / 20.0
    }

    fn task(length: f64, entry: f64, nominal: f64, exit: f64) -> Task {
        Task {
            done: 0,
            length: (length * 20.0 * 65536.0) as u32,
            entry: speed(entry),
            nominal: speed(nominal),
            exit: speed(exit),
        }
    }

    #[test]
    fn times_of_textbook_profiles() {
        for (name, task, expected) in [
            // 10 mm each to rise and fall at 500 mm/s2, 80 mm at 100 mm/s.
            ("trapezoid", task(100.0, 0.0, 100.0, 0.0), 0.2 + 0.8 + 0.2),
            // Rises to sqrt(500 * 10) mm/s.
            (
                "triangle",
                task(10.0, 0.0, 100.0, 0.0),
                2.0 * 5000f64.sqrt() / 500.0,
            ),
            ("steady", task(25.0, 50.0, 50.0, 50.0), 0.5),
            ("rise alone", task(10.0, 0.0, 100.0, 100.0), 0.2),
            ("fall alone", task(10.0, 100.0, 100.0, 0.0), 0.2),
            ("nothing", task(0.0, 0.0, 100.0, 0.0), 0.0),
        ] {
            let took = seconds(Profile::new(task, ACCELERATION).duration());
            assert!(
                (took - expected).abs() < 2e-6,
                "{name}: {took} s, not {expected} s"
            );
        }
    }

    #[test]
    fn the_slowest_feed_over_the_longest_way_is_exact_and_even() {
        let task = Task {
            nominal: Feed::from_bits(0).speed(),
            ..task(190.0, 0.0, 0.0, 0.0)
        };
        let profile = Profile::new(task, ACCELERATION);
        let half = millimetres(profile.at(profile.duration() / 2).0);
        assert!((half - 95.0).abs() < 0.001, "{half}");
        let (almost, _) = profile.at(profile.duration() - 256);
        assert!(millimetres(task.length - almost) < 0.001);
    }

    proptest! {
        #[test]
        fn it_goes_steadily_from_end_to_end(
            length in 0.001..150.0f64, entry in 0.0..1.0f64, exit in 0.0..1.0f64, nominal in 0.2..400.0f64,
        ) {
            // Entry and exit that can be reached from one another.
            let reach = |from: f64| (from * from + 2.0 * 500.0 * length).sqrt();
            let entry = (entry * nominal).min(nominal);
            let exit = (exit * nominal).min(reach(entry));
            let entry = entry.min(reach(exit));
            let task = task(length, entry, nominal, exit);
            let profile = Profile::new(task, ACCELERATION);
            let duration = profile.duration();
            prop_assert_eq!(profile.at(duration), (task.length, task.exit));
            let mut last = profile.at(0);
            // Last places of speed and slope over the longest ramp, 0.8 s: 0.1 um.
            let rounding_of_ramps = 128;
            prop_assert!(last.0 <= rounding_of_ramps);
            let pieces = 200;
            for piece in 1..=pieces {
                let (distance, now) = profile.at(duration * piece / pieces);
                prop_assert!(distance <= task.length);
                prop_assert!(distance + rounding_of_ramps >= last.0, "back from {} to {distance}", last.0);
                prop_assert!(now <= task.nominal.max(task.exit));
                let most = 500.0 * seconds(duration) / pieces as f64 + nominal * 1e-3 + 0.01;
                let change = (f64::from(now) - f64::from(last.1)).abs() / 85_899.345_92;
                prop_assert!(change <= most, "{change} mm/s, {most} at most");
                let mean = millimetres(distance.saturating_sub(last.0)) / seconds(duration) * pieces as f64;
                let between = (f64::from(now) + f64::from(last.1)) / 2.0 / 85_899.345_92;
                let rounding = millimetres(rounding_of_ramps) / seconds(duration) * pieces as f64;
                prop_assert!((mean - between).abs() <= most + rounding, "{mean} mm/s, not {between}");
                last = (distance, now);
            }
        }
    }
}
