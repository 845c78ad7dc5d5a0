//! From a command's numbers to points in time: scale and origin, the drawing area, steps.

mod area;
mod stepping;
mod transform;
mod units;

pub use area::{MAX_RADIUS, closest, contains, line_leaves};
pub use stepping::{DEFAULT_STEPS, STEP_TIME, StepRange, StepSize, Steps, WAVE};
pub use transform::{MAX_COORDINATE, MAX_SCALE, Transform};
pub use units::{
    Coordinate, HOME, Microdegrees, Micros, PEN_DOWN, PEN_DOWN_BELOW, PEN_UP, Position, PulseWidth,
    WideCoordinate,
};

pub(crate) use stepping::{Line, Rapid, Wave, hold};
