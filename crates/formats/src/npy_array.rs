//! Arrays in NumPy's `.npy` files.
//!
//! Half, single and double precision are read, little-endian and in C order; the layout is in
//! [`crate::npy`].

use crate::bytes::u32_at;
use crate::error::{Error, Result};

/// First bytes of a file.
pub(crate) const MAGIC: &[u8] = b"\x93NUMPY";

/// An array of floats as it lies in a file.
#[derive(Debug)]
pub struct NpyArray<'a> {
    kind: Float,
    /// Extents, the slowest first.
    pub shape: Vec<u64>,
    bytes: &'a [u8],
}

impl<'a> NpyArray<'a> {
    /// The array of a whole file, of a shape that `is_wanted`, in words `wanted`.
    ///
    /// # Errors
    /// `Invalid` where header and length disagree; `Value` for another shape, and for types and
    /// orders that are not read.
    pub fn of(file: &'a [u8], wanted: &str, is_wanted: impl Fn(&[u64]) -> bool) -> Result<Self> {
        let Header { kind, shape, start } = header(file)?;
        let sides: Vec<String> = shape.iter().map(u64::to_string).collect();
        let shown = format!("({})", sides.join(", "));
        if !is_wanted(&shape) {
            return Err(Error::value("shape of the array", shown, wanted));
        }
        let bytes = &file[start..];
        let wanted = shape
            .iter()
            .try_fold(kind.n_bytes() as u64, |n, side| n.checked_mul(*side));
        if wanted != Some(bytes.len() as u64) {
            let what = format!(
                "an array of shape {shown} takes {} bytes, the file has {} left",
                wanted.map_or_else(|| "too many".to_owned(), |n| n.to_string()),
                bytes.len()
            );
            return Err(Error::invalid(what, start as u64));
        }
        Ok(NpyArray { kind, shape, bytes })
    }

    /// Number `ix` of the array. Panics beyond its end.
    pub fn value(&self, ix: usize) -> f64 {
        self.kind.value(&self.bytes[ix * self.kind.n_bytes()..])
    }
}

/// What the header says.
#[derive(Debug)]
struct Header {
    kind: Float,
    shape: Vec<u64>,
    /// Where the array starts.
    start: usize,
}

#[derive(Clone, Copy, Debug)]
enum Float {
    Half,
    Single,
    Double,
}

impl Float {
    fn n_bytes(self) -> usize {
        match self {
            Float::Half => 2,
            Float::Single => 4,
            Float::Double => 8,
        }
    }

    /// The number at the start of `bytes`.
    fn value(self, bytes: &[u8]) -> f64 {
        match self {
            Float::Half => f64::from(half(u16::from_le_bytes([bytes[0], bytes[1]]))),
            Float::Single => f64::from(f32::from_bits(u32_at(bytes, 0))),
            Float::Double => {
                let [low, high] = [0, 4].map(|at| u64::from(u32_at(bytes, at)));
                f64::from_bits(high << 32 | low)
            }
        }
    }
}

/// IEEE 754 binary16.
fn half(bits: u16) -> f32 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023) / 1024.0);
    let size = match exponent {
        0 => fraction * 2f32.powi(-14),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1.0 + fraction) * 2f32.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

fn header(bytes: &[u8]) -> Result<Header> {
    let cut = || Error::invalid("file ends within its header", bytes.len() as u64);
    if !bytes.starts_with(MAGIC) {
        return Err(Error::invalid("file does not start with \\x93NUMPY", 0));
    }
    let version = *bytes.get(6).ok_or_else(cut)?;
    let (text_at, length) = match (version, bytes.get(8..12)) {
        (1, Some(word)) => (10, usize::from(u16::from_le_bytes([word[0], word[1]]))),
        (2 | 3, Some(word)) => (12, u32_at(word, 0) as usize),
        (1..=3, None) => return Err(cut()),
        _ => {
            let what = format!("version {version} of the header is unknown");
            return Err(Error::invalid(what, 6));
        }
    };
    let text = bytes.get(text_at..).unwrap_or_default();
    let text = text.get(..length).ok_or_else(cut)?;
    let invalid = |what: String| Error::invalid(what, text_at as u64);
    let text =
        std::str::from_utf8(text).map_err(|_| invalid("the header is no text".to_owned()))?;
    let value = |key: &str| {
        let quoted = [format!("'{key}'"), format!("\"{key}\"")];
        let found = quoted.iter().find_map(|key| text.split_once(key.as_str()));
        let value = found.and_then(|(_, rest)| rest.trim_start().strip_prefix(':'));
        value
            .map(str::trim_start)
            .ok_or_else(|| invalid(format!("the header lacks {key}")))
    };
    let descr = value("descr")?;
    let quote = descr.chars().next().unwrap_or_default();
    let descr = descr[quote.len_utf8().min(descr.len())..]
        .split(quote)
        .next()
        .unwrap_or_default();
    let kind = match descr {
        "<f2" => Float::Half,
        "<f4" => Float::Single,
        "<f8" => Float::Double,
        _ => {
            let range = "<f2, <f4 or <f8: save array.astype('<f4')";
            let shown: String = descr.chars().take(40).collect();
            return Err(Error::value(
                "type of the array",
                format!("{shown:?}"),
                range,
            ));
        }
    };
    if !value("fortran_order")?.starts_with("False") {
        let range = "C: save numpy.ascontiguousarray(array)";
        return Err(Error::value("order of the array", "Fortran", range));
    }
    let shape = value("shape")?;
    let shape = shape
        .strip_prefix('(')
        .and_then(|rest| rest.split_once(')'));
    let shape = shape.map_or("", |(shape, _)| shape);
    let sides: Vec<Option<u64>> = shape
        .split(',')
        .map(str::trim)
        .filter(|side| !side.is_empty())
        .map(|side| side.parse().ok())
        .collect();
    let Some(shape) = sides.into_iter().collect() else {
        let shown: String = shape.chars().take(40).collect();
        return Err(invalid(format!(
            "the shape ({shown}) is no list of numbers"
        )));
    };
    Ok(Header {
        kind,
        shape,
        start: text_at + length,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_read() {
        for (bits, value) in [
            (0, 0.0),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x3555, 0.333_251_95),
            (1, 5.960_464_5e-8),
            (0x7bff, 65504.0),
            (0x7c00, f32::INFINITY),
        ] {
            assert_eq!(half(bits), value, "{bits:#x}");
        }
        assert!(half(0x7e00).is_nan());
    }
}
