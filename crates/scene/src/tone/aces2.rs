//! ACES 2, the output transform of the Academy Color Encoding System 2.0 for SDR displays: white of
//! 100 nits, colours of Rec.709. As in `Lib.Academy.OutputTransform.ctl` of the Academy: colours by
//! their looks ([`appearance`]), lightness by a tone scale ([`mod@transform`]), then chroma and gamut
//! ([`gamut`]) compressed at the same hue. Pictures are shown by a table of it ([`grid`]).

mod appearance;
mod bisection;
mod gamut;
mod grid;
#[cfg(test)]
mod tests;
mod transform;

pub(crate) use grid::lut;
use transform::transform;

/// ACES 2 (Academy, 2025), linear Rec.709 in and out, for displays whose white has 100 nits: a curve
/// with much contrast, beyond which bright colours turn white at the hue that the eye sees. 0.18 in is
/// 0.10 out, greys of 128 and more are 1. Negative radiance and NaN are taken as 0.
///
/// Within 5e-4 of OpenColorIO 2.6, whose tables take hues at other steps, on 500 000 random colours of
/// at most 100 (99 of 100 within 5e-5). [`display`](super::display) interpolates in a table of this.
pub fn aces2(rgb: [f32; 3]) -> [f32; 3] {
    transform().shown(rgb).map(|x| x.clamp(0.0, 1.0))
}
