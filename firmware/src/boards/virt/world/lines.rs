//! Driver of the virtio console that brings lines from the host; the log goes out on the same device ([`crate::boards::virt::console`]).
#![allow(unsafe_code)]

use static_cell::ConstStaticCell;
use virtio_drivers::transport::Transport as _;

use super::{
    console_queue::{Port, RECEIVE},
    on_line,
};
use crate::boards::virt::virtio::Device;

/// Bytes received at a time.
const BATCH: usize = 64;
/// Longest line that can mean anything.
const LINE: usize = 32;

static BUFFER: ConstStaticCell<[u8; BATCH]> = ConstStaticCell::new([0; _]);

/// The console that brings lines in.
pub struct Lines(Port);

impl Lines {
    /// Takes the device.
    ///
    /// # Panics
    /// When the device refuses.
    pub fn new(device: Device) -> Self {
        Self(Port::new(device, RECEIVE))
    }

    /// Takes lines for ever.
    ///
    /// # Panics
    /// When called twice.
    pub async fn run(self) -> ! {
        let Self(mut port) = self;
        let buffer = BUFFER.take();
        let mut line = heapless::Vec::<u8, LINE>::new();
        loop {
            // SAFETY: the buffer lives for ever, and nothing touches it until it is popped; were this future dropped, it would
            // stay taken.
            let token =
                unsafe { port.queue.add(&[], &mut [buffer]) }.expect("one buffer at a time");
            port.transport.notify(RECEIVE);
            port.used().await;
            // SAFETY: the very buffer that was added.
            let received = unsafe { port.queue.pop_used(token, &[], &mut [buffer]) }
                .expect("only one was added");
            for &byte in &buffer[..(received as usize).min(BATCH)] {
                if byte == b'\n' {
                    on_line(&line);
                    line.clear();
                } else {
                    // A line that is too long keeps its beginning, is not recognised, and is reported.
                    let _ = line.push(byte);
                }
            }
        }
    }
}
