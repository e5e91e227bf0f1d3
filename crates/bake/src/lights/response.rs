//! What one fibre makes of a map: the measure by which light sets are judged.
//!
//! # The response
//! A fibre with tangent `u`, seen from the unit direction `wo`, answers light from `wi` by
//! ```text
//! K(wi) = cos(theta_i) / cos^2(theta_d) * sum over t of a_t M_t(theta_i) N_t(phi)
//! ```
//! so that its single scattering under a map `L` is the integral of `L K` over the sphere (Xu
//! 2011 Eq 11, no occlusion). theta is the inclination to the plane normal to `u`, theta_d =
//! (theta_o - theta_i) / 2, phi the difference of the azimuths about `u`.
//!
//! - `M_t`, longitudinal: a Gaussian in theta_i of unit mass about `2 alpha_t - theta_o`, of Xu's
//!   bandwidth `2 beta_t`. Shifts alpha -7, 3.5, 10.5 degrees and standard deviations 7, 3.5, 14
//!   degrees of the half angle for R, TT, TRT: the middle of Marschner 2003 Table 1.
//! - `N_t`, azimuthal, of unit mass: `cos(phi / 2) / 4` for R; circular Gaussians
//!   `exp(2 (cos(phi - phi_t) - 1) / lambda_t^2)` about pi with lambda 0.7 for TT and about 0 with
//!   lambda 0.8 for TRT, close to the widths of the exact model at eta 1.55.
//! - Energies `a_t` 0.075, 0.45, 0.03: the exact model's at eta 1.55, theta_d 0 and
//!   sigma_a 0.35, brown hair.
//!
//! # The error
//! [`FibreJudge::error`] is `sqrt(sum (I_set - I_map)^2 / sum I_map^2)` over [`FIBRES`] pairs of a
//! fibre and a view, and the three channels. Tangents are uniform on the sphere; views too, but
//! within |sin theta_o| <= 0.98, since nothing is seen of a fibre along its axis. The pairs come
//! from a fixed seed and are the same for every map. The fit never sees them: it works on the
//! expectation over all frames, of this response and of narrower ones (see `spectrum`).

use rayon::prelude::*;
use strandlight_scattering::exact::azimuthal_average;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::special::bessel_i_ratio_1;
use strandlight_scattering::wide::{Level, dispatch};
use strandlight_scattering::{HairParams, Lobe};

use super::cells::Cell;
use super::sphere::{Random, Vec3, tangents};

/// Pairs of fibre and view of the fibre error.
pub const FIBRES: usize = 512;

/// Seed of the pairs: the digits of pi, nothing that was chosen for its result.
const SEED: u64 = 0x3243_f6a8_885a_308d;

/// Largest |sin theta_o| of a view.
pub(super) const MAX_SIN_VIEW: f64 = 0.98;

/// Intervals of the tables over sin theta_i: the narrowest lobe (TT, 0.12 rad standard deviation)
/// spans 60 to 120.
const INTERVALS: usize = 1024;

/// One mode of the response.
#[derive(Clone, Copy, Debug)]
pub(super) struct ResponseLobe {
    /// Shift of the full angle, 2 alpha_t.
    pub shift: f64,
    /// Xu's bandwidth in the full angle, 2 beta_t.
    pub width: f64,
    /// Energy a_t, the mean over the channels.
    pub energy: f64,
    /// That of each channel over the mean.
    pub tint: [f64; 3],
    /// Shape over azimuth.
    pub azimuth: Azimuth,
}

/// The shape of a mode over azimuth.
#[derive(Clone, Copy, Debug)]
pub(super) enum Azimuth {
    /// `cos(phi / 2) / 4`.
    HalfCosine,
    /// `exp(2 (sign cos phi - 1) / lambda^2)`, normalised: about 0 (sign 1) or pi (sign -1).
    Gaussian { sign: f64, lambda: f64 },
}

/// The response of a fibre; see the module documentation.
#[derive(Clone, Debug)]
pub(super) struct Response {
    pub lobes: [ResponseLobe; 3],
}

