//! An independent f64 model of the drawing arm: the oracle of the golden tests.
//!
//! It is written from `reference/arm.md` (geometry), `reference/line-us.md` section 4 (moves) and `docs/protocol.md` (G4,
//! G31, G40) alone, shares no code
//! with it, and prefers being checkable by eye to being fast. `arm` holds the kinematics and the servos,
//! `area` the drawing area, `paper` what is particular to one arm, `gcode` reads lines, `motion` turns a program into set-points, `plan` tells what a
//! plotter's job takes.
//!
//! Units everywhere: arm units (20 = 1 mm), degrees, microseconds. Triples are x, y, z or shoulder, elbow, pen.

mod area;
mod arm;
mod gcode;
mod motion;
mod paper;
mod plan;

pub use area::{closest, inside};
pub use arm::{HOME, forward, inverse, pulse};
pub use motion::{Report, Step, frames, frames_fitted, reports, reports_fitted, steps};
pub use paper::Fitting;
pub use plan::{Order, corner_speed, job_seconds};
