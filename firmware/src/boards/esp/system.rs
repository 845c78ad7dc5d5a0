//! Who this chip is and how it fares: address, reset reason, memory, watchdog.

use esp_hal::efuse;
use esp_hal::peripherals::TIMG0;
use esp_hal::rtc_cntl::SocResetReason;
use esp_hal::system;
use esp_hal::time::Duration;
use esp_hal::timer::timg::{MwdtStage, Wdt};
use protocol_core::lineus::Identity;

/// Address of the station interface, of which each chip has its own.
pub fn identity() -> Identity {
    let address = efuse::interface_mac_address(efuse::InterfaceMacAddress::Station);
    let mut mac = [0; 6];
    for (byte, from) in mac.iter_mut().zip(address.as_bytes()) {
        *byte = *from;
    }
    Identity { mac }
}

/// Why the chip started, in the words of M122.
pub fn reset_reason() -> &'static str {
    use SocResetReason as Soc;
    match system::reset_reason() {
        Some(Soc::ChipPowerOn) => "power on",
        Some(Soc::CoreSw | Soc::Cpu0Sw) => "firmware",
        // A weak USB port, or servos without a supply of their own.
        Some(Soc::SysBrownOut) => "supply dropped",
        // The tool that loads firmware.
        #[cfg(not(feature = "esp32"))]
        Some(Soc::CoreUsbJtag | Soc::CoreUsbUart) => "USB",
        Some(Soc::CoreMwdt0 | Soc::CoreMwdt1 | Soc::CoreRtcWdt | Soc::SysRtcWdt) => "watchdog",
        _ => "other",
    }
}

/// Free heap in bytes. Only the radio uses the heap.
pub fn free_heap() -> u32 {
    u32::try_from(esp_alloc::HEAP.free()).unwrap_or(u32::MAX)
}

/// Resets the chip unless it is fed in time. Flash writes and the radio's start need up to 1 s.
pub struct Watchdog(Wdt<TIMG0<'static>>);

impl Watchdog {
    pub(super) fn new(timer: Wdt<TIMG0<'static>>) -> Self {
        Self(timer)
    }

    /// Starts to watch.
    pub fn start(&mut self, timeout: Duration) {
        self.0.set_timeout(MwdtStage::Stage0, timeout);
        self.0.enable();
    }

    /// All is well.
    pub fn feed(&mut self) {
        self.0.feed();
    }
}
