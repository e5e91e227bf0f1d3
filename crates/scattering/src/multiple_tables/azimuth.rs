//! Global scattering over azimuth: N_t^G as a constant and three functions of the lag.
//!
//! Two opposite half circles of light sum to the whole circle, so N_t^G(Delta) + N_t^G(pi - Delta) is
//! the same for all lags: beside the mean there are odd harmonics alone, cos((2 k + 1) Delta). Of
//! [`N_HARMONICS`] of them, those three sums that carry most of all modes, channels and inclinations of
//! this fibre are kept: the leading eigenvectors of their covariance. The cosines of 1, 2 and 3 Delta
//! leave 0.3 % (auburn), 0.9 % (black), 6.5 % (TRT alone); the cosines of 1, 3 and 5 Delta half of it.

use core::f32::consts::PI;

use crate::closed_form::{
    Lag, SampleLobes, Shading, further_orders, half_circle_basis, half_circle_r, half_circle_trt,
    half_circle_tt, inclination,
};
use crate::jobs::{self, Job};

/// Odd harmonics before they are reduced.
const N_HARMONICS: usize = 6;

/// Lags at which N_t^G is sampled.
const N_LAGS: usize = 2 * N_HARMONICS;

/// Functions of the lag that are kept.
pub(super) const N_FUNCTIONS: usize = 3;

/// Nodes over cos(theta_d), less one.
pub(super) const LAST_NODE: f32 = 128.0;

/// Nodes that one job samples.
const NODES_IN_A_JOB: usize = 4;

/// Nodes below this cosine are about as far apart as those above.
pub(super) const GRAZING: f32 = 0.2;

/// What one mode scatters at one theta_d, or a row of the table: for the constant and the functions each,
/// red, green, blue and a number that belongs to something else.
pub(super) type Row = [f32; 4 * (1 + N_FUNCTIONS)];

/// The functions of the lag: factors of cos((2 k + 1) Delta) in each, and zeros for the constant.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LagFunctions(pub [[f32; 4]; N_HARMONICS]);

impl LagFunctions {
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

/// N_t^G of the enabled modes over cos(theta_d).
pub(super) struct Profiles {
    /// `[mode][node]`; none of modes that are not enabled.
    nodes: [Vec<Row>; 3],
    pub functions: LagFunctions,
}

/// The constant and the harmonics at one node, `[0]` and `[1..]`, per channel.
type Spectrum = [[f32; 3]; 1 + N_HARMONICS];

fn cosine_of(node: usize) -> f32 {
    let at = node as f32 / LAST_NODE;
    GRAZING * at / (1.0 + GRAZING - at)
}

impl Profiles {
    /// Of a circular fibre.
    pub fn new(shading: &Shading<impl SampleLobes + Sync>, run: impl FnOnce(Vec<Job>)) -> Profiles {
        let lags: [Lag; N_LAGS] = std::array::from_fn(|k| {
            let half = 0.5 * PI * (k as f32 + 0.5) / N_LAGS as f32;
            Lag {
                sin_half: half.sin(),
                cos_half: half.cos(),
                cos_sum: 0.0,
                cos_view: 0.0,
            }
        });
        let n_nodes = LAST_NODE as usize + 1;
        let modes = (0..3).filter(|mode| shading.fibre.modes & (1 << mode) != 0);
        let modes: Vec<usize> = modes.collect();
        let mut found = vec![[[0.0; 3]; 1 + N_HARMONICS]; n_nodes * modes.len()];
        let node = |ix| spectrum_of(modes[ix / n_nodes], cosine_of(ix % n_nodes), &lags, shading);
        jobs::fill(&mut found, NODES_IN_A_JOB, node, run);
        let mut spectra: [Vec<Spectrum>; 3] = Default::default();
        for (mode, found) in modes.iter().zip(found.chunks_exact(n_nodes)) {
            spectra[*mode] = found.to_vec();
        }
        let vectors = leading(covariance(&spectra));
        let functions = std::array::from_fn(|harmonic| {
            let [a, b, c] = vectors.map(|vector| vector[harmonic] as f32);
            [0.0, a, b, c]
        });
        let reduce = |spectrum: &Spectrum| {
            let mut row = [0.0; 16];
            for channel in 0..3 {
                row[channel] = spectrum[0][channel];
                for (f, vector) in vectors.iter().enumerate() {
                    let along = spectrum[1..].iter().zip(vector);
                    let along = along.map(|(harmonic, v)| harmonic[channel] * *v as f32);
                    row[4 * (f + 1) + channel] = along.sum();
                }
            }
            row
        };
        Profiles {
            nodes: spectra.map(|spectra| spectra.iter().map(reduce).collect()),
            functions: LagFunctions(functions),
        }
    }

    /// `[mode][node]`, zeros of modes that are not enabled.
    pub fn rows(&self) -> Vec<Row> {
        let n_nodes = LAST_NODE as usize + 1;
        let mut rows = vec![[0.0; 16]; 3 * n_nodes];
        for (rows, nodes) in rows.chunks_exact_mut(n_nodes).zip(&self.nodes) {
            rows[..nodes.len()].copy_from_slice(nodes);
        }
        rows
    }

    /// What an enabled mode scatters at a node.
    pub fn node(&self, mode: usize, node: usize) -> &Row {
        &self.nodes[mode][node]
    }