impl Default for Response {
    fn default() -> Self {
        let hair = HairParams::default();
        let lobe = |lobe, energy, azimuth| ResponseLobe {
            shift: 2.0 * hair.shift.get(lobe),
            width: 2.0 * hair.width.get(lobe),
            energy,
            tint: [1.0; 3],
            azimuth,
        };
        let gaussian = |sign, lambda| Azimuth::Gaussian { sign, lambda };
        Response {
            lobes: [
                lobe(Lobe::R, 0.075, Azimuth::HalfCosine),
                lobe(Lobe::Tt, 0.45, gaussian(-1.0, 0.7)),
                lobe(Lobe::Trt, 0.03, gaussian(1.0, 0.8)),
            ],
        }
    }
}

impl Response {
    /// The response of a given hair: its shifts and widths; of the exact model at theta_d 0 the
    /// energies, each mode's own in each channel, and the widths over azimuth, by the mean cosine;
    /// that of TRT with the width of its caustics. The fibre is taken as round.
    pub fn of(hair: &HairParams) -> Response {
        let of_mode = |mode: Lobe, weight: &dyn Fn(f64) -> f64| {
            azimuthal_average(mode, 0.0, hair, Fresnel::Dielectric, weight)
        };
        let lobes = Lobe::ALL.map(|mode| {
            let energies = of_mode(mode, &|_| 1.0);
            let mean = energies.iter().sum::<f64>() / 3.0;
            let azimuth = match mode {
                Lobe::R => Azimuth::HalfCosine,
                Lobe::Tt | Lobe::Trt => {
                    let sign = if mode == Lobe::Tt { -1.0 } else { 1.0 };
                    let cos: f64 = of_mode(mode, &|phi| sign * phi.cos()).iter().sum();
                    let plain = azimuthal_width(cos / (3.0 * mean));
                    let lambda = match mode {
                        Lobe::Trt => plain.hypot(hair.caustic_width),
                        _ => plain,
                    };
                    Azimuth::Gaussian { sign, lambda }
                }
            };
            ResponseLobe {
                shift: 2.0 * hair.shift.get(mode),
                width: 2.0 * hair.width.get(mode),
                energy: mean * hair.intensity.get(mode),
                tint: match mean > 0.0 {
                    true => energies.map(|energy| energy / mean),
                    false => [1.0; 3],
                },
                azimuth,
            }
        });
        Response { lobes }
    }

    /// The response of a fibre whose longitudinal lobes are narrower by `factor`.
    pub fn narrowed(&self, factor: f64) -> Response {
        let mut lobes = self.lobes;
        for lobe in &mut lobes {
            lobe.width *= factor;
        }
        Response { lobes }
    }

    /// The factor of mode `t` that depends on theta_i: `a_t M_t cos(theta_i) / cos^2(theta_d)`.
    pub fn longitudinal(&self, t: usize, theta_i: f64, theta_o: f64) -> f64 {
        let lobe = &self.lobes[t];
        let x = (theta_i - lobe.shift + theta_o) / lobe.width;
        let gaussian = (-x * x).exp() / (std::f64::consts::PI.sqrt() * lobe.width);
        // cos^2 of half the difference; |theta_o| stays below 1.38, so it stays above 0.009.
        let cos2_theta_d = 0.5 * (1.0 + (theta_o - theta_i).cos());
        lobe.energy * gaussian * theta_i.cos() / cos2_theta_d
    }

    /// The factor of mode `t` that depends on azimuth: `N_t`.
    pub fn azimuthal(&self, t: usize, cos_phi: f64) -> f64 {
        match self.lobes[t].azimuth {
            Azimuth::HalfCosine => 0.25 * (0.5 * (1.0 + cos_phi)).max(0.0).sqrt(),
            Azimuth::Gaussian { sign, lambda } => {
                let sharpness = 2.0 / (lambda * lambda);
                (sharpness * (sign * cos_phi - 1.0)).exp() / circular_mass(sharpness)
            }
        }
    }

