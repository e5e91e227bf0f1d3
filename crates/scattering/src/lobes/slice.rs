//! One fibre's lobes over theta_d, as the renderer samples them: what an edit makes.
//!
//! Nothing is fitted here. Shapes and shares come from the baked table by cubic interpolation,
//! energies from 12 Gauss-Legendre nodes of the exact integral, so that the energy of each mode
//! is that of the exact model up to interpolation between texels. [`LobeRows`] depends on eta
//! (and, of TRT, eccentricity) alone, [`PackedShapes`] also on w_c, [`Energies`] and [`Shares`]
//! also on sigma_a: an edit makes only what it touches.
//!
//! TRT of an elliptic fibre wants the index that light and view choose (Xu 2011 Eq 24 to 26): its
//! texture has a row for each of several indices, see [`LobePlaces`].

use std::f64::consts::FRAC_PI_2;

use super::shape::LobeShape;
use super::table::{LobeSection, LobeTable, Stencil, alpha_from_cos_theta_d};
use crate::circular_gaussian::sharpness;
use crate::closed_form::{
    ETA_STAR_MAX, ETA_STAR_MIN, EVEN_TEXELS, LobeDecode, LobeView, N_LOBE_NUMBERS,
};
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe};
use crate::quadrature::GaussLegendre;

/// Texels over cos(theta_d).
pub const DEFAULT_LOBE_TEXELS: usize = 320;
/// Rows of TRT of an elliptic fibre: always as many, since a further one would be a jump. Together
/// they have a fifth more texels than that of a circular fibre.
pub(crate) const ELLIPTIC_ROWS: usize = 6;
/// Nodes of the energies over gamma.
const N_ENERGY_NODES: usize = 12;
/// Numbers of a texel that are shapes; amplitudes follow.
pub(super) const N_SHAPE_NUMBERS: usize = 7;
/// Least warp. Near eta = 1 the lobes turn at cos(theta_d) = sqrt(eta^2 - 1), and absorption makes
/// energies fall exponentially from there up: a compromise, found by search.
const WARP_MIN: f64 = 0.035;
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

    /// The lobes times `intensity`: what is stored stays, the amplitude of 1 is another.
    pub fn scaled(mut self, intensity: f64) -> LobeTexture {
        let factor = intensity as f32;
        self.decode.amplitude_scale *= factor;
        for number in self
            .decoded
            .iter_mut()
            .flat_map(|texel| &mut texel[N_SHAPE_NUMBERS..])
        {
            *number *= factor;
        }
        self
    }

    /// Texels a row.
    pub fn width(&self) -> usize {
        self.decode.last as usize + 1
    }

    /// Rows: one index of refraction each.
    pub fn rows(&self) -> usize {
        self.decode.last_row as usize + 1
    }
}

/// Where the texels of one fibre and mode stand: a row for each index of refraction, in each row
/// the same values of cos(theta_d).
#[derive(Clone, Debug, PartialEq)]
pub struct LobePlaces {
    /// Which mode.
    lobe: Lobe,
    /// The index of each row, evenly apart; one for circular fibres.
    etas: Vec<f64>,
    /// See [`LobeDecode`].
    warp: f64,
    /// Texels a row.
    n: usize,
}

impl LobePlaces {
    /// One row of `n` >= 2 texels for index `eta` >= 1.
    pub fn circular(lobe: Lobe, eta: f64, n: usize) -> LobePlaces {
        let eta = eta.max(1.0);
        LobePlaces {
            lobe,
            etas: vec![eta],
            warp: warp(eta),
            n: n.max(2),
        }
    }

    /// The places for `hair`: several rows for TRT of an elliptic fibre, over the indices of Eq 24
    /// clamped as the closed form clamps them; else one, of `n` >= 2 texels.
    pub fn new(lobe: Lobe, hair: &HairParams, n: usize) -> LobePlaces {
        let circular = LobePlaces::circular(lobe, hair.eta, n);
        let [eta_1, eta_2] = hair.elliptic_indices();
        let floor = hair.eta.min(f64::from(ETA_STAR_MIN));
        let [low, high] = [eta_1.min(eta_2), eta_1.max(eta_2)]
            .map(|eta| eta.clamp(floor, f64::from(ETA_STAR_MAX)));
        if lobe != Lobe::Trt || high - low < 1e-6 {
            return circular;
        }
        let rows = ELLIPTIC_ROWS;
        let step = (high - low) / (rows - 1) as f64;
        LobePlaces {
            etas: (0..rows).map(|row| low + step * row as f64).collect(),
            n: ((n + n / 5) / rows).max(2),
            ..circular
        }
    }

