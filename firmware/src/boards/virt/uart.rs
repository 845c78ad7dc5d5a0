//! The 16550 serial port, by interrupt in both directions.
#![allow(unsafe_code)]

use core::{
    cell::RefCell,
    convert::Infallible,
    num::NonZeroUsize,
    sync::atomic::{AtomicU32, Ordering},
};

use critical_section::Mutex;
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, pipe::Pipe};
use embedded_io_async::{Error, ErrorKind, ErrorType, Read, Write};
use uart_16550::{
    BaudRate, Config, Uart16550,
    backend::MmioBackend,
    spec::{
        FIFO_SIZE,
        registers::{FifoTriggerLevel, IER},
    },
};

use crate::boards::virt::{map, plic};

/// Bytes buffered in each direction.
pub const BUFFER: usize = 1024;

static PORT: Mutex<RefCell<Uart16550<MmioBackend>>> = Mutex::new(RefCell::new(port()));
static RECEIVED: Pipe<CriticalSectionRawMutex, BUFFER> = Pipe::new();
static TO_SEND: Pipe<CriticalSectionRawMutex, BUFFER> = Pipe::new();
static OVERRUNS: AtomicU32 = AtomicU32::new(0);

const fn port() -> Uart16550<MmioBackend> {
    let address = NonZeroUsize::new(map::UART).expect("not zero");
    // SAFETY: the serial port of the virt machine; used here only, save for the last words of a panic.
    match unsafe { Uart16550::new_mmio_from_address(address, 1) } {
        Ok(port) => port,
        Err(_) => panic!("a valid address"),
    }
}

/// Sets the port up and returns its two ends. To QEMU the line rate is only a time limit.
///
/// # Panics
/// When the device does not answer.
pub fn init() -> (Receiver, Transmitter) {
    let config = Config {
        interrupts: IER::DATA_READY,
        // QEMU offers its backend's bytes only as many at a time as the trigger level says; fewer are reported when four
        // characters' time has passed, which the highest rate makes short.
        fifo_trigger_level: Some(FifoTriggerLevel::Fourteen),
        baud_rate: BaudRate::Baud115200,
        ..Config::DEFAULT
    };
    critical_section::with(|cs| PORT.borrow_ref_mut(cs).init(config)).expect("16550");
    plic::enable(map::UART_SOURCE);
    (Receiver { told: 0 }, Transmitter(()))
}

/// Bytes that came when [`BUFFER`] was full and are lost.
pub fn overruns() -> u32 {
    OVERRUNS.load(Ordering::Relaxed)
}

pub(crate) fn on_interrupt() {
    critical_section::with(|cs| {
        let mut port = PORT.borrow_ref_mut(cs);
        // Reading the cause takes back "transmitter empty"; the rest is level triggered.
        let _ = port.isr();
        while let Ok(byte) = port.try_receive_byte() {
            if RECEIVED.try_write(&[byte]).is_err() {
                OVERRUNS.store(overruns() + 1, Ordering::Relaxed);
            }
        }
        feed(&mut port);
    });
}

/// Moves what waits into the transmit FIFO; "transmitter empty" interrupts as long as something was moved.
fn feed(port: &mut Uart16550<MmioBackend>) {
    if port.ready_to_send().is_err() {
        return;
    }
    let mut chunk = [0; FIFO_SIZE];
    match TO_SEND.try_read(&mut chunk) {
        Ok(length) => {
            port.send_bytes(&chunk[..length]);
            port.enable_interrupts(IER::THR_EMPTY);
        }
        Err(_) => port.disable_interrupts(IER::THR_EMPTY),
    }
}

/// Receiving end of the port.
pub struct Receiver {
    /// Overruns that have been told.
    told: u32,
}

/// A byte was lost; the next ones can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overrun;

impl core::fmt::Display for Overrun {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        out.write_str("a byte was lost")
    }
}

impl core::error::Error for Overrun {}

impl Error for Overrun {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl ErrorType for Receiver {
    type Error = Overrun;
}

impl Read for Receiver {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Overrun> {
        let lost = overruns();
        if self.told != lost {
            self.told = lost;
            return Err(Overrun);
        }
        Ok(RECEIVED.read(buffer).await)
    }
}

/// Sending end of the port.
pub struct Transmitter(());

impl ErrorType for Transmitter {
    type Error = Infallible;
}

impl Write for Transmitter {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let length = TO_SEND.write(bytes).await;
        critical_section::with(|cs| feed(&mut PORT.borrow_ref_mut(cs)));
        Ok(length)
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        // QEMU's FIFO is as good as sent; wait until everything is in it.
        while !TO_SEND.is_empty() {
            embassy_futures::yield_now().await;
        }
        Ok(())
    }
}

/// Writes bytes at once, past all buffers. For the last words of a panic only.
pub(crate) fn write_now(bytes: &[u8]) {
    // A second handle: the first may be borrowed by what panicked.
    port().send_bytes_exact(bytes);
}
