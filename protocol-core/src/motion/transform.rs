//! Scale and origin of one connection (`spec 1.0.4a, G54`).

use super::units::WideCoordinate;

/// Largest coordinate or offset a command may give, in drawing units either way (50 m).
pub const MAX_COORDINATE: u32 = 1_000_000;
/// Largest scale, either way.
pub const MAX_SCALE: u32 = 1000;

/// `arm = value * scale + offset`, for X and Y; Z is never transformed.
///
/// The specification's worked example contradicts its own rule, "the scale is applied first, and then
/// the offset added"; the rule holds: `G54 X100 Y0 S2.5` maps (200, 100) to (600, 250).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transform {
    /// Offset of X in 1/65536 units.
    x: i64,
    /// Offset of Y in 1/65536 units.
    y: i64,
    /// In 1/2^32, not zero.
    scale: i64,
}

/// A scale of 1.
const UNITY: i64 = 1 << Transform::SCALE_BITS;

impl Transform {
    /// Fraction bits of a scale.
    pub const SCALE_BITS: u32 = 32;

    /// What a new connection has: X0 Y0 S1.
    pub const IDENTITY: Self = Self {
        x: 0,
        y: 0,
        scale: UNITY,
    };

    /// Sets what is given and keeps the rest. Offsets in 1/65536 units, the scale in 1/2^32; `None`
    /// when the scale is zero.
    #[must_use]
    pub fn with(self, x: Option<i64>, y: Option<i64>, scale: Option<i64>) -> Option<Self> {
        let scale = scale.unwrap_or(self.scale);
        (scale != 0).then_some(Self {
            x: x.unwrap_or(self.x),
            y: y.unwrap_or(self.y),
            scale,
        })
    }

    /// An X as written, in 1/65536 units, in arm coordinates.
    pub fn x(self, value: i64) -> WideCoordinate {
        WideCoordinate::from_bits(self.scaled(value) + self.x)
    }

    /// A Y as written, in 1/65536 units, in arm coordinates.
    pub fn y(self, value: i64) -> WideCoordinate {
        WideCoordinate::from_bits(self.scaled(value) + self.y)
    }

    fn scaled(self, value: i64) -> i64 {
        if self.scale == UNITY {
            return value;
        }
        // 2^36 times 2^42: more than 64 bits. Rounded to the nearest.
        let exact = i128::from(value) * i128::from(self.scale);
        ((exact + (1 << (Self::SCALE_BITS - 1))) >> Self::SCALE_BITS) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const UNIT: i64 = 1 << 16;

    #[test]
    fn scale_first_then_offset() {
        let transform = Transform::IDENTITY
            .with(Some(100 * UNIT), Some(0), Some(UNITY * 5 / 2))
            .unwrap();
        assert_eq!(transform.x(200 * UNIT).bits(), 600 * UNIT);
        assert_eq!(transform.y(100 * UNIT).bits(), 250 * UNIT);
    }

    #[test]
    fn what_is_omitted_keeps_its_value() {
        let first = Transform::IDENTITY
            .with(Some(UNIT), Some(2 * UNIT), Some(3 * UNITY))
            .unwrap();
        let second = first.with(None, Some(5 * UNIT), None).unwrap();
        assert_eq!(second.x(UNIT).bits(), 4 * UNIT);
        assert_eq!(second.y(UNIT).bits(), 8 * UNIT);
    }

    #[test]
    fn a_scale_of_zero_is_refused() {
        assert_eq!(Transform::IDENTITY.with(None, None, Some(0)), None);
    }

    proptest! {
        #[test]
        fn it_is_the_affine_map_rounded_once(
            value in -(1i64 << 36)..1 << 36, offset in -(1i64 << 36)..1 << 36,
            scale in -(1i64 << 41)..1 << 41,
        ) {
            prop_assume!(scale != 0);
            let transform = Transform::IDENTITY.with(Some(offset), None, Some(scale)).unwrap();
            let exact = value as f64 * (scale as f64 / 4294967296.0) + offset as f64;
            let tolerance = 1.0 + exact.abs() * 1e-14;
            prop_assert!((transform.x(value).bits() as f64 - exact).abs() <= tolerance);
        }
    }
}
