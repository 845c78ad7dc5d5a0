//! The table: the rectangle on which millimetres are drawn, as plotters and laser cutters have one.
//!
//! A host draws X to the right and Y away from whoever looks at the picture. With the axes of
//! [`Table::DEFAULT`], that picture lies un-mirrored on the paper for somebody who sits with the arm's
//! body to the left: X leads away from the body, Y to the left of it when looking along x, and the
//! table's origin is the corner next to the body and to the viewer.

use super::area::contains;
use super::units::{Coordinate, WideCoordinate};

/// Drawing units in a millimetre (`reference/arm.md`).
pub const UNITS_PER_MILLIMETRE: i32 = 20;

/// A length or a place along an axis of the table, in 1/65536 of a millimetre: a whole number of
/// [`Coordinate`]'s last places, so that one is exactly twenty of the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Millimetres(i32);

impl Millimetres {
    /// Fraction bits of the representation.
    pub const FRACTION_BITS: u32 = 16;

    /// A whole number of millimetres.
    pub const fn new(millimetres: i16) -> Self {
        Self((millimetres as i32) << Self::FRACTION_BITS)
    }

    /// From 1/65536 millimetres.
    pub const fn from_bits(bits: i32) -> Self {
        Self(bits)
    }

    /// From 1/65536 millimetres; beyond the range of 32 m either way its end, which is off any table.
    pub fn saturating(bits: i64) -> Self {
        Self(bits.clamp(i32::MIN.into(), i32::MAX.into()) as i32)
    }

    /// In 1/65536 millimetres.
    pub const fn bits(self) -> i32 {
        self.0
    }

    /// The nearest thousandth of a millimetre, halves away from zero.
    pub const fn micrometres(self) -> i32 {
        let half = 1 << (Self::FRACTION_BITS - 1);
        let magnitude = (self.0.unsigned_abs() as u64 * 1000 + half) >> Self::FRACTION_BITS;
        if self.0 < 0 {
            -(magnitude as i32)
        } else {
            magnitude as i32
        }
    }

    /// In millimetres, for people and pictures.
    pub fn to_f64(self) -> f64 {
        f64::from(self.0) / f64::from(1 << Self::FRACTION_BITS)
    }

    /// In 1/65536 drawing units, exactly.
    const fn units(self) -> i64 {
        self.0 as i64 * UNITS_PER_MILLIMETRE as i64
    }
}

/// A place by the table's own axes; its origin, (0, 0), is the machine's physical home.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TablePoint {
    /// To the right, as hosts draw it.
    pub x: Millimetres,
    /// Away, as hosts draw it.
    pub y: Millimetres,
}

impl TablePoint {
    /// Physical home.
    pub const HOME: Self = Self {
        x: Millimetres::new(0),
        y: Millimetres::new(0),
    };
}

/// A direction on the paper, as the arm sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Away from the body, along the arm's x.
    Away,
    /// To the left when looking along x: the arm's y.
    Left,
    /// To the body.
    Towards,
    /// To the right when looking along x.
    Right,
}

impl Direction {
    const fn vector(self) -> (i64, i64) {
        match self {
            Self::Away => (1, 0),
            Self::Left => (0, 1),
            Self::Towards => (-1, 0),
            Self::Right => (0, -1),
        }
    }
}

/// One of the four sides of the table, in the order of a plotter's limit switches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// X below 0.
    X1,
    /// X beyond the table's width.
    X2,
    /// Y below 0.
    Y1,
    /// Y beyond the table's height.
    Y2,
}

/// Where the table lies; board data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Table {
    origin: (Coordinate, Coordinate),
    x: Direction,
    y: Direction,
    width: Millimetres,
    height: Millimetres,
}

/// The default table, or a compile error.
const DEFAULT: Option<Table> = Table::new(
    (Coordinate::from_units(710), Coordinate::from_units(-900)),
    (Direction::Away, Direction::Left),
    (Millimetres::new(50), Millimetres::new(90)),
);

