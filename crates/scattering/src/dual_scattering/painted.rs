//! The averages of painted fibres: over inclination, absorption, and factors of widths and shifts.
//!
//! Painted hair has one eta, w_c, and set of widths and shifts; each point has its own absorption,
//! a factor of the widths and one of the shifts. The averages of one channel depend on its own
//! absorption alone, so one table serves all channels and colours. `Delta_b` goes with the factor
//! of the shifts and `beta_f^2`, `sigma_b^2` with the square of that of the widths, but not quite:
//! wide lobes lose light past the ends, so `a_f` and `a_b` fall with the width (of the default
//! fibre twice as wide by 5 and 13 %, `A_b` by 19 %; four times by 17, 40 and 80 %). So what is
//! left over those factors is tabulated where a factor other than 1 is painted at all.
//!
//! Against [`AverageTable`](super::AverageTable) of the same hair, relative RMSE over inclinations
//! by their cosine, largest of sigma_a 0..20 (test `are_those_of_the_hair_that_is_painted`):
//!
//! | | A_b | Delta_b | sigma_b^2 | a_f | beta_f^2 |
//! |---|---|---|---|---|---|
//! | absorption alone | 1.8 % | 0.3 % | 0.3 % | 0.3 % | 0.1 % |
//! | factors 0.7..2 too | 2.5 % (5 % of black hair) | 2.3 % | 1.5 % | 1.4 % | 0.7 % |
//! | 3.3 | 3.6 % (10 %) | 1.9 % | 2.5 % | 2.4 % | 0.6 % |

use std::f64::consts::PI;

use super::azimuth::AzimuthRule;
use super::backscatter::{bounded_shift, counts};
use super::event::share_of;
use super::longitudinal::{full_angle, outgoing};
use super::table::{N_COLUMNS, N_INCLINATIONS, N_OFFSETS, N_OUTGOING, N_TURNS, REACH, Taps};
use crate::closed_form::{N_FORWARD, PaintedAverages, PaintedAveragesView, painted_place};
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe};
use crate::quadrature::GaussLegendre;

/// Layers over absorption; factors of widths and of shifts where those are painted.
pub const DEFAULT_AVERAGE_LAYERS: usize = 40;
/// See [`DEFAULT_AVERAGE_LAYERS`]; odd, so that 1 is one of them.
pub const DEFAULT_SCALES: usize = 9;

/// Largest sigma_a with a layer of its own, and the range of the factors.
const SIGMA_A_MAX: f64 = 50.0;
const SCALE_MIN: f64 = 0.05;

/// The averages of painted fibres, see [`PaintedAverages`] for the layout.
#[derive(Clone, Debug, PartialEq)]
pub struct PaintedAverageTable {
    /// How texels are placed; part of a uniform of the shaders.
    pub decode: PaintedAverages,
    /// `[shift][width][layer][column]`: A_b, Delta_b over its factor, sigma_b^2 over its factor's
    /// square and 0 at 128 inclinations; then a_f, beta_f^2 over its factor's square and two 0 at
    /// 64 sines.
    pub texels: Vec<[f32; 4]>,
}

/// The columns over cos(theta_d) of one mode.
struct Columns {
    taps: Taps,
    /// Layers; one of R, which is the same on all.
    n: usize,
    /// `[column]`: q_f of all layers, then q_b.
    values: Vec<f32>,
}

/// As [`super::event::BREATH`], in single precision.
const BREATH: f64 = 1e-25;

impl PaintedAverageTable {
    /// The table of `hair` (valid, see [`HairParams::validate`]), whatever its absorption: `layers`
    /// of absorption (at least 2), `widths` and `shifts` factors; 1 where none but 1 is painted.
    pub fn new(
        hair: &HairParams,
        fresnel: Fresnel,
        [layers, widths, shifts]: [usize; 3],
    ) -> PaintedAverageTable {
        let layers = layers.max(2);
        let decode = PaintedAverages::new([layers, widths.max(1), shifts.max(1)]);
        let sigmas: Vec<f64> = (0..layers).map(|ix| sigma_of(ix, layers)).collect();
        let columns = Lobe::ALL.map(|lobe| columns_of(hair, fresnel, lobe, &sigmas));
        let rule = GaussLegendre::new(N_OUTGOING);
        let mut texels = Vec::new();
        for shift in 0..shifts.max(1) {
            for width in 0..widths.max(1) {
                let scales = [scale_of(width, widths), scale_of(shift, shifts)];
                let painted = hair.scaled(scales[0], scales[1]);
                push_slice(&painted, scales, &columns, &rule, layers, &mut texels);
            }
        }
        PaintedAverageTable { decode, texels }
    }

