//! What a board file says: what is wired to which pin, and what the servos expect.
//!
//! To build your own arm, change the numbers in the file of your chip (`docs/boards.md`), and build.

use protocol_core::arm::{PenLift, ServoRange};
use protocol_core::machine::ArmData;
use protocol_core::motion::{Microdegrees, PulseWidth};

#[cfg(feature = "esp32")]
pub use crate::boards::esp32::BOARD;
#[cfg(feature = "esp32c3")]
pub use crate::boards::esp32c3::BOARD;
#[cfg(feature = "esp32c6")]
pub use crate::boards::esp32c6::BOARD;
#[cfg(feature = "esp32s3")]
pub use crate::boards::esp32s3::BOARD;

/// Everything that differs from one arm to the next.
pub struct Board {
    /// Name for people.
    pub name: &'static str,
    /// What manifests of updates call it: the feature that it is built with.
    pub update_name: &'static str,
    /// Servo frames a second: 50 for analogue servos, up to 333 for digital ones.
    pub frame_rate_hz: u32,
    /// The servo that carries the upper link.
    pub shoulder: ServoPort,
    /// The servo that sets the forearm's direction.
    pub elbow: ServoPort,
    /// The servo that lifts the pen.
    pub pen: ServoPort,
    /// Angle of the pen servo at Z = 0; at Z = 1000 it is 135 degrees.
    pub pen_down_degrees: i16,
    /// Full speed of the servos.
    pub degrees_per_second: u16,
    /// The status light.
    pub light: LightPort,
    /// Push button to ground; the chip's pull-up is switched on.
    pub button_pin: u8,
    /// UART0, towards a computer: 57600 8N1.
    pub serial: SerialPort,
    /// Air assist, aux1 and aux2 of the serial dialect (M80 to M85), high when on.
    pub outputs: [Option<u8>; 3],
    /// The door's switch.
    pub door_open: Option<InputPort>,
    /// The chiller's alarm.
    pub chiller_off: Option<InputPort>,
    /// The loss of the servos' supply; it stops the arm.
    pub power_off: Option<InputPort>,
    /// Pins of this chip that a board must not use: flash, USB, and so on.
    pub reserved_pins: &'static [u8],
}

impl Board {
    /// What the arm has to know of it.
    pub fn arm(&self) -> ArmData {
        ArmData {
            servos: [&self.shoulder, &self.elbow, &self.pen].map(ServoPort::range),
            lift: PenLift::new(Microdegrees::from_degrees(self.pen_down_degrees)),
            full_speed: self.degrees_per_second,
            ..ArmData::default()
        }
    }
}

/// One servo.
pub struct ServoPort {
    /// Signal pin. Take one without pull-up at reset, and add 10 kOhm to ground if the servo twitches at
    /// power-up: the pin floats until the firmware runs.
    pub pin: u8,
    /// Pulse at 0 degrees of servo angle.
    pub at_0: PulseWidth,
    /// Pulse at 180 degrees; the shorter one where the servo turns the other way.
    pub at_180: PulseWidth,
}

impl ServoPort {
    /// A servo at `pin`, with its pulses at 0 and at 180 degrees in microseconds.
    pub const fn new(pin: u8, micros_at_0: u16, micros_at_180: u16) -> Self {
        Self {
            pin,
            at_0: PulseWidth::from_micros(micros_at_0),
            at_180: PulseWidth::from_micros(micros_at_180),
        }
    }

    const fn range(&self) -> ServoRange {
        ServoRange::new(self.at_0, self.at_180)
    }
}

/// The status light.
pub enum LightPort {
    /// One addressable LED (WS2812, SK6812).
    Ws2812 {
        /// Data pin.
        pin: u8,
        /// In which order the LED takes the colours.
        order: ColourOrder,
    },
    /// Three LEDs, each with its own pin.
    Pwm {
        /// Pin of the red one.
        red: u8,
        /// Pin of the green one.
        green: u8,
        /// Pin of the blue one.
        blue: u8,
        /// The pins switch to ground (common anode): on is low.
        active_low: bool,
    },
}

/// Order of the colours on the wire.
#[derive(Clone, Copy)]
pub enum ColourOrder {
    /// Green first: WS2812B, SK6812.
    Grb,
    /// Red first: some clones.
    Rgb,
}

/// UART0.
pub struct SerialPort {
    /// From the machine to the computer.
    pub tx: u8,
    /// From the computer to the machine.
    pub rx: u8,
}

/// An input of the serial dialect.
pub struct InputPort {
    /// Signal pin.
    pub pin: u8,
    /// High says that the door is open, or chiller or power off; else low does. The pull is towards the
    /// other level.
    pub set_when_high: bool,
}

impl InputPort {
    const fn pin(port: &Option<Self>) -> Option<u8> {
        match port {
            Some(port) => Some(port.pin),
            None => None,
        }
    }
}

/// Nonsense in a board file stops the build, not the arm.
const _: () = check(&BOARD);

#[expect(
    clippy::indexing_slicing,
    reason = "done by the compiler, which has no iterators yet"
)]
const fn check(board: &Board) {
    assert!(
        board.frame_rate_hz >= 40 && board.frame_rate_hz <= 400,
        "frame rate: 40 to 400 Hz"
    );
    check_servo(&board.shoulder, board.frame_rate_hz);
    check_servo(&board.elbow, board.frame_rate_hz);
    check_servo(&board.pen, board.frame_rate_hz);
    assert!(
        board.pen_down_degrees >= 0 && board.pen_down_degrees <= 180,
        "pen: 0 to 180 degrees"
    );
    assert!(board.degrees_per_second > 0, "the arm would not move");

    // The light has one pin or three.
    let (light, green, blue) = match board.light {
        LightPort::Ws2812 { pin, .. } => (pin, None, None),
        LightPort::Pwm {
            red, green, blue, ..
        } => (red, Some(green), Some(blue)),
    };
    let pins = [
        Some(board.shoulder.pin),
        Some(board.elbow.pin),
        Some(board.pen.pin),
        Some(light),
        green,
        blue,
        Some(board.button_pin),
        Some(board.serial.tx),
        Some(board.serial.rx),
        board.outputs[0],
        board.outputs[1],
        board.outputs[2],
        InputPort::pin(&board.door_open),
        InputPort::pin(&board.chiller_off),
        InputPort::pin(&board.power_off),
    ];
    let mut i = 0;
    while i < pins.len() {
        if let Some(pin) = pins[i] {
            let mut j = 0;
            while j < i {
                let twice = matches!(pins[j], Some(other) if other == pin);
                assert!(!twice, "a pin is used twice");
                j += 1;
            }
            let mut r = 0;
            while r < board.reserved_pins.len() {
                assert!(
                    pin != board.reserved_pins[r],
                    "a pin is needed by the chip itself"
                );
                r += 1;
            }
        }
        i += 1;
    }
}

const fn check_servo(servo: &ServoPort, frame_rate_hz: u32) {
    // A servo wants to see the end of a pulse.
    let longest = 1_000_000 / frame_rate_hz - 100;
    check_pulse(servo.at_0, longest);
    check_pulse(servo.at_180, longest);
    assert!(
        servo.at_0.get() != servo.at_180.get(),
        "the servo would not move"
    );
}

const fn check_pulse(pulse: PulseWidth, longest_micros: u32) {
    let micros = pulse.get() / PulseWidth::PER_MICROSECOND;
    assert!(
        micros >= 200 && micros <= 2_900,
        "servo pulse: 200 to 2900 us"
    );
    assert!(micros <= longest_micros, "servo pulse: longer than a frame");
}
