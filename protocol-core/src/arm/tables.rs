//! Angle functions as piecewise quadratics in fixed point.
//!
//! The chip has no floating point and divides 64-bit numbers in software, but multiplies two
//! 32-bit numbers in one instruction. Each function is cut into equal segments; inside one,
//! `a + (b + c * t) * t` with t = 0..1 takes two high-half multiplications. The coefficients are
//! computed by the compiler from the functions' series, so there is no generated file and nothing
//! to keep in step.

// Tables are filled by the compiler, where an index out of bounds is a compile error.
#![allow(clippy::indexing_slicing)]

/// A function on `0..SEGMENTS`, one quadratic a segment; values in whatever unit it was made for.
pub(super) struct Table<const SEGMENTS: usize>([Quadratic; SEGMENTS]);

#[derive(Clone, Copy)]
struct Quadratic {
    constant: i32,
    /// Twice the linear coefficient: `t` has 31 bits and the high half of a product drops 32.
    linear: i32,
    /// Four times the quadratic coefficient.
    quadratic: i32,
}

impl<const SEGMENTS: usize> Table<SEGMENTS> {
    /// The value at `segment + t`, with t in 1/2^31; the last segment goes on for ever.
    #[inline]
    pub(super) fn at(&self, segment: u32, t: u32) -> i32 {
        let last = SEGMENTS - 1;
        let index = if segment as usize > last {
            last
        } else {
            segment as usize
        };
        // In bounds by the line above; `get` costs nothing once the compiler has seen it.
        let Some(piece) = self.0.get(index) else {
            return 0;
        };
        let t = (t & 0x7fff_ffff).cast_signed();
        let slope = piece.linear + high_half(piece.quadratic, t);
        piece.constant + high_half(slope, t)
    }
}

/// The high half of a 64-bit product: one instruction where the chip multiplies in hardware.
#[inline]
pub(crate) const fn high_half(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64) >> 32) as i32
}

/// Degrees in a radian, in microdegrees.
const MICRODEGREES: f64 = 180e6 / core::f64::consts::PI;

/// Arc tangent in microdegrees of a ratio in 1/64; the 65th segment holds the ratio 1 itself.
pub(super) static ATAN: Table<65> = {
    let mut pieces = [EMPTY; 65];
    let mut segment = 0;
    while segment < 65 {
        let from = segment as f64 / 64.0;
        pieces[segment] = fit(
            atan(from) * MICRODEGREES,
            atan(from + 0.25 / 64.0) * MICRODEGREES,
            atan(from + 0.75 / 64.0) * MICRODEGREES,
            atan(from + 1.0 / 64.0) * MICRODEGREES,
        );
        segment += 1;
    }
    Table(pieces)
};

/// `acos(r / 2000)` in microdegrees of r^2 in 2^15 square units: the half of the angle between
/// upper link and forearm. The last segment begins just inside r = 2000.
pub(super) static HALF_ELBOW: Table<122> = {
    let mut pieces = [EMPTY; 122];
    let mut segment = 0;
    while segment < 122 {
        let from = segment as f64;
        pieces[segment] = fit(
            half_elbow(from) * MICRODEGREES,
            half_elbow(from + 0.25) * MICRODEGREES,
            half_elbow(from + 0.75) * MICRODEGREES,
            half_elbow(from + 1.0) * MICRODEGREES,
        );
        segment += 1;
    }
    Table(pieces)
};

/// `1 / r` in 1/2^39 of r^2 in 2^15 square units; below r = 478, where the drawing area is not, as at it.
pub(super) static RECIPROCAL: Table<122> = {
    let mut pieces = [EMPTY; 122];
    let mut segment = 0;
    while segment < 122 {
        let from = if segment < 7 { 7.0 } else { segment as f64 };
        pieces[segment] = fit(
            reciprocal(from),
            reciprocal(from + 0.25),
            reciprocal(from + 0.75),
            reciprocal(from + 1.0),
        );
        segment += 1;
    }
    Table(pieces)
};

/// `1000 sin` in 1/65536 units of an angle in 1/64 of a right angle.
pub(super) static SINE: Table<65> = {
    let mut pieces = [EMPTY; 65];
    let mut segment = 0;
    while segment < 65 {
        let from = segment as f64 / 64.0;
        pieces[segment] = fit(
            sine(from) * 65_536_000.0,
            sine(from + 0.25 / 64.0) * 65_536_000.0,
            sine(from + 0.75 / 64.0) * 65_536_000.0,
            sine(from + 1.0 / 64.0) * 65_536_000.0,
        );
        segment += 1;
    }
    Table(pieces)
};

