//! Inverse and forward kinematics of the parallelogram arm (`reference/arm.md`).
//!
//! Upper link and forearm are 1000 units each. With r the distance of the nib from the shoulder, phi
//! its direction and `h = acos(r / 2000)`, the upper link points to `t1 = phi + h` and the forearm to
//! `t2 = phi - h`; the servos stand at `S = t1 + 45 deg` and `E = 45 deg - t2`.

use super::tables::{ATAN, HALF_ELBOW, SINE, high_half};
use crate::motion::{Coordinate, HOME, Microdegrees, PEN_DOWN, PEN_UP, Position};

/// Length of upper link and forearm, in drawing units.
pub(crate) const LINK: i32 = 1000;
/// S when the upper link points along x.
const SHOULDER_AT_ZERO: Microdegrees = Microdegrees::from_degrees(45);
/// E when the forearm points along x.
const FOREARM_AT_ZERO: Microdegrees = Microdegrees::from_degrees(45);
const RIGHT_ANGLE: i32 = 90_000_000;

/// The angles of the three servos.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Angles {
    /// S: carries the upper link.
    pub shoulder: Microdegrees,
    /// E: sets the forearm's absolute direction through the parallelogram.
    pub elbow: Microdegrees,
    /// P: lifts the pen.
    pub pen: Microdegrees,
}

impl Angles {
    /// In the order shoulder, elbow, pen.
    pub const fn to_array(self) -> [Microdegrees; 3] {
        [self.shoulder, self.elbow, self.pen]
    }

    /// From the order shoulder, elbow, pen.
    pub const fn from_array([shoulder, elbow, pen]: [Microdegrees; 3]) -> Self {
        Self {
            shoulder,
            elbow,
            pen,
        }
    }

    /// Each angle of one with the same of the other.
    pub(crate) fn zip(
        self,
        other: Self,
        f: impl Fn(Microdegrees, Microdegrees) -> Microdegrees,
    ) -> Self {
        Self {
            shoulder: f(self.shoulder, other.shoulder),
            elbow: f(self.elbow, other.elbow),
            pen: f(self.pen, other.pen),
        }
    }
}

/// Where the servos stand at home: `ok S:135.00 E:45.00 P:135.00` on a real machine.
pub const HOME_ANGLES: Angles = Angles {
    shoulder: Microdegrees::from_degrees(135),
    elbow: Microdegrees::from_degrees(45),
    pen: Microdegrees::from_degrees(135),
};

/// How the pen servo's angle follows Z: a straight line between its two ends.
#[derive(Clone, Copy, Debug)]
pub struct PenLift {
    down: Microdegrees,
    /// Microdegrees a unit of Z, in 1/4096.
    slope: i32,
}

impl PenLift {
    /// The servo's angle at Z = 0, with 135 degrees at Z = 1000 (`reference/arm.md`, pen servo).
    pub const fn new(at_z_0: Microdegrees) -> Self {
        let travel = HOME_ANGLES.pen.get() as i64 - at_z_0.get() as i64;
        Self {
            down: at_z_0,
            slope: (travel * 4096 / 1000) as i32,
        }
    }

    /// The servo's angle at a Z of -1000 to 1000.
    pub(crate) fn angle(self, z: Coordinate) -> Microdegrees {
        if z == PEN_UP {
            return HOME_ANGLES.pen;
        }
        // 1/65536 units (26 bits) times 2^4 times 1/4096 microdegrees, without the lower 32 bits.
        Microdegrees::new(self.down.get() + high_half(z.bits() << 4, self.slope))
    }

    /// How fast Z changes when the servo turns at so many degrees a second, in 1/65536 units a
    /// microsecond.
    pub(crate) fn rate(self, degrees_per_second: u16) -> u32 {
        // Degrees a second are microdegrees a microsecond.
        let turned = u64::from(degrees_per_second) << (12 + Coordinate::FRACTION_BITS);
        let rate = turned / u64::from(self.slope.unsigned_abs().max(1));
        rate.min(u32::MAX.into()) as u32
    }

    /// The Z at which the servo stands so, from -1000 to 1000.
    pub(crate) fn height(self, pen: Microdegrees) -> Coordinate {
        if self.slope == 0 {
            return PEN_UP;
        }
        let raised = i64::from(pen.get()) - i64::from(self.down.get());
        let bits = (raised << 28) / i64::from(self.slope);
        let most = i64::from(PEN_UP.bits());
        Coordinate::from_bits(bits.clamp(-most, most) as i32)
    }
}

impl Default for PenLift {
    /// 90 degrees at Z = 0.
    fn default() -> Self {
        Self::new(Microdegrees::from_degrees(90))
    }
}

/// Servo angles that put the nib at `position`, which lies inside the drawing area.
///
/// Within 0.0003 degrees of the exact angles there, that is 0.003 us of a 2000 us servo. Elsewhere
/// the result is some angle, never a panic.
#[inline]
pub fn inverse(position: Position, lift: PenLift) -> Angles {
    let (direction, half_elbow) = polar(position.x.bits(), position.y.bits());
    Angles {
        shoulder: Microdegrees::new(SHOULDER_AT_ZERO.get() + direction + half_elbow),
        elbow: Microdegrees::new(FOREARM_AT_ZERO.get() - direction + half_elbow),
        pen: lift.angle(position.z),
    }
}

