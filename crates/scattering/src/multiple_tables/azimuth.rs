//! Global scattering over azimuth: N_t^G of a fibre as a constant and a few functions.
//!
//! Of a round fibre they are three functions of the lag ([`super::lag`]), of an elliptic one seven of the
//! lag and the view's azimuth ([`super::elliptic`]): those sums of a basis that carry most of all modes,
//! channels and inclinations of this fibre, the leading eigenvectors of their covariance.

use crate::closed_form::{Fibre, Inclination, MODE_TRT, SampleLobes, Shading, inclination};
use crate::jobs::{self, Job};

use super::elliptic::{self, EllipticFunctions};
use super::lag::{LagFunctions, N_FUNCTIONS, SampledLags, Spectrum};
use super::leading::{Matrix, leading, leading_space};

/// Nodes over cos(theta_d), less one.
pub(super) const LAST_NODE: f32 = 128.0;

/// Nodes that one job samples.
const NODES_IN_A_JOB: usize = 4;

/// Nodes below this cosine are about as far apart as those above.
pub(super) const GRAZING: f32 = 0.2;

/// What one mode scatters at one theta_d, or a row of the table: for the constant and the functions each,
/// red, green, blue and a number that belongs to something else. Of an elliptic fibre there is a second
/// one, for four further functions.
pub(super) type Row = [f32; 4 * (1 + N_FUNCTIONS)];

/// Does N_TRT^G of this fibre depend on more than the lag?
pub(super) fn has_turning_index(fibre: &Fibre) -> bool {
    fibre.is_elliptic() && !fibre.is_energy() && fibre.modes & MODE_TRT != 0
}

/// N_t^G of the enabled modes over cos(theta_d).
pub(super) struct Profiles {
    /// `[half][mode][node]`; none of modes that are not enabled, and no second half of round fibres.
    nodes: [[Vec<Row>; 3]; 2],
    /// Zeros for an elliptic fibre.
    pub functions: LagFunctions,
    /// Of an elliptic fibre.
    pub elliptic: Option<Box<EllipticFunctions>>,
}

fn cosine_of(node: usize) -> f32 {
    let at = node as f32 / LAST_NODE;
    GRAZING * at / (1.0 + GRAZING - at)
}

/// The inclination of a node.
fn inclination_of(cos_theta_d: f32) -> Inclination {
    let mut incline = inclination(cos_theta_d.clamp(0.0, 1.0).acos());
    incline.cos_theta_d = incline.cos_theta_d.max(cos_theta_d);
    incline
}

impl Profiles {
    pub fn new(shading: &Shading<impl SampleLobes + Sync>, run: impl FnOnce(Vec<Job>)) -> Profiles {
        let lags = SampledLags::new();
        let of_lag = |mode, incline: &Inclination| lags.spectrum(mode, incline, shading);
        if !has_turning_index(shading.fibre) {
            let spectra = sample(shading.fibre, of_lag, run);
            let vectors: [_; N_FUNCTIONS] = leading(*covariance(&spectra));
            return Profiles {
                nodes: reduce(&spectra, &vectors),
                functions: LagFunctions::new(&vectors),
                elliptic: None,
            };
        }
        let sampler = elliptic::Sampler::new();
        let of_elliptic = |mode, incline: &Inclination| match mode {
            2 => sampler.spectrum(incline.cos_theta_d, shading),
            _ => elliptic::of_lag_alone(&of_lag(mode, incline)),
        };
        let spectra = sample(shading.fibre, of_elliptic, run);
        let vectors = leading_space(&covariance(&spectra));
        Profiles {
            nodes: reduce(&spectra, &vectors),
            functions: LagFunctions::default(),
            elliptic: Some(Box::new(EllipticFunctions::new(&vectors))),
        }
    }

    /// Halves of a row: 2 of an elliptic fibre, else 1.
    pub fn n_halves(&self) -> usize {
        1 + usize::from(self.elliptic.is_some())
    }