    /// The table as the closed form samples it.
    pub fn view(&self) -> PaintedAveragesView<'_> {
        PaintedAveragesView {
            texels: &self.texels,
            decode: &self.decode,
        }
    }
}

/// sigma_a of layer `ix` of `n`, the inverse of [`crate::closed_form::average_row`]'s.
fn sigma_of(ix: usize, n: usize) -> f64 {
    let middle = f64::from(crate::closed_form::LAYER_MIDDLE);
    let top = SIGMA_A_MAX / (middle + SIGMA_A_MAX);
    let t = ix as f64 / (n - 1) as f64;
    let t = top * t * t;
    middle * t / (1.0 - t)
}

/// Factor `ix` of `n`, evenly in x / (1 + x); 1 if there is only one.
fn scale_of(ix: usize, n: usize) -> f64 {
    if n < 2 {
        return 1.0;
    }
    let first = f64::from(painted_place(SCALE_MIN as f32));
    let u = first + (1.0 - 2.0 * first) * ix as f64 / (n - 1) as f64;
    u / (1.0 - u)
}

fn columns_of(hair: &HairParams, fresnel: Fresnel, lobe: Lobe, sigmas: &[f64]) -> Columns {
    let taps = Taps::new(hair.eta);
    // R does not enter the fibre.
    let n = if lobe == Lobe::R { 1 } else { sigmas.len() };
    let mut values = vec![0.0; N_COLUMNS * 2 * n];
    // What is kept without absorption and at 1: an exponential through both at any other.
    let clear = HairParams {
        sigma_a: [0.0, 1.0, 1.0],
        ..*hair
    };
    let azimuth = AzimuthRule::new(&clear, fresnel, N_OFFSETS, N_TURNS);
    for (ix, column) in values.chunks_exact_mut(2 * n).enumerate() {
        let (forward, backward) = column.split_at_mut(n);
        azimuth.each(lobe, taps.cos_theta_d(ix), |share, [clear, at_1, _]| {
            let exponent = if clear > 0.0 && lobe != Lobe::R {
                (at_1 / clear).max(1e-300).ln()
            } else {
                0.0
            };
            for ((f, b), sigma) in forward.iter_mut().zip(&mut *backward).zip(sigmas) {
                let kept = clear * (exponent * sigma).exp();
                *f += (kept * share) as f32;
                *b += (kept * (1.0 - share)) as f32;
            }
        });
    }
    Columns { taps, n, values }
}

impl Columns {
    /// Adds `weight` times the values at `cos_theta_d` in 0..=1, as the columns of
    /// [`super::AverageTable`] do.
    fn add(&self, cos_theta_d: f64, weight: f64, sums: &mut [f32]) {
        let (left, first, shares) = self.taps.at(cos_theta_d);
        let column = |ix: usize| &self.values[2 * self.n * ix..][..2 * self.n];
        let [a, b, c, d] = [0, 1, 2, 3].map(|tap| column(first + tap));
        let (low, high) = (column(left), column(left + 1));
        let (weight, w) = (weight as f32, shares.map(|share| share as f32));
        let sums = &mut sums[..2 * self.n];
        for i in 0..sums.len() {
            let value = w[0] * a[i] + w[1] * b[i] + w[2] * c[i] + w[3] * d[i];
            let least = if low[i] < high[i] { low[i] } else { high[i] };
            let most = if low[i] < high[i] { high[i] } else { low[i] };
            let value = if value > 0.5 * least {
                value
            } else {
                0.5 * least
            };
            sums[i] += weight
                * if value < 2.0 * most {
                    value
                } else {
                    2.0 * most
                };
        }
    }

