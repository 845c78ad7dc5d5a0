//! The arm's geometry: positions of the nib to servo angles and back, angles to pulses.

mod kinematics;
mod servos;
mod tables;

pub use kinematics::{Angles, HOME_ANGLES, PenLift, forward, inverse};
pub use servos::{Calibration, Pulses, ServoRange};

pub(crate) use kinematics::{LINK, square_of};
pub(crate) use tables::high_half;
