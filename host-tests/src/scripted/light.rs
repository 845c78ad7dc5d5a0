//! The light: what it showed when, and what a person would say it shows.

use super::power::Power;
use embassy_time::{Duration, Instant};
use firmware::board::{self, Colour};
use std::cell::RefCell;
use std::fmt;
use std::rc::Rc;

/// A light that has not changed for this long is steady; no flash is longer.
pub const STEADY: Duration = Duration::from_secs(1);
/// Flashes that take no longer than this, on and off together, are fast ones.
pub const FAST: Duration = Duration::from_millis(500);

/// A colour as a person names it: which of red, green and blue are in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hue([bool; 3]);

impl Hue {
    /// No light.
    pub const DARK: Self = Self([false; 3]);

    const NAMES: [(&str, Self); 8] = [
        ("dark", Self::DARK),
        ("red", Self([true, false, false])),
        ("green", Self([false, true, false])),
        ("blue", Self([false, false, true])),
        ("yellow", Self([true, true, false])),
        ("purple", Self([true, false, true])),
        ("cyan", Self([false, true, true])),
        ("white", Self([true; 3])),
    ];

    /// The colour of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::NAMES
            .iter()
            .find(|(other, _)| *other == name)
            .map(|(_, hue)| *hue)
    }

    fn of(colour: Colour) -> Self {
        let parts = [colour.red, colour.green, colour.blue];
        let most = parts.into_iter().max().unwrap_or(0);
        Self(parts.map(|part| part > 0 && part >= most / 2))
    }
}

impl fmt::Display for Hue {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = Self::NAMES.iter().find(|(_, hue)| hue == self);
        out.write_str(name.map_or("?", |(name, _)| name))
    }
}

/// What the light shows over a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// One colour.
    Steady(Hue),
    /// Two colours in turn; one of them may be dark.
    InTurn {
        /// In no order.
        hues: [Hue; 2],
        /// Both together take [`FAST`] at most.
        fast: bool,
    },
}

impl Pattern {
    /// Two colours in turn, in whatever order they are named.
    pub fn in_turn(a: Hue, b: Hue, fast: bool) -> Self {
        let index = |hue: Hue| Hue::NAMES.iter().position(|(_, other)| *other == hue);
        let hues = if index(a) < index(b) { [a, b] } else { [b, a] };
        Self::InTurn { hues, fast }
    }
}

impl fmt::Display for Pattern {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Steady(hue) => hue.fmt(out),
            Self::InTurn { hues: [a, b], fast } => {
                match (*a, *b) {
                    (Hue::DARK, hue) => write!(out, "{hue} flashing")?,
                    (a, b) => write!(out, "{a} and {b} in turn")?,
                }
                out.write_str(if *fast { " fast" } else { "" })
            }
        }
    }
}

/// What the light showed, and since when.
#[derive(Debug)]
pub struct LightRecord(RefCell<Vec<(Instant, Hue)>>);

impl Default for LightRecord {
    fn default() -> Self {
        Self(RefCell::new(vec![(Instant::MIN, Hue::DARK)]))
    }
}

impl LightRecord {
    /// The light changes now.
    pub fn show(&self, colour: Colour) {
        let hue = Hue::of(colour);
        let mut changes = self.0.borrow_mut();
        if changes.last().is_none_or(|(_, last)| *last != hue) {
            changes.push((Instant::now(), hue));
        }
    }

    /// What it shows now; `None` while that cannot be told yet.
    pub fn pattern(&self) -> Option<Pattern> {
        let changes = self.0.borrow();
        let now = Instant::now();
        let [.., (began, hue)] = changes.as_slice() else {
            return None;
        };
        if now - *began >= STEADY {
            return Some(Pattern::Steady(*hue));
        }
        // How long the last ones lasted, backwards: the colour before this one first.
        let mut lasted = [Duration::MIN; 3];
        let pairs = changes.iter().rev().zip(changes.iter().rev().skip(1));
        let known = lasted.iter_mut().zip(pairs);
        let known = known
            .map(|(lasted, ((end, _), (begin, _)))| *lasted = *end - *begin)
            .count();
        let [.., (_, first), (_, other), _] = changes.as_slice() else {
            return None;
        };
        let like = |a: Duration, b: Duration| a <= b + b / 5 && b <= a + a / 5;
        let [last, before, earlier] = lasted;
        // Of the colour that it has now, the last time is known; either both colours last equally long,
        // or the other one did so twice.
        let regular = like(last, before) || (known == 3 && like(last, earlier));
        if hue != first || !regular || now - *began > before + before / 5 {
            return None;
        }
        Some(Pattern::in_turn(*hue, *other, last + before <= FAST))
    }