const EMPTY: Quadratic = Quadratic {
    constant: 0,
    linear: 0,
    quadratic: 0,
};

/// The quadratic through both ends of a segment, so that neighbours meet, that is also right on
/// average at its quarter points, which spreads the error evenly.
const fn fit(start: f64, quarter: f64, three_quarters: f64, end: f64) -> Quadratic {
    // For v(t) = start + (end - start) t + bend t (t - 1): at both quarters t (t - 1) = -3/16.
    let bend = (start + end - quarter - three_quarters) * (16.0 / 6.0);
    Quadratic {
        constant: round(start),
        linear: round(2.0 * (end - start - bend)),
        quadratic: round(4.0 * bend),
    }
}

const fn round(value: f64) -> i32 {
    (if value < 0.0 {
        value - 0.5
    } else {
        value + 0.5
    }) as i32
}

const fn half_elbow(segment: f64) -> f64 {
    let cosine_squared = segment * 32_768.0 / 4e6;
    if cosine_squared >= 1.0 {
        return 0.0;
    }
    if cosine_squared <= 0.0 {
        return core::f64::consts::FRAC_PI_2;
    }
    atan(sqrt((1.0 - cosine_squared) / cosine_squared))
}

const fn reciprocal(segment: f64) -> f64 {
    (1u64 << 39) as f64 / sqrt(segment * 32_768.0)
}

/// Sine of a fraction of a right angle, by its Taylor series.
const fn sine(fraction: f64) -> f64 {
    let angle = fraction * core::f64::consts::FRAC_PI_2;
    let mut term = angle;
    let mut sum = angle;
    let mut n = 1.0;
    while n < 12.0 {
        term *= -angle * angle / ((2.0 * n) * (2.0 * n + 1.0));
        sum += term;
        n += 1.0;
    }
    sum
}

/// Arc tangent: the angle is halved three times, then the series converges at once.
const fn atan(tangent: f64) -> f64 {
    let mut reduced = tangent;
    let mut halvings = 0;
    while halvings < 3 {
        reduced = reduced / (1.0 + sqrt(1.0 + reduced * reduced));
        halvings += 1;
    }
    let square = reduced * reduced;
    let mut power = reduced;
    let mut sum = 0.0;
    let mut n = 0.0;
    while n < 16.0 {
        sum += power / (2.0 * n + 1.0);
        power *= -square;
        n += 1.0;
    }
    sum * 8.0
}

/// Square root by Newton's method.
const fn sqrt(value: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let mut root = if value > 1.0 { value } else { 1.0 };
    let mut step = 0;
    while step < 60 {
        root = 0.5 * (root + value / root);
        step += 1;
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest difference to `exact`, over the segments `from..to`.
    fn worst<const N: usize>(
        table: &Table<N>,
        from: u32,
        to: u32,
        exact: impl Fn(f64) -> f64,
    ) -> f64 {
        let mut worst = 0.0_f64;
        for segment in from..to {
            for step in 0..200 {
                let t = f64::from(step) / 200.0;
                let value = table.at(segment, (t * 2f64.powi(31)) as u32);
                worst = worst.max((f64::from(value) - exact(f64::from(segment) + t)).abs());
            }
        }
        worst
    }

    #[test]
    fn tables_agree_with_the_functions_they_stand_for() {
        let atan = worst(&ATAN, 0, 64, |at| (at / 64.0).atan().to_degrees() * 1e6);
        assert!(atan < 8.0, "atan: {atan} microdegrees");
        // The drawing area is r = 500..1950, segments 7..=116.
        let elbow = worst(&HALF_ELBOW, 7, 117, |at| {
            (at * 32768.0 / 4e6).sqrt().acos().to_degrees() * 1e6
        });
        assert!(elbow < 250.0, "half elbow: {elbow} microdegrees");
        let reciprocal = worst(&RECIPROCAL, 7, 117, |at| {
            2f64.powi(39) / (at * 32768.0).sqrt()
        });
        assert!(reciprocal < 6e4, "1 / r: {reciprocal} / 2^39");
        let sine = worst(&SINE, 0, 64, |at| {
            (at / 64.0 * 90f64).to_radians().sin() * 65_536_000.0
        });
        assert!(sine < 12.0, "sine: {sine} / 65536 units");
    }
}
