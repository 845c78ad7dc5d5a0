//! A move under way.

use crate::motion::{Line, Micros, Position, Rapid, Wave};

#[derive(Clone, Copy, Debug)]
pub(super) enum Motion {
    Line(Line),
    Rapid(Rapid),
    Wave(Wave),
    /// Staying at a place for a time.
    Dwell(Position, Micros),
}

impl Motion {
    pub(super) const fn duration(&self) -> Micros {
        match self {
            Self::Line(line) => line.duration(),
            Self::Rapid(rapid) => rapid.duration(),
            Self::Wave(_) => Wave::DURATION,
            Self::Dwell(_, duration) => *duration,
        }
    }

    pub(super) const fn end(&self) -> Position {
        match self {
            Self::Line(line) => line.end(),
            Self::Rapid(rapid) => rapid.end(),
            Self::Wave(wave) => wave.end(),
            Self::Dwell(place, _) => *place,
        }
    }

    pub(super) const fn leaves_the_area(&self) -> bool {
        match self {
            Self::Line(line) => line.leaves_the_area(),
            Self::Rapid(rapid) => rapid.leaves_the_area(),
            // Held at the edge where it would.
            Self::Wave(_) | Self::Dwell(..) => false,
        }
    }

    #[inline]
    pub(super) fn at(&self, elapsed: u32) -> (Position, bool) {
        match self {
            Self::Line(line) => line.at(elapsed),
            Self::Rapid(rapid) => rapid.at(elapsed),
            Self::Wave(wave) => wave.at(elapsed),
            Self::Dwell(place, _) => (*place, false),
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Active {
    pub(super) motion: Motion,
    pub(super) begun: Micros,
    pub(super) ends: Micros,
    /// The target was out of reach: its end is marked in the set-points.
    pub(super) short: bool,
}
