//! The arm's geometry in single precision, as it would be written with a maths library (formulas: `reference/arm.md`).

use micromath::F32Ext;

/// Length of both links together, in units.
const REACH: f32 = 2000.0;
const DEGREES: f32 = 180.0 / core::f32::consts::PI;
/// Pulse in us at 0 degrees, and us for each degree.
const PULSE: (f32, f32) = (500.0, 2000.0 / 180.0);
/// Stand-in for a calibration, in degrees; measured as a run-time value.
static CALIBRATION: [f32; 3] = [0.0; 3];

/// Shoulder and elbow in degrees, with `libm`.
pub fn inverse_libm(&[x, y, _]: &[f32; 3]) -> [f32; 2] {
    let phi = libm::atan2f(y, x);
    let h = libm::acosf(libm::sqrtf(x * x + y * y) / REACH);
    [(phi + h) * DEGREES + 45.0, 45.0 - (phi - h) * DEGREES]
}

/// Shoulder and elbow in degrees, with `micromath`.
pub fn inverse_micromath(&[x, y, _]: &[f32; 3]) -> [f32; 2] {
    let phi = F32Ext::atan2(y, x);
    let h = F32Ext::acos(F32Ext::sqrt(x * x + y * y) / REACH);
    [(phi + h) * DEGREES + 45.0, 45.0 - (phi - h) * DEGREES]
}

/// One step of the way from home to `target`: interpolation, drawing area, kinematics, calibration, pulse widths in us.
pub fn set_point_libm(target: &[f32; 3]) -> Option<[f32; 3]> {
    const HOME: [f32; 3] = [1000.0; 3];
    let part = core::hint::black_box(1.0_f32);
    let [x, y, z]: [f32; 3] =
        core::array::from_fn(|axis| HOME[axis] + (target[axis] - HOME[axis]) * part);
    let [shoulder, elbow] = inverse_libm(&[x, y, z]);
    let inside = x * x + y * y <= 1950.0 * 1950.0
        && x >= if y >= 0.0 { 500.0 } else { 700.0 }
        && shoulder >= 10.0
        && elbow >= 10.0;
    let pen = 135.0 - 45.0 * (1000.0 - z) / 1000.0;
    let offsets = core::hint::black_box(&CALIBRATION);
    let angles = [shoulder, elbow, pen];
    inside
        .then(|| core::array::from_fn(|servo| PULSE.0 + (angles[servo] + offsets[servo]) * PULSE.1))
}