impl Table {
    /// 50 x 90 mm: X from 35.5 mm to 85.5 mm in front of the shoulder, Y from 45 mm to its right to 45 mm to
    /// its left. Half a millimetre remains to where the pen screw would touch the body, and nearly a
    /// millimetre from the far corners to the end of the arm's reach.
    pub const DEFAULT: Self = {
        assert!(DEFAULT.is_some(), "the default table lies inside the area");
        match DEFAULT {
            Some(table) => table,
            None => unreachable!(),
        }
    };

    /// A table with a corner at `origin`, in arm coordinates, from which X and Y lead along `axes` for as
    /// many millimetres as `size` says. `None` when the axes are not square to one another, a size is
    /// not positive, or any part of it lies outside the drawing area.
    ///
    /// The corners are enough: a straight line between points of the area leaves it over the step of the
    /// body only (`line_leaves`), and a table that reaches across y = 0 has a corner there.
    pub const fn new(
        origin: (Coordinate, Coordinate),
        axes: (Direction, Direction),
        size: (Millimetres, Millimetres),
    ) -> Option<Self> {
        let table = Self {
            origin,
            x: axes.0,
            y: axes.1,
            width: size.0,
            height: size.1,
        };
        let ((a, b), (c, d)) = (axes.0.vector(), axes.1.vector());
        if a * c + b * d != 0 || size.0.bits() <= 0 || size.1.bits() <= 0 {
            return None;
        }
        let (width, height) = (size.0.units(), size.1.units());
        let inside = table.corner_is_inside(0, 0)
            && table.corner_is_inside(width, 0)
            && table.corner_is_inside(0, height)
            && table.corner_is_inside(width, height);
        if inside { Some(table) } else { None }
    }

    const fn corner_is_inside(&self, right: i64, away: i64) -> bool {
        let (x, y) = self.out(right, away);
        let (near_x, near_y) = (x as i32, y as i32);
        x == near_x as i64
            && y == near_y as i64
            && contains(Coordinate::from_bits(near_x), Coordinate::from_bits(near_y))
    }

    /// Along X.
    pub const fn width(&self) -> Millimetres {
        self.width
    }

    /// Along Y.
    pub const fn height(&self) -> Millimetres {
        self.height
    }

    /// Where a place of the table, or beyond it, is in arm coordinates; exact.
    pub const fn to_arm(&self, point: TablePoint) -> (WideCoordinate, WideCoordinate) {
        let (x, y) = self.out(point.x.units(), point.y.units());
        (WideCoordinate::from_bits(x), WideCoordinate::from_bits(y))
    }

    /// Where a place of the arm is by the table's axes, to the nearest 1/65536 mm.
    pub fn to_table(&self, x: Coordinate, y: Coordinate) -> TablePoint {
        let nearest = |bits: i64| {
            let half = i64::from(UNITS_PER_MILLIMETRE / 2);
            Millimetres::saturating((bits + half).div_euclid(i64::from(UNITS_PER_MILLIMETRE)))
        };
        let (right, away) = self.along((x, y));
        TablePoint {
            x: nearest(right),
            y: nearest(away),
        }
    }

    /// The point of the table closest to a place of the arm.
    pub(super) fn closest(&self, place: (Coordinate, Coordinate)) -> (Coordinate, Coordinate) {
        let (right, away) = self.along(place);
        self.place(
            right.clamp(0, self.width.units()),
            away.clamp(0, self.height.units()),
        )
    }