    /// The decoding that all textures here have; scales are yet to be set.
    fn decode(&self) -> LobeDecode {
        let rows = self.etas.len() - 1;
        let (first, last) = (self.etas[0], self.etas[rows]);
        LobeDecode {
            warp: self.warp as f32,
            last: (self.n - 1) as f32,
            eta_first: first as f32,
            eta_scale: if rows > 0 {
                (rows as f64 / (last - first)) as f32
            } else {
                0.0
            },
            last_row: rows as f32,
            ..bytemuck::Zeroable::zeroed()
        }
    }
}

/// Energies at the texels of one fibre and mode.
#[derive(Clone, Debug, PartialEq)]
pub struct Energies {
    /// Per texel and channel, over u^2 (see [`LobeDecode`]), at u = 0 the limit.
    texels: Vec<[f64; 3]>,
}

/// The warp of [`LobeDecode`].
fn warp(eta: f64) -> f64 {
    ((eta - 1.0) * (eta + 1.0)).max(0.0).sqrt().max(WARP_MIN)
}

/// `u` of texel `ix` of `n`. Grazing: energies go with u^2, so the limit is that of a small u.
pub(super) fn texel_at(ix: usize, n: usize) -> f64 {
    (ix as f64 / (n - 1) as f64).max(1e-4)
}

/// cos(theta_d) of texel `ix` of `n`.
pub(super) fn cos_theta_d_at(warp: f64, ix: usize, n: usize) -> f64 {
    let u = texel_at(ix, n);
    // u = c ((1 - e) (1 + k) / (c + k) + e) is e c^2 + b c - k u = 0.
    let even = f64::from(EVEN_TEXELS);
    let b = (1.0 - even) * (1.0 + warp) + even * warp - u;
    (2.0 * warp * u / (b + (b * b + 4.0 * even * warp * u).sqrt())).min(1.0)
}

/// Quadrature over gamma for energies.
pub(super) struct EnergyRule {
    eta: f64,
    fresnel: Fresnel,
    /// Sine and cosine of gamma, weight times cosine.
    nodes: Vec<(f64, f64, f64)>,
}

impl EnergyRule {
    pub(super) fn new(eta: f64, fresnel: Fresnel) -> EnergyRule {
        // gamma = pi/2 - scale sinh(t): dense near grazing, where little reflects back; the Fresnel
        // term turns at cos(gamma) = sqrt(eta^2 - 1) / cos(theta_d).
        let scale = ((eta - 1.0) * (eta + 1.0)).max(1e-6).sqrt();
        let nodes = GaussLegendre::new(N_ENERGY_NODES)
            .on(0.0, (FRAC_PI_2 / scale).asinh())
            .map(|(t, weight)| {
                let (cos, sin) = (scale * t.sinh()).sin_cos();
                (sin, cos, weight * cos * scale * t.cosh())
            })
            .collect();
        EnergyRule {
            eta,
            fresnel,
            nodes,
        }
    }

    /// Hands out, for each node at cos(theta_d) `c`: what TT and TRT keep without absorption times
    /// the node's weight over `u`^2, and the exponent of one crossing per sigma_a, -2 path.
    pub(super) fn add(&self, c: f64, u: f64, mut node: impl FnMut(f64, f64, f64)) {
        let eta = self.eta;
        let inner = (eta * eta - (1.0 - c * c)).max(1e-300).sqrt();
        let a = c / inner;
        let path = eta / inner;
        for &(sin, cos, weight) in &self.nodes {
            let through = self.fresnel.transmittance(eta, c * cos);
            let sin_t = a * sin;
            let crossing = -2.0 * path * (1.0 - sin_t * sin_t).sqrt();
            let kept = through * through * weight / (u * u);
            node(kept, kept * (1.0 - through), crossing);
        }
    }
}

impl Energies {
    /// Energies at `places` for absorption `sigma_a`.
    pub fn new(places: &LobePlaces, sigma_a: [f64; 3], fresnel: Fresnel) -> Energies {
        let trt = places.lobe == Lobe::Trt;
        let mut texels = Vec::with_capacity(places.etas.len() * places.n);
        for &eta in &places.etas {
            let rule = EnergyRule::new(eta, fresnel);
            texels.extend((0..places.n).map(|ix| {
                let c = cos_theta_d_at(places.warp, ix, places.n);
                let mut energy = [0.0; 3];
                rule.add(c, texel_at(ix, places.n), |kept, reflected, crossing| {
                    let (kept, exponent) = if trt {
                        (reflected, 2.0 * crossing)
                    } else {
                        (kept, crossing)
                    };
                    for (energy, sigma) in energy.iter_mut().zip(sigma_a) {
                        *energy += kept * (exponent * sigma).exp();
                    }
                });
                energy
            }));
        }
        Energies { texels }
    }
}

