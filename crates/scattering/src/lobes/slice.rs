//! One fibre's lobes over theta_d, as the renderer samples them: what an edit makes.
//!
//! Nothing is fitted here. Shapes and shares come from the baked table by cubic interpolation,
//! energies from 24 Gauss-Legendre nodes of the exact integral, so that the energy of each mode
//! is that of the exact model up to interpolation between texels.

use std::f64::consts::FRAC_PI_2;

use super::fit::LobeShape;
use super::table::{LobeTable, alpha_from_cos_theta_d};
use crate::circular_gaussian::sharpness;
use crate::closed_form::{LobeDecode, LobeView, N_LOBE_NUMBERS};
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe};
use crate::quadrature::GaussLegendre;

/// Texels over cos(theta_d).
pub const DEFAULT_LOBE_TEXELS: usize = 192;
/// Nodes of the energies over gamma.
const N_ENERGY_NODES: usize = 24;
/// Narrowest lobe: below, the sharpness outgrows single precision.
const LAMBDA_MIN: f64 = 0.002;

/// The lobes of one fibre and mode, see [`LobeDecode`] for the layout.
#[derive(Clone, Debug, PartialEq)]
pub struct LobeTexture {
    /// How texels are placed and decoded; a uniform of the shaders.
    pub decode: LobeDecode,
    /// 16 numbers of 16 bits a texel, two `rgba32uint` texels, low half first.
    pub texels: Vec<[u32; 8]>,
    /// The same, decoded.
    pub decoded: Vec<[f32; N_LOBE_NUMBERS]>,
}

impl LobeTexture {
    /// The texture as the closed form samples it.
    pub fn view(&self) -> LobeView<'_> {
        LobeView {
            texels: &self.decoded,
            decode: &self.decode,
        }
    }
}

/// Places and energies of the texels of one fibre, shared by TT and TRT.
#[derive(Clone, Debug)]
pub struct Energies {
    eta: f64,
    sigma_a: [f64; 3],
    warp: f64,
    /// Per texel: cos(theta_d), and energy of TT and of TRT per channel, over u^2 (see
    /// [`LobeDecode`]), at u = 0 the limit.
    texels: Vec<(f64, [[f64; 3]; 2])>,
}

/// `k` of the warp `u = (1 + k) c / (c + k)`, c = cos(theta_d).
fn warp(eta: f64) -> f64 {
    ((eta - 1.0) * (eta + 1.0)).max(0.0).sqrt().max(0.01)
}

impl Energies {
    /// Energies of `n` >= 2 texels for index `eta` >= 1 and absorption `sigma_a`.
    pub fn new(eta: f64, sigma_a: [f64; 3], fresnel: Fresnel, n: usize) -> Energies {
        let eta = eta.max(1.0);
        let warp = warp(eta);
        let rule: Vec<(f64, f64, f64)> = GaussLegendre::new(N_ENERGY_NODES)
            .on(0.0, FRAC_PI_2)
            .map(|(gamma, weight)| {
                let (sin, cos) = gamma.sin_cos();
                (sin, cos, weight * cos)
            })
            .collect();
        let n = n.max(2);
        let texels = (0..n)
            .map(|ix| {
                let u = ix as f64 / (n - 1) as f64;
                // Grazing: energies go with u^2, so the limit is that of a small u.
                let u = u.max(1e-4);
                let c = warp * u / (1.0 + warp - u);
                let sin_2 = 1.0 - c * c;
                let inner = (eta * eta - sin_2).max(1e-300).sqrt();
                let a = c / inner;
                let path = eta / inner;
                let mut energies = [[0.0; 3]; 2];
                for &(sin, cos, weight) in &rule {
                    let through = fresnel.transmittance(eta, c * cos);
                    let sin_t = a * sin;
                    let crossing = -2.0 * path * (1.0 - sin_t * sin_t).sqrt();
                    let kept = through * through * weight / (u * u);
                    let reflected = kept * (1.0 - through);
                    for channel in 0..3 {
                        let t = (crossing * sigma_a[channel]).exp();
                        energies[0][channel] += kept * t;
                        energies[1][channel] += reflected * t * t;
                    }
                }
                (c, energies)
            })
            .collect();
        Energies {
            eta,
            sigma_a,
            warp,
            texels,
        }
    }
}

/// The lobes of TT and TRT of one fibre.
pub fn slice(tables: [&LobeTable; 2], hair: &HairParams, n: usize) -> [LobeTexture; 2] {
    let energies = Energies::new(hair.eta, hair.sigma_a, tables[0].fresnel, n);
    tables.map(|table| slice_mode(table, &energies, hair.caustic_width))
}

