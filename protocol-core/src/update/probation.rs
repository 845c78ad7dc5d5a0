//! Whether a firmware on trial does its work.

use crate::motion::Micros;

/// All signs are good for so long, and the firmware confirms itself.
pub const STEADY: Micros = Micros::from_secs(10);
/// A firmware that has not confirmed itself after so long starts again, which counts.
pub const PATIENCE: Micros = Micros::from_secs(180);

/// What can be seen of a firmware that does its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signs {
    /// The servos have had set-points since the last look.
    pub tick: bool,
    /// The settings have been read.
    pub settings: bool,
    /// It is in its network, or has opened its own.
    pub network: bool,
}

/// What follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Look again in a second.
    Wait,
    /// It does its work.
    Confirm,
    /// It does not: start again.
    Restart,
}

/// A firmware on trial, from its start on.
#[derive(Clone, Copy, Debug)]
pub struct Probation {
    began: Micros,
    good_since: Option<Micros>,
}

impl Probation {
    /// It starts.
    pub const fn new(now: Micros) -> Self {
        Self {
            began: now,
            good_since: None,
        }
    }

    /// A look at it.
    pub fn look(&mut self, now: Micros, signs: Signs) -> Verdict {
        if !(signs.tick && signs.settings && signs.network) {
            self.good_since = None;
        } else if now - *self.good_since.get_or_insert(now) >= STEADY {
            return Verdict::Confirm;
        }
        match now - self.began >= PATIENCE {
            true => Verdict::Restart,
            false => Verdict::Wait,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Signs = Signs {
        tick: true,
        settings: true,
        network: true,
    };

    fn at(seconds: u32) -> Micros {
        Micros::from_secs(100 + seconds)
    }

    #[test]
    fn ten_good_seconds_confirm() {
        let mut probation = Probation::new(at(0));
        for second in 5..15 {
            assert_eq!(probation.look(at(second), GOOD), Verdict::Wait, "{second}");
        }
        assert_eq!(probation.look(at(15), GOOD), Verdict::Confirm);
    }

    #[test]
    fn the_seconds_are_counted_again_after_any_sign_is_missing() {
        for bad in [
            Signs {
                tick: false,
                ..GOOD
            },
            Signs {
                settings: false,
                ..GOOD
            },
            Signs {
                network: false,
                ..GOOD
            },
        ] {
            let mut probation = Probation::new(at(0));
            probation.look(at(0), GOOD);
            assert_eq!(probation.look(at(9), bad), Verdict::Wait);
            assert_eq!(probation.look(at(10), GOOD), Verdict::Wait);
            assert_eq!(probation.look(at(19), GOOD), Verdict::Wait);
            assert_eq!(probation.look(at(20), GOOD), Verdict::Confirm);
        }
    }

    #[test]
    fn three_minutes_without_are_enough() {
        let mut probation = Probation::new(at(0));
        let searching = Signs {
            network: false,
            ..GOOD
        };
        for second in 0..180 {
            assert_eq!(probation.look(at(second), searching), Verdict::Wait);
        }
        assert_eq!(probation.look(at(180), searching), Verdict::Restart);
    }
}