    /// Integral of each channel of `cells` against the response of one fibre and view.
    fn integrate(&self, fibre: &Fibre, tables: &AzimuthTables, cells: &CellColumns) -> [f64; 3] {
        let longitudinal = self.longitudinal_table(fibre.theta_o);
        let tints = [0, 1, 2].map(|c| [0, 1, 2].map(|t| self.lobes[t].tint[c]));
        let (sin_o, cos_o) = fibre.theta_o.sin_cos();
        let mut sum = [0.0; 3];
        // Plain loops in wider vectors: the same sums, and so the same bits.
        dispatch!(Level::new(), _simd => {
            let [mut sin_i, mut cos_phi, mut n_r] = [[0.0; TOGETHER]; 3];
            for block in &cells.blocks {
                angles(fibre, [sin_o, cos_o], block, &mut sin_i, &mut cos_phi, &mut n_r);
                for ix in 0..TOGETHER {
                    let m = lerp(&longitudinal, sin_i[ix]);
                    let n = lerp(&tables.0, cos_phi[ix].clamp(-1.0, 1.0));
                    let modes = [m[0] * n_r[ix], m[1] * n[1], m[2] * n[2]];
                    for c in 0..3 {
                        let [r, tt, trt] = tints[c];
                        let modes = modes[0] * r + modes[1] * tt + modes[2] * trt;
                        sum[c] += modes * block.energy[c][ix];
                    }
                }
            }
        });
        sum
    }

    /// [`Response::longitudinal`] of the three modes at sin theta_i = -1 + 2 k / INTERVALS.
    fn longitudinal_table(&self, theta_o: f64) -> Vec<[f64; 4]> {
        (0..=INTERVALS)
            .map(|k| {
                let theta_i = (-1.0 + 2.0 * k as f64 / INTERVALS as f64).asin();
                let [r, tt, trt] = [0, 1, 2].map(|t| self.longitudinal(t, theta_i, theta_o));
                [r, tt, trt, 0.0]
            })
            .collect()
    }
}

/// [`Response::azimuthal`] of TT and TRT over cos phi; R's square root is steep at phi = pi: no table.
struct AzimuthTables(Vec<[f64; 4]>);

impl AzimuthTables {
    fn new(response: &Response) -> Self {
        let node = |k: usize| -1.0 + 2.0 * k as f64 / INTERVALS as f64;
        let values = |k| {
            let [tt, trt] = [1, 2].map(|t| response.azimuthal(t, node(k)));
            [0.0, tt, trt, 0.0]
        };
        AzimuthTables((0..=INTERVALS).map(values).collect())
    }
}

/// Linear interpolation of a table over [-1, 1]: of four values, which are one vector.
#[inline(always)]
fn lerp(table: &[[f64; 4]], x: f64) -> [f64; 4] {
    let position = (x + 1.0) * (0.5 * INTERVALS as f64);
    let ix = (position as usize).min(INTERVALS - 1);
    let f = position - ix as f64;
    let (a, b) = (&table[ix], &table[ix + 1]);
    let mut found = [0.0; 4];
    for t in 0..4 {
        found[t] = a[t] + f * (b[t] - a[t]);
    }
    found
}

/// Cells whose angles are found together.
const TOGETHER: usize = 8;

/// Cells in blocks, their numbers side by side.
struct CellColumns {
    blocks: Vec<CellBlock>,
}

#[derive(Clone, Copy)]
struct CellBlock {
    /// x, y and z of the unit vectors.
    direction: [[f64; TOGETHER]; 3],
    /// By channel; none of cells that fill the last block.
    energy: [[f64; TOGETHER]; 3],
}

impl CellColumns {
    fn new(cells: &[Cell]) -> CellColumns {
        let block = |cells: &[Cell]| {
            let mut block = CellBlock {
                direction: [[1.0; TOGETHER], [0.0; TOGETHER], [0.0; TOGETHER]],
                energy: [[0.0; TOGETHER]; 3],
            };
            for (ix, cell) in cells.iter().enumerate() {
                for axis in 0..3 {
                    block.direction[axis][ix] = cell.direction[axis];
                    block.energy[axis][ix] = cell.energy[axis];
                }
            }
            block
        };
        CellColumns {
            blocks: cells.chunks(TOGETHER).map(block).collect(),
        }
    }
}

