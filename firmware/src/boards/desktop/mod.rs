//! The arm nobody needs hardware for: the firmware's tasks on a desktop, with real sockets, a file
//! for flash, and a picture of what the servos did.

pub mod air;
pub mod bootloader;
pub mod canvas;
pub mod clock;
pub mod draw;
pub mod draw_lasaur;
pub mod flash;
pub mod imprint;
pub mod net;
pub mod pty;
pub mod recorder;
pub mod slots;
pub mod trial;

use crate::board::{Address, Vitals};
use protocol_core::lineus::Identity;
use protocol_core::wifi::{Network, Ssid};

/// A made-up address of the kind that no maker has.
pub const IDENTITY: Identity = Identity {
    mac: [0x02, 0x51, 0x75, 0x69, 0x6c, 0x6c],
};

/// What a desktop that was started by hand knows about itself.
pub const VITALS: Vitals = Vitals {
    free_memory,
    reset_reason: "program start",
    last_panic: "",
};

/// The network that a desktop is in, whatever it is: as if it were an open one.
///
/// # Panics
/// Never: the name is short enough.
#[expect(clippy::expect_used, reason = "a constant of one to 32 bytes")]
pub fn own_network() -> Network {
    Network {
        ssid: Ssid::new(b"this computer's").expect("one to 32 bytes"),
        password: None,
    }
}

/// Addresses are the operating system's business.
pub struct NoAddress;

impl Address for NoAddress {
    fn ask(&self) {}

    async fn serve_guests(&self) -> ! {
        core::future::pending().await
    }
}

/// Available memory in bytes where the system tells it, as far as 32 bits go; else 0.
fn free_memory() -> u32 {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let kilobytes = text
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))
        .and_then(|rest| rest.trim().trim_end_matches(" kB").parse::<u64>().ok());
    u32::try_from(kilobytes.unwrap_or(0).saturating_mul(1024)).unwrap_or(u32::MAX)
}
