//! ESP32-C3-DevKitM-1, and the many boards with the same light (GPIO8) and BOOT button (GPIO9).

use super::esp::data::{Board, ColourOrder, LightPort, SerialPort, ServoPort};

/// The board.
pub const BOARD: Board = Board {
    name: "ESP32-C3-DevKitM-1",
    update_name: "esp32c3",
    // Analogue servos. Digital ones take up to 333.
    frame_rate_hz: 50,
    // Pulses at 0 and at 180 degrees, in microseconds.
    shoulder: ServoPort::new(3, 500, 2500),
    elbow: ServoPort::new(4, 500, 2500),
    pen: ServoPort::new(5, 500, 2500),
    // Where the pen servo stands with the pen on the paper; lifted it stands at 135.
    pen_down_degrees: 90,
    // How fast a servo turns on its own, for G00.
    degrees_per_second: 600,
    light: LightPort::Ws2812 {
        pin: 8,
        order: ColourOrder::Grb,
    },
    button_pin: 9,
    serial: SerialPort { tx: 21, rx: 20 },
    // Air assist, aux1, aux2.
    outputs: [None; 3],
    door_open: None,
    chiller_off: None,
    power_off: None,
    // Flash 11 to 17, USB 18 and 19.
    reserved_pins: &[11, 12, 13, 14, 15, 16, 17, 18, 19],
};
