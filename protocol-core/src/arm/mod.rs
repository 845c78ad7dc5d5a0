//! The arm's geometry: positions of the nib to servo angles and back, angles to pulses.

mod compensation;
mod kinematics;
mod servos;
mod tables;
mod z_map;

pub use compensation::{Compensation, NibShift};
pub use kinematics::{Angles, HOME_ANGLES, PenLift, forward, inverse};
pub use servos::{Calibration, Directions, Pulses, ServoRange};
pub use z_map::{MAX_HEIGHT, ZMap};

pub(crate) use kinematics::{LINK, bare_forward, square_of};
pub(crate) use tables::high_half;