    /// The end of a straight way on the table from `from` to `to`: `to` itself, or where the way leaves
    /// the table, and over which side. A way that starts beyond the table starts at its edge.
    pub(super) fn aim(
        &self,
        from: (Coordinate, Coordinate),
        to: TablePoint,
    ) -> ((Coordinate, Coordinate), Option<Side>) {
        let (from_x, from_y) = self.along(self.closest(from));
        let (to_x, to_y) = (to.x.units(), to.y.units());
        let crossings = [
            (Side::X1, to_x < 0, from_x, from_x - to_x),
            (Side::Y1, to_y < 0, from_y, from_y - to_y),
            (
                Side::X2,
                to_x > self.width.units(),
                self.width.units() - from_x,
                to_x - from_x,
            ),
            (
                Side::Y2,
                to_y > self.height.units(),
                self.height.units() - from_y,
                to_y - from_y,
            ),
        ];
        // The first side in the way: the least part of it that lies before the side.
        let first = crossings
            .into_iter()
            .filter(|(_, beyond, _, _)| *beyond)
            .min_by(|(_, _, a, whole_a), (_, _, b, whole_b)| {
                (i128::from(*a) * i128::from(*whole_b))
                    .cmp(&(i128::from(*b) * i128::from(*whole_a)))
            });
        let Some((side, _, before, whole)) = first else {
            return (self.place(to_x, to_y), None);
        };
        let part = |from: i64, to: i64, most: i64| {
            let way = i128::from(to - from) * i128::from(before) / i128::from(whole);
            (from + way as i64).clamp(0, most)
        };
        let end = self.place(
            part(from_x, to_x, self.width.units()),
            part(from_y, to_y, self.height.units()),
        );
        (end, Some(side))
    }

    /// By the arm's axes, of 1/65536 units by the table's.
    const fn out(&self, right: i64, away: i64) -> (i64, i64) {
        let ((a, b), (c, d)) = (self.x.vector(), self.y.vector());
        (
            self.origin.0.bits() as i64 + a * right + c * away,
            self.origin.1.bits() as i64 + b * right + d * away,
        )
    }

    /// As [`Self::out`], of a place on the table.
    const fn place(&self, right: i64, away: i64) -> (Coordinate, Coordinate) {
        let (x, y) = self.out(right, away);
        (
            Coordinate::from_bits(x as i32),
            Coordinate::from_bits(y as i32),
        )
    }