/// The lobes of the table's mode. Width `caustic_width` (w_c) widens those of TRT.
pub fn slice_mode(table: &LobeTable, energies: &Energies, caustic_width: f64) -> LobeTexture {
    let section = table.at_eta(energies.eta);
    let trt = table.lobe == Lobe::Trt;
    let blur = trt.then(|| blur_measure(sharpness(caustic_width)));
    let mut numbers = Vec::with_capacity(energies.texels.len());
    let mut shapes = Vec::with_capacity(energies.texels.len());
    for &(cos_theta_d, ref energy) in &energies.texels {
        let alpha = alpha_from_cos_theta_d(energies.eta, cos_theta_d);
        let stencil = section.stencil(alpha);
        let mut shape = section.shape(&stencil, LAMBDA_MIN);
        if let Some(blur) = blur {
            shape.lambda = shape.lambda.map(|lambda| widened(lambda, blur));
        }
        let sin_2 = 1.0 - cos_theta_d * cos_theta_d;
        let path = 1.0
            / (1.0 - sin_2 / (energies.eta * energies.eta))
                .max(1e-12)
                .sqrt();
        let shares = energies
            .sigma_a
            .map(|sigma| section.shares(&stencil, sigma * path));
        shapes.push(shape);
        numbers.push((energy[usize::from(trt)], shares));
    }
    pack(&shapes, &numbers, energies.warp)
}

/// Packs shapes first, so that amplitudes fit the widths as decoded.
fn pack(shapes: &[LobeShape], numbers: &[([f64; 3], [[f64; 3]; 3])], warp: f64) -> LobeTexture {
    let mut rows: Vec<[f64; N_LOBE_NUMBERS]> = shapes
        .iter()
        .map(|shape| {
            let mut row = [0.0; N_LOBE_NUMBERS];
            row[..3].copy_from_slice(&shape.lambda);
            for (pair, mu) in shape.mu.iter().enumerate() {
                row[3 + 2 * pair] = (0.5 * mu).cos();
                row[4 + 2 * pair] = (0.5 * mu).sin();
            }
            row
        })
        .collect();
    let mut packed = vec![[0u16; N_LOBE_NUMBERS]; rows.len()];
    let mut decode = LobeDecode {
        offset: [0.0; N_LOBE_NUMBERS],
        scale: [0.0; N_LOBE_NUMBERS],
        warp: warp as f32,
        last: (rows.len() - 1) as f32,
        padding_0: 0,
        padding_1: 0,
    };
    for number in 0..7 {
        quantise(&mut rows, &mut packed, &mut decode, number);
    }
    for (row, (energy, shares)) in rows.iter_mut().zip(numbers) {
        let heights: [f64; 3] = std::array::from_fn(|l| {
            let kappa = sharpness(row[l]);
            (if l == 0 { 1.0 } else { 0.5 }) / i0e_i1e(kappa).0
        });
        for channel in 0..3 {
            for l in 0..3 {
                let amplitude = energy[channel] * shares[channel][l] * heights[l];
                row[7 + 3 * channel + l] = amplitude;
            }
        }
    }
    for number in 7..N_LOBE_NUMBERS {
        quantise(&mut rows, &mut packed, &mut decode, number);
    }
    LobeTexture {
        decode,
        texels: packed
            .iter()
            .map(|row| {
                std::array::from_fn(|i| u32::from(row[2 * i]) | u32::from(row[2 * i + 1]) << 16)
            })
            .collect(),
        decoded: packed
            .iter()
            .map(|row| {
                std::array::from_fn(|i| decode.offset[i] + decode.scale[i] * f32::from(row[i]))
            })
            .collect(),
    }
}

/// Rounds column `number` to 16 bits between its extremes, in place.
fn quantise(
    rows: &mut [[f64; N_LOBE_NUMBERS]],
    packed: &mut [[u16; N_LOBE_NUMBERS]],
    decode: &mut LobeDecode,
    number: usize,
) {
    let values = rows.iter().map(|row| row[number]);
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    let offset = low as f32;
    let scale = (((high - low) / 65535.0) as f32).max(0.0);
    decode.offset[number] = offset;
    decode.scale[number] = scale;
    for (row, packed) in rows.iter_mut().zip(packed) {
        let steps = if scale > 0.0 {
            ((row[number] - f64::from(offset)) / f64::from(scale))
                .round()
                .clamp(0.0, 65535.0)
        } else {
            0.0
        };
        packed[number] = steps as u16;
        row[number] = f64::from(offset + scale * steps as f32);
    }
}