    /// q_f and q_b of a layer.
    fn of_layer(&self, sums: &[f32], layer: usize) -> [f64; 2] {
        let at = layer.min(self.n - 1);
        [sums[at], sums[self.n + at]].map(f64::from)
    }
}

/// Appends the rows of all layers for hair with its factors applied.
fn push_slice(
    hair: &HairParams,
    [width_scale, shift_scale]: [f64; 2],
    columns: &[Columns; 3],
    rule: &GaussLegendre,
    layers: usize,
    texels: &mut Vec<[f32; 4]>,
) {
    let first = texels.len();
    let width = N_INCLINATIONS + N_FORWARD;
    texels.resize(first + layers * width, [0.0; 4]);
    let slice = &mut texels[first..];
    let square = width_scale * width_scale;
    // [layer][inclination]: a_f, beta_f^2.
    let mut forward = vec![[[0.0f32; 2]; N_INCLINATIONS]; layers];
    let mut sums = [(); 3].map(|()| vec![0.0f32; 2 * layers]);
    for ix in 0..N_INCLINATIONS {
        let theta = PI * (ix as f64 / (N_INCLINATIONS - 1) as f64 - 0.5);
        for ((lobe, columns), sums) in Lobe::ALL.into_iter().zip(columns).zip(&mut sums) {
            let (shift, beta) = full_angle(hair, lobe);
            sums.fill(0.0);
            for node in outgoing(theta, shift, beta, REACH, f64::INFINITY, rule) {
                columns.add(node.cos_theta_d, node.weight, sums);
            }
            columns.add(theta.cos(), BREATH, sums);
        }
        for layer in 0..layers {
            let modes = [0, 1, 2].map(|t| columns[t].of_layer(&sums[t], layer));
            let [a_f, alpha_f, beta_f] = moments(hair, modes.map(|[f, _]| f));
            let [a_b, alpha_b, beta_b] = moments(hair, modes.map(|[_, b]| b));
            let [attenuation, n_f, n_b] = counts(a_f, a_b);
            let shift = bounded_shift(n_f * alpha_f + n_b * alpha_b) / shift_scale;
            let width_2 = (n_f * beta_f + n_b * beta_b) / square;
            slice[layer * width + ix] = [attenuation as f32, shift as f32, width_2 as f32, 0.0];
            forward[layer][ix] = [a_f as f32, (beta_f / square) as f32];
        }
    }
    for (row, forward) in slice.chunks_exact_mut(width).zip(&forward) {
        for (ix, texel) in row[N_INCLINATIONS..].iter_mut().enumerate() {
            let theta = (ix as f32 / (N_FORWARD - 1) as f32).asin();
            let [up, down] = [theta, -theta].map(|theta| {
                let last = (N_INCLINATIONS - 1) as f32;
                let x = ((theta / std::f32::consts::PI + 0.5) * last).clamp(0.0, last);
                let at = (x as usize).min(N_INCLINATIONS - 2);
                let t = x - at as f32;
                [0, 1].map(|i| (1.0 - t) * forward[at][i] + t * forward[at + 1][i])
            });
            let both = up[0] + down[0];
            let weighed = up[0] * up[1] + down[0] * down[1];
            *texel = [0.5 * both, weighed / both.max(1e-12), 0.0, 0.0];
        }
    }
}

/// Sum of what the modes send, its mean shift and its squared width.
fn moments(hair: &HairParams, modes: [f64; 3]) -> [f64; 3] {
    let sum: f64 = modes.iter().sum();
    let (mut mean, mut width_2) = (0.0, 0.0);
    for (lobe, share) in Lobe::ALL.into_iter().zip(modes) {
        let (shift, width) = full_angle(hair, lobe);
        let share = share_of(share, sum);
        mean += share * shift;
        width_2 += share * width * width;
    }
    [sum, mean, width_2]
}

#[cfg(test)]
mod tests {
    use super::super::{Average, AverageTable};
    use super::*;
    use crate::closed_form::{
        average_row, forward_table, pack_averages, sample_forward, sample_painted_averages,
        sample_painted_forward,
    };

    const FRESNEL: Fresnel = Fresnel::Dielectric;

