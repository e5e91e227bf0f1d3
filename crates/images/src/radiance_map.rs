//! Radiance .hdr maps (RGBE, flat or run-length encoded).

use crate::error::DecodeError;
use crate::map::{Map, check_size};
use crate::primaries::{Matrix, Primaries};
use crate::radiance_file;
use crate::source::MapSource;

/// First bytes: `#?RADIANCE` or `#?RGBE`.
pub(super) const MAGIC: &[u8] = b"#?";

/// Decodes a whole file.
///
/// Headers honoured: `FORMAT=32-bit_rle_rgbe` (XYZE is refused by name), `EXPOSURE` and
/// `COLORCORR` (radiance is the stored value divided by both, as Radiance defines), `PRIMARIES`
/// (all zeros, which some writers put, means none). Only the orientation `-Y H +X W` is read.
///
/// # Errors
/// What is wrong.
pub(super) fn decode(bytes: &[u8], hash: String) -> Result<Map, DecodeError> {
    let bad = DecodeError::Radiance;
    let (header, rest) = radiance_file::header(bytes).map_err(bad)?;
    let (width, height) = (header.width, header.height);
    check_size(width, height)?;
    // A run of the usual scheme holds at most 127 pixels in 2 bytes for each of 4 channels, so 16
    // pixels need a byte. A file far below that is not worth the allocation.
    if bytes.len() < height * 4 + width * height / 64 {
        return Err(DecodeError::Damaged(format!(
            "the file is truncated: {} bytes cannot hold {height} rows",
            bytes.len()
        )));
    }
    let gain = gain(header.exposure, header.correction)?;
    let matrix = match &header.primaries {
        Some(text) => primaries(text)?,
        None => None,
    };

    let mut pixels = radiance_file::pixels(rest, width, height).map_err(bad)?;
    if gain != [1.0; 3] {
        for pixel in &mut pixels {
            for c in 0..3 {
                pixel[c] *= gain[c];
            }
        }
    }
    let source = MapSource {
        hash,
        format: "Radiance RGBE".to_owned(),
        ..MapSource::default()
    };
    Map::from_decoded(width, height, pixels, matrix, source)
}

/// What the stored values are multiplied with to be radiance.
fn gain(exposure: f32, correction: [f32; 3]) -> Result<[f32; 3], DecodeError> {
    let [r, g, b] = correction;
    let gain = [r, g, b].map(|c| 1.0 / (c * exposure));
    if gain.iter().all(|g| g.is_finite() && *g > 0.0) {
        Ok(gain)
    } else {
        Err(DecodeError::Damaged(format!(
            "EXPOSURE {exposure} with COLORCORR {r} {g} {b} is no scale"
        )))
    }
}

/// The conversion that `PRIMARIES=rx ry gx gy bx by wx wy` asks for.
fn primaries(text: &str) -> Result<Option<Matrix>, DecodeError> {
    let values: Option<Vec<f64>> = text
        .split_whitespace()
        .map(|word| word.parse().ok())
        .collect();
    let Some([rx, ry, gx, gy, bx, by, wx, wy]) = values.and_then(|v| <[f64; 8]>::try_from(v).ok())
    else {
        let what = format!("PRIMARIES={text} are not eight numbers");
        return Err(DecodeError::Damaged(what));
    };
    if [rx, ry, gx, gy, bx, by, wx, wy] == [0.0; 8] {
        return Ok(None);
    }
    Primaries {
        red: [rx, ry],
        green: [gx, gy],
        blue: [bx, by],
        white: [wx, wy],
    }
    .to_rec_709()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat (not run-length encoded) 4 x 2 file of one pixel value.
    fn file(signature: &str, headers: &str, rgbe: [u8; 4]) -> Vec<u8> {
        let mut bytes = format!("{signature}\n{headers}\n-Y 2 +X 4\n").into_bytes();
        bytes.extend(std::iter::repeat_n(rgbe, 8).flatten());
        bytes
    }

    #[test]
    fn headers_are_honoured() {
        // Mantissas 128, 64, 32 at exponent 129: 1, 0.5, 0.25.
        let rgbe = [128, 64, 32, 129];
        let format = "FORMAT=32-bit_rle_rgbe\n";
        let read = |signature: &str, headers: &str| Map::decode(&file(signature, headers, rgbe));
        let plain = read("#?RADIANCE", format).unwrap();
        assert_eq!((plain.width(), plain.height()), (4, 2));
        assert!(plain.pixels().iter().all(|p| *p == [1.0, 0.5, 0.25]));
        let old = read("#?RGBE", format).unwrap();
        assert_eq!(old.pixels(), plain.pixels());
        let exposed = read("#?RADIANCE", &format!("{format}EXPOSURE=4\n")).unwrap();
        assert_eq!(exposed.pixels()[0], [0.25, 0.125, 0.0625]);
        let none = format!("{format}PRIMARIES=0 0 0 0 0 0 0 0\n");
        assert_eq!(read("#?RADIANCE", &none).unwrap().pixels(), plain.pixels());
        for wrong in [
            "FORMAT=32-bit_rle_xyze\n",
            "FORMAT=32-bit_rle_rgbe\nEXPOSURE=0\n",
            "FORMAT=32-bit_rle_rgbe\nPRIMARIES=1 2 3\n",
        ] {
            assert!(read("#?RADIANCE", wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn truncated_files_are_errors() {
        let bytes = file("#?RADIANCE", "FORMAT=32-bit_rle_rgbe\n", [128, 64, 32, 129]);
        for length in 0..bytes.len() {
            assert!(Map::decode(&bytes[..length]).is_err(), "{length}");
        }
        assert!(Map::decode(&bytes).is_ok());
    }
}
