//! virtio-net as an `embassy-net` driver.
//!
//! The stack reads frames where the device put them and writes them where the device takes them: no copy, no allocation, no
//! task in between. The device's interrupt wakes the stack; nothing polls.
//!
//! Built on the crate's virtqueues and not on its `VirtIONetRaw`: that one cannot silence the interrupts of one direction, and a
//! finished transmission, which is no news, would have the stack look through all its sockets for nothing.
#![allow(unsafe_code)]

use core::{cell::RefCell, task::Context};

use bitflags::bitflags;
use embassy_net_driver::{Capabilities, Driver, HardwareAddress, LinkState, RxToken, TxToken};
use static_cell::ConstStaticCell;
use virtio_drivers::{queue::VirtQueue, transport::Transport as _};

use crate::boards::virt::virtio::{Device, Slot, Transport, dma::BoardHal};

/// Number of the queue that the device fills.
const RECEIVE: u16 = 0;
/// Number of the queue that it empties.
const TRANSMIT: u16 = 1;
/// Buffers of each direction, each with one descriptor.
const BUFFERS: usize = 16;
/// Header in front of each frame; all zero means a plain frame (virtio 1.2, 5.1.6).
const HEADER: usize = 12;
/// Longest Ethernet frame.
const FRAME: usize = 1514;

type Buffer = [u8; HEADER + FRAME];
type Queue = VirtQueue<BoardHal, BUFFERS>;

bitflags! {
    #[derive(Clone, Copy, Debug)]
    struct Features: u64 {
        /// The device has an address of its own.
        const MAC = 1 << 5;
        /// Not a legacy device. Event indices are not asked for, as interrupts are switched with the rings' plain flag.
        const VERSION_1 = 1 << 32;
    }
}

static RX: ConstStaticCell<[Buffer; BUFFERS]> = ConstStaticCell::new([[0; _]; _]);
static TX: ConstStaticCell<[Buffer; BUFFERS]> = ConstStaticCell::new([[0; _]; _]);

/// The network card.
pub struct VirtNet {
    slot: Slot,
    address: [u8; 6],
    // In a cell because smoltcp sends an answer while it holds the frame that asked for it.
    transport: RefCell<Transport>,
    receiver: Receiver,
    sender: Sender,
}

struct Receiver {
    queue: Queue,
    buffers: &'static mut [Buffer; BUFFERS],
    /// Which buffer each descriptor holds.
    held: [u8; BUFFERS],
}

struct Sender {
    queue: Queue,
    buffers: &'static mut [Buffer; BUFFERS],
    /// Which buffer each descriptor holds, and how much of it.
    held: [(u8, u16); BUFFERS],
    /// One bit for each buffer that the device does not hold.
    free: u16,
}

impl VirtNet {
    /// The card's hardware address.
    pub const fn address(&self) -> [u8; 6] {
        self.address
    }

    /// Takes the card and gives it buffers to receive into.
    ///
    /// # Panics
    /// When the device refuses, or when called twice.
    pub fn new(device: Device) -> Self {
        let Device {
            slot,
            mut transport,
        } = device;
        transport.begin_init(Features::MAC | Features::VERSION_1);
        let address = transport
            .read_config_space(0)
            .expect("the address is at the start of the configuration space");
        let receive = Queue::new(&mut transport, RECEIVE, false, false).expect("virtio-net");
        let mut transmit = Queue::new(&mut transport, TRANSMIT, false, false).expect("virtio-net");
        transmit.set_dev_notify(false);
        transport.finish_init();
        let mut receiver = Receiver {
            queue: receive,
            buffers: RX.take(),
            held: [0; BUFFERS],
        };
        for n in 0..BUFFERS {
            receiver.offer(&mut transport, n);
        }
        slot.enable_interrupt();
        let sender = Sender {
            queue: transmit,
            buffers: TX.take(),
            held: [(0, 0); BUFFERS],
            free: u16::MAX,
        };
        Self {
            slot,
            address,
            transport: RefCell::new(transport),
            receiver,
            sender,
        }
    }
}

impl Receiver {
    /// Gives buffer `n` to the device.
    fn offer(&mut self, transport: &mut Transport, n: usize) {
        // SAFETY: the buffer lives for ever and is not touched until `take` has it back.
        let token = unsafe { self.queue.add(&[], &mut [&mut self.buffers[n]]) }
            .expect("as many descriptors as buffers");
        self.held[usize::from(token)] = n as u8;
        if self.queue.should_notify() {
            transport.notify(RECEIVE);
        }
    }

