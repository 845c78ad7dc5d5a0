//! One network interface for the stack, with the station or the access point behind it.
//!
//! The arm serves one network at a time: either it joined one, or it runs its own. A second stack
//! for the access point would double sockets and buffers for that.

use core::sync::atomic::{AtomicBool, Ordering};
use core::task::Context;
use embassy_net_driver::{Capabilities, Driver, HardwareAddress, LinkState};
use esp_radio::wifi::Interface;

static ACCESS_POINT: AtomicBool = AtomicBool::new(false);

/// Which side of the radio the network stack talks to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The joined network.
    Station,
    /// Our own.
    AccessPoint,
}

/// Chooses the side. The stack must be given the addresses that go with it, see [`super::net`].
pub(super) fn choose(side: Side) {
    ACCESS_POINT.store(side == Side::AccessPoint, Ordering::Relaxed);
}

/// Both sides of the radio as one interface.
pub struct Interfaces {
    station: Interface,
    access_point: Interface,
}

impl Interfaces {
    /// `None` if somebody holds one of the interfaces already.
    pub(super) fn take() -> Option<Self> {
        Some(Self {
            station: Interface::try_station()?,
            access_point: Interface::try_access_point()?,
        })
    }

    fn chosen(&mut self) -> &mut Interface {
        if ACCESS_POINT.load(Ordering::Relaxed) {
            &mut self.access_point
        } else {
            &mut self.station
        }
    }
}

impl Driver for Interfaces {
    type RxToken<'a> = <Interface as Driver>::RxToken<'a>;
    type TxToken<'a> = <Interface as Driver>::TxToken<'a>;

    fn receive(
        &mut self,
        context: &mut Context<'_>,
    ) -> Option<(Self::RxToken<'_>, Self::TxToken<'_>)> {
        Driver::receive(self.chosen(), context)
    }

    fn transmit(&mut self, context: &mut Context<'_>) -> Option<Self::TxToken<'_>> {
        Driver::transmit(self.chosen(), context)
    }

    fn link_state(&mut self, context: &mut Context<'_>) -> LinkState {
        Driver::link_state(self.chosen(), context)
    }

    fn capabilities(&self) -> Capabilities {
        self.station.capabilities()
    }

    fn hardware_address(&self) -> HardwareAddress {
        if ACCESS_POINT.load(Ordering::Relaxed) {
            self.access_point.hardware_address()
        } else {
            self.station.hardware_address()
        }
    }
}
