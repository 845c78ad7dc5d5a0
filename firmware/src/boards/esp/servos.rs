//! Three servos on the LEDC.
//!
//! When a width takes effect: at the next frame, never inside one. The LEDC compares its counter
//! with two latched points, high at `hpoint` (0 here), low at `hpoint + duty`, and loads both from
//! the registers when the counter overflows, if `duty_start` and `para_up` were set since. Sources:
//! ESP-IDF `driver/ledc.h`, `ledc_update_duty`: "the new LEDC parameters don't take effect until the
//! next PWM cycle"; register descriptions of HPOINT, DUTY and PARA_UP in Espressif's SVD; technical
//! reference manual, "LED PWM controller", "PWM generators".
//!
//! All three channels run from one timer. Whoever writes once per frame, just after the frame began,
//! has nearly a frame of time until the next overflow: the three new widths begin together. Two
//! writes within one frame are not allowed for (ESP-IDF's issue 7288 tells of lost ones).

use super::data::BOARD;
use super::light::PwmPower;
use super::pulse_clock::PulseClock;
use super::pwm_timer::{self, COUNTER_BITS, OverflowFrames, SERVO_TIMER, SOURCE_HZ};
use crate::board;
use embassy_time::Duration;
use esp_hal::gpio::{AnyPin, DriveMode, Level, Output, OutputConfig};
use esp_hal::ledc::LowSpeed;
use esp_hal::ledc::channel::{self, Channel, ChannelHW, ChannelIFace};
use esp_hal::ledc::timer::{self, TimerIFace};
use esp_hal::time::Rate;
use protocol_core::machine::SetPoint;
use protocol_core::motion::{Micros, PulseWidth};
use static_cell::StaticCell;

/// The timer of this board: as fine as its frame rate allows.
const CLOCK: PulseClock = finest();

#[expect(clippy::panic, reason = "while this is compiled")]
const fn finest() -> PulseClock {
    match PulseClock::finest(SOURCE_HZ, BOARD.frame_rate_hz, COUNTER_BITS) {
        Some(clock) => clock,
        None => panic!("the chip cannot make this frame rate"),
    }
}

/// One frame as the timer really makes it, to the microsecond.
pub const FRAME: Duration = Duration::from_micros(
    ((CLOCK.frame().get() + PulseWidth::PER_MICROSECOND / 2) / PulseWidth::PER_MICROSECOND) as u64,
);

const CHANNELS: [channel::Number; 3] = [
    channel::Number::Channel0,
    channel::Number::Channel1,
    channel::Number::Channel2,
];

/// What [`Servos`] is made of. Unlike `Servos` it may be sent to the task of the servo tick.
pub struct ServoPorts {
    pub(super) pins: [AnyPin<'static>; 3],
    pub(super) outputs: [Option<AnyPin<'static>>; 3],
    pub(super) power: PwmPower,
}

/// The servo outputs, and those of M80 to M85.
pub struct Servos {
    channels: [Channel<'static, LowSpeed>; 3],
    outputs: [Option<Output<'static>>; 3],
}

impl ServoPorts {
    /// Takes the servo timer into service. The pins are driven low and stay low, without any pulse,
    /// until the first set-point.
    #[expect(
        clippy::expect_used,
        reason = "constant settings, which the checks of the board data have let through"
    )]
    pub fn start(self) -> (Servos, OverflowFrames) {
        static TIMER: StaticCell<timer::Timer<'static, LowSpeed>> = StaticCell::new();

        let timer = TIMER.init(self.power.timer(SERVO_TIMER));
        // esp-hal's channels want a timer that it set up itself. The settings that count follow.
        timer
            .configure(timer::config::Config {
                duty: timer::config::Duty::Duty14Bit,
                clock_source: timer::LSClockSource::APBClk,
                frequency: Rate::from_hz(BOARD.frame_rate_hz),
            })
            .expect("14 bits fit every frame rate that is let through");
        pwm_timer::set(&CLOCK);

        let [shoulder, elbow, pen] = self.pins;
        let timer: &'static timer::Timer<'static, LowSpeed> = timer;
        let channels = [
            idle(CHANNELS[0], shoulder, timer),
            idle(CHANNELS[1], elbow, timer),
            idle(CHANNELS[2], pen, timer),
        ];
        let off = |pin| Output::new(pin, Level::Low, OutputConfig::default());
        let outputs = self.outputs.map(|pin| pin.map(off));
        let servos = Servos { channels, outputs };
        (servos, OverflowFrames::listen())
    }
}

/// A channel whose pulse has no length: always low.
#[expect(
    clippy::expect_used,
    reason = "fails with a timer that is not set up, and this one is"
)]
fn idle(
    number: channel::Number,
    pin: AnyPin<'static>,
    timer: &'static timer::Timer<'static, LowSpeed>,
) -> Channel<'static, LowSpeed> {
    let mut channel = Channel::new(number, pin);
    channel
        .configure(channel::config::Config {
            timer,
            duty_pct: 0,
            drive_mode: DriveMode::PushPull,
        })
        .expect("the timer is configured");
    channel
}

impl board::Servos for Servos {
    fn write(&mut self, _: Micros, set_point: &SetPoint) {
        critical_section::with(|_| {
            for (channel, pulse) in self.channels.iter().zip(set_point.pulses) {
                channel.set_duty_hw(CLOCK.counts(pulse));
            }
        });
        for (output, on) in self.outputs.iter_mut().zip(set_point.outputs) {
            if let Some(output) = output {
                output.set_level(if on { Level::High } else { Level::Low });
            }
        }
    }
}
