//! What a board says about its arm, and what the arm tells the board.

use crate::arm::{Angles, Compensation, PenLift, Pulses, ServoRange, bare_forward, forward};
use crate::motion::{Microdegrees, Micros, Outputs, PlanData, Position};

/// What a board says about its arm.
#[derive(Clone, Copy, Debug)]
pub struct ArmData {
    /// Pulse ranges of shoulder, elbow and pen.
    pub servos: [ServoRange; 3],
    /// How the pen servo follows Z.
    pub lift: PenLift,
    /// Full speed of every servo for G00, in degrees a second.
    pub full_speed: u16,
    /// How long the pen stays down after the connection that lowered it has ended.
    pub lift_after: Micros,
    /// The arm as a plotter.
    pub plan: PlanData,
}

impl Default for ArmData {
    /// 500..2500 us over 180 degrees, 600 degrees a second, 5 s (`reference/arm.md`).
    fn default() -> Self {
        Self {
            servos: [ServoRange::default(); 3],
            lift: PenLift::default(),
            full_speed: 600,
            lift_after: Micros::from_secs(5),
            plan: PlanData::default(),
        }
    }
}

/// What the servos are told in one frame, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetPoint {
    /// Where the nib is to be.
    pub position: Position,
    /// The pulses that put it there.
    pub pulses: Pulses,
    /// The position is not what was asked for: it is held at the edge of the drawing area.
    pub held: bool,
    /// A move is under way, or this is where it ended.
    pub moving: bool,
    /// Whether air, aux1 and aux2 are on (M80 to M85).
    pub outputs: Outputs,
}

/// Where the nib of an arm without offsets is when its servos are given `pulses`: forward kinematics,
/// for pictures of what the arm did.
pub fn position_of(pulses: Pulses, data: &ArmData) -> Position {
    forward(angles_of(pulses, data), data.lift)
}

/// The same for an arm whose paper lies and whose nib moves as `compensation` says.
pub fn nib_of(pulses: Pulses, data: &ArmData, compensation: &Compensation) -> Position {
    if compensation.is_none() {
        return position_of(pulses, data);
    }
    compensation.nib(bare_forward(angles_of(pulses, data), data.lift))
}

fn angles_of(pulses: Pulses, data: &ArmData) -> Angles {
    let mut angles = [Microdegrees::default(); 3];
    for ((angle, servo), pulse) in angles.iter_mut().zip(&data.servos).zip(pulses) {
        *angle = servo.angle(pulse);
    }
    Angles::from_array(angles)
}
