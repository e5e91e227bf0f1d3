//! What pictures are shown by: a tone map or a LUT.

use crate::lut::Lut;
use crate::tone::{self, ToneMap};

/// What turns linear radiance into what a screen shows. Clones share the LUT.
#[derive(Clone, Debug, PartialEq)]
pub enum DisplayTransform {
    /// A curve, and the encoding of sRGB.
    ToneMap(ToneMap),
    /// A LUT, which encodes by itself.
    Lut(Lut),
}

impl From<ToneMap> for DisplayTransform {
    fn from(tone_map: ToneMap) -> Self {
        DisplayTransform::ToneMap(tone_map)
    }
}

impl Default for DisplayTransform {
    fn default() -> Self {
        ToneMap::Filmic.into()
    }
}

impl DisplayTransform {
    /// The LUT that pictures are shown by: that of [`DisplayTransform::Lut`], or the one that ACES 2
    /// is shown by, which its first use makes, in some 40 ms.
    pub fn lut(&self) -> Option<&Lut> {
        match self {
            DisplayTransform::Lut(lut) => Some(lut),
            DisplayTransform::ToneMap(ToneMap::Aces2) => Some(tone::aces2_lut()),
            DisplayTransform::ToneMap(_) => None,
        }
    }

    /// sRGB in 0..=1 of linear Rec.709 radiance (exposure already applied).
    pub fn display(&self, rgb: [f32; 3]) -> [f32; 3] {
        match self {
            DisplayTransform::ToneMap(tone_map) => tone::display(rgb, *tone_map),
            DisplayTransform::Lut(lut) => lut.display(rgb),
        }
    }

    /// Linear radiance multiplied by alpha, and alpha, as straight sRGB and alpha in 0..=1; `scale`
    /// is 2^exposure.
    pub fn graded(&self, [r, g, b, a]: [f32; 4], scale: f32) -> [f32; 4] {
        // A pixel without coverage has no colour.
        let factor = if a > 0.0 { scale / a } else { 0.0 };
        let [r, g, b] = self.display([r * factor, g * factor, b * factor]);
        [r, g, b, a.clamp(0.0, 1.0)]
    }
}
