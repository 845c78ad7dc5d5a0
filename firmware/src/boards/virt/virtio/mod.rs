//! What the virtio drivers share: finding devices, their interrupts, and memory that devices may reach.
#![allow(unsafe_code)]

pub mod dma;

use core::ptr::NonNull;

use embassy_sync::waitqueue::AtomicWaker;
use virtio_drivers::transport::{
    DeviceType, Transport as _,
    mmio::{MmioTransport, VirtIOHeader},
};

use crate::boards::virt::{map, mmio::Register, plic};

/// How this board reaches a virtio device.
pub type Transport = MmioTransport<'static>;

/// `InterruptStatus` and `InterruptACK` (virtio 1.2, 4.2.2).
const INTERRUPT_STATUS: usize = 0x60;
const INTERRUPT_ACK: usize = 0x64;

/// One waker for each slot, so one task for each device.
static WAKERS: [AtomicWaker; map::VIRTIO_SLOTS] = [const { AtomicWaker::new() }; map::VIRTIO_SLOTS];

/// Number of a virtio slot, 0..8.
#[derive(Clone, Copy, Debug)]
pub struct Slot(usize);

impl Slot {
    pub(crate) fn base(self) -> usize {
        map::VIRTIO + self.0 * map::VIRTIO_STEP
    }

    /// What the device's interrupt wakes. Register first, then look at the device, and no interrupt is missed.
    pub fn waker(self) -> &'static AtomicWaker {
        &WAKERS[self.0]
    }

    /// Lets the device interrupt.
    pub fn enable_interrupt(self) {
        plic::enable(map::VIRTIO_SOURCE + self.0 as u32);
    }

    fn register(self, offset: usize) -> Register {
        // SAFETY: a register of a virtio slot of the virt machine; empty slots answer too.
        unsafe { Register::at(self.base() + offset) }
    }
}

/// A device and where it sits.
pub struct Device {
    /// Its slot.
    pub slot: Slot,
    /// Its registers.
    pub transport: Transport,
}

impl Device {
    /// Kind of device.
    pub fn kind(&self) -> DeviceType {
        self.transport.device_type()
    }
}

/// The devices that are plugged in, by rising slot number.
///
/// # Safety
/// Each slot may be taken by one driver only: call once.
pub unsafe fn devices() -> impl Iterator<Item = Device> {
    (0..map::VIRTIO_SLOTS).filter_map(|n| {
        let slot = Slot(n);
        let header = NonNull::new(core::ptr::without_provenance_mut::<VirtIOHeader>(
            slot.base(),
        ))?;
        // SAFETY: a slot of the virt machine, there for ever; the caller sees to it that it is taken once. This module
        // itself touches only the two interrupt registers, which the drivers of this board leave alone.
        let transport = unsafe { MmioTransport::new(header, map::VIRTIO_STEP) }.ok()?;
        Some(Device { slot, transport })
    })
}

/// A virtio device interrupts: acknowledge, and let its task look at the rings.
pub(crate) fn on_interrupt(source: u32) {
    let slot = Slot((source - map::VIRTIO_SOURCE) as usize);
    let status = slot.register(INTERRUPT_STATUS).read();
    slot.register(INTERRUPT_ACK).write(status);
    slot.waker().wake();
}
