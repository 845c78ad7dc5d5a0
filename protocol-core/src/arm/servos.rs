//! From angles to pulses: calibration offsets, then the pulse range of each servo.

use super::kinematics::Angles;
use super::tables::high_half;
use crate::motion::{Microdegrees, PulseWidth};

/// Set-points of the three servos: shoulder, elbow, pen.
pub type Pulses = [PulseWidth; 3];

/// The pulses a servo understands; board data (`reference/arm.md`, servos).
///
/// A servo that turns the other way has the longer pulse at 0 degrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServoRange {
    at_0: PulseWidth,
    at_180: PulseWidth,
    /// Tenths of a nanosecond a microdegree, in 1/2^32.
    slope: i32,
}

impl ServoRange {
    /// Pulses at 0 and at 180 degrees.
    pub const fn new(at_0: PulseWidth, at_180: PulseWidth) -> Self {
        let span = at_180.get() as i64 - at_0.get() as i64;
        Self {
            at_0,
            at_180,
            // Rounded up, because the product below is rounded down: whole degrees come out exact.
            slope: -((-(span << 32)).div_euclid(FULL_TURN as i64)) as i32,
        }
    }

    /// The range of the same servo, built in the other way around: it mirrors at 90 degrees.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        Self::new(self.at_180, self.at_0)
    }

    /// The pulse for an angle; beyond 0..=180 degrees the nearest one in range.
    #[inline]
    pub fn pulse(self, angle: Microdegrees) -> PulseWidth {
        let angle = angle.get();
        if angle >= FULL_TURN {
            return self.at_180;
        }
        let turned = high_half(angle.max(0), self.slope);
        PulseWidth::new(self.at_0.get().wrapping_add_signed(turned))
    }

    /// The angle of a pulse, the inverse of [`Self::pulse`]; for pictures and diagnostics.
    pub fn angle(self, pulse: PulseWidth) -> Microdegrees {
        if self.slope == 0 {
            return Microdegrees::default();
        }
        let turned = i64::from(pulse.get()) - i64::from(self.at_0.get());
        Microdegrees::new(((turned << 32) / i64::from(self.slope)) as i32)
    }
}

/// What a hobby servo can turn.
const FULL_TURN: i32 = 180_000_000;

impl Default for ServoRange {
    /// 500 us at 0 degrees, 2500 us at 180 degrees.
    fn default() -> Self {
        Self::new(PulseWidth::from_micros(500), PulseWidth::from_micros(2500))
    }
}

/// Which servos turn the other way than the board says, set by `M280` (`reference/line-us.md`, section 5).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Directions {
    /// Shoulder, elbow, pen: `true` turns the other way.
    pub reversed: [bool; 3],
}

impl Directions {
    /// For the settings: a bit for each servo.
    pub fn to_byte(self) -> u8 {
        let [shoulder, elbow, pen] = self.reversed.map(u8::from);
        shoulder | elbow << 1 | pen << 2
    }

    /// What [`Self::to_byte`] made.
    pub fn from_byte(byte: u8) -> Option<Self> {
        (byte < 8).then_some(Self {
            reversed: [1, 2, 4].map(|bit| byte & bit != 0),
        })
    }
}

/// Offsets between where the servos have to be told to go and where the model wants them, set by
/// `M374` (`spec 1.0.4a, M374`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Calibration {
    /// Added to the model's angles.
    pub offsets: Angles,
}

impl Calibration {
    /// Length of [`Self::to_bytes`].
    pub const BYTES: usize = 12;

    /// What to tell the servos so that they stand where the model wants them.
    #[inline]
    pub fn apply(self, model: Angles) -> Angles {
        model.zip(self.offsets, |model, offset| model + offset)
    }

    /// Where servos that were told `told` stand in the model.
    pub fn remove(self, told: Angles) -> Angles {
        told.zip(self.offsets, |told, offset| told - offset)
    }

