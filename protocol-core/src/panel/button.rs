//! What a person means by pressing the button.
//!
//! Levels and the time go in, gestures come out. A press that is there at power-on, or begins while the
//! light is still white, is the one for a factory reset: on boards where the button is also the chip's
//! own boot pin, a chip with a held button would not start the firmware at all.

use crate::motion::Micros;

/// A level counts when it has lasted this long: buttons bounce.
pub const BOUNCE: Micros = Micros::from_millis(30);
/// A press this long is a long one (`reference/line-us.md`, section 6).
pub const LONG_PRESS: Micros = Micros::from_millis(1_000);
/// The same where the start mode asks for more (`reference/line-us.md`, section 5, `M552 S4`).
pub const VERY_LONG_PRESS: Micros = Micros::from_millis(7_000);
/// A press that begins earlier than this after power-on is the one for a factory reset.
pub const POWER_ON: Micros = Micros::from_millis(2_000);
/// The button must be held this long for a factory reset; the warning is shown all the while.
pub const RESET_HOLD: Micros = Micros::from_millis(5_000);

/// What was meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gesture {
    /// Pressed and let go before [`LONG_PRESS`]. Told at the release.
    Short,
    /// Held for the time of a long press. Told while it is held still.
    Long,
    /// Held at power-on: a factory reset follows after [`RESET_HOLD`] unless it is let go.
    ResetWarning,
    /// Let go in time: nothing happens.
    ResetCancelled,
    /// Held to the end: factory reset.
    Reset,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Press {
    /// Nothing has come of it yet.
    Open,
    /// The warning has been told.
    Warned,
    /// It has had its meaning; only the release is waited for.
    Done,
}

/// The button, a value that is told levels and the time.
#[derive(Debug)]
pub struct Button {
    began: Micros,
    /// The level as it was told last, and since when it is so.
    pressed: bool,
    changed: Micros,
    /// The press that is under way, and its beginning.
    press: Option<(Press, Micros)>,
}

impl Button {
    /// At power-on, not pressed as far as anybody knows.
    pub const fn new(now: Micros) -> Self {
        Self {
            began: now,
            pressed: false,
            changed: now,
            press: None,
        }
    }

    /// Takes the level at `now`, with what is a long press at present, and gives what is meant, if
    /// anything. To be called at every change, and at [`Self::next_look`].
    pub fn update(&mut self, pressed: bool, long_press: Micros, now: Micros) -> Option<Gesture> {
        if pressed != self.pressed {
            self.pressed = pressed;
            self.changed = now;
        }
        let settled = now >= self.changed + BOUNCE;
        match (&mut self.press, pressed) {
            (None, true) if settled => {
                self.press = Some((Press::Open, self.changed));
                self.held(long_press, now)
            }
            (Some(_), true) => self.held(long_press, now),
            (Some((press, since)), false) if settled => {
                let (press, held) = (*press, self.changed - *since);
                self.press = None;
                match press {
                    Press::Open if held < LONG_PRESS => Some(Gesture::Short),
                    Press::Warned => Some(Gesture::ResetCancelled),
                    Press::Open | Press::Done => None,
                }
            }
            _ => None,
        }
    }

    fn held(&mut self, long_press: Micros, now: Micros) -> Option<Gesture> {
        let (press, since) = self.press.as_mut()?;
        let at_power_on = *since < self.began + POWER_ON;
        let held = now - *since;
        let (next, gesture) = match press {
            Press::Open if at_power_on => (Press::Warned, Gesture::ResetWarning),
            Press::Warned if held >= RESET_HOLD => (Press::Done, Gesture::Reset),
            Press::Open if held >= long_press => (Press::Done, Gesture::Long),
            _ => return None,
        };
        *press = next;
        Some(gesture)
    }