    /// By the table's axes, in 1/65536 units.
    const fn along(&self, (x, y): (Coordinate, Coordinate)) -> (i64, i64) {
        let ((a, b), (c, d)) = (self.x.vector(), self.y.vector());
        let (x, y) = (
            x.bits() as i64 - self.origin.0.bits() as i64,
            y.bits() as i64 - self.origin.1.bits() as i64,
        );
        (a * x + b * y, c * x + d * y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn units(x: i16, y: i16) -> (Coordinate, Coordinate) {
        (Coordinate::from_units(x), Coordinate::from_units(y))
    }

    fn point(x: i16, y: i16) -> TablePoint {
        TablePoint {
            x: Millimetres::new(x),
            y: Millimetres::new(y),
        }
    }

    #[test]
    fn the_default_table_leads_away_and_to_the_left() {
        for ((x, y), (arm_x, arm_y)) in [
            ((0, 0), (710, -900)),
            ((50, 0), (1710, -900)),
            ((0, 90), (710, 900)),
            ((50, 90), (1710, 900)),
            ((25, 45), (1210, 0)),
        ] {
            let (x, y) = Table::DEFAULT.to_arm(point(x, y));
            assert_eq!((x.bits() >> 16, y.bits() >> 16), (arm_x, arm_y));
        }
    }

    #[test]
    fn a_table_that_does_not_fit_is_none() {
        let size = (Millimetres::new(50), Millimetres::new(90));
        let axes = (Direction::Away, Direction::Left);
        assert!(Table::new(units(700, -900), axes, size).is_some());
        // The pen screw would touch the body; the far corners are out of reach.
        assert!(Table::new(units(690, -900), axes, size).is_none());
        assert!(Table::new(units(750, -900), axes, size).is_none());
        let not_square = (Direction::Away, Direction::Towards);
        assert!(Table::new(units(1000, 0), not_square, size).is_none());
        let none = (Millimetres::new(0), Millimetres::new(90));
        assert!(Table::new(units(700, -900), axes, none).is_none());
    }

    #[test]
    fn axes_may_lie_any_way() {
        // Seen by somebody who looks at the arm from the front: X to the arm's left, Y to the body.
        let table = Table::new(
            units(1700, -800),
            (Direction::Left, Direction::Towards),
            (Millimetres::new(80), Millimetres::new(40)),
        )
        .unwrap();
        let (x, y) = table.to_arm(point(80, 40));
        assert_eq!((x.bits() >> 16, y.bits() >> 16), (900, 800));
        assert_eq!(
            table.to_table(units(900, 800).0, units(900, 800).1),
            point(80, 40)
        );
    }

    #[test]
    fn a_way_ends_where_it_leaves() {
        let from = units(1210, 0);
        for (to, end, side) in [
            ((60, 45), (1710, 0), Side::X2),
            ((-25, 45), (710, 0), Side::X1),
            ((25, 135), (1210, 900), Side::Y2),
            ((75, -45), (1460, -450), Side::Y1),
        ] {
            let (to, end) = (point(to.0, to.1), units(end.0, end.1));
            let expected = match side {
                // Half way up the corner of a square, both sides are reached at once.
                Side::Y1 => (units(1710, -900), Some(Side::X2)),
                side => (end, Some(side)),
            };
            let found = Table::DEFAULT.aim(from, to);
            if side == Side::Y1 {
                assert!(matches!(found.1, Some(Side::Y1 | Side::X2)), "{found:?}");
                assert_eq!(found.0, expected.0);
            } else {
                assert_eq!(found, expected);
            }
        }
    }

    #[test]
    fn thousandths_as_hosts_read_them() {
        assert_eq!(Millimetres::from_bits(392_954).micrometres(), 5_996);
        assert_eq!(Millimetres::new(-5).micrometres(), -5_000);
    }

    proptest! {
        #[test]
        fn millimetres_become_units_and_come_back_exactly(x in 0..=50 << 16, y in 0..=90 << 16) {
            let point = TablePoint { x: Millimetres::from_bits(x), y: Millimetres::from_bits(y) };
            let (arm_x, arm_y) = Table::DEFAULT.to_arm(point);
            let [arm_x, arm_y] = [arm_x, arm_y].map(|wide| Coordinate::from_bits(wide.bits() as i32));
            prop_assert!(contains(arm_x, arm_y));
            prop_assert_eq!(Table::DEFAULT.to_table(arm_x, arm_y), point);
            prop_assert_eq!(Table::DEFAULT.aim(units(1000, 0), point), ((arm_x, arm_y), None));
        }

        #[test]
        fn an_end_is_on_the_way_and_on_the_table(
            from in (0.0..50.0, 0.0..90.0), to in (-200.0..200.0, -200.0..200.0),
        ) {
            let bits = |value: f64| Millimetres::from_bits((value * 65536.0) as i32);
            let of = |(x, y): (f64, f64)| TablePoint { x: bits(x), y: bits(y) };
            let (start_x, start_y) = Table::DEFAULT.to_arm(of(from));
            let start = [start_x, start_y].map(|wide| Coordinate::from_bits(wide.bits() as i32));
            let ((x, y), side) = Table::DEFAULT.aim((start[0], start[1]), of(to));
            let end = Table::DEFAULT.to_table(x, y);
            let (x, y) = (end.x.to_f64(), end.y.to_f64());
            prop_assert!((0.0..=50.0).contains(&x) && (0.0..=90.0).contains(&y), "({x}, {y})");
            let inside = (0.0..=50.0).contains(&to.0) && (0.0..=90.0).contains(&to.1);
            prop_assert_eq!(side.is_none(), inside);
            let edge = match side {
                None => 0.0,
                Some(Side::X1) => x,
                Some(Side::X2) => 50.0 - x,
                Some(Side::Y1) => y,
                Some(Side::Y2) => 90.0 - y,
            };
            prop_assert!(edge.abs() < 1e-4, "{side:?} at ({x}, {y})");
            let (way, along) = ((to.0 - from.0, to.1 - from.1), (x - from.0, y - from.1));
            let aside = (way.0 * along.1 - way.1 * along.0) / way.0.hypot(way.1);
            prop_assert!(aside.abs() < 1e-3, "{aside} mm aside");
        }
    }
}