    /// `[half][mode][node]`, zeros of modes that are not enabled.
    pub fn rows(&self) -> Vec<Row> {
        let n_nodes = LAST_NODE as usize + 1;
        let n_halves = self.n_halves();
        let mut rows = vec![[0.0; 16]; 3 * n_nodes * n_halves];
        let nodes = self.nodes[..n_halves].as_flattened();
        for (rows, nodes) in rows.chunks_exact_mut(n_nodes).zip(nodes) {
            rows[..nodes.len()].copy_from_slice(nodes);
        }
        rows
    }

    /// What an enabled mode scatters at the nodes.
    pub fn nodes(&self, half: usize, mode: usize) -> &[Row] {
        &self.nodes[half][mode]
    }

    /// Adds `factor` times N_t^G at `cos_theta_d` to a row.
    pub fn add(&self, mode: usize, cos_theta_d: f32, factor: f32, rows: &mut [Row]) {
        let place = (1.0 + GRAZING) * cos_theta_d / (GRAZING + cos_theta_d);
        let at = (LAST_NODE * place).clamp(0.0, LAST_NODE);
        let first = at.min(LAST_NODE - 1.0) as usize;
        let high = factor * (at - first as f32);
        let low = factor - high;
        for (row, nodes) in rows.iter_mut().zip(&self.nodes) {
            let (below, above) = (&nodes[mode][first], &nodes[mode][first + 1]);
            for (ix, value) in row.iter_mut().enumerate() {
                *value += low * below[ix] + high * above[ix];
            }
        }
    }
}

/// `[mode][node]` of the enabled modes.
fn sample<const N: usize>(
    fibre: &Fibre,
    spectrum: impl Fn(usize, &Inclination) -> Spectrum<N> + Sync,
    run: impl FnOnce(Vec<Job>),
) -> [Vec<Spectrum<N>>; 3] {
    let n_nodes = LAST_NODE as usize + 1;
    let modes = (0..3).filter(|mode| fibre.modes & (1 << mode) != 0);
    let modes: Vec<usize> = modes.collect();
    let mut found = vec![[[0.0; 3]; N]; n_nodes * modes.len()];
    let node = |ix| {
        spectrum(
            modes[ix / n_nodes],
            &inclination_of(cosine_of(ix % n_nodes)),
        )
    };
    jobs::fill(&mut found, NODES_IN_A_JOB, node, run);
    let mut spectra: [Vec<Spectrum<N>>; 3] = Default::default();
    for (mode, found) in modes.iter().zip(found.chunks_exact(n_nodes)) {
        spectra[*mode] = found.to_vec();
    }
    spectra
}

/// `[half][mode][node]`: the mean and how much of each function there is.
fn reduce<const N: usize>(
    spectra: &[Vec<Spectrum<N>>; 3],
    vectors: &[[f64; N]],
) -> [[Vec<Row>; 3]; 2] {
    let slot = |spectrum: &Spectrum<N>, slot: usize, channel: usize| match slot {
        0 => spectrum[0][channel],
        _ => match vectors.get(slot - 1) {
            Some(vector) => {
                let along = spectrum[1..].iter().zip(&vector[1..]);
                let along = along.map(|(part, v)| part[channel] * *v as f32);
                along.sum()
            }
            None => 0.0,
        },
    };
    let half = |half: usize| {
        let row = |spectrum: &Spectrum<N>| {
            std::array::from_fn(|ix| match ix % 4 {
                3 => 0.0,
                channel => slot(spectrum, 4 * half + ix / 4, channel),
            })
        };
        let is_needed = 4 * half <= vectors.len();
        let of_mode =
            |spectra: &Vec<Spectrum<N>>| spectra.iter().filter(|_| is_needed).map(row).collect();
        spectra.each_ref().map(of_mode)
    };
    [half(0), half(1)]
}

