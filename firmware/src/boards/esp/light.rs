//! The status light: a WS2812 through the RMT, or three LEDs on the LEDC.

use super::data::{ColourOrder, LightPort};
use super::pins::pin;
use crate::board::{self, Colour};
use esp_hal::Blocking;
use esp_hal::gpio::{DriveMode, Level};
use esp_hal::ledc::channel::{self, Channel, ChannelHW, ChannelIFace};
use esp_hal::ledc::timer::{self, TimerIFace, TimerSpeed};
use esp_hal::ledc::{LSGlobalClkSource, Ledc, LowSpeed};
use esp_hal::peripherals::{LEDC, RMT};
use esp_hal::rmt::{PulseCode, Rmt, Tx, TxChannelConfig, TxChannelCreator};
use esp_hal::time::Rate;
use static_cell::StaticCell;

/// RMT ticks of 12.5 ns.
const RMT_HZ: u32 = 80_000_000;
/// WS2812B data sheet: a 0 is 0.4 us high and 0.85 us low, a 1 is 0.8 us high and 0.45 us low,
/// each within 0.15 us.
const ZERO: PulseCode = PulseCode::new(Level::High, 32, Level::Low, 68);
const ONE: PulseCode = PulseCode::new(Level::High, 64, Level::Low, 36);

/// 13 bits leave an LED at 1/256 of its brightness 32 counts; 1 kHz does not flicker.
const PWM_RATE: Rate = Rate::from_hz(1_000);
const PWM_BITS: timer::config::Duty = timer::config::Duty::Duty13Bit;

/// The proof that the LEDC is powered and clocked, whoever of servos and light starts first.
#[derive(Clone, Copy)]
pub struct PwmPower(());

impl PwmPower {
    /// Powers the LEDC.
    pub(super) fn on(ledc: LEDC<'static>) -> Self {
        Ledc::new(ledc).set_global_slow_clock(LSGlobalClkSource::APBClk);
        Self(())
    }

    /// One of its timers. Each is to be used by one driver only.
    pub(super) fn timer<S: TimerSpeed>(self, number: timer::Number) -> timer::Timer<'static, S> {
        timer::Timer::new(LEDC::regs(), number)
    }
}

/// The status light.
pub struct Light(Kind);

enum Kind {
    /// The channel is away only while a colour is being sent.
    Ws2812 {
        channel: Option<esp_hal::rmt::Channel<'static, Blocking, Tx>>,
        order: ColourOrder,
    },
    Pwm {
        channels: [Channel<'static, LowSpeed>; 3],
        active_low: bool,
    },
}

impl Light {
    #[expect(
        clippy::expect_used,
        reason = "constant settings; 13 bits at 1 kHz fit 80 MHz"
    )]
    pub(super) fn new(port: &LightPort, rmt: RMT<'static>, power: PwmPower) -> Self {
        match *port {
            LightPort::Ws2812 { pin: number, order } => {
                let channel = Rmt::new(rmt, Rate::from_hz(RMT_HZ))
                    .and_then(|rmt| {
                        let config = TxChannelConfig::default()
                            .with_clk_divider(1)
                            .with_idle_output(true)
                            .with_idle_output_level(Level::Low);
                        rmt.channel0.configure_tx(&config)
                    })
                    .map(|channel| channel.with_pin(pin(number)));
                if channel.is_err() {
                    defmt::error!("no RMT channel for the light");
                }
                Self(Kind::Ws2812 {
                    channel: channel.ok(),
                    order,
                })
            }
            LightPort::Pwm {
                red,
                green,
                blue,
                active_low,
            } => {
                static TIMER: StaticCell<timer::Timer<'static, LowSpeed>> = StaticCell::new();
                let timer = TIMER.init(power.timer(timer::Number::Timer1));
                timer
                    .configure(timer::config::Config {
                        duty: PWM_BITS,
                        clock_source: timer::LSClockSource::APBClk,
                        frequency: PWM_RATE,
                    })
                    .expect("13 bits at 1 kHz fit 80 MHz");
                let timer: &'static timer::Timer<'static, LowSpeed> = timer;
                let off = if active_low { 100 } else { 0 };
                let led = |number, at: u8| {
                    let mut channel = Channel::new(number, pin(at));
                    channel
                        .configure(channel::config::Config {
                            timer,
                            duty_pct: off,
                            drive_mode: DriveMode::PushPull,
                        })
                        .expect("the timer is configured");
                    channel
                };
                let channels = [
                    led(channel::Number::Channel3, red),
                    led(channel::Number::Channel4, green),
                    led(channel::Number::Channel5, blue),
                ];
                Self(Kind::Pwm {
                    channels,
                    active_low,
                })
            }
        }
    }
}

impl board::Light for Light {
    /// A WS2812 keeps the caller for 31 us; call it at most
    /// every 100 us, or the LED takes two colours for one.
    fn show(&mut self, colour: Colour) {
        match &mut self.0 {
            Kind::Ws2812 { channel, order } => {
                let Some(idle) = channel.take() else { return };
                let sent = match idle.transmit(&ws2812_bits(colour, *order)) {
                    Ok(transaction) => transaction.wait(),
                    Err(refused) => Err(refused),
                };
                *channel = Some(match sent {
                    Ok(idle) => idle,
                    Err((error, idle)) => {
                        defmt::warn!("light: {}", error);
                        idle
                    }
                });
            }
            Kind::Pwm {
                channels,
                active_low,
            } => {
                let full = 1 << PWM_BITS as u32;
                for (channel, level) in channels.iter().zip([colour.red, colour.green, colour.blue])
                {
                    let on = u32::from(level) * full / 255;
                    channel.set_duty_hw(if *active_low { full - on } else { on });
                }
            }
        }
    }
}

/// 24 bits, most significant first, and the end.
fn ws2812_bits(colour: Colour, order: ColourOrder) -> [PulseCode; 25] {
    let bytes = match order {
        ColourOrder::Grb => [colour.green, colour.red, colour.blue],
        ColourOrder::Rgb => [colour.red, colour.green, colour.blue],
    };
    let mut codes = [PulseCode::end_marker(); 25];
    let bits = bytes
        .iter()
        .flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1 == 1));
    for (code, bit) in codes.iter_mut().zip(bits) {
        *code = if bit { ONE } else { ZERO };
    }
    codes
}
