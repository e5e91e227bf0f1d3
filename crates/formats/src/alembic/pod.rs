//! Types of values, and samples of them as numbers and texts.

use crate::bytes::u32_at;

/// The type of the values of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pod {
    Bool,
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F16,
    F32,
    F64,
    /// Texts that end in a byte of 0.
    Text,
    /// Texts of 4-byte letters that end in a letter of 0.
    WideText,
}

impl Pod {
    const ALL: [Pod; 14] = [
        Pod::Bool,
        Pod::U8,
        Pod::I8,
        Pod::U16,
        Pod::I16,
        Pod::U32,
        Pod::I32,
        Pod::U64,
        Pod::I64,
        Pod::F16,
        Pod::F32,
        Pod::F64,
        Pod::Text,
        Pod::WideText,
    ];

    /// The type that headers call `code`.
    pub fn from_code(code: u32) -> Option<Pod> {
        Pod::ALL.get(code as usize).copied()
    }

    /// What headers call it.
    pub fn code(self) -> u32 {
        self as u32
    }

    /// Bytes of a value; of texts, of a letter.
    pub fn bytes(self) -> usize {
        match self {
            Pod::Bool | Pod::U8 | Pod::I8 | Pod::Text => 1,
            Pod::U16 | Pod::I16 | Pod::F16 => 2,
            Pod::U32 | Pod::I32 | Pod::F32 | Pod::WideText => 4,
            Pod::U64 | Pod::I64 | Pod::F64 => 8,
        }
    }

    pub fn is_text(self) -> bool {
        matches!(self, Pod::Text | Pod::WideText)
    }

    pub fn is_integer(self) -> bool {
        !self.is_text() && !matches!(self, Pod::F16 | Pod::F32 | Pod::F64)
    }

    /// Its name in the metadata of parameters.
    pub fn name(self) -> &'static str {
        match self {
            Pod::Bool => "bool_t",
            Pod::U8 => "uint8_t",
            Pod::I8 => "int8_t",
            Pod::U16 => "uint16_t",
            Pod::I16 => "int16_t",
            Pod::U32 => "uint32_t",
            Pod::I32 => "int32_t",
            Pod::U64 => "uint64_t",
            Pod::I64 => "int64_t",
            Pod::F16 => "float16_t",
            Pod::F32 => "float32_t",
            Pod::F64 => "float64_t",
            Pod::Text => "string",
            Pod::WideText => "wstring",
        }
    }
}

/// The values of one sample; their number of bytes fits the type.
#[derive(Clone, Copy)]
pub(super) struct Values<'a> {
    pub pod: Pod,
    pub bytes: &'a [u8],
    /// Where in the file they stand.
    pub offset: u64,
}

impl<'a> Values<'a> {
    /// Number of values; not of texts.
    pub fn len(&self) -> usize {
        self.bytes.len() / self.pod.bytes()
    }

    /// Value `ix`, which must be there, rounded to a double.
    pub fn double(&self, ix: usize) -> f64 {
        let at = ix * self.pod.bytes();
        let two = || u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]]);
        let four = || u32_at(self.bytes, at);
        let eight = || u64::from(four()) | (u64::from(u32_at(self.bytes, at + 4)) << 32);
        match self.pod {
            Pod::Bool => f64::from(u8::from(self.bytes[at] != 0)),
            Pod::U8 | Pod::Text => f64::from(self.bytes[at]),
            Pod::I8 => f64::from(self.bytes[at] as i8),
            Pod::U16 => f64::from(two()),
            Pod::I16 => f64::from(two() as i16),
            Pod::U32 | Pod::WideText => f64::from(four()),
            Pod::I32 => f64::from(four() as i32),
            Pod::U64 => eight() as f64,
            Pod::I64 => eight() as i64 as f64,
            Pod::F16 => f64::from(half_to_float(two())),
            Pod::F32 => f64::from(f32::from_bits(four())),
            Pod::F64 => f64::from_bits(eight()),
        }
    }

    /// All values as doubles.
    pub fn doubles(&self) -> impl Iterator<Item = f64> + use<'a> {
        let values = *self;
        (0..self.len()).map(move |ix| values.double(ix))
    }

    /// The texts, each without its end. What is no Unicode is shown as U+FFFD.
    pub fn texts(&self) -> Vec<String> {
        let letters: Vec<char> = match self.pod {
            Pod::Text => {
                let parts = self
                    .bytes
                    .strip_suffix(&[0])
                    .map(|all| all.split(|&b| b == 0));
                let texts = parts.into_iter().flatten();
                return texts
                    .map(|text| String::from_utf8_lossy(text).into_owned())
                    .collect();
            }
            Pod::WideText => self
                .bytes
                .chunks_exact(4)
                .map(|letter| char::from_u32(u32_at(letter, 0)).unwrap_or('\u{fffd}'))
                .collect(),
            _ => Vec::new(),
        };
        let parts = letters
            .strip_suffix(&['\0'])
            .map(|all| all.split(|&c| c == '\0'));
        let texts = parts.into_iter().flatten();
        texts.map(|text| text.iter().collect()).collect()
    }
}

/// A float of 16 bits, exactly.
fn half_to_float(half: u16) -> f32 {
    let sign = if half & 0x8000 != 0 { -1.0 } else { 1.0 };
    let (exponent, fraction) = ((half >> 10) & 31, f32::from(half & 1023));
    sign * match exponent {
        0 => fraction * f32::from_bits(0x3380_0000), // 2^-24
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1.0 + fraction / 1024.0) * f32::from_bits((u32::from(exponent) + 112) << 23),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_exact() {
        for (half, value) in [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x3555, 0.333_251_95),
            (0x0001, 5.960_464_5e-8),
            (0x03ff, 6.097_555e-5),
            (0x0400, 6.103_515_6e-5),
            (0x7bff, 65504.0),
            (0x0000, 0.0),
            (0x7c00, f32::INFINITY),
            (0xfc00, f32::NEG_INFINITY),
        ] {
            assert_eq!(half_to_float(half), value, "{half:#x}");
        }
        assert!(half_to_float(0x7e00).is_nan());
    }

    #[test]
    fn codes_are_those_of_the_order() {
        for (code, pod) in (0..).zip(Pod::ALL) {
            assert_eq!((pod.code(), Pod::from_code(code)), (code, Some(pod)));
        }
        assert_eq!(Pod::from_code(14), None);
    }

    #[test]
    fn texts_end_in_zero() {
        let texts = |pod, bytes| {
            Values {
                pod,
                bytes,
                offset: 0,
            }
            .texts()
        };
        assert_eq!(texts(Pod::Text, b"ab\0\0c\0"), ["ab", "", "c"]);
        assert_eq!(texts(Pod::Text, b"cut"), [""; 0]);
        assert_eq!(texts(Pod::WideText, b"a\0\0\0\0\0\0\0"), ["a"]);
        assert_eq!(texts(Pod::Text, b""), [""; 0]);
    }
}