/// phi and h of a point, in microdegrees.
#[inline]
fn polar(x: i32, y: i32) -> (i32, i32) {
    let square = square_of(x).wrapping_add(square_of(y));
    let half_elbow = HALF_ELBOW.at(square >> 23, square << 8);

    let (across, along) = (y.unsigned_abs() >> 5, x.unsigned_abs() >> 5);
    let steep = across > along;
    let (short, long) = if steep {
        (along, across)
    } else {
        (across, along)
    };
    // short / long in 20 bits by two divisions of 32 bits; both are below 2^22.
    let long = long.max(1);
    let upper = (short << 10) / long;
    let lower = (((short << 10) - upper * long) << 10) / long;
    let ratio = (upper << 10).wrapping_add(lower);
    let angle = ATAN.at(ratio >> 14, ratio << 17);
    let angle = if steep { RIGHT_ANGLE - angle } else { angle };
    (if y < 0 { -angle } else { angle }, half_elbow)
}

/// The square of a coordinate in 1/65536 units, in 1/256 square units.
#[inline]
pub(crate) const fn square_of(bits: i32) -> u32 {
    high_half(bits << 4, bits << 4).cast_unsigned()
}

/// Where the nib is when the servos stand at `angles`, within 0.001 units; Z is limited to 0..=1000.
pub fn forward(angles: Angles, lift: PenLift) -> Position {
    let bare = bare_forward(angles, lift);
    Position {
        z: bare.z.max(PEN_DOWN),
        ..bare
    }
}

/// The same with the pen as low as its servo has it, down to Z = -1000.
pub(crate) fn bare_forward(angles: Angles, lift: PenLift) -> Position {
    let (upper, forearm) = joint_directions(angles);
    let (x1, y1) = link_end(upper);
    let (x2, y2) = link_end(forearm);
    Position {
        x: Coordinate::from_bits(x1 + x2),
        y: Coordinate::from_bits(y1 + y2),
        z: lift.height(angles.pen),
    }
}

/// Directions of upper link and forearm, t1 and t2.
fn joint_directions(angles: Angles) -> (Microdegrees, Microdegrees) {
    (
        angles.shoulder - SHOULDER_AT_ZERO,
        FOREARM_AT_ZERO - angles.elbow,
    )
}

/// `1000 cos`, `1000 sin` in 1/65536 units.
fn link_end(direction: Microdegrees) -> (i32, i32) {
    (
        sine(direction.get().saturating_add(RIGHT_ANGLE)),
        sine(direction.get()),
    )
}

fn sine(angle: i32) -> i32 {
    let turned = angle.rem_euclid(4 * RIGHT_ANGLE);
    let (half, within) = (turned / (2 * RIGHT_ANGLE), turned % (2 * RIGHT_ANGLE));
    let rising = if within > RIGHT_ANGLE {
        2 * RIGHT_ANGLE - within
    } else {
        within
    };
    // A right angle is 2^26 here: 64 segments of 20 bits. 3_202_559_735 = 2^58 / 90_000_000.
    let scaled = ((u64::from(rising.unsigned_abs()) * 3_202_559_735) >> 32) as u32;
    let value = SINE.at(scaled >> 20, scaled << 11);
    if half == 1 { -value } else { value }
}

const _: () = assert!(HOME.x.bits() == LINK << 16 && HOME.y.bits() == LINK << 16);

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(name: &str, actual: f64, expected: f64, tolerance: f64) {
        let off = (actual - expected).abs();
        assert!(
            off <= tolerance,
            "{name}: {actual}, expected {expected}, off by {off}"
        );
    }

    #[test]
    fn home_is_what_a_real_machine_says() {
        let angles = inverse(HOME, PenLift::default());
        assert_near("S", angles.shoulder.to_f64(), 135.0, 3e-4);
        assert_near("E", angles.elbow.to_f64(), 45.0, 3e-4);
        assert_eq!(angles.pen, HOME_ANGLES.pen);
    }

    #[test]
    fn both_servos_are_centred_straight_ahead() {
        let x = Coordinate::from_bits((2e6_f64.sqrt() * 65536.0).round() as i32);
        let angles = inverse(
            Position {
                x,
                ..Position::default()
            },
            PenLift::default(),
        );
        assert_near("S", angles.shoulder.to_f64(), 90.0, 3e-4);
        assert_near("E", angles.elbow.to_f64(), 90.0, 3e-4);
        assert_near("P", angles.pen.to_f64(), 90.0, 2e-6);
    }

    #[test]
    fn forward_puts_the_links_end_to_end() {
        let home = forward(HOME_ANGLES, PenLift::default());
        assert_near("x", home.x.to_f64(), 1000.0, 1e-3);
        assert_near("y", home.y.to_f64(), 1000.0, 1e-3);
        assert_eq!(home.z, PEN_UP);
    }

    #[test]
    fn sine_is_right_all_around_the_circle() {
        for degrees in -720..=720 {
            let exact = f64::from(degrees).to_radians().sin() * 65_536_000.0;
            assert_near(
                "1000 sin",
                f64::from(sine(degrees * 1_000_000)),
                exact,
                16.0,
            );
        }
    }

    #[test]
    fn no_angle_and_no_point_makes_it_panic() {
        for bits in [i32::MIN, i32::MIN / 2, -1, 0, 1, i32::MAX / 2, i32::MAX] {
            let angle = Microdegrees::new(bits);
            let _ = forward(Angles::from_array([angle; 3]), PenLift::default());
        }
    }
}
