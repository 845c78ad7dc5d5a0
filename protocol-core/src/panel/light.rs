//! The light: one table of patterns.

/// A colour of the light, each part 0 (off) to 255.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Colour {
    /// Red.
    pub red: u8,
    /// Green.
    pub green: u8,
    /// Blue.
    pub blue: u8,
}

/// One part of a pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flash {
    /// What is shown.
    pub colour: Colour,
    /// For how long, in milliseconds.
    pub millis: u16,
}

/// What the light says. Patterns differ in their rhythm as well as in their colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lamp {
    /// The firmware starts.
    Starting,
    /// A station without its network.
    Searching,
    /// A station in its network.
    Connected,
    /// The machine's own network is open.
    Setup,
    /// The button is held: everything will be forgotten unless it is let go.
    ResetWarning,
    /// Something does not work; M122 tells what.
    Error,
    /// New firmware is being written.
    Update,
}

const OFF: Colour = colour(0, 0, 0);
const RED: Colour = colour(64, 0, 0);
const BLUE: Colour = colour(0, 0, 64);
const WHITE: Colour = colour(40, 40, 40);

impl Lamp {
    /// Every lamp, with the name that it has in documents and scenarios, and its pattern, which is
    /// repeated; one of a single part is steady.
    pub const TABLE: [(Self, &'static str, &'static [Flash]); 7] = [
        (Self::Starting, "white", &[flash(WHITE, 1000)]),
        (
            Self::Searching,
            "blue flashing",
            &[flash(BLUE, 500), flash(OFF, 500)],
        ),
        (Self::Connected, "blue", &[flash(BLUE, 1000)]),
        (
            Self::Setup,
            "red flashing",
            &[flash(RED, 500), flash(OFF, 500)],
        ),
        (
            Self::ResetWarning,
            "red and white, fast",
            &[flash(RED, 100), flash(WHITE, 100)],
        ),
        (
            Self::Error,
            "red and white",
            &[flash(RED, 500), flash(WHITE, 500)],
        ),
        (
            Self::Update,
            "blue and white",
            &[flash(BLUE, 500), flash(WHITE, 500)],
        ),
    ];

    /// Its name in documents and scenarios.
    pub fn name(self) -> &'static str {
        self.row().map_or("", |(_, name, _)| name)
    }

    /// Its pattern, which is repeated; one of a single part is steady.
    pub fn pattern(self) -> &'static [Flash] {
        self.row().map_or(&[], |(_, _, pattern)| pattern)
    }

    fn row(self) -> Option<(Self, &'static str, &'static [Flash])> {
        Self::TABLE.into_iter().find(|(lamp, ..)| *lamp == self)
    }
}

const fn colour(red: u8, green: u8, blue: u8) -> Colour {
    Colour { red, green, blue }
}

const fn flash(colour: Colour, millis: u16) -> Flash {
    Flash { colour, millis }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lamp_has_its_row_and_no_two_look_alike() {
        for lamp in [
            Lamp::Starting,
            Lamp::Searching,
            Lamp::Connected,
            Lamp::Setup,
            Lamp::ResetWarning,
            Lamp::Error,
            Lamp::Update,
        ] {
            assert!(!lamp.pattern().is_empty(), "{lamp:?} is dark");
            let alike = Lamp::TABLE
                .iter()
                .filter(|(_, name, pattern)| *name == lamp.name() || *pattern == lamp.pattern());
            assert_eq!(alike.count(), 1, "{lamp:?}");
        }
    }
}