/// I0e and I1e in f64 to 2e-7 (Abramowitz and Stegun 9.8.1 to 9.8.4).
fn i0e_i1e(x: f64) -> (f64, f64) {
    let horner = |c: &[f64], y: f64| c.iter().rev().fold(0.0, |sum, c| sum * y + c);
    if x < 3.75 {
        let y = (x / 3.75).powi(2);
        let scale = (-x).exp();
        return (scale * horner(&SMALL_0, y), scale * x * horner(&SMALL_1, y));
    }
    let y = 3.75 / x;
    let scale = 1.0 / x.sqrt();
    (scale * horner(&LARGE_0, y), scale * horner(&LARGE_1, y))
}

const SMALL_0: [f64; 7] = [
    1.0, 3.5156229, 3.0899424, 1.2067492, 0.2659732, 0.0360768, 0.0045813,
];
const SMALL_1: [f64; 7] = [
    0.5, 0.87890594, 0.51498869, 0.15084934, 0.02658733, 0.00301532, 0.00032411,
];
const LARGE_0: [f64; 9] = [
    0.39894228,
    0.01328592,
    0.00225319,
    -0.00157565,
    0.00916281,
    -0.02057706,
    0.02635537,
    -0.01647633,
    0.00392377,
];
const LARGE_1: [f64; 9] = [
    0.39894228,
    -0.03988024,
    -0.00362018,
    0.00163801,
    -0.01031555,
    0.02282967,
    -0.02895312,
    0.01787654,
    -0.00420059,
];

/// `-ln(I_1(kappa) / I_0(kappa))`, which adds up when circular Gaussians are folded, with its
/// derivative by kappa.
fn blur_measure_slope(kappa: f64) -> (f64, f64) {
    let ratio = if kappa > 20.0 {
        let y = 1.0 / kappa;
        1.0 - y * (0.5 + y * (0.125 + y * (0.125 + y * (25.0 / 128.0 + y * (13.0 / 32.0)))))
    } else {
        let (i_0, i_1) = i0e_i1e(kappa);
        (i_1 / i_0).max(1e-30)
    };
    // A' = 1 - A/kappa - A^2, near 1/(2 kappa^2) for large kappa.
    let slope = if kappa > 20.0 {
        let y = 1.0 / kappa;
        y * y * (0.5 + y * (0.25 + y * (0.375 + y * 25.0 / 32.0)))
    } else {
        1.0 - ratio / kappa - ratio * ratio
    };
    (-ratio.ln(), -slope / ratio)
}

fn blur_measure(kappa: f64) -> f64 {
    blur_measure_slope(kappa).0
}

/// Width of a circular Gaussian of width `lambda` folded with one of measure `blur`, the circular
/// Gaussian of the same mean cosine.
fn widened(lambda: f64, blur: f64) -> f64 {
    let kappa = sharpness(lambda);
    let target = (blur_measure(kappa) + blur).min(30.0);
    // Exact for narrow ones: the measure is 1/(2 kappa). For wide ones A = kappa/2.
    let mut kappa = 0.5 / target;
    if target > 0.3 {
        kappa = kappa
            .min(2.0 * (-target).exp() + 0.5 / (target * target))
            .max(1e-12);
    }
    for _ in 0..6 {
        let (value, slope) = blur_measure_slope(kappa);
        // Newton in ln kappa: the measure is nearly a power of kappa.
        let step = (value - target) / (slope * kappa);
        kappa *= (-step).clamp(-2.0, 2.0).exp();
        if step.abs() < 1e-7 {
            break;
        }
    }
    (2.0 / kappa).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::special::bessel_i_ratio_1;

    #[test]
    fn folded_widths_keep_the_mean_cosine() {
        for lambda in [0.002, 0.03, 0.2, 0.7, 2.0, 4.0] {
            for width in [0.01, 0.08, 0.3, 1.5] {
                let found = widened(lambda, blur_measure(sharpness(width)));
                let cosine = |lambda: f64| bessel_i_ratio_1(sharpness(lambda));
                let expected = -(cosine(lambda) * cosine(width)).ln();
                let error = -cosine(found).ln() / expected - 1.0;
                assert!(error.abs() < 3e-6, "{lambda} {width} {found} {error}");
            }
        }
    }
}
