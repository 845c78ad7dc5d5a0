//! A move under way.

use crate::motion::{Line, Micros, Position, Rapid};

#[derive(Clone, Copy, Debug)]
pub(super) enum Motion {
    Line(Line),
    Rapid(Rapid),
}

impl Motion {
    pub(super) const fn duration(&self) -> Micros {
        match self {
            Self::Line(line) => line.duration(),
            Self::Rapid(rapid) => rapid.duration(),
        }
    }

    pub(super) const fn end(&self) -> Position {
        match self {
            Self::Line(line) => line.end(),
            Self::Rapid(rapid) => rapid.end(),
        }
    }

    pub(super) const fn leaves_the_area(&self) -> bool {
        match self {
            Self::Line(line) => line.leaves_the_area(),
            Self::Rapid(rapid) => rapid.leaves_the_area(),
        }
    }

    #[inline]
    pub(super) fn at(&self, elapsed: u32) -> (Position, bool) {
        match self {
            Self::Line(line) => line.at(elapsed),
            Self::Rapid(rapid) => rapid.at(elapsed),
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
