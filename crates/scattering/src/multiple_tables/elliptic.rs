//! Global scattering of an elliptic fibre over azimuth: N_t^G as a constant and seven functions of the lag
//! Delta = phi_j - phi_o, from the view to the light, and of the view's azimuth phi_o.
//!
//! Its N_TRT is that of the index eta* = mean + swing cos(2 phi_o + psi), psi = phi_i - phi_o (Xu 2011
//! Eq 24 to 26). As a Chebyshev series in eta* it is a sum of functions of psi times
//! cos(m (2 phi_o + psi)), so N_TRT^G is one of cos(2 m phi_o) times cosines of the lag and
//! sin(2 m phi_o) times sines; of these a half circle of light keeps the odd ones and the constant.
//! N_R and N_TT have the order m = 0 alone.
//!
//! Six orders and seven functions leave at most 0.6 % of N^G of all modes, a in 0.5..2, beside fine
//! sums over azimuth. TRT alone follows the index more sharply: 5 to 12 % of brown hair's, 23 to 46 % of black hair's, which is
//! next to nothing. Eight orders leave 0.4 % of all modes.

use core::f32::consts::{FRAC_1_PI, PI, SQRT_2};

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{Lobes, SampleLobes, Shading, eta_at};
use crate::wide::eccentric::one_at_azimuths;
use crate::wide::math::mul_add;
use crate::wide::{LANES, Level, dispatch};

use super::lag::{LagSpectrum, N_HARMONICS, Spectrum};

/// Orders m that are kept.
const N_ORDERS: usize = 6;

/// Parts of an order: a constant in the lag, then cosines of its odd multiples, then sines.
const ORDER_PARTS: usize = 13;

const _: () = assert!(ORDER_PARTS == 1 + 2 * N_HARMONICS);

/// Parts of all orders, those first of m = 0, whose first is the mean.
const N_PARTS: usize = N_ORDERS * ORDER_PARTS;

/// Functions that are kept, the constant among them.
pub(super) const N_FUNCTIONS: usize = 8;

/// Indices at which N_TRT is looked at: Chebyshev's points.
const N_INDICES: usize = 12;

/// Azimuths psi in 0..pi at which it is, by eights.
const N_EIGHTS: usize = 6;
const N_AZIMUTHS: usize = N_EIGHTS * LANES;

/// A number for each of them.
type AtAzimuths = [[f32; LANES]; N_EIGHTS];

/// What is added to the squares of the lobes' widths: those much narrower than a step are then as wide as
/// one, and count the same wherever they lie.
const BLUR: f32 = 0.5 * (PI / N_AZIMUTHS as f32) * (PI / N_AZIMUTHS as f32);

/// A number for each of the functions.
pub(super) type Functions = [f32; N_FUNCTIONS];

/// The functions: factors of each term, `[order][term]`; the first function is 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EllipticFunctions(pub [[Functions; ORDER_PARTS]; N_ORDERS]);

/// What terms with the lag and an order are to be multiplied by to be as large as the others.
fn evened(part: usize) -> f32 {
    match part >= ORDER_PARTS && !part.is_multiple_of(ORDER_PARTS) {
        true => SQRT_2,
        false => 1.0,
    }
}

impl EllipticFunctions {
    /// By the parts of all but the first.
    pub fn new(vectors: &[[f64; N_PARTS]; N_FUNCTIONS - 1]) -> EllipticFunctions {
        let mut factors = [[[0.0; N_FUNCTIONS]; ORDER_PARTS]; N_ORDERS];
        for (part, functions) in factors.as_flattened_mut().iter_mut().enumerate() {
            let of_vectors = vectors.map(|vector| vector[part] as f32);
            for (factor, vector) in functions[1..].iter_mut().zip(of_vectors) {
                *factor = evened(part) * vector;
            }
        }
        factors[0][0] = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        EllipticFunctions(factors)
    }

    /// Factors of the constant, the cosines and the sines where 2 phi_o has this cosine and sine.
    #[inline(always)]
    pub fn seen_from(&self, cos_view: f32, sin_view: f32) -> [Functions; ORDER_PARTS] {
        let mut seen = self.0[0];
        let (mut cos, mut sin) = (cos_view, sin_view);
        for of_order in &self.0[1..] {
            for (term, (seen, factors)) in seen.iter_mut().zip(of_order).enumerate() {
                let turn = if term > N_HARMONICS { sin } else { cos };
                for (seen, factor) in seen.iter_mut().zip(factors) {
                    *seen += turn * factor;
                }
            }
            (cos, sin) = (
                cos * cos_view - sin * sin_view,
                sin * cos_view + cos * sin_view,
            );
        }
        seen
    }

    /// The functions at a lag of this cosine and sine, there.
    #[inline(always)]
    pub fn at(&self, [cos, sin]: [f32; 2], [cos_view, sin_view]: [f32; 2]) -> Functions {
        let seen = self.seen_from(cos_view, sin_view);
        let mut functions = seen[0];
        let [mut cos_k, mut sin_k] = [cos, sin];
        let [cos_2, sin_2] = [1.0 - 2.0 * sin * sin, 2.0 * sin * cos];
        for k in 0..N_HARMONICS {
            let (cosines, sines) = (&seen[1 + k], &seen[1 + N_HARMONICS + k]);
            for (f, function) in functions.iter_mut().enumerate() {
                *function += cos_k * cosines[f] + sin_k * sines[f];
            }
            (cos_k, sin_k) = (cos_k * cos_2 - sin_k * sin_2, sin_k * cos_2 + cos_k * sin_2);
        }
        functions
    }
}

