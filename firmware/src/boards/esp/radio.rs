//! The board's radio over esp-radio.
//!
//! WPA3: the supplicant that comes with esp-radio 1.0.0-beta.1 has none (its issue 1600). Networks
//! that also take WPA2 are joined with WPA2; one that insists on WPA3 shows as open in a scan and
//! cannot be joined.

use crate::board::{Radio, RadioFault};
use embassy_futures::select::select;
use embassy_time::{Duration, Timer, with_timeout};
use esp_hal::peripherals::WIFI;
use esp_radio::wifi::ap::{AccessPointConfig, AccessPointInfo};
use esp_radio::wifi::scan::ScanConfig;
use esp_radio::wifi::sta::{ScanMethod, StationConfig};
use esp_radio::wifi::{
    AuthenticationMethod, AuthenticationMethodConfig, Config, ConnectionError, ControllerConfig,
    DisconnectReason, WifiController, WifiError,
};
use heapless::Vec;
use protocol_core::wifi::{Heard, Joined, Network, Password, Security, Ssid};

/// A scan of all channels (2 s) and a handshake (at worst 10 s) fit.
const JOIN_AT_MOST: Duration = Duration::from_secs(20);
const LEAVE_AT_MOST: Duration = Duration::from_secs(2);
const SCAN_AT_MOST: Duration = Duration::from_secs(10);
/// How often the link is looked at besides waiting for its event.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// Guests of the access point: phone and computer of one person, and a spare.
const GUESTS_MAX: u16 = 4;

/// The radio.
pub struct EspRadio {
    controller: WifiController<'static>,
    station: StationConfig,
    access_point: Option<AccessPointConfig>,
    /// A network was joined, and its loss was not told yet.
    joined: bool,
}

impl EspRadio {
    /// Starts the radio, in station mode, joined to nothing. Takes about 60 kB of heap.
    pub(super) fn start(wifi: WIFI<'static>) -> Result<Self, RadioFault> {
        let controller = WifiController::new(wifi, ControllerConfig::default()).map_err(fault)?;
        Ok(Self {
            controller,
            station: StationConfig::default(),
            access_point: None,
            joined: false,
        })
    }

    /// Hands mode and settings to the driver. A change between station alone and station with
    /// access point restarts the radio; every link is then lost.
    fn apply(&mut self) -> Result<(), WifiError> {
        let station = self.station.clone();
        let config = match &self.access_point {
            None => Config::Station(station),
            // With a station beside it: an access point alone can neither scan nor join.
            Some(offer) => Config::AccessPointStation(station, offer.clone()),
        };
        self.controller.set_config(&config)
    }

    async fn connect(&mut self, network: &Network) -> Joined {
        self.leave().await;
        let Some(config) = station_config(network) else {
            return Joined::Failed(0);
        };
        self.station = config;
        if let Err(error) = self.apply() {
            fault(error);
            return Joined::Failed(0);
        }
        match with_timeout(JOIN_AT_MOST, self.controller.connect_async()).await {
            Ok(Ok(_)) => Joined::Yes,
            Ok(Err(ConnectionError::Failed(why))) => outcome(why.reason),
            Ok(Err(error)) => {
                defmt::warn!("join: {}", error);
                Joined::Failed(0)
            }
            // The event may have been pushed out of the driver's queue by others.
            Err(_) if self.controller.is_connected() => Joined::Yes,
            Err(_) => {
                self.leave().await;
                Joined::Failed(0)
            }
        }
    }
}

impl Radio for EspRadio {
    async fn scan<const N: usize>(&mut self, heard: &mut Vec<Heard, N>) -> Result<(), RadioFault> {
        heard.clear();
        let config = ScanConfig::default().with_max(N);
        let found = with_timeout(SCAN_AT_MOST, self.controller.scan_async(&config))
            .await
            .map_err(|_| RadioFault)?
            .map_err(fault)?;
        // The driver sorts by strength.
        for entry in found.iter().filter_map(entry) {
            if heard.push(entry).is_err() {
                break;
            }
        }
        Ok(())
    }

    async fn join(&mut self, network: &Network) -> Joined {
        let joined = self.connect(network).await;
        self.joined = joined == Joined::Yes;
        joined
    }

    async fn leave(&mut self) {
        self.joined = false;
        // `NotConnected` is the answer where there is nothing to leave.
        match with_timeout(LEAVE_AT_MOST, self.controller.disconnect_async()).await {
            Ok(Ok(_) | Err(WifiError::NotConnected)) => {}
            Ok(Err(error)) => defmt::warn!("leave: {}", error),
            Err(_) => defmt::warn!("leave: no answer"),
        }
    }

    async fn open_access_point(&mut self, network: &Network) -> Result<(), RadioFault> {
        let offer = access_point_config(network).ok_or(RadioFault)?;
        self.access_point = Some(offer);
        let applied = self.apply().map_err(fault);
        if applied.is_err() {
            self.access_point = None;
        }
        applied
    }

