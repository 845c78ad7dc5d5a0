//! Pins by number, so that a board file is plain data.

use esp_hal::gpio::AnyPin;

/// Takes a pin of the board by its number.
///
/// # Panics
///
/// If the chip has no such pin. Board data is constant, so this shows at the first start.
#[expect(unsafe_code, reason = "pins by number, see SAFETY")]
pub(crate) fn pin(number: u8) -> AnyPin<'static> {
    // SAFETY: two drivers must not hold the same pin. Every number that comes here is a field of
    // `BOARD`, each is taken once by `start::parts`, and `data::check` refuses a board that uses
    // a pin twice or that uses one of the flash or USB pins.
    unsafe { AnyPin::steal(number) }
}
