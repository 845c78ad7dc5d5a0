//! What the two virtio consoles share.

use core::{future::poll_fn, task::Poll};

use bitflags::bitflags;
use virtio_drivers::queue::VirtQueue;
use virtio_drivers::transport::Transport as _;

use crate::boards::virt::virtio::{Device, Slot, Transport, dma::BoardHal};

/// Number of the queue that the device fills (virtio 1.2, 5.3.2).
pub const RECEIVE: u16 = 0;
/// Number of the queue that it empties.
pub const TRANSMIT: u16 = 1;

/// A queue with one buffer at a time.
type Queue = VirtQueue<BoardHal, 2>;

bitflags! {
    #[derive(Clone, Copy, Debug)]
    struct Features: u64 {
        /// Not a legacy device; nothing else is asked for: one port, plain rings.
        const VERSION_1 = 1 << 32;
    }
}

/// One direction of a console.
pub struct Port {
    slot: Slot,
    /// The device's registers.
    pub transport: Transport,
    /// What it fills or empties.
    pub queue: Queue,
}

impl Port {
    /// Takes the device, for the direction of queue `number` alone.
    ///
    /// # Panics
    /// When the device refuses.
    pub fn new(device: Device, number: u16) -> Self {
        let Device {
            slot,
            mut transport,
        } = device;
        transport.begin_init(Features::VERSION_1);
        let queue = Queue::new(&mut transport, number, false, false).expect("virtio-console");
        transport.finish_init();
        slot.enable_interrupt();
        Self {
            slot,
            transport,
            queue,
        }
    }

    /// Waits until the device has finished with the buffer.
    pub async fn used(&self) {
        poll_fn(|cx| {
            self.slot.waker().register(cx.waker());
            if self.queue.can_pop() {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
        .await;
    }
}
