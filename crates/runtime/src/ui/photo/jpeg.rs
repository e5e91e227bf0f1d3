//! Photos as cameras write them: JPEG, baseline or progressive, upright by their EXIF orientation.

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::error::{MAX_PIXELS, PhotoError};

/// Most scans of a progressive file. Programs write some ten; each takes time whatever it holds.
const MAX_SCANS: usize = 32;

/// Longest side that the format has.
const MAX_JPEG_SIDE: usize = 65_535;

/// Do these bytes begin as a JPEG does?
pub fn is_jpeg(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xff, 0xd8, 0xff])
}

/// How a picture is turned to stand upright: columns and rows are swapped first, then sides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Orientation {
    /// Rows of the file are columns of the picture.
    is_transposed: bool,
    /// Left is right, and top is bottom, of the picture.
    is_mirrored: [bool; 2],
}

impl Orientation {
    /// By its EXIF number, 1..=8; upright for all others.
    fn of(number: u16) -> Orientation {
        let (is_transposed, is_mirrored) = match number {
            2 => (false, [true, false]),
            3 => (false, [true, true]),
            4 => (false, [false, true]),
            5 => (true, [false, false]),
            6 => (true, [true, false]),
            7 => (true, [true, true]),
            8 => (true, [false, true]),
            _ => (false, [false, false]),
        };
        Orientation {
            is_transposed,
            is_mirrored,
        }
    }

    /// The picture of `size`, as the file has it, upright.
    pub fn upright(
        self,
        [width, height]: [usize; 2],
        pixels: Vec<[u8; 3]>,
    ) -> ([usize; 2], Vec<[u8; 3]>) {
        if self == Orientation::default() {
            return ([width, height], pixels);
        }
        let size = match self.is_transposed {
            true => [height, width],
            false => [width, height],
        };
        let mirrored = |at: usize, axis: usize| match self.is_mirrored[axis] {
            true => size[axis] - 1 - at,
            false => at,
        };
        let places = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
        let turned = places.filter_map(|[x, y]| {
            let (x, y) = (mirrored(x, 0), mirrored(y, 1));
            let (x, y) = if self.is_transposed { (y, x) } else { (x, y) };
            pixels.get(y * width + x).copied()
        });
        (size, turned.collect())
    }
}

/// A photo as its file has it.
pub struct Decoded {
    /// Width and height.
    pub size: [usize; 2],
    /// sRGB, rows from the top of the file.
    pub pixels: Vec<[u8; 3]>,
    /// How it stands upright.
    pub orientation: Orientation,
}

/// Reads a JPEG.
///
/// # Errors
/// What is damaged, too large, or of colours that mean nothing without the profile of a printer.
pub fn decode(name: &str, bytes: &[u8]) -> Result<Decoded, PhotoError> {
    let wrong = |source| PhotoError::Jpeg {
        name: name.to_owned(),
        source,
    };
    // What is cut short is said, in place of grey where there is nothing.
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_use_unsafe(false)
        .set_max_width(MAX_JPEG_SIDE)
        .set_max_height(MAX_JPEG_SIDE)
        .jpeg_set_max_scans(MAX_SCANS)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(wrong)?;
    let size = decoder
        .info()
        .map_or([0, 0], |info| [info.width, info.height].map(usize::from));
    let pixels = size.map(|side| side as u64).into_iter().product();
    if pixels > MAX_PIXELS {
        let name = name.to_owned();
        return Err(PhotoError::TooLarge { name, pixels });
    }
    let colors = decoder.input_colorspace();
    if !matches!(
        colors,
        Some(ColorSpace::RGB | ColorSpace::YCbCr | ColorSpace::Luma)
    ) {
        let name = name.to_owned();
        return Err(PhotoError::Colors { name });
    }
    let orientation = decoder.exif().and_then(|exif| orientation(exif));
    let data = decoder.decode().map_err(wrong)?;
    let pixels = data.as_chunks::<3>().0.to_vec();
    Ok(Decoded {
        size,
        pixels,
        orientation: Orientation::of(orientation.unwrap_or(1)),
    })
}

/// The number of the orientation in EXIF data, which are a TIFF header and a list of tags; none where that is
/// missing or damaged.
fn orientation(exif: &[u8]) -> Option<u16> {
    const TAG: u16 = 0x0112;
    /// Of a tag's type: 16 bits.
    const SHORT: u16 = 3;
    let is_little = match exif.get(..4)? {
        b"II*\0" => true,
        b"MM\0*" => false,
        _ => return None,
    };
    let short = |at: usize| {
        let bytes = exif.get(at..at.checked_add(2)?)?.try_into().ok()?;
        Some(match is_little {
            true => u16::from_le_bytes(bytes),
            false => u16::from_be_bytes(bytes),
        })
    };
    let long = |at: usize| {
        let [a, b] = [short(at)?, short(at.checked_add(2)?)?].map(u32::from);
        Some(if is_little { a | b << 16 } else { a << 16 | b })
    };
    let list = usize::try_from(long(4)?).ok()?;
    for entry in 0..usize::from(short(list)?) {
        let at = list.checked_add(2 + 12 * entry)?;
        if (short(at)?, short(at.checked_add(2)?)?) == (TAG, SHORT) {
            return short(at.checked_add(8)?);
        }
    }
    None
}

#[cfg(test)]
mod tests;
