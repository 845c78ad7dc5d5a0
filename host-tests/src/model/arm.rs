//! Kinematics and servo pulses (`reference/arm.md`, "Inverse kinematics", "Pen servo", "Servos").

/// Length of the upper link and of the forearm.
pub const LINK: f64 = 1000.0;
pub const HOME: [f64; 3] = [1000.0, 1000.0, 1000.0];

/// Servo angles \[S, E, P\] in degrees that put the pen at (x, y, z). NaN beyond the arm's reach of 2000.
pub fn inverse(x: f64, y: f64, z: f64) -> [f64; 3] {
    let r = x.hypot(y);
    let phi = y.atan2(x).to_degrees();
    let h = (r / (2.0 * LINK)).acos().to_degrees();
    let t1 = phi + h;
    let t2 = phi - h;
    [t1 + 45.0, 45.0 - t2, 135.0 - 45.0 * (1000.0 - z) / 1000.0]
}

/// Where the pen is when the servos stand at these angles, in degrees.
pub fn forward(angles: [f64; 3]) -> [f64; 3] {
    let [s, e, p] = angles;
    let t1 = (s - 45.0).to_radians();
    let t2 = (45.0 - e).to_radians();
    [
        LINK * (t1.cos() + t2.cos()),
        LINK * (t1.sin() + t2.sin()),
        1000.0 - (135.0 - p) * 1000.0 / 45.0,
    ]
}

/// Pulse width in microseconds: 500..2500 over 0..180 degrees, limited to that range.
pub fn pulse(angle: f64) -> f64 {
    (500.0 + 2000.0 * angle / 180.0).clamp(500.0, 2500.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(got: [f64; 3], want: [f64; 3], tolerance: f64) {
        assert!(
            (0..3).all(|i| (got[i] - want[i]).abs() <= tolerance),
            "{got:?}, not {want:?}"
        );
    }

    #[test]
    fn home_and_centre() {
        assert_near(inverse(1000.0, 1000.0, 1000.0), [135.0, 45.0, 135.0], 1e-9);
        assert_near(inverse(1414.2136, 0.0, 0.0), [90.0, 90.0, 90.0], 1e-5);
        assert_near(
            [135.0, 45.0, 90.0].map(pulse),
            [2000.0, 1000.0, 1500.0],
            1e-9,
        );
        assert_eq!([-1.0, 0.0, 181.0].map(pulse), [500.0, 500.0, 2500.0]);
    }

    #[test]
    fn forward_undoes_inverse() {
        let mut points = 0;
        for x in (500..=1950).step_by(10) {
            for y in (-1600..=1600).step_by(10) {
                let p = [f64::from(x), f64::from(y), f64::from(x - 500) / 1.45];
                if super::super::inside(p[0], p[1]) {
                    assert_near(forward(inverse(p[0], p[1], p[2])), p, 1e-9);
                    points += 1;
                }
            }
        }
        assert!(points > 30_000, "{points}");
    }
}
