//! Global scattering over azimuth of a round fibre: N_t^G as a constant and three functions of the lag.
//!
//! Two opposite half circles of light sum to the whole circle, so N_t^G(Delta) + N_t^G(pi - Delta) is
//! the same for all lags: beside the mean there are odd harmonics alone, cos((2 k + 1) Delta). Of
//! [`N_HARMONICS`] of them, those three sums that carry most of all modes, channels and inclinations of
//! this fibre are kept ([`super::azimuth`]). The cosines of 1, 2 and 3 Delta
//! leave 0.3 % (auburn), 0.9 % (black), 6.5 % (TRT alone); the cosines of 1, 3 and 5 Delta half of it.

use core::f32::consts::PI;

use crate::closed_form::{
    Inclination, Lag, SampleLobes, Shading, further_orders, half_circle_basis, half_circle_r,
    half_circle_trt, half_circle_tt,
};

/// Odd harmonics before they are reduced.
pub(super) const N_HARMONICS: usize = 6;

/// How many [`SampledLags`] are.
const N_LAGS: usize = 2 * N_HARMONICS;

/// Functions of the lag that are kept beside the constant.
pub(super) const N_FUNCTIONS: usize = 3;

/// N_t^G at one node, per channel: the mean first, then parts of a basis whose functions are orthogonal and
/// equally large.
pub(super) type Spectrum<const N: usize> = [[f32; 3]; N];

/// That of the lag: the mean and the harmonics.
pub(super) type LagSpectrum = Spectrum<{ 1 + N_HARMONICS }>;

/// The functions of the lag: factors of cos((2 k + 1) Delta) in each, and zeros for the constant.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LagFunctions(pub [[f32; 4]; N_HARMONICS]);

impl LagFunctions {
    /// By the parts of the functions.
    pub fn new(vectors: &[[f64; 1 + N_HARMONICS]; N_FUNCTIONS]) -> LagFunctions {
        LagFunctions(std::array::from_fn(|harmonic| {
            let [a, b, c] = vectors.map(|vector| vector[1 + harmonic] as f32);
            [0.0, a, b, c]
        }))
    }

    /// The functions at the lag of this cosine; the first is 0.
    ///
    /// By Clenshaw's recurrence, cos((2 k + 3) x) = 2 cos(2 x) cos((2 k + 1) x) - cos((2 k - 1) x).
    #[inline(always)]
    pub fn at(&self, cosine: f32) -> [f32; 4] {
        let twice = 4.0 * cosine * cosine - 2.0;
        let mut sums = [[0.0f32; 4]; 2];
        for row in self.0[1..].iter().rev() {
            let next = std::array::from_fn(|k| row[k] + twice * sums[0][k] - sums[1][k]);
            sums = [next, sums[0]];
        }
        // The two before the first are cos(x) and cos(-x).
        std::array::from_fn(|k| cosine * (self.0[0][k] + (twice - 1.0) * sums[0][k] - sums[1][k]))
    }
}

/// Lags at which N_t^G is sampled.
pub(super) struct SampledLags([Lag; N_LAGS]);

impl SampledLags {
    pub fn new() -> SampledLags {
        SampledLags(std::array::from_fn(|k| {
            let half = 0.5 * PI * (k as f32 + 0.5) / N_LAGS as f32;
            Lag {
                sin_half: half.sin(),
                cos_half: half.cos(),
                cos_sum: 0.0,
                cos_view: 0.0,
            }
        }))
    }

    /// N_t^G of a mode by its samples at the lags.
    pub fn spectrum(
        &self,
        mode: usize,
        incline: &Inclination,
        shading: &Shading<impl SampleLobes>,
    ) -> LagSpectrum {
        let fibre = shading.fibre;
        let lobes = match mode {
            0 => None,
            1 => Some(shading.tt.lobes_at(fibre.eta, incline.cos_theta_d)),
            _ => Some(shading.trt.lobes_at(fibre.eta, incline.cos_theta_d)),
        };
        let mut spectrum = [[0.0; 3]; 1 + N_HARMONICS];
        for (k, lag) in self.0.iter().enumerate() {
            let value = match &lobes {
                None => [half_circle_r(&half_circle_basis(lag), incline, shading.reflectance); 3],
                Some(lobes) if mode == 1 => half_circle_tt(lag, lobes),
                Some(lobes) => half_circle_trt(lag, lobes),
            };
            let delta = PI * (k as f32 + 0.5) / N_LAGS as f32;
            for (harmonic, sum) in spectrum.iter_mut().enumerate() {
                let factor = match harmonic {
                    0 => 1.0,
                    _ => 2.0 * ((2 * harmonic - 1) as f32 * delta).cos(),
                };
                for (sum, value) in sum.iter_mut().zip(value) {
                    *sum += factor / N_LAGS as f32 * value;
                }
            }
        }
        if mode == 2 {
            // Orders beyond TRT leave evenly; none of model `marschner`.
            let further = further_orders(fibre, incline.cos_theta_d);
            for (sum, further) in spectrum[0].iter_mut().zip(further) {
                *sum += further / (2.0 * PI);
            }
        }
        spectrum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lag_functions_are_sums_of_odd_harmonics() {
        let factors = std::array::from_fn(|k| [0.0, 1.0 / (k as f32 + 1.0), 0.3 - k as f32, 0.5]);
        let functions = LagFunctions(factors);
        for step in 0..=40 {
            let delta = PI * step as f32 / 40.0;
            let found = functions.at(delta.cos());
            for (f, found) in found.into_iter().enumerate() {
                let terms = (0..N_HARMONICS).map(|k| {
                    f64::from(factors[k][f]) * f64::from((2 * k + 1) as f32 * delta).cos()
                });
                let sum: f64 = terms.sum();
                assert!(
                    (f64::from(found) - sum).abs() < 1e-4,
                    "{delta} {f}: {found} {sum}"
                );
            }
        }
    }
}
