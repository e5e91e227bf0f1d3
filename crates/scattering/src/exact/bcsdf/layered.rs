//! N_TRT blurred by w_c of fibres of any absorption.

use crate::fresnel::Fresnel;
use crate::hair::HairParams;

use super::table::{BlurredTrt, Rows, columns_at};

/// N_TRT over (theta_d, phi) in layers over sigma_a, and the density of the azimuth, as
/// [`BlurredTrt`] has them; between layers the logarithm goes linearly.
///
/// A channel of N_TRT is a mean of `exp(-sigma_a l)` over paths, whose logarithm is bent by the
/// variance of the paths' lengths l alone: within 1e-3 of the peak that the [`BlurredTrt`] of a
/// fibre has, at any absorption up to 50 (3e-3 where eta is near 1 and lengths run from 0 to 4;
/// tested).
#[derive(Clone, Debug)]
pub(super) struct LayeredTrt {
    rows: Rows,
    n_phi: usize,
    /// `[row][phi][layer]`, the density after the last.
    texels: Vec<f32>,
}

/// Layers over sigma_a 0..=[`SIGMA_A_MAX`]: 0.05 apart at 0, a tenth of sigma_a far above
/// [`SIGMA_A_MIDDLE`]. The error goes with the square of the distance.
const N_LAYERS: usize = 48;
const SIGMA_A_MAX: f64 = 50.0;
const SIGMA_A_MIDDLE: f64 = 0.5;

/// The least that has a logarithm.
const TINY: f64 = 1e-37;

/// Where an absorption stands among the layers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    layer: usize,
    /// Weight of the next layer, 0..=1.
    fraction: f64,
}

/// sigma_a of a layer.
fn sigma_of(layer: usize) -> f64 {
    let step = (1.0 + SIGMA_A_MAX / SIGMA_A_MIDDLE).ln() / (N_LAYERS - 1) as f64;
    SIGMA_A_MIDDLE * (step * layer as f64).exp_m1()
}

impl Place {
    /// Of sigma_a in 0..=50.
    pub fn of(sigma_a: f64) -> Place {
        let step = (1.0 + SIGMA_A_MAX / SIGMA_A_MIDDLE).ln() / (N_LAYERS - 1) as f64;
        let at = (sigma_a / SIGMA_A_MIDDLE).ln_1p() / step;
        let layer = (at as usize).min(N_LAYERS - 2);
        let [low, high] = [sigma_of(layer), sigma_of(layer + 1)];
        Place {
            layer,
            fraction: ((sigma_a - low) / (high - low)).clamp(0.0, 1.0),
        }
    }
}

impl LayeredTrt {
    /// The table of fibres of the eta and w_c of `hair`: 16 tables of one fibre each.
    pub fn new(hair: &HairParams, fresnel: Fresnel) -> Self {
        let tables: Vec<BlurredTrt> = (0..N_LAYERS / 3)
            .map(|ix| {
                let sigma_a = [0, 1, 2].map(|c| sigma_of((3 * ix + c).min(N_LAYERS - 1)));
                BlurredTrt::new(&HairParams { sigma_a, ..*hair }, fresnel)
            })
            .collect();
        let first = &tables[0];
        let mut texels = Vec::with_capacity(first.texels.len() * (N_LAYERS + 1));
        for (at, [.., density]) in first.texels.iter().enumerate() {
            for table in &tables {
                texels.extend_from_slice(&table.texels[at][..3]);
            }
            texels.push(*density);
        }
        LayeredTrt {
            rows: first.rows,
            n_phi: first.n_phi,
            texels,
        }
    }

    /// `[N_TRT rgb, density]` at `theta_d` and `phi` (wrapped, +-pi) of the absorptions `places`.
    pub fn at(&self, theta_d: f64, phi: f64, places: &[Place; 3]) -> [f64; 4] {
        let (row, row_weights) = self.rows.at(theta_d);
        let (column, column_weights) = columns_at(self.n_phi, phi);
        // Of each channel the two layers; the density.
        let mut sums = [0.0; 7];
        for (r, row_weight) in row_weights.into_iter().enumerate() {
            for (c, column_weight) in column_weights.into_iter().enumerate() {
                let weight = row_weight * column_weight;
                let at = (row + r) * (self.n_phi + 2) + column + c;
                let layers = &self.texels[at * (N_LAYERS + 1)..][..=N_LAYERS];
                for (pair, place) in sums.chunks_exact_mut(2).zip(places) {
                    pair[0] += weight * f64::from(layers[place.layer]);
                    pair[1] += weight * f64::from(layers[place.layer + 1]);
                }
                sums[6] += weight * f64::from(layers[N_LAYERS]);
            }
        }
        let channel = |c: usize| {
            // The cubic swings below zero beside a caustic.
            let [near, far] = [sums[2 * c], sums[2 * c + 1]].map(|x: f64| x.max(TINY));
            near * (places[c].fraction * (far / near).ln()).exp()
        };
        [channel(0), channel(1), channel(2), sums[6].max(0.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::R2;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn any_absorption_has_the_table_of_its_fibre() {
        for (eta, caustic_width) in [(1.55, 0.148), (1.35, 0.4), (1.0001, 0.1), (3.0, 0.2)] {
            let hair = HairParams {
                eta,
                caustic_width,
                ..HairParams::default()
            };
            let layered = LayeredTrt::new(&hair, Fresnel::Dielectric);
            let mut worst = 0.0f64;
            for sigma_a in [
                [0.0, 0.01, 0.07],
                [0.2, 0.42, 0.83],
                [1.3, 2.1, 3.7],
                [6.0, 17.0, 50.0],
            ] {
                let one = BlurredTrt::new(&HairParams { sigma_a, ..hair }, Fresnel::Dielectric);
                let places = sigma_a.map(Place::of);
                let peak = one.texels.iter().fold([0.0f64; 4], |peak, texel| {
                    std::array::from_fn(|c| peak[c].max(f64::from(texel[c])))
                });
                for i in 1..=400 {
                    let theta_d = FRAC_PI_2 * (f64::from(i) * R2[0] % 1.0);
                    let phi = PI * (f64::from(i) * R2[1] % 1.0);
                    let found = layered.at(theta_d, phi, &places);
                    let right = one.at(theta_d, phi);
                    for c in 0..4 {
                        let error = (found[c] - right[c]).abs() / peak[c].max(1e-12);
                        worst = worst.max(error);
                    }
                }
            }
            println!("{eta} {caustic_width}: {worst:e}");
            assert!(worst < 5e-3, "{eta} {caustic_width}: {worst:e}");
        }
    }
}