    /// Takes the buffer of `token`, which the device has just finished, back; returns its number and the frame's length.
    fn take(&mut self, token: u16) -> (usize, usize) {
        let n = usize::from(self.held[usize::from(token)]);
        // SAFETY: the very buffer that was added with this token.
        let written = unsafe { self.queue.pop_used(token, &[], &mut [&mut self.buffers[n]]) }
            .expect("it was just peeked");
        (n, (written as usize).saturating_sub(HEADER).min(FRAME))
    }
}

impl Sender {
    /// Whether a buffer is free. Takes back what the device has sent; when that leaves none, the next one interrupts.
    fn ready(&mut self) -> bool {
        self.reclaim();
        if self.free == 0 {
            self.queue.set_dev_notify(true);
            // One may have been finished just before the interrupt was asked for.
            self.reclaim();
        }
        if self.free != 0 {
            self.queue.set_dev_notify(false);
        }
        self.free != 0
    }

    fn reclaim(&mut self) {
        while let Some(token) = self.queue.peek_used() {
            let (n, length) = self.held[usize::from(token)];
            let buffer = &self.buffers[usize::from(n)][..usize::from(length)];
            // SAFETY: the very bytes that were added with this token.
            unsafe { self.queue.pop_used(token, &[buffer], &mut []) }.expect("it was just peeked");
            self.free |= 1 << n;
        }
    }
}

/// A received frame, still in the device's queue until it is consumed.
pub struct Received<'a> {
    transport: &'a RefCell<Transport>,
    receiver: &'a mut Receiver,
    token: u16,
}

impl RxToken for Received<'_> {
    fn consume<R, F: FnOnce(&mut [u8]) -> R>(self, f: F) -> R {
        let Self {
            transport,
            receiver,
            token,
        } = self;
        let (n, length) = receiver.take(token);
        let result = f(&mut receiver.buffers[n][HEADER..][..length]);
        receiver.offer(&mut transport.borrow_mut(), n);
        result
    }
}

/// Leave to send one frame.
pub struct Sendable<'a> {
    transport: &'a RefCell<Transport>,
    sender: &'a mut Sender,
}

impl TxToken for Sendable<'_> {
    fn consume<R, F: FnOnce(&mut [u8]) -> R>(self, length: usize, f: F) -> R {
        let Self { transport, sender } = self;
        let n = sender.free.trailing_zeros() as usize;
        let whole = HEADER + length;
        // The header of each buffer has been zero from the start and stays so.
        let buffer = &mut sender.buffers[n][..whole];
        let result = f(&mut buffer[HEADER..]);
        // SAFETY: the buffer lives for ever and is not touched until `reclaim` has it back.
        let token = unsafe { sender.queue.add(&[buffer], &mut []) }
            .expect("as many descriptors as buffers");
        sender.free &= !(1 << n);
        sender.held[usize::from(token)] = (n as u8, whole as u16);
        if sender.queue.should_notify() {
            transport.borrow_mut().notify(TRANSMIT);
        }
        result
    }
}

impl Driver for VirtNet {
    type RxToken<'a> = Received<'a>;
    type TxToken<'a> = Sendable<'a>;

    fn receive(&mut self, cx: &mut Context) -> Option<(Received<'_>, Sendable<'_>)> {
        self.slot.waker().register(cx.waker());
        let token = self.receiver.queue.peek_used()?;
        // A frame is taken only when it can be answered.
        self.sender.ready().then_some((
            Received {
                transport: &self.transport,
                receiver: &mut self.receiver,
                token,
            },
            Sendable {
                transport: &self.transport,
                sender: &mut self.sender,
            },
        ))
    }

    fn transmit(&mut self, cx: &mut Context) -> Option<Sendable<'_>> {
        self.slot.waker().register(cx.waker());
        self.sender.ready().then_some(Sendable {
            transport: &self.transport,
            sender: &mut self.sender,
        })
    }

    fn link_state(&mut self, _cx: &mut Context) -> LinkState {
        LinkState::Up
    }

    fn capabilities(&self) -> Capabilities {
        let mut capabilities = Capabilities::default();
        capabilities.max_transmission_unit = FRAME;
        capabilities.max_burst_size = Some(BUFFERS);
        capabilities
    }

    fn hardware_address(&self) -> HardwareAddress {
        HardwareAddress::Ethernet(self.address)
    }
}
