//! ESP32-DevKitC with the first ESP32: three LEDs of your own, BOOT button on GPIO0. Not yet tried.

use super::esp::data::{Board, LightPort, SerialPort, ServoPort};

/// The board.
pub const BOARD: Board = Board {
    name: "ESP32-DevKitC",
    update_name: "esp32",
    // Analogue servos. Digital ones take up to 333.
    frame_rate_hz: 50,
    // Pulses at 0 and at 180 degrees, in microseconds.
    shoulder: ServoPort::new(25, 500, 2500),
    elbow: ServoPort::new(26, 500, 2500),
    pen: ServoPort::new(27, 500, 2500),
    // Where the pen servo stands with the pen on the paper; lifted it stands at 135.
    pen_down_degrees: 90,
    // How fast a servo turns on its own, for G00.
    degrees_per_second: 600,
    light: LightPort::Pwm {
        red: 16,
        green: 17,
        blue: 18,
        active_low: false,
    },
    button_pin: 0,
    serial: SerialPort { tx: 1, rx: 3 },
    // Air assist, aux1, aux2.
    outputs: [None; 3],
    door_open: None,
    chiller_off: None,
    power_off: None,
    // Flash 6 to 11, inputs only 34 to 39.
    reserved_pins: &[6, 7, 8, 9, 10, 11, 34, 35, 36, 37, 38, 39],
};
