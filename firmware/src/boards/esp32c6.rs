//! ESP32-C6-DevKitC-1: light on GPIO8, BOOT button on GPIO9.

use super::esp::data::{Board, ColourOrder, LightPort, SerialPort, ServoPort};

/// The board.
pub const BOARD: Board = Board {
    name: "ESP32-C6-DevKitC-1",
    update_name: "esp32c6",
    // Analogue servos. Digital ones take up to 333.
    frame_rate_hz: 50,
    // Pulses at 0 and at 180 degrees, in microseconds.
    shoulder: ServoPort::new(18, 500, 2500),
    elbow: ServoPort::new(19, 500, 2500),
    pen: ServoPort::new(20, 500, 2500),
    // Where the pen servo stands with the pen on the paper; lifted it stands at 135.
    pen_down_degrees: 90,
    // How fast a servo turns on its own, for G00.
    degrees_per_second: 600,
    light: LightPort::Ws2812 {
        pin: 8,
        order: ColourOrder::Grb,
    },
    button_pin: 9,
    serial: SerialPort { tx: 16, rx: 17 },
    // Air assist, aux1, aux2.
    outputs: [None; 3],
    door_open: None,
    chiller_off: None,
    power_off: None,
    // USB 12 and 13, flash 24 to 30.
    reserved_pins: &[12, 13, 24, 25, 26, 27, 28, 29, 30],
};
