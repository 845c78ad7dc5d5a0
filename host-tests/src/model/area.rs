//! The drawing area (`reference/arm.md`, "Drawing area").

use super::arm::{LINK, inverse};

const REACH: f64 = 1950.0;
/// Least angle of shoulder and of elbow, in degrees.
const LEAST_ANGLE: f64 = 10.0;
/// The body's edge where y >= 0, and where y < 0.
const BODY_LEFT: f64 = 500.0;
pub const BODY_RIGHT: f64 = 700.0;
/// What f64 rounding may put a point of the edge outside by; in units, or in degrees.
const ROUNDING: f64 = 1e-9;

/// Whether (x, y) belongs to the drawing area, its edge included.
pub fn inside(x: f64, y: f64) -> bool {
    // Reach first: beyond 2000 the inverse does not exist.
    if x.hypot(y) > REACH + ROUNDING {
        return false;
    }
    let [s, e, _] = inverse(x, y, 0.0);
    let body = if y >= -ROUNDING {
        BODY_LEFT
    } else {
        BODY_RIGHT
    };
    x >= body - ROUNDING && s >= LEAST_ANGLE - ROUNDING && e >= LEAST_ANGLE - ROUNDING
}

/// The point of the area closest to (x, y): (x, y) itself if it is inside.
///
/// Only below-left of the notch's corner (700, 0) can two points be equally close, such as (600, 0) and (700, -100) to
/// (600, -100); then the one on the line y = 0 is taken.
pub fn closest(x: f64, y: f64) -> (f64, f64) {
    if inside(x, y) {
        return (x, y);
    }
    let distance = |p: &(f64, f64)| (p.0 - x).hypot(p.1 - y);
    // min_by takes the first of equals, so the order of the pieces settles ties.
    outline()
        .iter()
        .map(|piece| piece.closest(x, y))
        .min_by(|p, q| distance(p).total_cmp(&distance(q)))
        .unwrap()
}

/// A piece of the area's outline.
enum Piece {
    /// x constant, y from..to.
    Upright { x: f64, y: (f64, f64) },
    /// y constant, x from..to.
    Level { y: f64, x: (f64, f64) },
    /// Circle about `centre`, in directions from..to, in degrees; none of ours comes near +-180.
    Arc {
        centre: (f64, f64),
        radius: f64,
        direction: (f64, f64),
    },
}

impl Piece {
    fn closest(&self, px: f64, py: f64) -> (f64, f64) {
        match *self {
            Piece::Upright { x, y } => (x, py.clamp(y.0, y.1)),
            Piece::Level { y, x } => (px.clamp(x.0, x.1), y),
            Piece::Arc {
                centre,
                radius,
                direction,
            } => {
                let on = |d: f64| {
                    (
                        centre.0 + radius * d.to_radians().cos(),
                        centre.1 + radius * d.to_radians().sin(),
                    )
                };
                let d = (py - centre.1).atan2(px - centre.0).to_degrees();
                // Radially, from without or within; beyond an end, that end.
                on(d.clamp(direction.0, direction.1))
            }
        }
    }
}