/// Of each cell of a block sin theta_i and cos phi about a fibre, whose theta_o has this sine and cosine, and N_R.
#[inline(always)]
fn angles(
    fibre: &Fibre,
    [sin_o, cos_o]: [f64; 2],
    block: &CellBlock,
    sin_i: &mut [f64; TOGETHER],
    cos_phi: &mut [f64; TOGETHER],
    n_r: &mut [f64; TOGETHER],
) {
    let [x, y, z] = &block.direction;
    let (u, v) = (&fibre.tangent, &fibre.view);
    for ix in 0..TOGETHER {
        let sin = (x[ix] * u[0] + y[ix] * u[1] + z[ix] * u[2]).clamp(-1.0, 1.0);
        let cos = (1.0 - sin * sin).max(1e-24).sqrt();
        let along_view = x[ix] * v[0] + y[ix] * v[1] + z[ix] * v[2];
        sin_i[ix] = sin;
        cos_phi[ix] = (along_view - sin * sin_o) / (cos * cos_o);
        n_r[ix] = 0.25 * (0.5 * (1.0 + cos_phi[ix])).max(0.0).sqrt();
    }
}

/// Integral of `exp(sharpness (cos phi - 1))` over a turn, by the trapezoidal rule: exact to
/// rounding for sharpness up to 100 with 256 nodes.
fn circular_mass(sharpness: f64) -> f64 {
    const NODES: usize = 256;
    let step = 2.0 * std::f64::consts::PI / NODES as f64;
    (0..NODES)
        .map(|k| (sharpness * ((k as f64 * step).cos() - 1.0)).exp())
        .sum::<f64>()
        * step
}

/// Width lambda of the circular Gaussian `exp(2 (cos phi - 1) / lambda^2)` of this mean cosine; one
/// that is not positive gives the widest, nearly uniform.
fn azimuthal_width(mean_cosine: f64) -> f64 {
    // Sharpness; the mean cosine I_1 / I_0 grows with it.
    let (mut low, mut high) = (0.02f64, 2000.0f64);
    for _ in 0..50 {
        let middle = (low * high).sqrt();
        if bessel_i_ratio_1(middle) < mean_cosine {
            low = middle;
        } else {
            high = middle;
        }
    }
    (2.0 / high).sqrt()
}

/// A fibre and the direction it is seen from.
struct Fibre {
    tangent: Vec3,
    view: Vec3,
    theta_o: f64,
}

/// The pairs of the fibre error.
fn fibres(count: usize, seed: u64) -> Vec<Fibre> {
    let mut random = Random::new(seed);
    (0..count)
        .map(|_| {
            let tangent = random.direction();
            let sin_o = MAX_SIN_VIEW * (2.0 * random.uniform() - 1.0);
            let (sin, cos) = (2.0 * std::f64::consts::PI * random.uniform()).sin_cos();
            let cos_o = (1.0 - sin_o * sin_o).sqrt();
            let [v, w] = tangents(tangent);
            Fibre {
                tangent,
                view: super::sphere::combine(tangent, sin_o, v, cos_o * cos, w, cos_o * sin),
                theta_o: sin_o.asin(),
            }
        })
        .collect()
}

/// The responses of all pairs to one map, to compare others with: the fibre error (see the module
/// documentation), the same for any number of threads.
pub(super) struct FibreJudge {
    response: Response,
    tables: AzimuthTables,
    fibres: Vec<Fibre>,
    reference: Vec<[f64; 3]>,
}

impl FibreJudge {
    pub fn new(response: &Response, map: &[Cell]) -> FibreJudge {
        let mut judge = FibreJudge {
            response: response.clone(),
            tables: AzimuthTables::new(response),
            fibres: fibres(FIBRES, SEED),
            reference: Vec::new(),
        };
        judge.reference = judge.responses(map);
        judge
    }

    fn responses(&self, cells: &[Cell]) -> Vec<[f64; 3]> {
        let fibres = self.fibres.par_iter();
        let cells = CellColumns::new(cells);
        let response = |fibre| self.response.integrate(fibre, &self.tables, &cells);
        fibres.map(response).collect()
    }

    /// Relative RMSE of the responses to `lights` against those to the map; 0 if both are dark.
    pub fn error(&self, lights: &[Cell]) -> f64 {
        let sums: Vec<[f64; 2]> = self
            .responses(lights)
            .iter()
            .zip(&self.reference)
            .map(|(set, map)| squares(*set, *map))
            .collect();
        relative_rms(&sums)
    }
}

/// Squares of the difference of a set from its map, and of the map; all channels.
pub(super) fn squares(set: [f64; 3], map: [f64; 3]) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for c in 0..3 {
        sums[0] += (set[c] - map[c]).powi(2);
        sums[1] += map[c] * map[c];
    }
    sums
}

