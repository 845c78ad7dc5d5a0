//! What the two virtio consoles share.

use core::{future::poll_fn, task::Poll};

use bitflags::bitflags;
use virtio_drivers::queue::VirtQueue;

use crate::boards::virt::virtio::{Slot, dma::BoardHal};

/// Number of the queue that the device fills (virtio 1.2, 5.3.2).
pub const RECEIVE: u16 = 0;
/// Number of the queue that it empties.
pub const TRANSMIT: u16 = 1;

/// A queue with one buffer at a time.
pub type Queue = VirtQueue<BoardHal, 2>;

bitflags! {
    #[derive(Clone, Copy, Debug)]
    pub struct Features: u64 {
        /// Not a legacy device; nothing else is asked for: one port, plain rings.
        const VERSION_1 = 1 << 32;
    }
}

/// Waits until the device has finished with the buffer.
pub async fn used(slot: Slot, queue: &Queue) {
    poll_fn(|cx| {
        slot.waker().register(cx.waker());
        if queue.can_pop() {
            Poll::Ready(())
        } else {
            Poll::Pending
        }
    })
    .await;
}
