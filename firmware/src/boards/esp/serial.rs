//! UART0 for G-code. Log text never goes here: it leaves through USB-Serial-JTAG.
//!
//! The ROM and the second-stage bootloader do print on UART0 while the chip starts, at 115200
//! baud, before this firmware runs; a host must be prepared to discard it.

use super::data::SerialPort;
use super::pins::pin;
use esp_hal::Async;
use esp_hal::peripherals::UART0;
use esp_hal::uart::{Config, ConfigError, DataBits, Parity, StopBits, Uart, UartRx, UartTx};

/// Of the LasaurGrbl dialect.
const BAUD: u32 = 57_600;

/// Receiving half: `embedded_io_async::Read`. An error (noise, overrun) loses bytes, not the port.
pub type SerialRx = UartRx<'static, Async>;
/// Sending half: `embedded_io_async::Write`.
pub type SerialTx = UartTx<'static, Async>;

/// Opens UART0 with 57600 8N1.
pub(super) fn open(
    uart: UART0<'static>,
    port: &SerialPort,
) -> Result<(SerialRx, SerialTx), ConfigError> {
    let config = Config::default()
        .with_baudrate(BAUD)
        .with_data_bits(DataBits::_8)
        .with_parity(Parity::None)
        .with_stop_bits(StopBits::_1);
    let uart = Uart::new(uart, config)?
        .with_tx(pin(port.tx))
        .with_rx(pin(port.rx))
        .into_async();
    Ok(uart.split())
}
