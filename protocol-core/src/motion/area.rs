//! The drawing area: where the nib may be without anything touching (`reference/arm.md`).
//!
//! r <= 1950, S >= 10 deg, E >= 10 deg, x >= 500 where y >= 0, x >= 700 where y < 0.
//!
//! No angle is needed to test the joints. E >= 10 deg says that the forearm points no further left
//! than 35 deg, `phi - h <= 35 deg`. For a nib left of that direction this holds inside the circle of
//! radius 1000 around the elbow at which the *upper link* points to 35 deg: with the links swapped,
//! the parallelogram has that corner as well. S >= 10 deg is its mirror image in y = 0.

use super::units::{Coordinate, WideCoordinate};
use crate::arm::{LINK, high_half, square_of};

/// Radius of the outer edge, in drawing units.
pub const MAX_RADIUS: i32 = 1950;
/// Least x left of the shoulder, y >= 0.
const LEFT_WALL: i32 = 500 << 16;
/// Least x right of the shoulder, y < 0: the pen screw would touch the body.
const RIGHT_WALL: i32 = 700 << 16;
/// The elbow with a link at 35 degrees, 1000 (cos 35, sin 35), in 1/65536 units.
const CORNER_X: i32 = 53_683_948;
const CORNER_Y: i32 = 37_589_905;
/// Ends of the outer arc: direction 35 deg + acos(0.975), a hair inside: (1308.88, 1445.45).
const ARC_END: (i32, i32) = (85_778_900, 94_729_010);
/// Curved edges are drawn in by this much (0.0001 unit), so that a point put onto one is inside
/// whatever way its coordinates were rounded.
const INSET: i64 = 8;

/// Whether a nib at (x, y) is inside the drawing area, edges included.
#[inline]
pub const fn contains(x: Coordinate, y: Coordinate) -> bool {
    let (x, y) = (x.bits(), y.bits());
    let wall = if y >= 0 { LEFT_WALL } else { RIGHT_WALL };
    // Far points first: the squares below are good for 2048 units.
    if x < wall || x > MAX_RADIUS << 16 || y.unsigned_abs() > (MAX_RADIUS as u32) << 16 {
        return false;
    }
    let across = y.abs();
    let square = square_of(x) + square_of(across);
    if square > (MAX_RADIUS * MAX_RADIUS) as u32 * 256 {
        return false;
    }
    // x and y times 2^4, corner times 2^4: both products in 1/256 square units, like the square.
    let along_corner = high_half(x << 4, CORNER_X << 4) + high_half(across << 4, CORNER_Y << 4);
    let left_of_corner = high_half(across << 4, CORNER_X << 4) > high_half(x << 4, CORNER_Y << 4);
    // |p - c| <= 1000 with |c| = 1000 is |p|^2 <= 2 p.c
    !left_of_corner || square.cast_signed() <= 2 * along_corner
}

/// Whether the straight line between two points of the area leaves it.
///
/// Both ends inside, a line can leave only over the step of the body between x = 500 and x = 700 at
/// y = 0: the outer circle is convex, and the joints' edges are arcs that bulge outwards.
pub fn line_leaves(from: (Coordinate, Coordinate), to: (Coordinate, Coordinate)) -> bool {
    let (left, right) = match (from.1.bits() >= 0, to.1.bits() >= 0) {
        (true, false) => (from, to),
        (false, true) => (to, from),
        _ => return false,
    };
    let [left_x, left_y, right_x, right_y] =
        [left.0, left.1, right.0, right.1].map(|coordinate| i64::from(coordinate.bits()));
    // x where the line passes y = 0, less than 700, multiplied out: left_y >= 0 > right_y.
    let height = left_y - right_y;
    left_x * height + (right_x - left_x) * left_y < i64::from(RIGHT_WALL) * height
}

