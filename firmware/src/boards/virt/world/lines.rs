//! Driver of the virtio console that brings lines from the host; the log goes out on the same device ([`crate::boards::virt::console`]).
#![allow(unsafe_code)]

use static_cell::ConstStaticCell;
use virtio_drivers::transport::Transport as _;

use super::{
    console_queue::{Features, Queue, RECEIVE, used},
    on_line,
};
use crate::boards::virt::virtio::{Device, Slot, Transport};

/// Bytes received at a time.
const BATCH: usize = 64;
/// Longest line that can mean anything.
const LINE: usize = 32;

static BUFFER: ConstStaticCell<[u8; BATCH]> = ConstStaticCell::new([0; _]);

/// The console that brings lines in.
pub struct Lines {
    slot: Slot,
    transport: Transport,
    queue: Queue,
}

impl Lines {
    /// Takes the device.
    ///
    /// # Panics
    /// When the device refuses.
    pub fn new(device: Device) -> Self {
        let Device {
            slot,
            mut transport,
        } = device;
        transport.begin_init(Features::VERSION_1);
        let queue = Queue::new(&mut transport, RECEIVE, false, false).expect("virtio-console");
        transport.finish_init();
        slot.enable_interrupt();
        Self {
            slot,
            transport,
            queue,
        }
    }

    /// Takes lines for ever.
    ///
    /// # Panics
    /// When called twice.
    pub async fn run(self) -> ! {
        let Self {
            slot,
            mut transport,
            mut queue,
        } = self;
        let buffer = BUFFER.take();
        let mut line = heapless::Vec::<u8, LINE>::new();
        loop {
            // SAFETY: the buffer lives for ever, and nothing touches it until it is popped; were this future dropped, it would
            // stay taken.
            let token = unsafe { queue.add(&[], &mut [buffer]) }.expect("one buffer at a time");
            transport.notify(RECEIVE);
            used(slot, &queue).await;
            // SAFETY: the very buffer that was added.
            let received =
                unsafe { queue.pop_used(token, &[], &mut [buffer]) }.expect("only one was added");
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