/// The lobes of TT and TRT of one fibre, `n` >= 2 texels over theta_d.
pub fn slice(tables: [&LobeTable; 2], hair: &HairParams, n: usize) -> [LobeTexture; 2] {
    tables.map(|table| slice_mode(table, hair, n))
}

/// The lobes of the table's mode for `hair`; w_c widens those of TRT.
pub fn slice_mode(table: &LobeTable, hair: &HairParams, n: usize) -> LobeTexture {
    let places = LobePlaces::new(table.lobe, hair, n);
    let energies = Energies::new(&places, hair.sigma_a, table.fresnel);
    let rows = LobeRows::new(table, &places);
    let shapes = PackedShapes::new(&rows, hair.caustic_width);
    let shares = Shares::new(&rows, hair.sigma_a);
    LobeTexture::new(&shapes, &energies, &shares)
}

/// A table of lobes at the places of one fibre: what [`PackedShapes`] and [`Shares`] are made of.
#[derive(Clone, Debug, PartialEq)]
pub struct LobeRows {
    pub(super) lobe: Lobe,
    /// The table at the index of each row.
    sections: Vec<LobeSection>,
    /// Decoding of textures made of this; scales are yet to be set.
    decode: LobeDecode,
    /// Per texel, row by row: where it stands on the axis of alpha, and the length of a crossing,
    /// in radii over 2 cos(gamma_t).
    texels: Vec<(Stencil, f64)>,
}

impl LobeRows {
    /// `table` at `places`, both of one mode.
    pub fn new(table: &LobeTable, places: &LobePlaces) -> LobeRows {
        let sections: Vec<LobeSection> = places.etas.iter().map(|&eta| table.at_eta(eta)).collect();
        let mut texels = Vec::with_capacity(places.etas.len() * places.n);
        for (section, eta) in sections.iter().zip(&places.etas) {
            texels.extend((0..places.n).map(|ix| {
                let cos_theta_d = cos_theta_d_at(places.warp, ix, places.n);
                let stencil = section.stencil(alpha_from_cos_theta_d(*eta, cos_theta_d));
                let sin_2 = 1.0 - cos_theta_d * cos_theta_d;
                let path = 1.0 / (1.0 - sin_2 / (eta * eta)).max(1e-12).sqrt();
                (stencil, path)
            }));
        }
        LobeRows {
            lobe: table.lobe,
            sections,
            decode: places.decode(),
            texels,
        }
    }

    /// Section, stencil and path of each texel.
    pub(super) fn each(&self) -> impl Iterator<Item = (&LobeSection, &Stencil, f64)> {
        let n = self.texels.len() / self.sections.len();
        let rows = self.sections.iter().zip(self.texels.chunks_exact(n));
        rows.flat_map(|(section, row)| {
            row.iter()
                .map(move |(stencil, path)| (section, stencil, *path))
        })
    }
}

/// Shapes of one fibre and mode, rounded as textures hold them.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedShapes {
    pub(super) decode: LobeDecode,
    pub(super) packed: Vec<[u16; N_SHAPE_NUMBERS]>,
    /// Per texel: 1 / I0e of each lobe's sharpness, halved for the pairs.
    pub(super) heights: Vec<[f64; 3]>,
}

