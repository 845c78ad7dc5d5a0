//! WiFi: joins the stored network, or runs the setup network, and shows which with the light.
//!
//! At the start the stored network is tried; if that fails, or there is none, the machine opens its own
//! network, `Line-us-Setup`. The button changes between the two. A network that `M587` brings is
//! joined at once. A lost network is looked for again until it is back.

use super::panel::{Lamp, Panel};
use crate::board::{Address, Radio};
use crate::log::{info, warning};
use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_futures::select::{Either, Either3, select, select3};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer};
use protocol_core::wifi::{Joined, Network, Ssid};

/// Name of the machine's own, open network.
pub const SETUP_SSID: &[u8] = b"Line-us-Setup";
/// Time for the reply to `M587` to reach its client before the network changes.
const GRACE: Duration = Duration::from_millis(500);
/// Pause before a lost network is tried again.
const RETRY: Duration = Duration::from_secs(5);

/// The way of the other services to the network.
pub struct Wifi {
    stored: Mutex<CriticalSectionRawMutex, RefCell<Option<Network>>>,
    changed: Signal<CriticalSectionRawMutex, ()>,
    is_setup: AtomicBool,
}

/// What the machine is to be next.
enum Mode {
    Station,
    Setup,
}

impl Wifi {
    /// With the network that is remembered.
    pub const fn new(stored: Option<Network>) -> Self {
        Self {
            stored: Mutex::new(RefCell::new(stored)),
            changed: Signal::new(),
            is_setup: AtomicBool::new(false),
        }
    }

    /// Joins another network from now on.
    pub fn change(&self, network: Network) {
        self.stored
            .lock(|stored| *stored.borrow_mut() = Some(network));
        self.changed.signal(());
    }

    /// Whether the machine is on its own network, for setup.
    pub fn is_setup(&self) -> bool {
        self.is_setup.load(Ordering::Relaxed)
    }

    /// Waits for another network, and a little longer: the reply that says so is on its way still.
    async fn changed(&self) {
        self.changed.wait().await;
        Timer::after(GRACE).await;
    }

    /// The network policy, for ever.
    pub async fn run(&self, mut radio: impl Radio, address: impl Address, panel: &Panel) -> ! {
        let mut mode = Mode::Station;
        loop {
            mode = match mode {
                Mode::Station => self.station(&mut radio, &address, panel).await,
                Mode::Setup => self.setup(&mut radio, &address, panel).await,
            };
        }
    }

    /// Stays in the stored network until there is something else to do.
    async fn station(&self, radio: &mut impl Radio, address: &impl Address, panel: &Panel) -> Mode {
        self.is_setup.store(false, Ordering::Relaxed);
        panel.show(Lamp::Searching);
        let mut was_joined = false;
        loop {
            let Some(network) = self.stored.lock(|stored| stored.borrow().clone()) else {
                return Mode::Setup;
            };
            let joined = match select(radio.join(&network), panel.pressed()).await {
                Either::First(joined) => joined,
                Either::Second(()) => {
                    radio.leave().await;
                    return Mode::Setup;
                }
            };
            match joined {
                Joined::Yes => {
                    info!("network joined");
                    address.ask();
                    panel.show(Lamp::Connected);
                    was_joined = true;
                    match select3(radio.lost(), self.changed(), panel.pressed()).await {
                        Either3::First(()) => warning!("network lost"),
                        // The new one has to show first that it can be joined.
                        Either3::Second(()) => was_joined = false,
                        Either3::Third(()) => {
                            radio.leave().await;
                            return Mode::Setup;
                        }
                    }
                    panel.show(Lamp::Searching);
                    continue;
                }
                Joined::NotFound => warning!("network not found"),
                Joined::WrongPassword => warning!("network refuses the password"),
                Joined::Failed(reason) => warning!("network not joined, reason {}", reason),
            }
            if !was_joined {
                return Mode::Setup;
            }
            match select3(Timer::after(RETRY), self.changed(), panel.pressed()).await {
                Either3::First(()) => {}
                Either3::Second(()) => was_joined = false,
                Either3::Third(()) => return Mode::Setup,
            }
        }
    }

    /// Runs the machine's own network until the button is pressed or there is another to join.
    async fn setup(&self, radio: &mut impl Radio, address: &impl Address, panel: &Panel) -> Mode {
        let Some(ssid) = Ssid::new(SETUP_SSID) else {
            return Mode::Station;
        };
        let own = Network {
            ssid,
            password: None,
        };
        self.is_setup.store(true, Ordering::Relaxed);
        panel.show(Lamp::Setup);
        panel.forget_press();
        if radio.open_access_point(&own).await.is_err() {
            warning!("setup network not opened");
            panel.show(Lamp::Error);
            Timer::after(RETRY).await;
        } else {
            info!("setup network opened");
            let until = select(self.changed(), panel.pressed());
            match select(address.serve_guests(), until).await {
                Either::First(never) => never,
                Either::Second(_) => {}
            }
            if radio.close_access_point().await.is_err() {
                warning!("setup network not closed");
            }
        }
        Mode::Station
    }
}