/// The point of the area closest to (x, y), wherever that is: radially inwards at the outer edge.
pub fn closest(x: WideCoordinate, y: WideCoordinate) -> (Coordinate, Coordinate) {
    if let (Ok(near_x), Ok(near_y)) = (i32::try_from(x.bits()), i32::try_from(y.bits())) {
        let near = (Coordinate::from_bits(near_x), Coordinate::from_bits(near_y));
        if contains(near.0, near.1) {
            return near;
        }
    }
    let point = (x.bits(), y.bits());
    // The nearest point lies on one of the edges or at a corner: of all that are inside, the one at
    // the least distance. Ends of the straight edges are corners too, and need no entry.
    let corner = (i64::from(CORNER_X), i64::from(CORNER_Y));
    let candidates = [
        on_circle(point, (0, 0), MAX_RADIUS),
        on_circle(point, corner, LINK),
        on_circle(point, (corner.0, -corner.1), LINK),
        on_wall(point, LEFT_WALL, 0, LEFT_WALL_END),
        on_wall(point, RIGHT_WALL, RIGHT_WALL_END, -1),
        (point.0.clamp(LEFT_WALL.into(), RIGHT_WALL.into()), 0),
        (ARC_END.0.into(), ARC_END.1.into()),
        (ARC_END.0.into(), (-ARC_END.1).into()),
    ];
    let mut best = (Coordinate::from_units(1000), Coordinate::from_units(1000));
    let mut least = u128::MAX;
    for (x, y) in candidates {
        let candidate = (
            Coordinate::from_bits(x as i32),
            Coordinate::from_bits(y as i32),
        );
        let (dx, dy) = (i128::from(x - point.0), i128::from(y - point.1));
        let distance = (dx * dx + dy * dy).cast_unsigned();
        if distance < least && contains(candidate.0, candidate.1) {
            (best, least) = (candidate, distance);
        }
    }
    best
}

/// y where the left wall meets the elbow's edge, and the right wall the shoulder's, a hair inside.
const LEFT_WALL_END: i32 = 99_698_580;
const RIGHT_WALL_END: i32 = -102_659_005;

fn on_wall(point: (i64, i64), wall: i32, lowest: i32, highest: i32) -> (i64, i64) {
    (wall.into(), point.1.clamp(lowest.into(), highest.into()))
}

