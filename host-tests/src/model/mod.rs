//! An independent f64 model of the drawing arm: the oracle of the golden tests.
//!
//! It is written from `reference/arm.md` (geometry) and `reference/line-us.md` section 4 (moves) alone, shares no code
//! with it, and prefers being checkable by eye to being fast. `arm` holds the kinematics and the servos,
//! `area` the drawing area, `gcode` reads lines, `motion` turns a program into set-points, `plan` tells what a
//! plotter's job takes.
//!
//! Units everywhere: arm units (20 = 1 mm), degrees, microseconds. Triples are x, y, z or shoulder, elbow, pen.

mod area;
mod arm;
mod gcode;
mod motion;
mod plan;

pub use area::{closest, inside};
pub use arm::{HOME, forward, inverse, pulse};
pub use motion::{Report, Step, frames, frames_calibrated, reports, steps};
pub use plan::{Order, corner_speed, job_seconds};