/// Sum over modes, channels and inclinations (each by its share of the sphere) of the products of
/// parts but the mean; every channel counts the same.
fn covariance<const N: usize>(spectra: &[Vec<Spectrum<N>>; 3]) -> Box<Matrix<N>> {
    let mut sum = Box::new([[0.0; N]; N]);
    // The stack of a page is small.
    let mut of_channel = Box::new([[0.0; N]; N]);
    for channel in 0..3 {
        of_channel.as_flattened_mut().fill(0.0);
        for spectra in spectra {
            for (node, pair) in spectra.windows(2).enumerate() {
                let sine = |node| f64::from(1.0 - cosine_of(node).powi(2)).max(0.0).sqrt();
                let weight = sine(node) - sine(node + 1);
                let parts: [f64; N] = std::array::from_fn(|k| f64::from(pair[0][k][channel]));
                for (a, row) in of_channel.iter_mut().enumerate().skip(1) {
                    // R and TT have order 0 alone.
                    if parts[a] == 0.0 {
                        continue;
                    }
                    for (b, entry) in row.iter_mut().enumerate().skip(1) {
                        *entry += weight * parts[a] * parts[b];
                    }
                }
            }
        }
        let trace: f64 = (0..N).map(|k| of_channel[k][k]).sum();
        let all = sum.as_flattened_mut().iter_mut();
        for (sum, entry) in all.zip(of_channel.as_flattened()) {
            *sum += entry / trace.max(1e-30);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use core::f32::consts::{FRAC_1_PI, PI};

    use super::*;
    use crate::HairParams;
    use crate::closed_form::{
        DirectionInFrame, LobeView, eta_at, half_circle_basis, half_circle_r, half_circle_tt,
        lag_between, lobes_at_azimuth,
    };
    use crate::jobs::in_turn;
    use crate::wide::fixture::Fixture;

    /// N_TRT^G by many azimuths.
    fn exact(cos_theta_d: f32, [delta, phi_o]: [f32; 2], shading: &Shading<LobeView>) -> [f32; 3] {
        const N: usize = 720;
        let mut sum = [0.0f64; 3];
        for ix in 0..N {
            let psi = delta + PI * ((ix as f32 + 0.5) / N as f32 - 0.5);
            let eta = eta_at((2.0 * phi_o + psi).cos(), shading.fibre);
            let lobes = shading.trt.lobes_at(eta, cos_theta_d);
            let (sin, cos) = (0.5 * psi).sin_cos();
            for (sum, value) in sum.iter_mut().zip(lobes_at_azimuth(&lobes, sin, cos, 0.0)) {
                *sum += f64::from(value);
            }
        }
        sum.map(|sum| sum as f32 * 0.5 * FRAC_1_PI / N as f32)
    }

    /// Of the functions and their factors.
    fn found(
        profiles: &Profiles,
        modes: &[usize],
        cos_theta_d: f32,
        [delta, phi_o]: [f32; 2],
    ) -> [f32; 3] {
        let mut rows = [Row::default(); 2];
        for &mode in modes {
            profiles.add(mode, cos_theta_d, 1.0, &mut rows);
        }
        let functions = profiles.elliptic.as_ref().expect("of an elliptic fibre");
        let view = (2.0 * phi_o).sin_cos();
        let functions = functions.at([delta.cos(), delta.sin()], [view.1, view.0]);
        let slots = rows.as_flattened().as_chunks::<4>().0;
        std::array::from_fn(|channel| {
            let along = functions.iter().zip(slots);
            along.map(|(f, slot)| f * slot[channel]).sum()
        })
    }

    /// N_R^G and N_TT^G together, at the lag.
    fn exact_others(cos_theta_d: f32, delta: f32, shading: &Shading<LobeView>) -> [f32; 3] {
        let [view, light] = [0.0, delta].map(|phi| DirectionInFrame::from_angles(0.0, phi));
        let lag = lag_between(view.cos_phi, view.sin_phi, light.cos_phi, light.sin_phi);
        let incline = inclination(cos_theta_d.acos());
        let r = half_circle_r(&half_circle_basis(&lag), &incline, shading.reflectance);
        let lobes = shading.tt.lobes_at(shading.fibre.eta, cos_theta_d);
        half_circle_tt(&lag, &lobes).map(|tt| r + tt)
    }

    /// Relative RMSE of TRT of itself, and of all modes, over theta_d, lag and view.
    fn errors(fixture: &Fixture, hair: &HairParams) -> [f64; 2] {
        let hair = fixture.hair_of(hair);
        let shading = hair.shading(fixture);
        let profiles = Profiles::new(&shading, in_turn);
        let mut squares = [[0.0f64; 2]; 2];
        for ix in 0..400 {
            let sine = (ix as f32 + 0.5) / 400.0;
            let cos_theta_d = (1.0 - sine * sine).sqrt();
            let azimuths = [0.7, 1.3].map(|step| step * ix as f32);
            let trt = exact(cos_theta_d, azimuths, &shading);
            let others = exact_others(cos_theta_d, azimuths[0], &shading);
            let found =
                [&[2][..], &[0, 1, 2]].map(|modes| found(&profiles, modes, cos_theta_d, azimuths));
            for channel in 0..3 {
                let exact = [trt[channel], trt[channel] + others[channel]];
                for ((squares, found), exact) in squares.iter_mut().zip(found).zip(exact) {
                    squares[0] += f64::from(found[channel] - exact).powi(2);
                    squares[1] += f64::from(exact).powi(2);
                }
            }
        }
        squares.map(|[error, size]| (error / size).sqrt())
    }

    #[test]
    fn functions_of_elliptic_fibres_are_near_the_integrals() {
        let fixture = Fixture::new();
        let brown = [0.26, 0.42, 0.83];
        // Black TRT, next to nothing, follows the index most sharply.
        for (sigma_a, of_trt, of_all) in [(brown, 0.13, 0.007), ([3.3, 5.6, 10.9], 0.5, 0.007)] {
            for eccentricity in [0.5, 0.8, 0.999_999, 1.25, 2.0] {
                for caustic_width in [0.03, 0.15] {
                    let hair = HairParams {
                        eccentricity,
                        sigma_a,
                        caustic_width,
                        ..HairParams::default()
                    };
                    let [trt, all] = errors(&fixture, &hair);
                    println!("{eccentricity} {sigma_a:?} {caustic_width}: {trt:.2e}, {all:.2e}");
                    let is_round = (eccentricity - 1.0).abs() < 1e-3;
                    let of_trt = if is_round { 0.03 } else { of_trt };
                    assert!(trt < of_trt && all < of_all, "{eccentricity}: {trt} {all}");
                }
            }
        }
    }

    /// Nothing is scattered by TRT, or by anything.
    #[test]
    fn modes_that_are_black_leave_no_numbers_behind() {
        let fixture = Fixture::new();
        for (sigma_a, intensity) in [([20.0; 3], 1.0), ([0.0; 3], 0.0)] {
            let hair = HairParams {
                eccentricity: 0.8,
                sigma_a,
                intensity: crate::PerLobe {
                    r: intensity,
                    tt: intensity,
                    trt: intensity,
                },
                ..HairParams::default()
            };
            let hair = fixture.hair_of(&hair);
            let profiles = Profiles::new(&hair.shading(&fixture), in_turn);
            let numbers = profiles.rows();
            assert!(numbers.as_flattened().iter().all(|x| x.is_finite()));
            let value = found(&profiles, &[0, 1, 2], 0.7, [0.4, 1.0]);
            assert!(
                value.iter().all(|x| x.is_finite() && *x >= -1e-6),
                "{value:?}"
            );
        }
    }
}
