//! What owners do to the settings of their machines.

use crate::dice::Dice;
use protocol_core::arm::{Angles, Calibration, Directions, NibShift, ZMap};
use protocol_core::motion::Microdegrees;
use protocol_core::settings::{AccessPointName, MachineName, Settings, StartMode};
use protocol_core::wifi::{MAX_PASSWORD, MAX_SSID, MIN_PASSWORD, Network, Password, Ssid};

/// How much an owner stores.
#[derive(Clone, Copy)]
pub struct Habits {
    /// Most networks.
    pub networks: usize,
    /// Longest network name, and longest password.
    pub lengths: (usize, usize),
}

impl Habits {
    /// Whatever fits.
    pub const ANY: Self = Self {
        networks: protocol_core::wifi::MAX_NETWORKS,
        lengths: (MAX_SSID, MAX_PASSWORD),
    };
    /// A record that fits a page of 256 bytes.
    pub const MODEST: Self = Self {
        networks: 3,
        lengths: (12, 20),
    };
}

pub fn name(dice: &mut Dice) -> MachineName {
    let text = format!("arm-{:x}", dice.number() >> dice.below(60));
    MachineName::new(&text).expect("letters, digits and a hyphen")
}

pub fn calibration(dice: &mut Dice) -> Calibration {
    let offsets = [(); 3].map(|()| Microdegrees::new(dice.number() as i32 / 100));
    Calibration {
        offsets: Angles::from_array(offsets),
    }
}

pub fn network(dice: &mut Dice, (longest_name, longest_password): (usize, usize)) -> Network {
    let length = 1 + dice.below(longest_name);
    let ssid = Ssid::new(&dice.bytes(length)).expect("1 to 32 bytes");
    let length = MIN_PASSWORD + dice.below(longest_password + 1 - MIN_PASSWORD);
    let password =
        (dice.below(4) > 0).then(|| Password::new(&dice.bytes(length)).expect("8 to 63 bytes"));
    Network { ssid, password }
}

/// Settings after the owner has changed something.
pub fn change(before: &Settings, dice: &mut Dice, habits: Habits) -> Settings {
    let mut after = before.clone();
    match dice.below(12) {
        0 | 1 => after.name = name(dice),
        2 => after.calibration = calibration(dice),
        3 | 4 => {
            let network = network(dice, habits.lengths);
            // One that is not remembered any more makes room.
            if after.networks.len() >= habits.networks
                && let Some(oldest) = before.networks.iter().next()
            {
                after.networks.remove(&oldest.ssid);
            }
            after.networks.put(network).expect("there is room");
        }
        5 => {
            if let Some(oldest) = before.networks.iter().next() {
                after.networks.remove(&oldest.ssid);
            }
        }
        6 => after.start = StartMode::from_number(1 + dice.byte() % 4).expect("1 to 4"),
        7 => {
            after.access_point = AccessPointName::from_number(1 + dice.byte() % 2).expect("1 or 2");
        }
        8 => {
            let corners = [0; 4].map(|_: i16| i16::from(dice.byte()));
            after.map = ZMap::new(corners).expect("heights below 500");
        }
        9 => {
            let hundredths = i16::from(dice.byte() % 201);
            after.shift = NibShift::from_hundredths(hundredths).expect("2 mm at most");
        }
        10 => after.directions = Directions::from_byte(dice.byte() % 8).expect("three bits"),
        _ => after.waves = !after.waves,
    }
    after
}