    /// Whether it has been `hue` at any time since `then`.
    pub fn was(&self, hue: Hue, then: Instant) -> bool {
        let changes = self.0.borrow();
        let ends = changes.iter().skip(1).map(|(began, _)| *began);
        let ends = ends.chain([Instant::MAX]);
        changes
            .iter()
            .zip(ends)
            .any(|((_, shown), end)| *shown == hue && end > then)
    }

    /// The last changes, for a person.
    pub fn describe(&self) -> String {
        match self.pattern() {
            Some(pattern) => format!("the light is {pattern}"),
            None => {
                let changes = self.0.borrow();
                let last = changes.iter().rev().take(4).rev();
                let last: Vec<String> = last
                    .map(|(at, hue)| format!("{hue} since {}", super::journal::seconds(*at)))
                    .collect();
                format!("the light changes: {}", last.join(", "))
            }
        }
    }
}

/// The light of the board.
pub struct Light {
    /// Where it is recorded.
    pub record: Rc<LightRecord>,
    /// Without which it shows nothing.
    pub power: Power,
}

impl board::Light for Light {
    fn show(&mut self, colour: Colour) {
        if self.power.is_on() {
            self.record.show(colour);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::boards::desktop::clock::HandTime;

    /// What is seen after colours that last so many milliseconds each.
    fn seen(colours: &[(&str, u64)]) -> String {
        let time = HandTime::take();
        let record = LightRecord::default();
        for (name, milliseconds) in colours {
            let level = |part: bool| if part { 64 } else { 0 };
            let [red, green, blue] = Hue::named(name).unwrap().0.map(level);
            record.show(Colour { red, green, blue });
            time.go_on_to(Instant::now() + Duration::from_millis(*milliseconds));
        }
        record
            .pattern()
            .map_or("?".into(), |pattern| pattern.to_string())
    }

    #[test]
    fn patterns_are_what_a_person_sees() {
        for (colours, pattern) in [
            (&[("blue", 1000)][..], "blue"),
            (&[("blue", 999)], "?"),
            (&[("red", 500), ("dark", 500), ("red", 0)], "red flashing"),
            (&[("red", 500), ("dark", 500), ("red", 500)], "red flashing"),
            (&[("red", 500), ("dark", 500), ("red", 700)], "?"),
            (&[("red", 500), ("dark", 500)], "?"),
            (&[("red", 500), ("dark", 100), ("red", 0)], "?"),
            (
                &[("dark", 100), ("red", 500), ("dark", 100), ("red", 0)],
                "red flashing",
            ),
            (
                &[("dark", 200), ("red", 500), ("dark", 100), ("red", 0)],
                "?",
            ),
            (&[("red", 500), ("dark", 500), ("blue", 0)], "?"),
            (
                &[("red", 250), ("dark", 250), ("red", 0)],
                "red flashing fast",
            ),
            (
                &[("white", 500), ("red", 500), ("white", 0)],
                "red and white in turn",
            ),
            (
                &[("red", 500), ("white", 500), ("red", 0)],
                "red and white in turn",
            ),
        ] {
            assert_eq!(seen(colours), pattern, "{colours:?}");
        }
    }

    #[test]
    fn colours_are_told_by_their_strongest_parts() {
        let hue = |red, green, blue| Hue::of(Colour { red, green, blue }).to_string();
        assert_eq!(hue(0, 0, 0), "dark");
        assert_eq!(hue(1, 0, 0), "red");
        assert_eq!(hue(40, 40, 40), "white");
        assert_eq!(hue(255, 10, 10), "red");
        assert_eq!(hue(200, 180, 0), "yellow");
    }
}
