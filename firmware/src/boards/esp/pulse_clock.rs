//! Arithmetic of the pulse timer: which resolution a frame rate allows, and how many counts a
//! pulse width is. No registers here.

use protocol_core::motion::PulseWidth;

/// The LEDC's clock divider has 10 whole and 8 fractional bits.
const DIVIDER_ONE: u64 = 1 << 8;
const DIVIDER_MAX: u64 = 0x3_FFFF;

/// 1 s in units of [`PulseWidth`].
const SECOND: u64 = 10_000_000_000;

/// A timer that counts from 0 to 2^bits once per servo frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PulseClock {
    bits: u8,
    divider: u32,
    source_hz: u32,
    /// Counts per 0.1 ns, times 2^32.
    counts_per_unit: u32,
}

impl PulseClock {
    /// The finest timer for this frame rate: as many bits as the chip has, as long as the source
    /// clock is not slower than the counter. The divider is rounded to the nearest 1/256, which
    /// moves the frame rate by at most 0.2 %; pulse widths are computed from the rounded divider.
    ///
    /// `None` if no divider fits.
    pub const fn finest(source_hz: u32, frame_rate_hz: u32, max_bits: u8) -> Option<Self> {
        let mut bits = max_bits;
        while bits > 0 {
            let counts_hz = (frame_rate_hz as u64) << bits;
            let divider = (source_hz as u64 * DIVIDER_ONE + counts_hz / 2) / counts_hz;
            if divider >= DIVIDER_ONE {
                if divider > DIVIDER_MAX {
                    return None;
                }
                return Some(Self {
                    bits,
                    divider: divider as u32,
                    source_hz,
                    counts_per_unit: counts_per_unit(source_hz, divider),
                });
            }
            bits -= 1;
        }
        None
    }

    /// Width of the counter.
    pub const fn bits(&self) -> u8 {
        self.bits
    }

    /// Clock divider in 1/256, as the LEDC takes it.
    pub const fn divider(&self) -> u32 {
        self.divider
    }

    /// One frame as the timer really makes it.
    pub const fn frame(&self) -> PulseWidth {
        let clocks = (self.divider as u64) << self.bits;
        let source = self.source_hz as u64 * DIVIDER_ONE;
        PulseWidth::new(((clocks * (SECOND / 1000) + source / 2000) / (source / 1000)) as u32)
    }

    /// Smallest step of a pulse, rounded.
    pub const fn step(&self) -> PulseWidth {
        PulseWidth::new((self.frame().get() + (1 << self.bits) / 2) >> self.bits)
    }

    /// Counts for a pulse, to the nearest; at most one less than a frame.
    pub const fn counts(&self, pulse: PulseWidth) -> u32 {
        let counts = (pulse.get() as u64 * self.counts_per_unit as u64 + (1 << 31)) >> 32;
        let most = (1 << self.bits) - 1;
        if counts > most {
            most as u32
        } else {
            counts as u32
        }
    }
}

const fn counts_per_unit(source_hz: u32, divider: u64) -> u32 {
    // 2^32 * 256 * source_hz does not fit 64 bits; 128-bit division happens at compile time only.
    let numerator = (source_hz as u128 * DIVIDER_ONE as u128) << 32;
    let denominator = divider as u128 * SECOND as u128;
    ((numerator + denominator / 2) / denominator) as u32
}

#[expect(clippy::panic, reason = "while this is compiled")]
const fn made(clock: Option<PulseClock>) -> PulseClock {
    match clock {
        Some(clock) => clock,
        None => panic!("no divider"),
    }
}

// Figures of the data sheets, checked when this is compiled.
const _: () = {
    let c3 = made(PulseClock::finest(80_000_000, 50, 14));
    assert!(c3.bits == 14 && c3.divider == 25_000); // exactly 50 Hz
    assert!(c3.frame().get() == 200_000_000 && c3.step().get() == 12_207);
    assert!(c3.counts(PulseWidth::from_micros(500)) == 410); // 409.6
    assert!(c3.counts(PulseWidth::from_micros(1_500)) == 1_229); // 1228.8
    assert!(c3.counts(PulseWidth::from_micros(20_000)) == 16_383);

    let c3_fast = made(PulseClock::finest(80_000_000, 333, 14));
    assert!(c3_fast.bits == 14 && c3_fast.divider == 3_754);
    assert!(c3_fast.step().get() == 1_833);

    let c6 = made(PulseClock::finest(80_000_000, 50, 20));
    assert!(c6.bits == 20 && c6.divider == 391); // 49.95 Hz
    assert!(c6.frame().get() == 200_192_000 && c6.step().get() == 191);
    assert!(c6.counts(PulseWidth::from_micros(1_500)) == 78_568); // 78567.8

    let c6_fast = made(PulseClock::finest(80_000_000, 333, 20));
    assert!(c6_fast.bits == 17 && c6_fast.step().get() == 229);
};
