//! Who asks something of the arm, what it is, and how it turned out.

#[cfg(doc)]
use super::Machine;
use crate::motion::{HOME, Micros, PEN_UP, Position, WideCoordinate};

/// Clients that may be connected at once; the next one is told so and closed.
pub const MAX_CLIENTS: usize = 4;

/// Connections of the web interface that may be served at once; the next one is told so and closed.
pub const MAX_WEB_CLIENTS: usize = 4;

/// Everybody who may ask something of the arm: network clients, the serial port, the firmware itself,
/// the drawing that it holds, drawings that it keeps, web clients.
pub const MAX_ASKERS: usize = MAX_CLIENTS + 4 + MAX_WEB_CLIENTS;

/// One of those who may ask something of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Client(pub(super) u8);

impl Client {
    /// The serial port.
    pub const SERIAL: Self = Self(MAX_CLIENTS as u8);
    /// The firmware itself: waves, and settings that nobody on a connection asked to store.
    pub const HOUSE: Self = Self(MAX_CLIENTS as u8 + 1);
    /// The drawing that the machine holds.
    pub const JOB: Self = Self(MAX_CLIENTS as u8 + 2);
    /// A drawing from memory.
    pub const DRAWER: Self = Self(MAX_CLIENTS as u8 + 3);

    /// The network client in a slot, `None` beyond [`MAX_CLIENTS`].
    pub const fn new(slot: u8) -> Option<Self> {
        if (slot as usize) < MAX_CLIENTS {
            Some(Self(slot))
        } else {
            None
        }
    }

    /// The client of the web interface in a slot, `None` beyond [`MAX_WEB_CLIENTS`].
    pub const fn web(slot: u8) -> Option<Self> {
        if (slot as usize) < MAX_WEB_CLIENTS {
            Some(Self(MAX_CLIENTS as u8 + 4 + slot))
        } else {
            None
        }
    }

    /// Its slot, below [`MAX_ASKERS`].
    pub const fn slot(self) -> usize {
        self.0 as usize
    }
}

/// Where to go; a coordinate left out stays as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Target {
    /// In arm coordinates.
    pub x: Option<WideCoordinate>,
    /// In arm coordinates.
    pub y: Option<WideCoordinate>,
    /// Limited to 0..=1000.
    pub z: Option<WideCoordinate>,
}

impl Target {
    /// Home (`spec 1.0.4a, G28`).
    pub const HOME: Self = Self::at(HOME);

    /// Where the arm is, with the pen up.
    pub const PEN_UP: Self = Self {
        x: None,
        y: None,
        z: Some(WideCoordinate::from_bits(PEN_UP.bits() as i64)),
    };

    /// A place inside the arm's reach.
    pub const fn at(position: Position) -> Self {
        Self {
            x: Some(WideCoordinate::from_bits(position.x.bits() as i64)),
            y: Some(WideCoordinate::from_bits(position.y.bits() as i64)),
            z: Some(WideCoordinate::from_bits(position.z.bits() as i64)),
        }
    }
}

/// How to go there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Manner {
    /// In a straight line (G01).
    Straight,
    /// Every servo at its own full speed (G00).
    Rapid,
}

/// Which axes of a move are the arm's own: without calibration, map and shift (`reference/line-us.md`,
/// section 5, G40).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bare {
    /// X and Y; they belong together, because each moves both servos.
    pub xy: bool,
    /// Z.
    pub z: bool,
}

/// What a client asks of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Errand {
    /// Go somewhere.
    Move(Manner, Target),
    /// Go where the servos of an arm without offsets would put the nib, in a straight line (G40).
    Uncalibrated(Target, Bare),
    /// Stay where it is for this long (G4), at most [`MOST_DWELL`](crate::motion::MOST_DWELL).
    Dwell(Micros),
    /// Make a little wave and be back: nothing happens while the pen is down.
    Wave,
    /// Come to rest and stay there until [`Machine::release`]: for what must not be done in motion.
    Rest,
}

/// In what way a move differs from what was asked for; [`Self::text`] has it in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limited {
    /// The target is out of reach: the arm goes to the closest point.
    Target {
        /// The pen was to be down and is lifted instead.
        lifted: bool,
    },
    /// The way there leaves the drawing area: it is held at the edge.
    Way,
}

impl Limited {
    /// For people, without a double quote.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Target { lifted: true } => "out of reach: going to the closest point, pen lifted",
            Self::Target { lifted: false } => "out of reach: going to the closest point",
            Self::Way => "the way leaves the drawing area: held at its edge",
        }
    }
}

/// How an errand turned out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Report {
    /// The move has begun.
    Moving {
        /// Where it ends, in arm coordinates.
        end: Position,
        /// What is different from what was asked for.
        limited: Option<Limited>,
    },
    /// The arm is at rest and waits for [`Machine::release`].
    Resting,
    /// There is no move: the machine is stopped until [`Machine::resume`].
    Stopped,
}