impl PackedShapes {
    /// Shapes of `rows`; width `caustic_width` (w_c) widens those of TRT.
    pub fn new(rows: &LobeRows, caustic_width: f64) -> PackedShapes {
        let blur = (rows.lobe == Lobe::Trt).then(|| blur_measure(sharpness(caustic_width)));
        let shapes: Vec<LobeShape> = rows
            .each()
            .map(|(section, stencil, _)| {
                let mut shape = section.shape(stencil, LAMBDA_MIN);
                if let Some(blur) = blur {
                    shape.lambda = shape.lambda.map(|lambda| widened(lambda, blur));
                }
                shape
            })
            .collect();
        let widths = shapes.iter().flat_map(|shape| shape.lambda);
        let decode = LobeDecode {
            lambda_scale: widths.fold(0.0, f64::max) as f32,
            ..rows.decode
        };
        let packed: Vec<[u16; N_SHAPE_NUMBERS]> = shapes
            .iter()
            .map(|shape| {
                let width = |l: usize| fraction(shape.lambda[l] / f64::from(decode.lambda_scale));
                let [half_1, half_2] = shape.mu.map(|mu| {
                    let (sin, cos) = (0.5 * mu).sin_cos();
                    [cos, sin].map(|x| fraction(0.5 + 0.5 * x))
                });
                [
                    width(0),
                    width(1),
                    width(2),
                    half_1[0],
                    half_1[1],
                    half_2[0],
                    half_2[1],
                ]
            })
            .collect();
        // Amplitudes fit the widths as decoded.
        let heights = packed
            .iter()
            .map(|packed| {
                let decoded = decode_shape(packed, &decode);
                let height = |l: usize| 1.0 / i0e_i1e(sharpness(f64::from(decoded[l]))).0;
                [height(0), 0.5 * height(1), 0.5 * height(2)]
            })
            .collect();
        PackedShapes {
            decode,
            packed,
            heights,
        }
    }
}

/// Shares of the three lobes of one fibre and mode, per texel and channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Shares(Vec<[[f64; 3]; 3]>);

impl Shares {
    /// Shares of `rows` for absorption `sigma_a`.
    pub fn new(rows: &LobeRows, sigma_a: [f64; 3]) -> Shares {
        let texels = rows.each();
        Shares(
            texels
                .map(|(section, stencil, path)| {
                    sigma_a.map(|sigma| section.shares(stencil, sigma * path))
                })
                .collect(),
        )
    }
}

impl LobeTexture {
    /// The texture of these parts, all of the same places.
    pub fn new(shapes: &PackedShapes, energies: &Energies, shares: &Shares) -> LobeTexture {
        let mut decode = shapes.decode;
        let texels = energies.texels.iter().zip(&shares.0).zip(&shapes.heights);
        let mut amplitudes: Vec<[f64; 9]> = texels
            .map(|((energy, shares), heights)| {
                std::array::from_fn(|ix| {
                    let (channel, l) = (ix / 3, ix % 3);
                    energy[channel] * shares[channel][l] * heights[l]
                })
            })
            .collect();
        let width = decode.last as usize + 1;
        amplitudes.chunks_mut(width).for_each(centre);
        let highest = amplitudes.as_flattened().iter().copied();
        let scale = highest.fold(1e-30, f64::max) / FLOAT16_HIGHEST;
        decode.amplitude_scale = scale as f32;
        let lowest = scale * f64::from(FLOAT16_LOWEST);
        for (amplitudes, heights) in amplitudes.iter_mut().zip(&shapes.heights) {
            for channel in amplitudes.as_chunks_mut::<3>().0 {
                move_lost(channel, heights, lowest);
            }
        }
        let rows = shapes.packed.iter().zip(&amplitudes);
        let (texels, decoded) = rows
            .map(|(packed, amplitudes)| {
                let mut bits = [0u16; N_LOBE_NUMBERS];
                let mut numbers = [0.0; N_LOBE_NUMBERS];
                bits[..N_SHAPE_NUMBERS].copy_from_slice(packed);
                numbers[..N_SHAPE_NUMBERS].copy_from_slice(&decode_shape(packed, &decode));
                for (ix, amplitude) in amplitudes.iter().enumerate() {
                    let float = float16((amplitude / scale) as f32);
                    bits[N_SHAPE_NUMBERS + ix] = float;
                    numbers[N_SHAPE_NUMBERS + ix] = decode.amplitude_scale * from_float16(float);
                }
                let words = std::array::from_fn(|i| {
                    u32::from(bits[2 * i]) | u32::from(bits[2 * i + 1]) << 16
                });
                (words, numbers)
            })
            .unzip();
        LobeTexture {
            decode,
            texels,
            decoded,
        }
    }
}

/// Moves amplitudes by half of what linear interpolation misses in the middle between texels, so
/// that errors there and at the texels are even; not by more than a tenth.
fn centre(amplitudes: &mut [[f64; 9]]) {
    let Some(mut before) = amplitudes.first().copied() else {
        return;
    };
    for ix in 1..amplitudes.len() - 1 {
        let here = amplitudes[ix];
        let after = amplitudes[ix + 1];
        for j in 0..9 {
            let missed = (before[j] - 2.0 * here[j] + after[j]) / 16.0;
            amplitudes[ix][j] = here[j] - missed.clamp(-0.1 * here[j], 0.1 * here[j]);
        }
        before = here;
    }
}

