//! Networks as the firmware speaks of them: names, passwords, what is heard, how joining ended.

mod policy;

pub use policy::{Effect, Event, Job, PAUSES, Phase, Policy, Status};

use heapless::Vec;

/// Name of the machine's own, open network (`reference/line-us.md`, section 6).
pub const SETUP_SSID: &str = "Line-us-Setup";
/// Networks that are listened to at once; of more, the weakest are not heard.
pub const MAX_HEARD: usize = 16;

/// Longest network name in bytes (IEEE 802.11).
pub const MAX_SSID: usize = 32;
/// Shortest WPA passphrase.
pub const MIN_PASSWORD: usize = 8;
/// Longest WPA passphrase; 64 characters would be a raw key, which is not offered.
pub const MAX_PASSWORD: usize = 63;

/// Name of a network: 1 to [`MAX_SSID`] bytes, not necessarily text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ssid(Vec<u8, MAX_SSID>);

impl Ssid {
    /// A name, `None` if it is empty or too long.
    pub fn new(name: &[u8]) -> Option<Self> {
        if name.is_empty() {
            return None;
        }
        Vec::from_slice(name).ok().map(Self)
    }

    /// The name of the machine's own network, where nobody else has it.
    pub fn setup() -> Self {
        Self(SETUP_SSID.bytes().collect())
    }

    /// The name as it is on the air.
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }
}

/// Passphrase of a network: [`MIN_PASSWORD`] to [`MAX_PASSWORD`] bytes. It is never shown, not even by
/// `Debug`.
#[derive(Clone, PartialEq, Eq)]
pub struct Password(Vec<u8, MAX_PASSWORD>);

impl Password {
    /// A passphrase, `None` if its length cannot be.
    pub fn new(phrase: &[u8]) -> Option<Self> {
        if phrase.len() < MIN_PASSWORD {
            return None;
        }
        Vec::from_slice(phrase).ok().map(Self)
    }

    /// The passphrase, for the radio and the memory only.
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }
}

impl core::fmt::Debug for Password {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        out.write_str("Password(..)")
    }
}

/// A network to join, or one to offer; open if it has no password.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Network {
    /// Its name.
    pub ssid: Ssid,
    /// Its passphrase.
    pub password: Option<Password>,
}

/// Longest stored form of a network, in bytes.
pub const MAX_NETWORK: usize = 1 + MAX_SSID + MAX_PASSWORD;

impl Network {
    /// For the settings: length of the name, name, passphrase.
    pub fn to_bytes(&self) -> Vec<u8, MAX_NETWORK> {
        let mut bytes = Vec::new();
        let ssid = self.ssid.as_bytes();
        // All three fit by the types' own limits.
        let _ = bytes.push(ssid.len() as u8);
        let _ = bytes.extend_from_slice(ssid);
        let _ = bytes.extend_from_slice(self.password.as_ref().map_or(&[], Password::as_bytes));
        bytes
    }

    /// What [`Self::to_bytes`] made.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (&length, rest) = bytes.split_first()?;
        let (ssid, password) = rest.split_at_checked(length.into())?;
        let password = match password {
            [] => None,
            phrase => Some(Password::new(phrase)?),
        };
        Some(Self {
            ssid: Ssid::new(ssid)?,
            password,
        })
    }
}

/// Networks that can be remembered; the next one is refused.
pub const MAX_NETWORKS: usize = 8;

/// [`MAX_NETWORKS`] are remembered already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full;

/// The networks that are remembered, each name once, in the order in which they came.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Networks(Vec<Network, MAX_NETWORKS>);

impl Networks {
    /// None.
    pub const fn new() -> Self {
        Self(Vec::new())
    }

    /// All of them.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Network> + Clone {
        self.0.iter()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The network of that name.
    pub fn find(&self, ssid: &Ssid) -> Option<&Network> {
        self.0.iter().find(|network| network.ssid == *ssid)
    }

    /// Remembers a network, in the place of one of the same name if there is one.
    ///
    /// # Errors
    /// [`Full`] when there is no place; nothing has changed then.
    pub fn put(&mut self, network: Network) -> Result<(), Full> {
        match self.0.iter_mut().find(|old| old.ssid == network.ssid) {
            Some(old) => {
                *old = network;
                Ok(())
            }
            None => self.0.push(network).map_err(|_| Full),
        }
    }

    /// Forgets the network of that name; says whether there was one.
    pub fn remove(&mut self, ssid: &Ssid) -> bool {
        let before = self.0.len();
        self.0.retain(|network| network.ssid != *ssid);
        self.0.len() < before
    }

    /// Forgets all of them.
    pub fn clear(&mut self) {
        self.0.clear();
    }
}

/// How a network that was heard protects itself, as far as joining it matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Security {
    /// No password.
    Open,
    /// A passphrase.
    Password,
    /// Something that the radio cannot join.
    Unsupported,
}

/// A network that was heard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heard {
    /// Its name; hidden networks are not heard.
    pub ssid: Ssid,
    /// How to join it.
    pub security: Security,
    /// Strength in dBm, about -30 beside it to -95 hardly there.
    pub signal_dbm: i8,
}

/// How an attempt to join ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Joined {
    /// The link is up; the address comes from DHCP.
    Yes,
    /// No network of that name in reach.
    NotFound,
    /// The network is there and does not take the password.
    WrongPassword,
    /// The network is there, and its protection is another one than this machine can have with it: WPA3
    /// alone where the radio does not speak that, or no password where one is remembered.
    Unfit,
    /// Anything else, with the radio's own reason: IEEE 802.11 reason codes, 200 and up are the
    /// driver's, 0 if there is none.
    Failed(u16),
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    fn network(ssid: &[u8], password: &[u8]) -> Network {
        Network {
            ssid: Ssid::new(ssid).unwrap(),
            password: Password::new(password),
        }
    }

    #[test]
    fn lengths_have_their_limits() {
        assert_eq!(Ssid::new(b""), None);
        assert!(Ssid::new(&[0xff; MAX_SSID]).is_some());
        assert_eq!(Ssid::new(&[0; MAX_SSID + 1]), None);
        assert_eq!(Password::new(&[b'x'; MIN_PASSWORD - 1]), None);
        assert!(Password::new(&[b'x'; MAX_PASSWORD]).is_some());
        assert_eq!(Password::new(&[b'x'; MAX_PASSWORD + 1]), None);
    }

    #[test]
    fn networks_survive_their_bytes() {
        for network in [
            network(b"home", b"correct horse"),
            network(b"open", b""),
            network(&[0xff; MAX_SSID], &[0xee; MAX_PASSWORD]),
        ] {
            assert_eq!(Network::from_bytes(&network.to_bytes()), Some(network));
        }
    }

    #[test]
    fn foreign_bytes_are_no_network() {
        for bytes in [&[][..], &[0], &[5, b'a'], &[1, b'a', b'x'], &[0xff; 200]] {
            assert_eq!(Network::from_bytes(bytes), None, "{bytes:?}");
        }
    }

    #[test]
    fn a_password_is_never_shown() {
        let shown = std::format!("{:?}", network(b"home", b"correct horse"));
        assert!(!shown.contains("horse"), "{shown}");
    }
}