/// The point of a circle nearest to `point`, drawn in by [`INSET`].
fn on_circle(point: (i64, i64), centre: (i64, i64), radius: i32) -> (i64, i64) {
    let (mut dx, mut dy) = (point.0 - centre.0, point.1 - centre.1);
    // Only the direction matters; within 30 bits the squares add up inside 64.
    while dx.unsigned_abs().max(dy.unsigned_abs()) >= 1 << 30 {
        dx >>= 1;
        dy >>= 1;
    }
    let length = ((dx * dx + dy * dy).cast_unsigned().isqrt() as i64).max(1);
    let radius = i64::from(radius << 16) - INSET;
    (
        centre.0 + dx * radius / length,
        centre.1 + dy * radius / length,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(x: f64, y: f64) -> (Coordinate, Coordinate) {
        let bits = |value: f64| Coordinate::from_bits((value * 65536.0).round() as i32);
        (bits(x), bits(y))
    }

    fn inside(x: f64, y: f64) -> bool {
        contains(at(x, y).0, at(x, y).1)
    }

    fn closest_to(x: f64, y: f64) -> (f64, f64) {
        let bits = |value: f64| WideCoordinate::from_bits((value * 65536.0).round() as i64);
        let (x, y) = closest(bits(x), bits(y));
        (x.to_f64(), y.to_f64())
    }

    /// The rule of `reference/arm.md`, word for word.
    fn rule(x: f64, y: f64) -> bool {
        let (r, phi) = (x.hypot(y), y.atan2(x).to_degrees());
        let h = (r / 2000.0).min(1.0).acos().to_degrees();
        r <= 1950.0
            && 45.0 + phi + h >= 10.0
            && 45.0 - phi + h >= 10.0
            && x >= if y >= 0.0 { 500.0 } else { 700.0 }
    }

    #[test]
    fn the_outline_is_the_one_of_the_drawing() {
        // Vertices of `reference/arm.md`; the drawing is good to a few units only.
        for (x, y) in [
            (500.0, 1521.0),
            (818.0, 1573.0),
            (1312.0, 1443.0),
            (1950.0, 0.0),
            (1317.0, -1438.0),
            (820.0, -1570.0),
            (700.0, -1563.0),
        ] {
            let (dx, dy) = (1100.0_f64 - x, 0.0_f64 - y);
            let unit = 4.5 / dx.hypot(dy);
            assert!(
                inside(x + dx * unit, y + dy * unit),
                "just inside ({x}, {y})"
            );
            assert!(
                !inside(x - dx * unit, y - dy * unit),
                "just outside ({x}, {y})"
            );
        }
    }

    #[test]
    fn edges_belong_to_the_area() {
        assert!(inside(500.0, 0.0) && inside(500.0, 1000.0) && inside(700.0, -1000.0));
        assert!(inside(1950.0, 0.0) && inside(700.0, -0.001));
        assert!(!inside(600.0, -0.001) && !inside(1950.001, 0.0));
    }

    #[test]
    fn corners_are_inside_and_where_they_should_be() {
        let corner = closest_to(450.0, 1530.0);
        assert!(
            (corner.0 - 500.0).abs() < 0.5 && (corner.1 - 1521.2).abs() < 0.5,
            "{corner:?}"
        );
        for y in [LEFT_WALL_END, LEFT_WALL_END - 64] {
            assert!(contains(
                Coordinate::from_bits(LEFT_WALL),
                Coordinate::from_bits(y)
            ));
        }
        assert!(!contains(
            Coordinate::from_bits(LEFT_WALL),
            Coordinate::from_bits(LEFT_WALL_END + 64)
        ));
        assert!(contains(
            Coordinate::from_bits(RIGHT_WALL),
            Coordinate::from_bits(RIGHT_WALL_END)
        ));
        assert!(!contains(
            Coordinate::from_bits(RIGHT_WALL),
            Coordinate::from_bits(RIGHT_WALL_END - 64)
        ));
        for sign in [1, -1] {
            let (x, y) = (ARC_END.0, sign * ARC_END.1);
            assert!(
                contains(Coordinate::from_bits(x), Coordinate::from_bits(y)),
                "arc end {sign}"
            );
            assert!(
                !contains(Coordinate::from_bits(x + 200), Coordinate::from_bits(y)),
                "arc end {sign}"
            );
        }
    }

    #[test]
    fn the_closest_point_of_what_clients_ask_for() {
        let far = 1950.0 / 2.0_f64.sqrt();
        for ((x, y), expected) in [
            ((0.0, 0.0), (500.0, 0.0)),
            ((2000.0, 0.0), (1950.0, 0.0)),
            ((1e6, 1e6), (far, far)),
            ((-1000.0, 1000.0), (500.0, 1000.0)),
            ((600.0, -1000.0), (700.0, -1000.0)),
            ((600.0, -30.0), (600.0, 0.0)),
            ((690.0, -30.0), (700.0, -30.0)),
            ((1000.0, 1000.0), (1000.0, 1000.0)),
        ] {
            let found = closest_to(x, y);
            let off = (found.0 - expected.0).hypot(found.1 - expected.1);
            assert!(off < 0.001, "({x}, {y}): {found:?}, expected {expected:?}");
        }
    }

    #[test]
    fn lines_leave_over_the_step_of_the_body_only() {
        assert!(line_leaves(at(510.0, 300.0), at(720.0, -300.0)));
        assert!(line_leaves(at(720.0, -300.0), at(510.0, 300.0)));
        assert!(!line_leaves(at(700.0, 300.0), at(700.0, -300.0)));
        assert!(!line_leaves(at(510.0, 300.0), at(900.0, -10.0)));
        assert!(!line_leaves(at(510.0, 0.0), at(510.0, 1000.0)));
    }

    proptest! {
        #[test]
        fn it_is_the_rule(x in -100.0..2100.0, y in -2100.0..2100.0) {
            // Exact but for a hair at the edges.
            let near_edge = [(0.003, 0.0), (-0.003, 0.0), (0.0, 0.003), (0.0, -0.003)]
                .iter()
                .any(|(dx, dy)| rule(x + dx, y + dy) != rule(x, y));
            prop_assume!(!near_edge);
            prop_assert_eq!(inside(x, y), rule(x, y));
        }

        #[test]
        fn the_closest_point_is_inside_and_none_is_closer(
            x in -4000.0..4000.0, y in -4000.0..4000.0, other_x in 500.0..1950.0, other_y in -1600.0..1600.0,
        ) {
            let (cx, cy) = closest_to(x, y);
            prop_assert!(inside(cx, cy), "({cx}, {cy}) is outside");
            if rule(other_x, other_y) {
                let closer = (other_x - x).hypot(other_y - y) + 0.001 < (cx - x).hypot(cy - y);
                prop_assert!(!closer, "({other_x}, {other_y}) is closer than ({cx}, {cy})");
            }
        }

        #[test]
        fn points_of_a_line_are_inside_unless_it_is_said_to_leave(
            a in (500.0..1950.0, -1600.0..1600.0), b in (500.0..1950.0, -1600.0..1600.0), t in 0.0..1.0,
        ) {
            prop_assume!(rule(a.0, a.1) && rule(b.0, b.1));
            let point = (a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t);
            if !line_leaves(at(a.0, a.1), at(b.0, b.1)) {
                let (cx, cy) = closest_to(point.0, point.1);
                prop_assert!((cx - point.0).hypot(cy - point.1) < 0.001, "{point:?} is outside");
            }
        }

        #[test]
        fn no_point_makes_it_panic(x: i64, y: i64) {
            let limit = 1i64 << 47;
            let (x, y) = closest(WideCoordinate::from_bits(x % limit), WideCoordinate::from_bits(y % limit));
            prop_assert!(contains(x, y));
        }
    }
}
