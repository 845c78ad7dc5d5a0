//! The way of a job as one line, and where on it set-points lie.

use host_tests::model::{self, Order};
use protocol_core::machine::SetPoint;

/// A set-point may lie this far beside the way, in mm: rounding.
const BESIDE: f64 = 1e-4;

/// One straight piece.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    pub from: [f64; 2],
    pub to: [f64; 2],
    /// Along the whole way.
    pub begins: f64,
    pub length: f64,
    /// mm/s.
    pub nominal: f64,
    pub intensity: u8,
}

/// A job's way from a place on.
pub fn pieces(start: [f64; 2], orders: &[Order]) -> Vec<Piece> {
    let (mut at, mut begins) = (start, 0.0);
    let mut pieces = Vec::new();
    for order in orders {
        let Order::Line {
            to,
            feed,
            intensity,
        } = *order
        else {
            continue;
        };
        let length = (to[0] - at[0]).hypot(to[1] - at[1]);
        if length > 0.0 {
            pieces.push(Piece {
                from: at,
                to,
                begins,
                length,
                nominal: feed / 60.0,
                intensity,
            });
            begins += length;
            at = to;
        }
    }
    pieces
}

/// On the default table, in mm.
pub fn place(set_point: &SetPoint) -> [f64; 2] {
    let position = set_point.position;
    [
        (position.x.to_f64() - 710.0) / 20.0,
        (position.y.to_f64() + 900.0) / 20.0,
    ]
}

/// How a set-point may be read: so far along the way, on that piece, so much after the set-point before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    pub index: usize,
    pub distance: f64,
    pub step: f64,
}

/// Walks along a way, set-point by set-point.
///
/// Ways cross themselves and turn back, so a set-point may be read in several ways; all are followed, and
/// only those go on that keep to the rules.
pub struct Walk<'a> {
    pub pieces: &'a [Piece],
    readings: Vec<Reading>,
}

impl<'a> Walk<'a> {
    pub fn new(pieces: &'a [Piece]) -> Self {
        let begin = Reading {
            index: 0,
            distance: 0.0,
            step: 0.0,
        };
        Self {
            pieces,
            readings: vec![begin],
        }
    }

    /// The next set-point, which follows `rule` (of the reading before and this one) in one reading at least.
    pub fn step(
        &mut self,
        set_point: &SetPoint,
        rule: impl Fn(&Reading, &Reading) -> Result<(), String>,
    ) -> Result<(), String> {
        let mut why = format!("{:?} is beside the way or behind", place(set_point));
        let mut next: Vec<Reading> = Vec::new();
        for last in &self.readings {
            for reading in self.after(last, place(set_point)) {
                match rule(last, &reading) {
                    Ok(()) if next.contains(&reading) => {}
                    Ok(()) => next.push(reading),
                    Err(broken) => why = broken,
                }
            }
        }
        if next.is_empty() {
            return Err(why);
        }
        self.readings = next;
        Ok(())
    }

    /// How far along the way the last set-point is.
    pub fn distance(&self) -> f64 {
        self.readings
            .iter()
            .map(|reading| reading.distance)
            .fold(0.0, f64::max)
    }

    fn after(&self, last: &Reading, at: [f64; 2]) -> Vec<Reading> {
        const MOST_STEP: f64 = 5.0;
        let ahead = self.pieces.iter().enumerate().skip(last.index);
        ahead
            .take_while(|(_, piece)| piece.begins <= last.distance + MOST_STEP)
            .filter_map(|(index, piece)| {
                let way = [0, 1].map(|axis| (piece.to[axis] - piece.from[axis]) / piece.length);
                let from = [0, 1].map(|axis| at[axis] - piece.from[axis]);
                let along = (way[0] * from[0] + way[1] * from[1]).clamp(0.0, piece.length);
                let beside = (from[0] - way[0] * along).hypot(from[1] - way[1] * along);
                let distance = piece.begins + along;
                let on_the_way = beside <= BESIDE && distance >= last.distance - BESIDE;
                on_the_way.then_some(Reading {
                    index,
                    distance,
                    step: distance - last.distance,
                })
            })
            .collect()
    }
}

/// Largest speed at the corner that begins a piece, in mm/s.
pub fn corner_limit(before: &Piece, after: &Piece) -> f64 {
    if (before.intensity > 0) != (after.intensity > 0) {
        return 0.0;
    }
    let way = |piece: &Piece| [0, 1].map(|axis| (piece.to[axis] - piece.from[axis]) / piece.length);
    let ([ax, ay], [bx, by]) = (way(before), way(after));
    let turn = (ax * by - ay * bx).atan2(ax * bx + ay * by).abs();
    before
        .nominal
        .min(after.nominal)
        .min(model::corner_speed(turn))
}
