//! How numbers are stored in a binary layer.

use crate::usd::model::Real;

/// What a number is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    U8,
    I32,
    U32,
    I64,
    U64,
    Half,
    Float,
    Double,
}

impl Scalar {
    /// Length.
    pub fn bytes(self) -> u64 {
        match self {
            Scalar::U8 => 1,
            Scalar::Half => 2,
            Scalar::I32 | Scalar::U32 | Scalar::Float => 4,
            Scalar::I64 | Scalar::U64 | Scalar::Double => 8,
        }
    }

    /// The number that `bytes` hold.
    pub fn decode<T: Real>(self, bytes: &[u8]) -> T {
        let mut wide = [0; 8];
        wide[..bytes.len()].copy_from_slice(bytes);
        let bits = u64::from_le_bytes(wide);
        match self {
            Scalar::U8 | Scalar::U32 | Scalar::U64 => T::from_f64(bits as f64),
            Scalar::I32 => T::from_f64((bits as i32).into()),
            Scalar::I64 => T::from_f64(bits as i64 as f64),
            Scalar::Half => T::from_f32(half(bits as u16)),
            Scalar::Float => T::from_f32(f32::from_bits(bits as u32)),
            Scalar::Double => T::from_f64(f64::from_bits(bits)),
        }
    }
}

/// How a value of a numeric type is stored: scalars, their number, is it a matrix or a quaternion?
pub(super) fn layout(type_number: u8) -> Option<(Scalar, usize, Shape)> {
    use Scalar::{Double, Float, Half, I32, I64, U8, U32, U64};
    use Shape::{Matrix, Quaternion, Tuple};
    Some(match type_number {
        1 | 2 => (U8, 1, Tuple),
        3 => (I32, 1, Tuple),
        4 => (U32, 1, Tuple),
        5 => (I64, 1, Tuple),
        6 => (U64, 1, Tuple),
        7 => (Half, 1, Tuple),
        8 => (Float, 1, Tuple),
        9 | 56 => (Double, 1, Tuple),
        13..=15 => (Double, [4, 9, 16][usize::from(type_number - 13)], Matrix),
        16..=18 => (
            [Double, Float, Half][usize::from(type_number - 16)],
            4,
            Quaternion,
        ),
        19..=30 => {
            let scalar = [Double, Float, Half, I32][usize::from(type_number - 19) % 4];
            (scalar, 2 + usize::from(type_number - 19) / 4, Tuple)
        }
        _ => return None,
    })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Tuple,
    Matrix,
    Quaternion,
}

/// The number that 16 bits of IEEE 754 stand for.
fn half(bits: u16) -> f32 {
    let sign = if bits >> 15 == 0 { 1.0 } else { -1.0 };
    let fraction = f32::from(bits & 0x3ff);
    sign * match bits >> 10 & 0x1f {
        0 => fraction * f32::powi(2.0, -24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        exponent => (1024.0 + fraction) * f32::powi(2.0, i32::from(exponent) - 25),
    }
}

/// A value in the 48 bits themselves.
pub(super) fn inlined<T: Real>(payload: u64, scalar: Scalar, width: usize, shape: Shape) -> Vec<T> {
    let byte = |ix: usize| f64::from((payload >> (8 * ix)) as u8 as i8);
    match (shape, width) {
        (Shape::Matrix, _) => {
            let side = width.isqrt();
            let on_diagonal = |ix: usize| match ix % (side + 1) {
                0 => byte(ix / (side + 1)),
                _ => 0.0,
            };
            (0..width).map(|ix| T::from_f64(on_diagonal(ix))).collect()
        }
        (_, 1) => {
            // Doubles as floats, longer integers as shorter ones.
            let scalar = match scalar {
                Scalar::Double => Scalar::Float,
                Scalar::I64 => Scalar::I32,
                Scalar::U64 => Scalar::U32,
                other => other,
            };
            let bytes = payload.to_le_bytes();
            vec![scalar.decode(&bytes[..scalar.bytes() as usize])]
        }
        _ => (0..width.min(6)).map(|ix| T::from_f64(byte(ix))).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::half;

    #[test]
    fn halves_are_what_they_should_be() {
        for (bits, value) in [
            (0x0000, 0.0),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x3555, 0.333_251_95),
            (0x7bff, 65504.0),
            (0x0001, 5.960_464_5e-8),
            (0x03ff, 6.097_555e-5),
            (0x0400, 6.103_515_6e-5),
            (0x7c00, f32::INFINITY),
        ] {
            assert_eq!(half(bits), value, "{bits:#x}");
        }
        assert!(half(0x7c01).is_nan());
    }
}
