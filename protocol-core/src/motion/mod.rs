//! From a command's numbers to points in time: scale and origin, the drawing area, steps; and for a
//! plotter's millimetres the table and the plan.

mod area;
mod planner;
mod stepping;
mod table;
mod transform;
mod units;

pub use area::{MAX_RADIUS, closest, contains, line_leaves};
pub use planner::{
    Acceleration, Assist, Feed, Intensity, LEAST_FEED, MOST_DWELL, MOST_FEED, Outputs,
    PLAN_SEGMENTS, PenDepth, PlanData, STREAM_GAP, Segment,
};
pub use stepping::{DEFAULT_STEPS, STEP_TIME, StepRange, StepSize, Steps};
pub use table::{Direction, Millimetres, Side, Table, TablePoint, UNITS_PER_MILLIMETRE};
pub use transform::{MAX_COORDINATE, MAX_SCALE, Transform};
pub use units::{
    Coordinate, HOME, Microdegrees, Micros, PEN_DOWN, PEN_DOWN_BELOW, PEN_UP, Position, PulseWidth,
    WideCoordinate,
};

pub(crate) use planner::{PlanEvent, Planner};
pub(crate) use stepping::{Line, Rapid, Wave, hold};