    /// Relative RMSE of A_b, Delta_b, sigma_b^2, a_f and beta_f^2 over inclinations, by cosine.
    fn errors(table: &PaintedAverageTable, hair: &HairParams, scales: [f32; 2]) -> [f64; 5] {
        let painted = hair.scaled(f64::from(scales[0]), f64::from(scales[1]));
        let expected = AverageTable::new(&painted, FRESNEL);
        let forward = forward_table(&pack_averages(&expected));
        let view = table.view();
        let sigma_a = hair.sigma_a.map(|x| x as f32);
        let row = average_row(view.decode, sigma_a, scales[0], scales[1]);
        let mut sums = [[0.0f64; 2]; 5];
        for ix in 0..200 {
            let theta = PI as f32 * ((ix as f32 + 0.5) / 200.0 - 0.5);
            let found = sample_painted_averages(&view, &row, theta);
            let right = expected.sample(theta);
            let (a_f, beta_f_2) = sample_painted_forward(&view, &row, theta.abs().sin());
            let at = sample_forward(&forward, theta.abs().sin());
            for c in 0..3 {
                let width = right[Average::SigmaB as usize][c];
                for (q, (found, right)) in [
                    (found.attenuation_b[c], right[Average::Ab as usize][c]),
                    (found.shift_b[c], right[Average::DeltaB as usize][c]),
                    (found.width_b_2[c], width * width),
                    (a_f[c], at.0[c]),
                    (beta_f_2[c], at.1[c]),
                ]
                .into_iter()
                .enumerate()
                {
                    let (found, right) = (f64::from(found), f64::from(right));
                    let weight = f64::from(theta.cos());
                    sums[q][0] += weight * (found - right) * (found - right);
                    sums[q][1] += weight * right * right;
                }
            }
        }
        sums.map(|[square, all]| (square / all.max(1e-30)).sqrt())
    }

    #[test]
    fn are_those_of_the_hair_that_is_painted() {
        let start = std::time::Instant::now();
        let hair = HairParams::default();
        let plain = PaintedAverageTable::new(&hair, FRESNEL, [DEFAULT_AVERAGE_LAYERS, 1, 1]);
        println!("one slice: {:?}", start.elapsed());
        let start = std::time::Instant::now();
        let n = DEFAULT_SCALES;
        let scaled = PaintedAverageTable::new(&hair, FRESNEL, [DEFAULT_AVERAGE_LAYERS, n, n]);
        println!(
            "all slices: {:?}, {} texels",
            start.elapsed(),
            scaled.texels.len()
        );
        let mut worst = [[0.0f64; 5]; 2];
        for sigma_a in [
            [0.0, 0.003, 0.01],
            [0.03, 0.07, 0.15],
            [0.26, 0.42, 0.83],
            [1.2, 2.2, 3.9],
            [5.0, 9.0, 20.0],
        ] {
            let hair = HairParams { sigma_a, ..hair };
            let found = errors(&plain, &hair, [1.0; 2]);
            println!("{sigma_a:?}: {:.2?}", found.map(|x| 100.0 * x));
            (0..5).for_each(|q| worst[0][q] = worst[0][q].max(found[q]));
            for scales in [
                [0.7, 1.0],
                [1.3, 1.0],
                [2.0, 1.0],
                [3.3, 1.0],
                [1.0, 0.6],
                [1.0, 1.7],
                [1.8, 1.5],
            ] {
                let found = errors(&scaled, &hair, scales);
                println!("  {scales:?}: {:.2?}", found.map(|x| 100.0 * x));
                (0..5).for_each(|q| worst[1][q] = worst[1][q].max(found[q]));
            }
        }
        println!("worst {worst:.4?}");
        // A_b of dark hair, which sends next to nothing back, is the worst of scales.
        let limits = [
            [0.025, 0.005, 0.005, 0.006, 0.002],
            [0.12, 0.03, 0.03, 0.03, 0.01],
        ];
        for (worst, limits) in worst.iter().zip(limits) {
            assert!(
                worst
                    .iter()
                    .zip(limits)
                    .all(|(&error, limit)| error < limit)
            );
        }
        // What the slices are for: one table and its factors alone are far off.
        let found = errors(&plain, &hair, [2.0, 1.0]);
        assert!(found[0] > 0.1 && found[3] > 0.03, "{found:?}");
    }
}
