//! An arm as it is built, on a table as it is: offsets of the servos, heights of the paper, and a nib that
//! moves to the side as the lift comes down (`docs/protocol.md`, G31 and M374).

use super::area;
use super::arm::{forward, inverse};

/// How an arm differs from one that is exact, on a flat table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitting {
    /// What the servos have to be told more: shoulder, elbow, pen, in degrees.
    pub offsets_deg: [f64; 3],
    /// Heights of the paper, in units of Z: top left, top right, bottom right, bottom left.
    pub map: [f64; 4],
    /// How far the nib moves outwards while the lift comes down from 1000 to 0.
    pub shift_mm: f64,
}

impl Fitting {
    pub const NONE: Self = Fitting {
        offsets_deg: [0.0; 3],
        map: [0.0; 4],
        shift_mm: 0.0,
    };

    /// The height of the paper: bilinear between the corners of (650, -1000) to (1775, 1000), beyond them as at the
    /// nearest edge.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        let right = ((x - 650.0) / (1775.0 - 650.0)).clamp(0.0, 1.0);
        let up = ((y + 1000.0) / 2000.0).clamp(0.0, 1.0);
        let [top_left, top_right, bottom_right, bottom_left] = self.map;
        let top = top_left + (top_right - top_left) * right;
        let bottom = bottom_left + (bottom_right - bottom_left) * right;
        bottom + (top - bottom) * up
    }

    /// How far the nib is further out than the lift at this height, in units.
    fn out(&self, lift: f64) -> f64 {
        self.shift_mm * 20.0 * (1000.0 - lift) / 1000.0
    }

    /// Where an arm with this lift has its nib, whatever anybody wants: x, y and the height above Z = 0.
    pub fn physical_nib(&self, arm: [f64; 3]) -> [f64; 3] {
        let [x, y, lift] = arm;
        let r = x.hypot(y);
        let longer = (r + self.out(lift)) / r;
        [x * longer, y * longer, lift]
    }

    /// Where the arm is to be for a nib at a place: as high as the paper wants it, pulled in by what the lift puts
    /// it out, and inside the drawing area.
    pub fn arm(&self, nib: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = nib;
        let lift = z + self.height(x, y) * (1.0 - z / 1000.0);
        let r = x.hypot(y);
        let shorter = (r - self.out(lift)) / r;
        let (mut x, mut y) = (x * shorter, y * shorter);
        // What is on the edge by a hair of rounding is inside.
        if self.out(lift) != 0.0 && !area::inside(x, y) {
            (x, y) = area::closest(x, y);
        }
        [x, y, lift]
    }

    /// The other way: the place, by its Z, of the nib of an arm.
    pub fn nib(&self, arm: [f64; 3]) -> [f64; 3] {
        let [x, y, lift] = self.physical_nib(arm);
        [x, y, self.z(x, y, lift)]
    }

    /// The Z of a nib over (x, y) on a lift so high.
    pub fn z(&self, x: f64, y: f64, lift: f64) -> f64 {
        let part = 1.0 - self.height(x, y) / 1000.0;
        (1000.0 - (1000.0 - lift) / part).clamp(0.0, 1000.0)
    }

    /// What the servos are told for a nib at a place.
    pub fn told(&self, nib: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.arm(nib);
        let angles = inverse(x, y, z);
        [0, 1, 2].map(|i| angles[i] + self.offsets_deg[i])
    }

    /// Where the arm is whose servos are told so.
    pub fn arm_told(&self, told: [f64; 3]) -> [f64; 3] {
        forward([0, 1, 2].map(|i| told[i] - self.offsets_deg[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ODD: Fitting = Fitting {
        offsets_deg: [3.0, -2.0, 1.0],
        map: [0.0, 100.0, 300.0, 200.0],
        shift_mm: 0.85,
    };

    #[test]
    fn corners_and_middle() {
        for ((x, y), height) in [
            ((650.0, 1000.0), 0.0),
            ((1775.0, 1000.0), 100.0),
            ((1775.0, -1000.0), 300.0),
            ((650.0, -1000.0), 200.0),
            ((1212.5, 0.0), 150.0),
            ((1950.0, 0.0), 200.0),
        ] {
            assert_eq!(ODD.height(x, y), height, "({x}, {y})");
        }
    }

    #[test]
    fn the_nib_comes_down_where_it_should() {
        // Straight ahead, 17 units less the 15 % that the paper takes.
        let arm = ODD.arm([1212.5, 0.0, 0.0]);
        assert!(
            (arm[0] - (1212.5 - 17.0 * 0.85)).abs() < 1e-9 && arm[2] == 150.0,
            "{arm:?}"
        );
        for z in [0.0, 100.0, 700.0, 1000.0] {
            let place = [1200.0, -300.0, z];
            let back = ODD.nib(ODD.arm(place));
            assert!(
                (0..3).all(|i| (back[i] - place[i]).abs() < 1e-9),
                "{back:?}"
            );
            let told = ODD.arm_told(ODD.told(place));
            let back = ODD.nib(told);
            assert!(
                (0..3).all(|i| (back[i] - place[i]).abs() < 1e-6),
                "{back:?}"
            );
        }
    }
}