/// The parts of what depends on the lag alone.
pub(super) fn of_lag_alone(spectrum: &LagSpectrum) -> Spectrum<N_PARTS> {
    let mut parts = [[0.0; 3]; N_PARTS];
    parts[..spectrum.len()].copy_from_slice(spectrum);
    parts
}

/// What N_TRT at the azimuths adds to the parts of N_TRT^G.
pub(super) struct Sampler {
    /// Sine and cosine of half of psi.
    half_angles: [AtAzimuths; 2],
    /// By order and index, before cos(m (2 phi_o + psi)).
    series: [[f32; N_INDICES]; N_ORDERS],
    /// By part.
    parts: Vec<AtAzimuths>,
}

impl Sampler {
    pub fn new() -> Sampler {
        let at_azimuths = |value: &dyn Fn(f32) -> f32| -> AtAzimuths {
            std::array::from_fn(|eight| {
                std::array::from_fn(|lane| value(psi_of(LANES * eight + lane)))
            })
        };
        let chebyshev = |m: usize, ix: usize| {
            let factor = if m == 0 { 1.0 } else { 2.0 };
            factor / N_INDICES as f32 * (m as f32 * chebyshev_angle(ix)).cos()
        };
        let part = |part| at_azimuths(&|psi| part_factor(part, psi));
        Sampler {
            half_angles: [
                at_azimuths(&|psi| (0.5 * psi).sin()),
                at_azimuths(&|psi| (0.5 * psi).cos()),
            ],
            series: std::array::from_fn(|m| std::array::from_fn(|ix| chebyshev(m, ix))),
            parts: (0..N_PARTS).map(part).collect(),
        }
    }

    /// N_TRT^G at `cos_theta_d`.
    pub fn spectrum(
        &self,
        cos_theta_d: f32,
        shading: &Shading<impl SampleLobes>,
    ) -> Spectrum<N_PARTS> {
        let lobes: [Lobes; N_INDICES] = std::array::from_fn(|ix| {
            let eta = eta_at(chebyshev_angle(ix).cos(), shading.fibre);
            shading.trt.lobes_at(eta, cos_theta_d)
        });
        dispatch!(Level::new(), simd => self.spectrum_of(simd, &lobes))
    }

    /// Of the lobes at the indices.
    #[inline(always)]
    fn spectrum_of<S: Simd>(&self, simd: S, lobes: &[Lobes; N_INDICES]) -> Spectrum<N_PARTS> {
        let zero = f32x8::splat(simd, 0.0);
        // By order, channel and eight azimuths.
        let mut series = [[[zero; N_EIGHTS]; 3]; N_ORDERS];
        for (ix, lobes) in lobes.iter().enumerate() {
            for eight in 0..N_EIGHTS {
                let sin = f32x8::load_array_ref(simd, &self.half_angles[0][eight]);
                let cos = f32x8::load_array_ref(simd, &self.half_angles[1][eight]);
                let value = one_at_azimuths(simd, lobes, sin, cos, BLUR);
                for (series, factors) in series.iter_mut().zip(&self.series) {
                    let factor = f32x8::splat(simd, factors[ix]);
                    for (series, value) in series.iter_mut().zip(value) {
                        series[eight] = mul_add(factor, value, series[eight]);
                    }
                }
            }
        }
        let mut spectrum = [[0.0; 3]; N_PARTS];
        for (part, (rgb, factors)) in spectrum.iter_mut().zip(&self.parts).enumerate() {
            for (sum, series) in rgb.iter_mut().zip(&series[part / ORDER_PARTS]) {
                let mut along = zero;
                for (factors, value) in factors.iter().zip(series) {
                    along = mul_add(f32x8::load_array_ref(simd, factors), *value, along);
                }
                let lanes: [f32; LANES] = along.into();
                *sum = lanes.iter().sum();
            }
        }
        spectrum
    }
}

fn psi_of(azimuth: usize) -> f32 {
    PI * (azimuth as f32 + 0.5) / N_AZIMUTHS as f32
}

/// 2 phi_o + psi of an index.
fn chebyshev_angle(ix: usize) -> f32 {
    PI * (ix as f32 + 0.5) / N_INDICES as f32
}

/// What the azimuths +-psi add to a part: f(psi) cos(m (2 phi_o + psi)), f even, is sorted by cos(2 m phi_o) and
/// sin(2 m phi_o), and its harmonics in psi are averaged over half circles.
fn part_factor(part: usize, psi: f32) -> f32 {
    let (m, term) = (part / ORDER_PARTS, part % ORDER_PARTS);
    // N_t^G is 1 / (2 pi) times the mean of N_t over the half circle.
    let share = 0.5 * FRAC_1_PI / (N_AZIMUTHS as f32 * evened(part));
    let (sin, cos) = (m as f32 * psi).sin_cos();
    if term == 0 {
        return share * cos;
    }
    let k = (term - 1) % N_HARMONICS;
    let odd = (2 * k + 1) as f32;
    let side = if k.is_multiple_of(2) { 4.0 } else { -4.0 };
    let half_circle = side * FRAC_1_PI / odd;
    match term <= N_HARMONICS {
        true => share * half_circle * cos * (odd * psi).cos(),
        false => -share * half_circle * sin * (odd * psi).sin(),
    }
}
