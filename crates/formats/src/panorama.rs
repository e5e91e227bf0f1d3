//! An environment map as it is seen behind the hair.
//!
//! The `.panorama` file, version 1:
//!
//! | section | content |
//! |---|---|
//! | `META` | record, [`Meta`] |
//! | `TXLS` | texels, top row first, u32 each: RGB9E5 (shared exponent), as GPUs read it |
//!
//! A texel times `2^exponent` of the record is linear radiance, Rec.709.

use std::io::{Read, Seek};

use serde::{Deserialize, Serialize};

use crate::baked_file::BakedFile;
use crate::container::{Container, ContainerWriter, Kind, encode_record};
use crate::error::{Error, Result};
use crate::provenance::tool_version;
use crate::shared_exponent::{LARGEST, decode, encode, power_of_two};
use crate::validate::in_range;

/// Largest width of a panorama; its height is half of it.
pub const MAX_PANORAMA_WIDTH: u32 = 4096;

/// Exponents of the factor on all texels: with them, the least and the largest float are in range.
const EXPONENTS: [i32; 2] = [-126, 112];

/// An environment map for the background of pictures: linear Rec.709 radiance, latitude-longitude layout, row 0 on
/// top.
///
/// Texel (column i, row j) of W x H lies at latitude `pi (0.5 - (j + 0.5) / H)` and longitude
/// `pi - 2 pi (i + 0.5) / W`, direction `(cos lat sin lon, sin lat, cos lat cos lon)`, +Y up:
/// OpenEXR's `latlong`.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    width: u32,
    exponent: i32,
    texels: Vec<u32>,
    /// What it was made from.
    pub source: PanoramaSource,
}

/// What a panorama was made from.
#[derive(Clone, Debug, PartialEq)]
pub struct PanoramaSource {
    /// [`crate::content_hash`] of the map's file; empty if there is none.
    pub map_hash: String,
    /// Width and height of the map in pixels; zero if there is none.
    pub map_size: [u32; 2],
    /// Program that made it.
    pub tool_version: String,
    /// What else is known of the map, as name and value, in order.
    pub parameters: Vec<(String, String)>,
}

impl Default for PanoramaSource {
    fn default() -> Self {
        PanoramaSource {
            map_hash: String::new(),
            map_size: [0; 2],
            tool_version: tool_version(),
            parameters: Vec::new(),
        }
    }
}

#[derive(Serialize, Deserialize)]
struct Meta {
    width: u32,
    height: u32,
    exponent: i32,
    map_hash: String,
    map_size: [u32; 2],
    tool_version: String,
    parameters: Vec<(String, String)>,
}

const META: [u8; 4] = *b"META";
const TEXELS: [u8; 4] = *b"TXLS";

impl Panorama {
    /// The panorama of `pixels`, linear radiance, `width / 2` rows of `width`, the top row first. Each channel is kept
    /// to 1/512 of the largest one of its pixel, or to 2^-40 of the brightest pixel.
    ///
    /// # Errors
    /// `Value`: a size that no panorama has, another number of pixels, a pixel that is not finite or negative.
    pub fn from_pixels(width: u32, pixels: &[[f32; 3]]) -> Result<Self> {
        check_size(width, width / 2, pixels.len())?;
        let mut largest = 0f32;
        for (ix, &x) in pixels.iter().flatten().enumerate() {
            let key = || format!("pixels[{}]", ix / 3);
            if !(x >= 0.0 && x.is_finite()) {
                return Err(Error::value(key(), x, "finite and not negative"));
            }
            largest = largest.max(x);
        }
        let exponent = exponent_for(largest);
        let factor = power_of_two(-exponent);
        let scaled = |x: f32| (f64::from(x) * factor) as f32;
        Ok(Panorama {
            width,
            exponent,
            texels: pixels.iter().map(|rgb| encode(rgb.map(scaled))).collect(),
            source: PanoramaSource::default(),
        })
    }

    /// Texels across.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Texels down, half of [`Panorama::width`].
    pub fn height(&self) -> u32 {
        self.width / 2
    }

    /// A texel times 2 to the power of this is linear radiance.
    pub fn exponent(&self) -> i32 {
        self.exponent
    }

    /// The texels as the file and GPUs have them, `width * height`, top row first.
    pub fn texels(&self) -> &[u32] {
        &self.texels
    }

    /// The numbers of the texel in column `i`, row `j`, without the factor of [`Panorama::exponent`]; beyond the
    /// borders, of the nearest row and of the column that follows around the sphere.
    pub fn texel(&self, i: i64, j: i64) -> [f32; 3] {
        let (width, height) = (i64::from(self.width), i64::from(self.height()));
        let at = j.clamp(0, height - 1) * width + i.rem_euclid(width);
        decode(self.texels.get(at as usize).copied().unwrap_or_default())
    }

    /// Linear radiance of all pixels, top row first.
    pub fn pixels(&self) -> Vec<[f32; 3]> {
        let factor = power_of_two(self.exponent);
        let scaled = |x: f32| (f64::from(x) * factor) as f32;
        let texels = self.texels.iter();
        texels.map(|&texel| decode(texel).map(scaled)).collect()
    }

