//! Time inside the planner: finer than microseconds, because segments may be shorter than a hundred.

use super::super::units::Micros;

/// A point in time, in 1/256 us.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Moment(u64);

impl Moment {
    pub(super) const fn after(self, duration: u64) -> Self {
        Self(self.0 + duration)
    }

    /// In 1/256 us; nothing before `earlier`.
    pub(super) const fn since(self, earlier: Self) -> u64 {
        self.0.saturating_sub(earlier.0)
    }

    /// Whole microseconds, at most an hour.
    pub(super) fn micros_since(self, earlier: Self) -> u32 {
        (self.since(earlier).min(u32::MAX.into()) >> 8) as u32
    }

    /// The first whole microsecond that is not before it.
    pub(super) const fn micros(self) -> Micros {
        Micros::new(self.0.div_ceil(256))
    }
}

/// In 1/256 us.
pub(super) const fn fine(time: Micros) -> u64 {
    time.get() << 8
}

impl From<Micros> for Moment {
    fn from(time: Micros) -> Self {
        Self(fine(time))
    }
}