/// `sqrt(sum of first / sum of second)`, added in order; 0 if nothing is there.
pub(super) fn relative_rms(sums: &[[f64; 2]]) -> f64 {
    let (difference, reference) = sums
        .iter()
        .fold((0.0, 0.0), |(d, r), [a, b]| (d + a, r + b));
    if difference == 0.0 {
        0.0
    } else {
        (difference / reference).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::cells::{light_cells, map_cells, map_cells_of};
    use crate::lights::harmonics::DEGREES;
    use crate::lights::harmonics::Harmonics;
    use crate::lights::spectrum::Filter;
    use crate::lights::sun::Rest;
    use strandlight_formats::{LightSet, SrbfLight};
    use strandlight_images::Map;

    fn fibre_error(lights: &[Cell], map: &[Cell]) -> f64 {
        FibreJudge::new(&Response::default(), map).error(lights)
    }

    fn light(direction: Vec3, lambda: f32, rgb: [f32; 3]) -> LightSet {
        let lights = vec![SrbfLight {
            direction: crate::lights::sphere::normalize(direction).map(|x| x as f32),
            lambda,
            rgb,
        }];
        LightSet {
            lights,
            ..LightSet::default()
        }
    }

    #[test]
    fn equal_light_has_no_error_and_turned_light_has() {
        let a = light_cells(&light([0.0, 0.3, 1.0], 0.2, [1.0, 0.5, 0.2]));
        let b = light_cells(&light([0.1, 0.3, 1.0], 0.2, [1.0, 0.5, 0.2]));
        let brighter = light_cells(&light([0.0, 0.3, 1.0], 0.2, [1.1, 0.55, 0.22]));
        assert!(fibre_error(&a, &a) == 0.0);
        assert!(
            (0.05..0.6).contains(&fibre_error(&b, &a)),
            "{}",
            fibre_error(&b, &a)
        );
        assert!((fibre_error(&brighter, &a) - 0.1).abs() < 1e-6);
        assert!(fibre_error(&[], &[]) == 0.0);
        assert!((fibre_error(&[], &a) - 1.0).abs() < 1e-12);
    }

    /// The azimuthal factors have unit mass; the longitudinal ones, without their
    /// `cos(theta_i) / cos^2(theta_d)`, have their energy a_t over all theta_i.
    #[test]
    fn modes_have_their_energy() {
        let response = Response::default();
        let steps = 20_000;
        for t in 0..3 {
            let turn = 2.0 * std::f64::consts::PI;
            let mass: f64 = (0..steps)
                .map(|k| {
                    let phi = turn * (f64::from(k) + 0.5) / f64::from(steps);
                    response.azimuthal(t, phi.cos())
                })
                .sum::<f64>()
                * turn
                / f64::from(steps);
            assert!((mass - 1.0).abs() < 1e-6, "{t}: {mass}");
            let lobe = &response.lobes[t];
            for theta_o in [-1.2, 0.0, 0.7] {
                // The Gaussian to exp(-36), beyond the range of directions too: the formulas go on.
                let step = 12.0 * lobe.width / f64::from(steps);
                let energy: f64 = (0..steps)
                    .map(|k| {
                        let from_centre = (f64::from(k) + 0.5) * step - 6.0 * lobe.width;
                        let theta_i = lobe.shift - theta_o + from_centre;
                        let cos_theta_d = (0.5 * (theta_o - theta_i)).cos();
                        let foreshortening = theta_i.cos() / (cos_theta_d * cos_theta_d);
                        response.longitudinal(t, theta_i, theta_o) / foreshortening
                    })
                    .sum::<f64>()
                    * step;
                let ratio = energy / lobe.energy;
                assert!((ratio - 1.0).abs() < 1e-6, "{t} {theta_o}: {ratio}");
            }
        }
    }

    /// The formulas of a given hair, at the hair of the default response. (Its TRT is twice as strong
    /// as the exact model's and wider; it has a twentieth of the energy.)
    #[test]
    fn the_default_hair_has_about_the_default_response() {
        let hair = HairParams {
            sigma_a: [0.35; 3],
            ..HairParams::default()
        };
        let (found, wanted) = (Response::of(&hair), Response::default());
        for (t, (found, wanted)) in found.lobes.iter().zip(&wanted.lobes).enumerate() {
            assert_eq!((found.shift, found.width), (wanted.shift, wanted.width));
            assert!(found.tint.iter().all(|tint| (tint - 1.0).abs() < 1e-12));
            let ratio = found.energy / wanted.energy;
            assert!((0.5..1.01).contains(&ratio), "{t}: {ratio}");
            assert!(t == 2 || ratio > 0.99, "{t}: {ratio}");
        }
        let width = |response: &Response, t: usize| match response.lobes[t].azimuth {
            Azimuth::Gaussian { lambda, .. } => lambda,
            Azimuth::HalfCosine => 0.0,
        };
        assert!((width(&found, 1) / width(&wanted, 1) - 1.0).abs() < 0.05);
        assert!((0.3..0.8).contains(&width(&found, 2)));
        // Red hair keeps red light.
        let red = Response::of(&HairParams {
            sigma_a: [0.1, 0.5, 1.5],
            ..hair
        });
        let [r, g, b] = red.lobes[1].tint;
        assert!(r > g && g > b && b > 0.0 && (r + g + b - 3.0).abs() < 1e-9);
        for sharpness in [0.1, 3.0, 50.0] {
            let width = azimuthal_width(bessel_i_ratio_1(sharpness));
            assert!((2.0 / (width * width) / sharpness - 1.0).abs() < 1e-6);
        }
        assert!(azimuthal_width(-0.2) > 9.0);
        assert!(azimuthal_width(f64::NAN) > 0.0);
    }

    /// Cells of 1.4 degrees against every pixel, with a sun of a few pixels: the centroid makes
    /// the difference vanish against the errors that are measured.
    #[test]
    fn cells_stand_for_pixels() {
        let (width, height) = (512, 256);
        let mut pixels: Vec<[f32; 3]> = (0..width * height)
            .map(|ix| [0.2 + 0.1 * ((ix / width) % 32 / 16) as f32, 0.3, 0.5])
            .collect();
        for (x, y) in [(301, 150), (302, 150), (303, 151), (302, 151), (301, 149)] {
            pixels[y * width + x] = [20_000.0, 18_000.0, 15_000.0];
        }
        let map = Map::new(width, height, pixels).unwrap();
        let error = fibre_error(&map_cells(&map), &map_cells_of(&map, 1));
        assert!(error < 1e-3, "{error}");
    }

    /// The filter's L2 norm is the expectation of the squared response over frames.
    #[test]
    fn the_filter_is_the_mean_over_frames() {
        let (width, height) = (256, 128);
        let mut random = Random::new(9);
        let pixels: Vec<[f32; 3]> = (0..width * height)
            .map(|ix| {
                [0; 3].map(|_| {
                    if ix % 37 == 0 {
                        random.uniform().powi(30) as f32
                    } else {
                        0.0
                    }
                })
            })
            .collect();
        let map = Map::new(width, height, pixels).unwrap();
        let response = Response::default();
        let tables = AzimuthTables::new(&response);
        let cells = CellColumns::new(&map_cells_of(&map, 1));
        // Variance over frames, without the mean: the fine structure is what matters.
        let mean: [f64; 3] = map.energy().map(|e| e / (4.0 * std::f64::consts::PI));
        let uniform = Map::new(width, height, vec![mean.map(|x| x as f32); width * height]);
        let uniform = CellColumns::new(&map_cells_of(&uniform.unwrap(), 1));
        let frames = fibres(2000, 77);
        let [structure, flat] = frames
            .par_iter()
            .map(|fibre| {
                let a = response.integrate(fibre, &tables, &cells);
                let b = response.integrate(fibre, &tables, &uniform);
                [(a[0] - b[0]).powi(2), b[0] * b[0]]
            })
            .collect::<Vec<_>>()
            .iter()
            .fold([0.0; 2], |sum, x| [sum[0] + x[0], sum[1] + x[1]]);
        let mut harmonics = Harmonics::analyse(&Rest::new(&map));
        harmonics.filter(&Filter::new(&[response]).factors);
        let power = harmonics.power();
        let expected = power[1..DEGREES].iter().sum::<f64>() / power[0];
        let measured = structure / flat;
        assert!(
            (measured / expected - 1.0).abs() < 0.1,
            "measured {measured}, expected {expected}"
        );
    }
}
