//! How this arm differs from its model: calibration, the servos' directions, paper and lift.

use super::{Bare, Limited, Machine, Target};
use crate::arm::{
    Angles, Calibration, Compensation, Directions, HOME_ANGLES, bare_forward, inverse,
};
use crate::motion::{Coordinate, HOME, PEN_DOWN, PEN_UP, Position, WideCoordinate, closest, hold};

impl Machine {
    /// Where the servos are now, in the model's angles.
    pub fn angles(&self) -> Angles {
        self.angles_at(self.position())
    }

    /// Where the servos have to be, in the model's angles, so that the nib is at `position`.
    #[inline]
    pub(super) fn angles_at(&self, position: Position) -> Angles {
        inverse(self.compensation.arm(position), self.data.lift)
    }

    /// The calibration in force.
    pub const fn calibration(&self) -> Calibration {
        self.calibration
    }

    /// The calibration by which the servos, as they stand now, stand at the calibration point, which
    /// is home (`reference/arm.md`, calibration).
    pub fn calibration_here(&self) -> Calibration {
        Calibration::between(self.told(), HOME_ANGLES)
    }

    /// Puts a calibration in force. The servos stay where they are, and the arm's position becomes
    /// what they now mean; where that is outside the drawing area or its heights, they go to its edge in
    /// the next frame.
    pub fn set_calibration(&mut self, calibration: Calibration) {
        let model = calibration.remove(self.told());
        self.calibration = calibration;
        (self.position, _) = hold(self.nib_at(model));
        self.active = None;
        if self.plan.has_the_arm() {
            self.plan.forget(self.position);
        }
    }

    /// Map and shift in force.
    pub const fn compensation(&self) -> &Compensation {
        &self.compensation
    }

    /// Puts map and shift in force: the position stays, and the servos go to what it takes in the next
    /// frame, at their own full speed. With the pen up they have nowhere to go.
    pub const fn set_compensation(&mut self, compensation: Compensation) {
        self.compensation = compensation;
    }

    /// Which servos turn the other way.
    pub const fn directions(&self) -> Directions {
        self.directions
    }

    /// Puts directions in force: the position stays and so does the calibration, whose offsets count in
    /// the model's direction; the pulses of a servo that turns the other way than before are
    /// mirrored at 90 degrees, and it goes there in the next frame, at its own full speed.
    pub fn set_directions(&mut self, directions: Directions) {
        let changed = directions
            .reversed
            .iter()
            .zip(self.directions.reversed)
            .map(|(new, old)| *new != old);
        for (servo, changed) in self.data.servos.iter_mut().zip(changed) {
            if changed {
                *servo = servo.mirrored();
            }
        }
        self.directions = directions;
    }

    /// What the servos were told last, or at rest will have been told at the next frame, calibration
    /// included.
    fn told(&self) -> Angles {
        self.calibration.apply(self.angles())
    }

    /// Where the nib is when the servos stand at `model`; it may be outside the drawing area.
    fn nib_at(&self, model: Angles) -> Position {
        if model == HOME_ANGLES {
            return HOME;
        }
        let arm = bare_forward(model, self.data.lift);
        let nib = match self.compensation.is_none() {
            true => arm,
            false => self.compensation.nib(arm),
        };
        Position {
            z: nib.z.max(PEN_DOWN),
            ..nib
        }
    }

    /// The target by whose axes, as far as they are bare, the servos are told what those of an arm
    /// without offsets, map and shift would be told. A bare place outside the drawing area becomes the
    /// closest point inside, with the pen up.
    pub(super) fn without_offsets(&self, target: &Target, bare: Bare) -> (Target, Option<Limited>) {
        if self.calibration == Calibration::default() && self.compensation.is_none() {
            return (*target, None);
        }
        let mut new = *target;
        let offsets = self.calibration.offsets;
        // What the pen servo is to be told is the angle itself, so it stands off by the calibration.
        let height = target.z.filter(|_| bare.z).map(|z| {
            let pen = self.data.lift.angle(within_lift(z)) - offsets.pen;
            self.data.lift.height(pen)
        });
        let mut limited = None;
        if bare.xy && (target.x.is_some() || target.y.is_some()) {
            let now = bare_forward(self.told(), self.data.lift);
            let wanted = (
                target.x.unwrap_or(now.x.into()),
                target.y.unwrap_or(now.y.into()),
            );
            let (x, y) = closest(wanted.0, wanted.1);
            if wanted != (x.into(), y.into()) {
                limited = Some(Limited::Target { lifted: false });
            }
            let told = inverse(Position { x, y, z: PEN_UP }, self.data.lift);
            let arm = bare_forward(self.calibration.remove(told), self.data.lift);
            // The shift depends on the arm's height. Where that is to follow from the nib's, it depends on the
            // place by the map, which is so flat that the second time it is right.
            let z = new.z.map_or(self.position.z, within_lift);
            let mut nib = Position {
                x: arm.x,
                y: arm.y,
                z,
            };
            for _ in 0..2 {
                let z = height.unwrap_or(self.compensation.arm(Position { z, ..nib }).z);
                nib = self.compensation.nib(Position {
                    x: arm.x,
                    y: arm.y,
                    z,
                });
            }
            (new.x, new.y) = (Some(nib.x.into()), Some(nib.y.into()));
        }
        if let Some(height) = height {
            let (x, y) = closest(
                new.x.unwrap_or(self.position.x.into()),
                new.y.unwrap_or(self.position.y.into()),
            );
            new.z = Some(self.compensation.height_over_paper(x, y, height).into());
        }
        let lifted = limited.is_some() && {
            let z = new.z.map_or(self.position.z, within_lift);
            Position { z, ..self.position }.pen_is_down()
        };
        if lifted {
            new.z = Some(PEN_UP.into());
            limited = Some(Limited::Target { lifted });
        }
        (new, limited)
    }
}

/// Z limited to 0..=1000.
pub(super) fn within_lift(z: WideCoordinate) -> Coordinate {
    let within = z.bits().clamp(PEN_DOWN.bits().into(), PEN_UP.bits().into());
    Coordinate::from_bits(within as i32)
}

#[cfg(test)]
mod tests;
