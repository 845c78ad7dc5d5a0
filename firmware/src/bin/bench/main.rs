//! What the core's work costs on this instruction set, and what the usual libraries take for the same:
//! `name;instructions`, one line each, on the serial port.
//!
//! Run under `-icount shift=0`; nothing here sleeps, so `minstret` counts instructions exactly.
#![no_std]
#![no_main]
// A measurement that cannot be made ends the run with a message, which is what a panic does here.
#![allow(clippy::expect_used, clippy::indexing_slicing)]

mod core_work;
mod float;
mod measure;
mod parse;

use firmware::boards::virt::power;

/// The command that is parsed.
const COMMAND: &str = "G01 X1234 Y-567 Z1000\n";
/// Points of the drawing area; costs are their means, as soft floats take different ways.
const POINTS: [[f32; 3]; 5] = [
    [1000.0, 1000.0, 1000.0],
    [1414.2136, 0.0, 0.0],
    [650.0, -1000.0, 500.0],
    [1775.0, 800.0, 1000.0],
    [700.0, -1500.0, 0.0],
];

/// Never returns.
#[riscv_rt::entry]
fn main() -> ! {
    core_work::report();
    measure::report("parse, gcode 0.7", &[COMMAND], parse::with_gcode);
    measure::report(
        "parse, async-gcode 0.3",
        &[COMMAND],
        parse::with_async_gcode,
    );
    measure::report(
        "inverse kinematics, f32 with libm",
        &POINTS,
        float::inverse_libm,
    );
    measure::report(
        "inverse kinematics, f32 with micromath",
        &POINTS,
        float::inverse_micromath,
    );
    measure::report("set-point, f32 with libm", &POINTS, float::set_point_libm);
    measure::check(
        parse::with_gcode(&COMMAND) == parse::with_async_gcode(&COMMAND),
        "both parsers agree",
    );
    measure::check(
        parse::with_gcode(&COMMAND) == Some((1, [1234.0, -567.0, 1000.0])),
        "and are right",
    );
    let [shoulder, elbow] = float::inverse_libm(&POINTS[0]);
    measure::check(
        (shoulder - 135.0).abs() < 1e-3 && (elbow - 45.0).abs() < 1e-3,
        "home is S 135, E 45",
    );
    let widths = float::set_point_libm(&POINTS[0]).expect("home is inside");
    measure::check(
        widths
            .iter()
            .zip([2000.0, 1000.0, 2000.0])
            .all(|(a, b)| (a - b).abs() < 1e-2),
        "home pulses",
    );
    let [shoulder, elbow] = float::inverse_micromath(&POINTS[0]);
    // Its square root alone is off by some percent.
    measure::check(
        (shoulder - 135.0).abs() < 5.0 && (elbow - 45.0).abs() < 5.0,
        "micromath: within five degrees",
    );
    power::exit(0)
}
