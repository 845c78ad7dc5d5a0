//! Driver of the virtio console that takes the records, by interrupt and without spinning; the driver that comes with
//! `virtio-drivers` waits in a loop for each buffer it sends.
//!
//! Attach a file (`-chardev file`): of a socket or a pipe that does not take everything at once, QEMU's `virtconsole` drops the
//! rest without a word (`hw/char/virtio-console.c`, `flush_buf`).
#![allow(unsafe_code)]

use static_cell::ConstStaticCell;
use virtio_drivers::transport::Transport as _;

use super::{
    console_queue::{Port, TRANSMIT},
    record,
};
use crate::boards::virt::virtio::Device;

/// Bytes sent at a time.
const BATCH: usize = 4096;

static BUFFER: ConstStaticCell<[u8; BATCH]> = ConstStaticCell::new([0; _]);

/// The console that carries records out.
pub struct Recorder(Port);

impl Recorder {
    /// Takes the device.
    ///
    /// # Panics
    /// When the device refuses.
    pub fn new(device: Device) -> Self {
        Self(Port::new(device, TRANSMIT))
    }

    /// Carries records for ever.
    ///
    /// # Panics
    /// When called twice.
    pub async fn run(self) -> ! {
        let Self(mut port) = self;
        let buffer = BUFFER.take();
        loop {
            let length = record::next_batch(buffer).await;
            // SAFETY: the buffer lives for ever, and nothing touches it until it is popped; were this future dropped, it would
            // stay taken.
            let token = unsafe { port.queue.add(&[&buffer[..length]], &mut []) }
                .expect("one buffer at a time");
            port.transport.notify(TRANSMIT);
            port.used().await;
            // SAFETY: the very bytes that were added.
            unsafe { port.queue.pop_used(token, &[&buffer[..length]], &mut []) }
                .expect("only one was added");
        }
    }
}
