//! Paint of a point as shading reads it. Twin: `shaders/lib/paint.wgsl`.

use super::azimuthal_r::Reflectance;
use super::fibre::Fibre;
use super::painted_averages::{
    PaintedAverages, PaintedAveragesView, PaintedPointAverages, average_row,
};
use super::painted_lobes::{
    LAYER_MIDDLE, PaintedDecode, PaintedPointLobes, PaintedView, lobe_layer,
};
use super::single_scattering::Shading;
use super::tables::Tables;
use super::transmittance::{from_half_bits, half_bits};
use crate::hair::Parameter;

/// A point's paint, unpacked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointPaint {
    /// Absorption of the dye per fibre radius, linear RGB.
    pub dye: [f32; 3],
    /// How much of it there is, 0..=1.
    pub weight: f32,
    /// Factor of the widths.
    pub width_scale: f32,
    /// Factor of the shifts.
    pub shift_scale: f32,
    /// Absorption of the hair around the point, 0..=50; [`None`] where that is as the point.
    pub around: Option<[f32; 3]>,
}

/// A texel of paint, `rgba32uint`: dye and weight, then both factors as half floats, low half first; the last word is 0
/// or has absorption around: of each channel in ten bits, from the lowest on, the root of `sigma_a / (LAYER_MIDDLE + sigma_a)`,
/// and the highest bit.
pub type PaintTexel = [u32; 4];

/// Steps of a channel of absorption around, ten bits.
const AROUND_STEPS: f32 = 1023.0;

/// What painted points have in common, byte for byte the uniform `PaintedHair` of the shaders (400
/// bytes).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PaintedHair {
    /// The fibre without paint.
    pub fibre: Fibre,
    /// R's coefficients.
    pub reflectance: Reflectance,
    /// Placement of the lobes of TT.
    pub tt: PaintedDecode,
    /// Placement of the lobes of TRT.
    pub trt: PaintedDecode,
    /// Placement of the averages.
    pub averages: PaintedAverages,
}

crate::mirrors! {
    PaintedHair as "PaintedHair" in "lib/paint" { fibre, reflectance, tt, trt, averages }
}

/// The textures of painted hair.
#[derive(Clone, Copy, Debug)]
pub struct PaintedViews<'a> {
    /// What points have in common.
    pub hair: &'a PaintedHair,
    /// The table C, for R.
    pub tables: Tables<'a>,
    /// Lobes of TT.
    pub tt: PaintedView<'a>,
    /// Lobes of TRT.
    pub trt: PaintedView<'a>,
    /// Averages.
    pub averages: PaintedAveragesView<'a>,
}

/// The texel of a point's paint.
pub fn pack_paint(paint: &PointPaint) -> PaintTexel {
    let [r, g, b] = paint.dye.map(half_bits);
    let place = |sigma_a: f32| {
        let place = (sigma_a / (LAYER_MIDDLE + sigma_a)).sqrt();
        (place * AROUND_STEPS).round() as u32
    };
    let around = paint.around.map(|around| around.map(place));
    [
        r | g << 16,
        b | half_bits(paint.weight) << 16,
        half_bits(paint.width_scale) | half_bits(paint.shift_scale) << 16,
        around.map_or(0, |[r, g, b]| r | g << 10 | b << 20 | 1 << 31),
    ]
}

/// Absorption around by the last word of a texel.
fn unpack_around(word: u32) -> Option<[f32; 3]> {
    let sigma_a = |shift: u32| {
        let place = (word >> shift & 1023) as f32 / AROUND_STEPS;
        LAYER_MIDDLE * place * place / (1.0 - place * place).max(1e-3)
    };
    (word != 0).then(|| [0, 10, 20].map(sigma_a))
}