    /// Checks size, number of texels and exponent.
    ///
    /// # Errors
    /// `Value` naming what breaks a promise.
    fn validate(&self) -> Result<()> {
        check_size(self.width, self.height(), self.texels.len())?;
        let [least, most] = EXPONENTS.map(f64::from);
        in_range("exponent", f64::from(self.exponent), least, most)
    }
}

/// The least exponent with which `largest` is a texel; 0 where there is no light.
fn exponent_for(largest: f32) -> i32 {
    if largest <= 0.0 {
        return 0;
    }
    let [least, most] = EXPONENTS;
    let fits = |exponent: &i32| f64::from(LARGEST) * power_of_two(*exponent) >= largest.into();
    (least..most).find(fits).unwrap_or(most)
}

fn check_size(width: u32, height: u32, n_texels: usize) -> Result<()> {
    in_range("width", width.into(), 4.0, MAX_PANORAMA_WIDTH.into())?;
    if !width.is_multiple_of(2) || height != width / 2 {
        let size = format!("{width} x {height}");
        return Err(Error::value("size", size, "twice as wide as high"));
    }
    let wanted = u64::from(width) * u64::from(height);
    if n_texels as u64 != wanted {
        let range = format!("width times height, {wanted}");
        return Err(Error::value("number of texels", n_texels, range));
    }
    Ok(())
}

impl BakedFile for Panorama {
    const KIND: Kind = Kind::Panorama;

    fn from_container<R: Read + Seek>(mut file: Container<R>) -> Result<Self> {
        let meta: Meta = file.read_record(META)?;
        let texels: Vec<u32> = file.read_array(TEXELS, 0)?;
        file.check_unread()?;
        check_size(meta.width, meta.height, texels.len())?;
        let panorama = Panorama {
            width: meta.width,
            exponent: meta.exponent,
            texels,
            source: PanoramaSource {
                map_hash: meta.map_hash,
                map_size: meta.map_size,
                tool_version: meta.tool_version,
                parameters: meta.parameters,
            },
        };
        panorama.validate()?;
        Ok(panorama)
    }

    fn to_bytes(&self) -> Result<Vec<u8>> {
        self.validate()?;
        let source = &self.source;
        let meta = Meta {
            width: self.width,
            height: self.height(),
            exponent: self.exponent,
            map_hash: source.map_hash.clone(),
            map_size: source.map_size,
            tool_version: source.tool_version.clone(),
            parameters: source.parameters.clone(),
        };
        let mut file = ContainerWriter::new(Kind::Panorama);
        file.section(META, 0, encode_record(&meta)?);
        file.section(TEXELS, 0, bytemuck::cast_slice(&self.texels));
        file.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_range_of_light_is_kept() {
        let mut n_checked = 0;
        for largest in [0.0, f32::MIN_POSITIVE, 1e-20, 0.7, 69_120.0, 1e9, f32::MAX] {
            let mut pixels = vec![[0.25 * largest; 3]; 8];
            pixels[5] = [largest, 0.5 * largest, 0.0];
            let panorama = Panorama::from_pixels(4, &pixels).expect("valid");
            for (found, wanted) in panorama.pixels().iter().zip(&pixels) {
                for (found, wanted) in found.iter().zip(wanted) {
                    let most = largest / 512.0 + f32::MIN_POSITIVE * 0.01;
                    assert!(
                        (found - wanted).abs() <= most,
                        "{largest}: {found} {wanted}"
                    );
                    n_checked += 1;
                }
            }
            let again = Panorama::from_bytes(&panorama.to_bytes().expect("valid"));
            assert_eq!(again.expect("valid"), panorama);
        }
        assert_eq!(n_checked, 7 * 24);
    }

    #[test]
    fn columns_go_around_and_rows_end() {
        let pixels: Vec<[f32; 3]> = (0..8).map(|ix| [ix as f32, 0.0, 0.0]).collect();
        let panorama = Panorama::from_pixels(4, &pixels).expect("valid");
        let factor = (panorama.exponent() as f32).exp2();
        for (i, j, wanted) in [
            (0, 0, 0.0),
            (-1, 0, 3.0),
            (5, 1, 5.0),
            (3, -4, 3.0),
            (2, 7, 6.0),
        ] {
            assert_eq!(panorama.texel(i, j)[0] * factor, wanted, "{i}, {j}");
        }
        assert_eq!((panorama.width(), panorama.height()), (4, 2));
    }

    #[test]
    fn what_is_no_panorama_is_refused() {
        let dark = |n| vec![[0f32; 3]; n];
        let mut odd = [dark(8), dark(8)];
        odd[0][7][1] = f32::NAN;
        odd[1][2][2] = -1.0;
        let [nan, negative] = odd;
        for (width, pixels, needle) in [
            (2, dark(2), "width is 2"),
            (4098, dark(4098 * 2049), "width is 4098"),
            (5, dark(10), "twice as wide"),
            (4, dark(7), "number of texels is 7"),
            (4, nan, "pixels[7] is NaN"),
            (4, negative, "pixels[2] is -1"),
        ] {
            let error = Panorama::from_pixels(width, &pixels).expect_err(needle);
            assert!(error.to_string().contains(needle), "{error}");
        }
    }
}