    async fn close_access_point(&mut self) -> Result<(), RadioFault> {
        if self.access_point.take().is_none() {
            return Ok(());
        }
        self.apply().map_err(fault)
    }

    fn is_joined(&self) -> bool {
        self.controller.is_connected()
    }

    async fn lost(&mut self) {
        // Looking at the state again each second covers a loss between two waits.
        while self.joined && self.controller.is_connected() {
            let event = self.controller.wait_for_disconnect_async();
            select(event, Timer::after(LOOK_EVERY)).await;
        }
        self.joined = false;
    }
}

fn fault(error: WifiError) -> RadioFault {
    defmt::warn!("radio: {}", error);
    RadioFault
}

fn station_config(network: &Network) -> Option<StationConfig> {
    let config = StationConfig::default()
        .with_ssid(network.ssid.as_bytes().try_into().ok()?)
        .with_authentication(protection(network.password.as_ref())?)
        // The strongest access point of that name, not the first that answers.
        .with_scan_method(ScanMethod::AllChannels);
    Some(config)
}

fn access_point_config(network: &Network) -> Option<AccessPointConfig> {
    let config = AccessPointConfig::default()
        .with_ssid(network.ssid.as_bytes().try_into().ok()?)
        .with_authentication(protection(network.password.as_ref())?)
        .with_max_connections(GUESTS_MAX);
    Some(config)
}

/// For a station this is the weakest protection accepted: a network with a stored password is never
/// joined without, even if somebody puts up an open one of the same name.
fn protection(password: Option<&Password>) -> Option<AuthenticationMethodConfig> {
    Some(match password {
        None => AuthenticationMethodConfig::Open,
        Some(phrase) => {
            AuthenticationMethodConfig::Wpa2Personal(phrase.as_bytes().try_into().ok()?)
        }
    })
}

fn entry(info: &AccessPointInfo) -> Option<Heard> {
    // esp-radio shows a name only as text, cut at the first byte that is not UTF-8. A name that was
    // cut would be another network's: such networks are left out. They can still be joined by name.
    let name = info.ssid.as_str();
    if name.len() != info.ssid.len() {
        return None;
    }
    Some(Heard {
        ssid: Ssid::new(name.as_bytes())?,
        security: match info.auth_method {
            Some(AuthenticationMethod::None) => Security::Open,
            Some(
                AuthenticationMethod::Wpa2Personal
                | AuthenticationMethod::WpaWpa2Personal
                | AuthenticationMethod::Wpa2Wpa3Personal,
            ) => Security::Password,
            _ => Security::Unsupported,
        },
        signal_dbm: info.signal_strength,
    })
}

/// What a refusal means to a person.
///
/// Reasons are those of esp_wifi_types.h (ESP-IDF, "Wi-Fi reason code"): with a wrong passphrase
/// an access point stays silent in the four-way handshake (15, or 204 as the driver's own timeout),
/// or ends it (14: the check value does not fit; 202: authentication failed). 2, the expired
/// authentication, is not among them: an access point at the edge of reach gives it too.
fn outcome(reason: DisconnectReason) -> Joined {
    use DisconnectReason as Why;
    match reason {
        Why::NoAccessPointFound | Why::NoAccessPointFoundInRssiThreshold => Joined::NotFound,
        Why::NoAccessPointFoundWithCompatibleSecurity
        | Why::NoAccessPointFoundInAuthmodeThreshold => Joined::Unfit,
        Why::FourWayHandshakeTimeout
        | Why::HandshakeTimeout
        | Why::AuthenticationFailed
        | Why::MicFailure => Joined::WrongPassword,
        other => Joined::Failed(number(other)),
    }
}

/// The number behind a reason, for M122 and for looking it up.
fn number(reason: DisconnectReason) -> u16 {
    use DisconnectReason as Why;
    match reason {
        Why::AuthenticationExpired => 2,
        Why::AuthenticationLeave => 3,
        Why::DisassociatedDueToInactivity => 4,
        Why::AssociationTooMany => 5,
        Why::Class2FrameFromNonAuthenticatedStation => 6,
        Why::Class3FrameFromNonAssociatedStation => 7,
        Why::AssociationLeave => 8,
        Why::AssociationNotAuthenticated => 9,
        Why::MicFailure => 14,
        Why::FourWayHandshakeTimeout => 15,
        Why::GroupKeyUpdateTimeout => 16,
        Why::BeaconTimeout => 200,
        Why::NoAccessPointFound => 201,
        Why::AuthenticationFailed => 202,
        Why::AssociationFailed => 203,
        Why::HandshakeTimeout => 204,
        Why::ConnectionFailed => 205,
        Why::NoAccessPointFoundInRssiThreshold => 212,
        _ => 1,
    }
}