    /// The calibration by which servos that were told `told` stand at `model`.
    pub fn between(told: Angles, model: Angles) -> Self {
        Self {
            offsets: told.zip(model, |told, model| told - model),
        }
    }

    /// For the settings: three little-endian counts of microdegrees.
    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let [[a, b, c, d], [e, f, g, h], [i, j, k, l]] = self
            .offsets
            .to_array()
            .map(|angle| angle.get().to_le_bytes());
        [a, b, c, d, e, f, g, h, i, j, k, l]
    }

    /// What [`Self::to_bytes`] made.
    pub fn from_bytes([a, b, c, d, e, f, g, h, i, j, k, l]: [u8; Self::BYTES]) -> Self {
        let angles = [[a, b, c, d], [e, f, g, h], [i, j, k, l]];
        Self {
            offsets: Angles::from_array(
                angles.map(|bytes| Microdegrees::new(i32::from_le_bytes(bytes))),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulses_span_the_range_and_stay_in_it() {
        let range = ServoRange::default();
        for (degrees, micros) in [
            (0, 500),
            (45, 1000),
            (90, 1500),
            (135, 2000),
            (180, 2500),
            (-30, 500),
            (200, 2500),
        ] {
            let pulse = range.pulse(Microdegrees::from_degrees(degrees)).get();
            assert!(
                pulse.abs_diff(micros * 10_000) <= 1,
                "{degrees} deg: {pulse}"
            );
        }
    }

    #[test]
    fn a_reversed_servo_counts_down() {
        let range = ServoRange::new(PulseWidth::from_micros(2400), PulseWidth::from_micros(600));
        assert_eq!(
            range.pulse(Microdegrees::from_degrees(0)),
            PulseWidth::from_micros(2400)
        );
        assert!(
            range
                .pulse(Microdegrees::from_degrees(90))
                .get()
                .abs_diff(15_000_000)
                <= 1
        );
        assert_eq!(
            range.pulse(Microdegrees::from_degrees(190)),
            PulseWidth::from_micros(600)
        );
    }

    #[test]
    fn a_mirrored_servo_mirrors_at_90_degrees() {
        let range = ServoRange::new(PulseWidth::from_micros(600), PulseWidth::from_micros(2400));
        for degrees in 0..=180 {
            let angle = Microdegrees::from_degrees(degrees);
            let mirrored = Microdegrees::from_degrees(180 - degrees);
            let (there, here) = (range.mirrored().pulse(angle), range.pulse(mirrored));
            assert!(
                there.get().abs_diff(here.get()) <= 1,
                "{degrees} deg: {there:?}, not {here:?}"
            );
        }
        assert_eq!(range.mirrored().mirrored(), range);
    }

    #[test]
    fn directions_survive_their_byte() {
        for byte in 0..8 {
            assert_eq!(
                Directions::from_byte(byte).map(Directions::to_byte),
                Some(byte)
            );
        }
        assert_eq!(Directions::from_byte(8), None);
        let elbow = Directions {
            reversed: [false, true, false],
        };
        assert_eq!(elbow.to_byte(), 2);
    }

    #[test]
    fn pulses_and_angles_are_each_others_inverse() {
        for range in [
            ServoRange::default(),
            ServoRange::new(PulseWidth::from_micros(2400), PulseWidth::from_micros(600)),
        ] {
            for degrees in 0..=180 {
                let angle = Microdegrees::from_degrees(degrees);
                let back = range.angle(range.pulse(angle));
                assert!(
                    back.get().abs_diff(angle.get()) <= 20,
                    "{degrees}: {back:?}"
                );
            }
        }
    }

    #[test]
    fn calibration_survives_its_bytes() {
        let calibration = Calibration {
            offsets: Angles::from_array([-1_902_405, 10_797_350, i32::MIN].map(Microdegrees::new)),
        };
        assert_eq!(Calibration::from_bytes(calibration.to_bytes()), calibration);
    }
}