/// The paint of a texel.
pub fn unpack_paint(texel: &PaintTexel) -> PointPaint {
    let halves = |word: u32| [word & 0xffff, word >> 16].map(from_half_bits);
    let ([r, g], [b, weight]) = (halves(texel[0]), halves(texel[1]));
    let [width_scale, shift_scale] = halves(texel[2]);
    PointPaint {
        dye: [r, g, b],
        weight,
        width_scale,
        shift_scale,
        around: unpack_around(texel[3]),
    }
}

/// The fibre of a painted point: absorption `mix(fibre.sigma_a, dye, weight)`, widths and shifts
/// times their factors, kept in the ranges of [`crate::HairParams`].
pub fn painted_fibre(fibre: &Fibre, paint: &PointPaint) -> Fibre {
    let mixed = |c: usize| fibre.sigma_a[c] * (1.0 - paint.weight) + paint.dye[c] * paint.weight;
    let [least, most] = Parameter::Width.range().map(|beta| beta as f32);
    let shift_max = Parameter::Shift.range()[1] as f32;
    Fibre {
        sigma_a: [0, 1, 2].map(mixed),
        alpha: fibre
            .alpha
            .map(|alpha| (paint.shift_scale * alpha).clamp(-shift_max, shift_max)),
        beta: fibre
            .beta
            .map(|beta| (paint.width_scale * beta).clamp(least, most)),
        ..*fibre
    }
}

/// Where the averages of a point of this `fibre` ([`painted_fibre`]'s) stand: those of the hair around it, which light
/// comes through and is sent back by.
pub fn painted_averages<'a>(
    averages: PaintedAveragesView<'a>,
    fibre: &Fibre,
    paint: &PointPaint,
) -> PaintedPointAverages<'a> {
    let (width, shift) = (paint.width_scale, paint.shift_scale);
    PaintedPointAverages {
        view: averages,
        row: average_row(
            averages.decode,
            paint.around.unwrap_or(fibre.sigma_a),
            width,
            shift,
        ),
    }
}

/// What the shading of a point of this `fibre` ([`painted_fibre`]'s) reads.
pub fn painted_shading<'a>(
    views: &PaintedViews<'a>,
    fibre: &'a Fibre,
) -> Shading<'a, PaintedPointLobes<'a>> {
    let lobes = |view: PaintedView<'a>| PaintedPointLobes {
        view,
        layers: fibre
            .sigma_a
            .map(|sigma_a| lobe_layer(view.decode, sigma_a)),
    };
    Shading {
        fibre,
        tables: views.tables,
        reflectance: &views.hair.reflectance,
        tt: lobes(views.tt),
        trt: lobes(views.trt),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paint_survives_packing() {
        let paint = PointPaint {
            dye: [0.25, 49.0, 0.001],
            weight: 0.7,
            width_scale: 0.3,
            shift_scale: 1.7,
            around: Some([0.2, 50.0, 3.0]),
        };
        let again = unpack_paint(&pack_paint(&paint));
        for (a, b) in again.dye.iter().zip(paint.dye) {
            assert!((a / b - 1.0).abs() <= 1.0 / 2048.0, "{a} {b}");
        }
        assert!((again.weight - 0.7).abs() <= 0.7 / 2048.0);
        for (a, b) in [(again.width_scale, 0.3), (again.shift_scale, 1.7)] {
            assert!((a / b - 1.0f32).abs() <= 1.0 / 2048.0, "{a} {b}");
        }
        // As near as half a step of the places that averages are looked up at.
        let place = |sigma_a: f32| (sigma_a / (LAYER_MIDDLE + sigma_a)).sqrt();
        for (a, b) in again.around.unwrap().into_iter().zip([0.2, 50.0, 3.0]) {
            let off = (place(a) - place(b)).abs();
            assert!(off <= 0.501 / AROUND_STEPS, "{a} {b}");
        }
        let none = PointPaint {
            dye: [0.0; 3],
            weight: 0.0,
            width_scale: 1.0,
            shift_scale: 1.0,
            around: None,
        };
        assert_eq!(unpack_paint(&pack_paint(&none)), none);
    }
}