    /// When to look again even if the level does not change.
    pub fn next_look(&self, long_press: Micros) -> Option<Micros> {
        let settles = self.changed + BOUNCE;
        match (self.press, self.pressed) {
            (None, true) | (Some(_), false) => Some(settles),
            (Some((Press::Open, since)), true) => Some(since + long_press),
            (Some((Press::Warned, since)), true) => Some(since + RESET_HOLD),
            (Some((Press::Done, _)), true) | (None, false) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const LATER: u64 = 10_000;

    /// Levels at given milliseconds after power-on; everything the button says, with its time.
    fn gestures(levels: &[(u64, bool)], long_press: Micros) -> Vec<(u64, Gesture)> {
        let mut button = Button::new(Micros::default());
        let mut said = Vec::new();
        let mut pressed = false;
        let end = (60_000, false);
        for &(at, level) in levels.iter().chain([&end]) {
            let at = Micros::new(at * 1000);
            // What is due before the next change.
            while let Some(look) = button.next_look(long_press).filter(|look| *look < at) {
                said.extend(
                    button
                        .update(pressed, long_press, look)
                        .map(|gesture| (look.get() / 1000, gesture)),
                );
            }
            pressed = level;
            said.extend(
                button
                    .update(pressed, long_press, at)
                    .map(|gesture| (at.get() / 1000, gesture)),
            );
        }
        said
    }

    fn press(from: u64, length: u64) -> [(u64, bool); 2] {
        [(from, true), (from + length, false)]
    }

    /// A press of so many milliseconds says this, so many milliseconds after its beginning, and no more.
    fn a_press_says(length: u64, long_press: Micros, expected: Option<(u64, Gesture)>) {
        let said = gestures(&press(LATER, length), long_press);
        let expected = expected.map(|(at, gesture)| (LATER + at, gesture));
        assert_eq!(said, Vec::from_iter(expected), "{length} ms");
    }

    #[test]
    fn short_and_long_presses() {
        for (length, expected) in [
            (10, None),
            (40, Some((70, Gesture::Short))),
            (999, Some((1029, Gesture::Short))),
            (1001, Some((1000, Gesture::Long))),
            (20_000, Some((1000, Gesture::Long))),
        ] {
            a_press_says(length, LONG_PRESS, expected);
        }
    }

    #[test]
    fn where_a_long_press_is_seven_seconds_one_of_three_means_nothing() {
        for (length, expected) in [
            (900, Some((930, Gesture::Short))),
            (3_000, None),
            (7_100, Some((7_000, Gesture::Long))),
        ] {
            a_press_says(length, VERY_LONG_PRESS, expected);
        }
    }

    #[test]
    fn a_button_that_bounces_is_pressed_once() {
        let levels = [
            (LATER, true),
            (LATER + 3, false),
            (LATER + 5, true),
            (LATER + 9, false),
            (LATER + 12, true),
            (LATER + 300, false),
            (LATER + 304, true),
            (LATER + 311, false),
        ];
        assert_eq!(
            gestures(&levels, LONG_PRESS),
            [(LATER + 341, Gesture::Short)]
        );
    }

    #[test]
    fn held_at_power_on_it_warns_and_resets() {
        assert_eq!(
            gestures(&press(0, 8_000), LONG_PRESS),
            [(30, Gesture::ResetWarning), (5_000, Gesture::Reset)]
        );
        // Also where the button cannot be held at power-on itself.
        assert_eq!(
            gestures(&press(1_500, 8_000), LONG_PRESS),
            [(1_530, Gesture::ResetWarning), (6_500, Gesture::Reset)]
        );
    }

    #[test]
    fn one_can_change_ones_mind() {
        assert_eq!(
            gestures(&press(0, 4_900), LONG_PRESS),
            [
                (30, Gesture::ResetWarning),
                (4_930, Gesture::ResetCancelled)
            ]
        );
    }

    proptest! {
        /// However the button is pressed, a press has one meaning, and a warning is followed by one
        /// of its two ends.
        #[test]
        fn warnings_and_their_ends_alternate(gaps in proptest::collection::vec(1u64..3_000, 0..40)) {
            let mut at = 0;
            let levels: Vec<_> = gaps
                .iter()
                .enumerate()
                .map(|(index, gap)| {
                    at += gap;
                    (at, index % 2 == 0)
                })
                .take_while(|(at, _)| *at < 59_000)
                .collect();
            let mut warned = false;
            for (_, gesture) in gestures(&levels, LONG_PRESS) {
                match gesture {
                    Gesture::ResetWarning => {
                        prop_assert!(!warned);
                        warned = true;
                    }
                    Gesture::Reset | Gesture::ResetCancelled => {
                        prop_assert!(warned);
                        warned = false;
                    }
                    Gesture::Short | Gesture::Long => prop_assert!(!warned),
                }
            }
        }
    }
}
