//! Linear pictures and their 8-bit form.

use crate::display::DisplayTransform;
use crate::error::RenderError;
use crate::png_file;
use crate::provenance::Provenance;
use crate::tone;

/// A linear picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear Rec.709 radiance multiplied by alpha, and alpha (share of the pixel that is not
    /// see-through); row 0 on top.
    pub rgba: Vec<[f32; 4]>,
}

impl Picture {
    /// 8-bit sRGB with straight alpha: radiance times `2^exposure` through `display`, dithered.
    pub fn to_srgb8(&self, exposure: f32, display: &DisplayTransform) -> Vec<[u8; 4]> {
        let scale = exposure.exp2();
        let width = self.width.max(1);
        (0..)
            .zip(&self.rgba)
            .map(|(ix, &rgba): (u32, _)| {
                let dither = tone::dither([ix % width, ix / width]);
                display
                    .graded(rgba, scale)
                    .map(|value| tone::level(value, dither))
            })
            .collect()
    }

    /// A PNG file: RGB if every pixel is opaque, else RGBA.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn to_png(
        &self,
        exposure: f32,
        display: &DisplayTransform,
    ) -> Result<Vec<u8>, RenderError> {
        self.to_png_of(exposure, display, &Provenance::default())
    }

    /// [`Picture::to_png`] with what the picture was made from as `tEXt` chunks.
    ///
    /// # Errors
    /// As there.
    pub fn to_png_of(
        &self,
        exposure: f32,
        display: &DisplayTransform,
        provenance: &Provenance,
    ) -> Result<Vec<u8>, RenderError> {
        let pixels = self.to_srgb8(exposure, display);
        let size = [self.width, self.height];
        let texts = provenance.entries();
        let opaque = pixels.iter().all(|pixel| pixel[3] == 255);
        Ok(if opaque {
            let pixels: Vec<[u8; 3]> = pixels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
            png_file::encode(size, &pixels, texts)?
        } else {
            png_file::encode(size, &pixels, texts)?
        })
    }
}