/// The outline in analytic pieces.
///
/// E = 10 means t2 = 35: the pen is 1000 from an elbow-like centre c = 1000 (cos 35, sin 35), in direction t1, so this edge
/// is a circle about c. S = 10 (t1 = -35) is its mirror image in the x axis.
fn outline() -> [Piece; 6] {
    let t2 = 45.0 - LEAST_ANGLE;
    let c = (LINK * t2.to_radians().cos(), LINK * t2.to_radians().sin());
    // On that circle r = 2000 cos((t1 - t2) / 2), hence the direction in which it meets the reach, as t1 and as phi.
    let h = (REACH / (2.0 * LINK)).acos().to_degrees();
    let (reach_t1, reach_phi) = (t2 + 2.0 * h, t2 + h);
    // The directions in which it meets x = 500 and, mirrored, x = 700; and the y there.
    let left = ((BODY_LEFT - c.0) / LINK).acos().to_degrees();
    let right = ((BODY_RIGHT - c.0) / LINK).acos().to_degrees();
    let left_y = c.1 + LINK * left.to_radians().sin();
    let right_y = c.1 + LINK * right.to_radians().sin();
    [
        Piece::Level {
            y: 0.0,
            x: (BODY_LEFT, BODY_RIGHT),
        },
        Piece::Upright {
            x: BODY_LEFT,
            y: (0.0, left_y),
        },
        Piece::Arc {
            centre: c,
            radius: LINK,
            direction: (reach_t1, left),
        },
        Piece::Arc {
            centre: (0.0, 0.0),
            radius: REACH,
            direction: (-reach_phi, reach_phi),
        },
        Piece::Arc {
            centre: (c.0, -c.1),
            radius: LINK,
            direction: (-right, -reach_t1),
        },
        Piece::Upright {
            x: BODY_RIGHT,
            y: (-right_y, 0.0),
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::arm::forward;

    fn gap(p: (f64, f64), q: (f64, f64)) -> f64 {
        (p.0 - q.0).hypot(p.1 - q.1)
    }

    /// The outline as curves over 0..1, by forward kinematics and the rule itself: no circle centres, and each runs
    /// past its ends, where `inside` cuts it off.
    fn curves() -> [fn(f64) -> (f64, f64); 6] {
        fn joints(s: f64, e: f64) -> (f64, f64) {
            let [x, y, _] = forward([s, e, 0.0]);
            (x, y)
        }
        [
            |t| (500.0 + 200.0 * t, 0.0),
            |t| (500.0, 1600.0 * t),
            |t| joints(100.0 + 60.0 * t, 10.0),
            |t| {
                (
                    1950.0 * (2.0 * t - 1.0).cos(),
                    1950.0 * (2.0 * t - 1.0).sin(),
                )
            },
            |t| joints(10.0, 100.0 + 60.0 * t),
            |t| (700.0, -1600.0 * t),
        ]
    }

    /// Distance to the outline by sampling, refined by golden section around the best sample.
    fn sampled_distance(p: (f64, f64)) -> f64 {
        const SAMPLES: i32 = 500;
        let mut best = f64::INFINITY;
        for curve in curves() {
            let at = |t: f64| {
                let q = curve(t);
                if inside(q.0, q.1) {
                    gap(p, q)
                } else {
                    f64::INFINITY
                }
            };
            let sample = |i: i32| f64::from(i) / f64::from(SAMPLES);
            let i = (0..=SAMPLES)
                .min_by(|&i, &j| at(sample(i)).total_cmp(&at(sample(j))))
                .unwrap();
            let (mut a, mut b) = (sample((i - 1).max(0)), sample((i + 1).min(SAMPLES)));
            let ratio = (5f64.sqrt() - 1.0) / 2.0;
            for _ in 0..60 {
                let (c, d) = (b - ratio * (b - a), a + ratio * (b - a));
                // Where both are cut off the piece lies on the side of the sample.
                let left = if at(c).is_infinite() && at(d).is_infinite() {
                    sample(i) < c
                } else {
                    at(c) < at(d)
                };
                if left {
                    b = d
                } else {
                    a = c
                }
                best = best.min(at(c)).min(at(d));
            }
            best = best.min(at(sample(i)));
        }
        best
    }

    #[test]
    fn projection_agrees_with_sampling() {
        let (mut outside, mut worst) = (0, 0f64);
        for x in (-2500..=3500).step_by(97) {
            for y in (-3000..=3000).step_by(83) {
                let p = (f64::from(x), f64::from(y));
                let q = closest(p.0, p.1);
                assert!(inside(q.0, q.1), "{p:?} -> {q:?}");
                if !inside(p.0, p.1) {
                    outside += 1;
                    worst = worst.max((gap(p, q) - sampled_distance(p)).abs());
                }
            }
        }
        println!("{outside} points, distances differ by at most {worst:e}");
        assert!(outside > 2000 && worst < 1e-6, "{outside} points, {worst}");
    }

    #[test]
    fn closest_points() {
        let near = |x, y, want| {
            let got = closest(x, y);
            assert!(gap(got, want) < 1e-3, "({x}, {y}) -> {got:?}, not {want:?}");
        };
        near(1000.0, 1000.0, (1000.0, 1000.0));
        near(0.0, 0.0, (500.0, 0.0));
        near(3000.0, 0.0, (1950.0, 0.0));
        near(1800.0, 1800.0, (1950.0 / 2f64.sqrt(), 1950.0 / 2f64.sqrt())); // radial
        near(600.0, -50.0, (600.0, 0.0));
        near(690.0, -500.0, (700.0, -500.0));
        near(600.0, -100.0, (600.0, 0.0)); // as far from (700, -100)
        near(0.0, 800.0, (500.0, 800.0));
        near(819.152, 1700.0, (819.152, 1573.576)); // straight up from the centre of the circle E = 10
        near(819.152, -1700.0, (819.152, -1573.576));
        near(0.0, 3000.0, (500.0, 1521.28)); // a corner
    }

    /// Every vertex of the maker's drawing lies within 1 unit of our outline but (820, -1570), which is 3.58 inside.
    /// Corner by corner the drawing is rougher where S = 10 and at the reach: it has (1312, 1443), (1317, -1438) and
    /// (700, -1563) where the rule gives corners 3.8, 10.9 and 3.5 away. At its lower vertices S is 10.22 to 10.33.
    #[test]
    fn vertices_of_the_drawing() {
        let sharp = [
            (500.0, 0.0),
            (500.0, 1521.0),
            (818.0, 1573.0),
            (1312.0, 1443.0),
            (1950.0, 0.0),
        ];
        for v in sharp
            .into_iter()
            .chain([(1317.0, -1438.0), (700.0, -1563.0), (700.0, 0.0)])
        {
            assert!(sampled_distance(v) < 1.0, "{v:?}: {}", sampled_distance(v));
        }
        let rough = (820.0, -1570.0);
        assert!(inside(rough.0, rough.1) && (sampled_distance(rough) - 3.58).abs() < 0.01);
        // The rule's own corners, each as the closest point to one beyond it.
        let corners = [
            (500.0, 1521.28),
            (1309.0, 1445.35),
            (1309.0, -1445.35),
            (700.0, -1566.45),
        ];
        let beyond = [
            (400.0, 1600.0),
            (1367.8, 1526.2),
            (1367.8, -1526.2),
            (600.0, -1650.0),
        ];
        for (corner, p) in corners.into_iter().zip(beyond) {
            let q = closest(p.0, p.1);
            assert!(gap(q, corner) < 0.5, "{q:?}, not {corner:?}");
        }
        // The figures arm.md gives for the "app drawing area".
        assert!(
            inside(1775.0, 807.0)
                && !inside(1775.0, 808.0)
                && inside(1775.0, -807.0)
                && !inside(1775.0, -808.0)
        );
        assert!(
            inside(1674.0, 1000.0)
                && !inside(1675.0, 1000.0)
                && inside(1674.0, -1000.0)
                && !inside(1675.0, -1000.0)
        );
    }
}