/// Gives the energy of amplitudes that would be rounded to 0, below `lowest`, to the lobe of most
/// energy.
pub(super) fn move_lost(amplitudes: &mut [f64; 3], heights: &[f64; 3], lowest: f64) {
    if amplitudes.iter().all(|&amplitude| amplitude >= lowest) {
        return;
    }
    let energy = |amplitudes: &[f64; 3], l: usize| amplitudes[l] / heights[l];
    let most = (1..3).fold(0, |most, l| {
        if energy(amplitudes, l) > energy(amplitudes, most) {
            l
        } else {
            most
        }
    });
    for l in 0..3 {
        if l != most && amplitudes[l] < lowest {
            amplitudes[most] += heights[most] * energy(amplitudes, l);
            amplitudes[l] = 0.0;
        }
    }
}

/// 16 bits of a fraction of 1.
fn fraction(x: f64) -> u16 {
    (65535.0 * x.clamp(0.0, 1.0)).round() as u16
}

/// The numbers that [`PackedShapes`] packed.
pub(super) fn decode_shape(
    packed: &[u16; N_SHAPE_NUMBERS],
    decode: &LobeDecode,
) -> [f32; N_SHAPE_NUMBERS] {
    std::array::from_fn(|ix| {
        let fraction = f32::from(packed[ix]) / 65535.0;
        if ix < 3 {
            decode.lambda_scale * fraction
        } else {
            2.0 * fraction - 1.0
        }
    })
}

/// What the highest amplitude is stored as, and the lowest 16 bit float used: below, some GPUs
/// flush to 0.
pub(super) const FLOAT16_HIGHEST: f64 = 32768.0;
pub(super) const FLOAT16_LOWEST: f32 = 6.103_515_6e-5;

/// Bits of the 16 bit float nearest to `x` in 0..=65504; 0 below the normal range.
pub(super) fn float16(x: f32) -> u16 {
    if x < FLOAT16_LOWEST {
        return 0;
    }
    // Round the mantissa to 10 bits, ties to even; a carry runs into the exponent as it should.
    let bits = x.to_bits();
    let rounded = bits + 0xfff + (bits >> 13 & 1);
    ((rounded >> 13) - (112 << 10)) as u16
}

/// The value of [`float16`]'s bits.
pub(super) fn from_float16(bits: u16) -> f32 {
    if bits == 0 {
        return 0.0;
    }
    f32::from_bits((u32::from(bits) + (112 << 10)) << 13)
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
    // Narrow ones: measure = y/2 + y^2/4, y = 1/kappa; wide ones: A = kappa/2.
    let mut kappa = if target < 0.5 {
        0.25 * (1.0 + (1.0 + 4.0 * target).sqrt()) / target
    } else {
        2.0 * (-target).exp()
    };
    for _ in 0..6 {
        let (value, slope) = blur_measure_slope(kappa);
        // Newton in ln kappa: the measure is nearly a power of kappa.
        let step = (value - target) / (slope * kappa);
        kappa *= (-step).clamp(-2.0, 2.0).exp();
        // Steps square.
        if step.abs() < 1e-3 {
            break;
        }
    }
    (2.0 / kappa).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form::lobe_place;
    use crate::special::bessel_i_ratio_1;

    #[test]
    fn texels_stand_where_they_are_sampled() {
        for eta in [1.0001, 1.05, 1.55, 3.0] {
            let warp = warp(eta);
            for ix in 0..DEFAULT_LOBE_TEXELS {
                let c = cos_theta_d_at(warp, ix, DEFAULT_LOBE_TEXELS);
                let u = f64::from(lobe_place(warp as f32, c as f32));
                assert!(
                    (u - texel_at(ix, DEFAULT_LOBE_TEXELS)).abs() < 3e-7,
                    "{eta} {ix}"
                );
            }
        }
    }

    #[test]
    fn float16_rounds_to_nearest() {
        for (x, bits) in [
            (0.0, 0),
            (6e-5, 0),
            (1.0, 0x3c00),
            (0.5, 0x3800),
            (65504.0, 0x7bff),
        ] {
            assert_eq!(float16(x), bits);
        }
        assert_eq!(
            (float16(1.000_488_2), float16(1.000_488_4)),
            (0x3c00, 0x3c01)
        );
        for step in 0..10_000u32 {
            let x = 6.2e-5 * 1.002f32.powi(step.cast_signed());
            if x > 65504.0 {
                break;
            }
            assert!((from_float16(float16(x)) / x - 1.0).abs() <= 4.9e-4);
        }
    }

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
