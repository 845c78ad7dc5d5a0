//! ESP32-S3-DevKitC-1: light on GPIO48 (version 1.1: GPIO38), BOOT button on GPIO0. Not yet tried.

use super::esp::data::{Board, ColourOrder, LightPort, SerialPort, ServoPort};

/// The board.
pub const BOARD: Board = Board {
    name: "ESP32-S3-DevKitC-1",
    update_name: "esp32s3",
    // Analogue servos. Digital ones take up to 333.
    frame_rate_hz: 50,
    // Pulses at 0 and at 180 degrees, in microseconds.
    shoulder: ServoPort::new(4, 500, 2500),
    elbow: ServoPort::new(5, 500, 2500),
    pen: ServoPort::new(6, 500, 2500),
    // Where the pen servo stands with the pen on the paper; lifted it stands at 135.
    pen_down_degrees: 90,
    // How fast a servo turns on its own, for G00.
    degrees_per_second: 600,
    light: LightPort::Ws2812 {
        pin: 48,
        order: ColourOrder::Grb,
    },
    button_pin: 0,
    serial: SerialPort { tx: 43, rx: 44 },
    // Air assist, aux1, aux2.
    outputs: [None; 3],
    door_open: None,
    chiller_off: None,
    power_off: None,
    // USB 19 and 20, flash and PSRAM 26 to 37.
    reserved_pins: &[19, 20, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37],
};