    /// Adds `factor` times N_t^G at `cos_theta_d` to a row.
    pub fn add(&self, mode: usize, cos_theta_d: f32, factor: f32, row: &mut Row) {
        let place = (1.0 + GRAZING) * cos_theta_d / (GRAZING + cos_theta_d);
        let at = (LAST_NODE * place).clamp(0.0, LAST_NODE);
        let first = at.min(LAST_NODE - 1.0) as usize;
        let high = factor * (at - first as f32);
        let low = factor - high;
        let (below, above) = (&self.nodes[mode][first], &self.nodes[mode][first + 1]);
        for (ix, value) in row.iter_mut().enumerate() {
            *value += low * below[ix] + high * above[ix];
        }
    }
}

/// N_t^G by its samples at the lags.
fn spectrum_of(
    mode: usize,
    cos_theta_d: f32,
    lags: &[Lag; N_LAGS],
    shading: &Shading<impl SampleLobes>,
) -> Spectrum {
    let fibre = shading.fibre;
    let mut incline = inclination(cos_theta_d.clamp(0.0, 1.0).acos());
    incline.cos_theta_d = incline.cos_theta_d.max(cos_theta_d);
    let lobes = match mode {
        0 => None,
        1 => Some(shading.tt.lobes_at(fibre.eta, incline.cos_theta_d)),
        _ => Some(shading.trt.lobes_at(fibre.eta, incline.cos_theta_d)),
    };
    let mut spectrum = [[0.0; 3]; 1 + N_HARMONICS];
    for (k, lag) in lags.iter().enumerate() {
        let value = match &lobes {
            None => [half_circle_r(&half_circle_basis(lag), &incline, shading.reflectance); 3],
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

type Matrix = [[f64; N_HARMONICS]; N_HARMONICS];

/// Sum over modes, channels and inclinations (each by its share of the sphere) of the products of
/// harmonics; every channel counts the same.
fn covariance(spectra: &[Vec<Spectrum>; 3]) -> Matrix {
    let mut by_channel = [[[0.0; N_HARMONICS]; N_HARMONICS]; 3];
    for spectra in spectra {
        for (node, pair) in spectra.windows(2).enumerate() {
            let sine = |node| f64::from(1.0 - cosine_of(node).powi(2)).max(0.0).sqrt();
            let weight = sine(node) - sine(node + 1);
            for (channel, matrix) in by_channel.iter_mut().enumerate() {
                for (a, row) in matrix.iter_mut().enumerate() {
                    for (b, entry) in row.iter_mut().enumerate() {
                        let [a, b] = [a, b].map(|k| f64::from(pair[0][1 + k][channel]));
                        *entry += weight * a * b;
                    }
                }
            }
        }
    }
    let mut sum = [[0.0; N_HARMONICS]; N_HARMONICS];
    for matrix in by_channel {
        let trace: f64 = (0..N_HARMONICS).map(|k| matrix[k][k]).sum();
        for (sum, row) in sum.as_flattened_mut().iter_mut().zip(matrix.as_flattened()) {
            *sum += row / trace.max(1e-30);
        }
    }
    sum
}

/// The eigenvectors of the largest eigenvalues of a symmetric matrix, by Jacobi's rotations.
fn leading(mut matrix: Matrix) -> [[f64; N_HARMONICS]; N_FUNCTIONS] {
    let mut vectors: Matrix = std::array::from_fn(|a| {
        let mut unit = [0.0; N_HARMONICS];
        unit[a] = 1.0;
        unit
    });
    for _sweep in 0..12 {
        for p in 0..N_HARMONICS {
            for q in p + 1..N_HARMONICS {
                let off = matrix[p][q];
                if off.abs() < 1e-30 {
                    continue;
                }
                let theta = (matrix[q][q] - matrix[p][p]) / (2.0 * off);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for row in &mut matrix {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                let (a, b) = (matrix[p], matrix[q]);
                matrix[p] = std::array::from_fn(|k| c * a[k] - s * b[k]);
                matrix[q] = std::array::from_fn(|k| s * a[k] + c * b[k]);
                let (a, b) = (vectors[p], vectors[q]);
                vectors[p] = std::array::from_fn(|k| c * a[k] - s * b[k]);
                vectors[q] = std::array::from_fn(|k| s * a[k] + c * b[k]);
            }
        }
    }
    let mut order: [usize; N_HARMONICS] = std::array::from_fn(|k| k);
    order.sort_by(|&a, &b| matrix[b][b].total_cmp(&matrix[a][a]));
    std::array::from_fn(|f| vectors[order[f]])
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

    #[test]
    fn leading_vectors_are_eigenvectors() {
        let matrix: Matrix = std::array::from_fn(|a| {
            std::array::from_fn(|b| {
                let (a, b) = (a as f64, b as f64);
                1.0 / (1.0 + a + b) + if a == b { a * a } else { 0.0 }
            })
        });
        let mut last = f64::INFINITY;
        for vector in leading(matrix) {
            let image: [f64; N_HARMONICS] =
                matrix.map(|row| row.iter().zip(vector).map(|(m, v)| m * v).sum());
            let value: f64 = image.iter().zip(vector).map(|(a, b)| a * b).sum();
            for (a, b) in image.into_iter().zip(vector) {
                assert!((a - value * b).abs() < 1e-9, "{a} {b}");
            }
            assert!(value < last);
            last = value;
        }
    }
}
