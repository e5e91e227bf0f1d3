//! N_TRT blurred by w_c of an elliptic fibre, whose index follows both azimuths.

use std::f64::consts::{FRAC_PI_2, PI};

use super::table::{BlurredTrt, Rows, columns_at, cubic};
use crate::exact::{FibreSection, eta_star};
use crate::fresnel::Fresnel;
use crate::hair::HairParams;

/// N_TRT over (index eta*, theta_d, phi), and what the sampler draws its azimuth by.
///
/// Which path leaves where follows from the effective index eta_eff alone. So a row is an eta_eff,
/// and at one eta_eff caustics stay where they are whatever eta*: between nodes of eta* only what
/// the paths keep changes, slowly. A handful of nodes, evenly over ln(eta*^2 - 1), do. Nodes above a
/// row's eta_eff are no fibre's, but the formulas go on smoothly there (cos theta_d above 1).
///
/// Cubic look-up in all three: RMS error 5e-4, 7e-3 at most of the peak over phi, for eta 1.35 to 1.8, a 0.5
/// to 2 and sigma_a up to 3.5 (tested against quadrature). 3 MB at w_c 0.15 and a 0.85, 0.6 s on one core, 26 MB
/// at 0.06; size and time go with the range of the index and w_c^-2.
#[derive(Clone, Debug)]
pub(super) struct EllipticTrt {
    eta: f64,
    eccentricity: f64,
    /// [`angle`] of the least effective index: the last row.
    greatest_angle: f64,
    /// ln(sqrt(eta*^2 - 1)) of node 0, and nodes per unit of it.
    first: f64,
    nodes_per_unit: f64,
    n_nodes: usize,
    /// Over [`angle`], which is `greatest_angle v^2`.
    rows: Rows,
    n_phi: usize,
    /// `[row][phi][node]`: rgb over [`normal_reflectance`].
    texels: Vec<[f32; 3]>,
    /// Over theta_d.
    density_rows: Rows,
    /// `[row][phi][N_TURNS]` over theta_d and phi: density of the sampler's azimuth.
    densities: Vec<[f32; N_TURNS]>,
    /// `Int N_TRT dphi` at theta_d and each of the turns, less its mean over all.
    swings: Vec<[[f64; 3]; N_TURNS]>,
}

/// Places of 2 phi_o that the sampler has densities for, over 0..=pi.
const N_TURNS: usize = 17;

/// Azimuths phi that the sampler takes indices for, most often within this of 0: most of TRT goes back.
const NEAR: f64 = 1.5;
/// How often.
const NEAR_SHARE: f64 = 0.8;

/// Nodes in a unit of ln(eta*^2 - 1)/2 where there is no absorption, and how many more at sigma_a 1.
const NODES_PER_UNIT: f64 = 6.0;
const NODES_PER_SIGMA: f64 = 2.5;
/// Most of them.
const MOST_PER_UNIT: f64 = 30.0;

/// Rows of effective indices: caustics move by w_c within a few.
const ROWS_PER_WIDTH: f64 = 24.0;

/// Excess of an effective index in the middle of the rows, that of eta 1.55.
const MIDDLE: f64 = 1.2;

/// A row's place as an angle in 0..pi/2, from the excess of its effective index: 0 at grazing
/// theta_d, where it is infinite. Caustics move about evenly over it.
fn angle(effective: f64) -> f64 {
    (MIDDLE / effective).atan()
}

/// Reflectance at normal incidence, which TRT is about proportional to.
fn normal_reflectance(eta: f64) -> f64 {
    let r = (eta - 1.0) / (eta + 1.0);
    r * r
}

/// `sqrt(eta^2 - 1)`.
fn excess(eta: f64) -> f64 {
    ((eta - 1.0) * (eta + 1.0)).sqrt()
}

impl EllipticTrt {
    /// One [`BlurredTrt`] a node.
    pub fn new(hair: &HairParams, fresnel: Fresnel) -> Self {
        let star = |phi_h| eta_star(hair.eta, hair.eccentricity, phi_h);
        let ends = [star(0.0), star(FRAC_PI_2)];
        let [least, most] = [f64::min, f64::max].map(|of| excess(of(ends[0], ends[1])));
        let sigma = hair.sigma_a.into_iter().fold(0.0, f64::max);
        let nodes_per_unit = (NODES_PER_UNIT + NODES_PER_SIGMA * sigma).min(MOST_PER_UNIT);
        // One node more at each end for the cubic.
        let n_nodes = ((most / least).ln() * nodes_per_unit) as usize + 4;
        let first = least.ln() - 1.0 / nodes_per_unit;
        let width = hair.caustic_width;
        let rows = Rows::new((ROWS_PER_WIDTH / width).ceil().clamp(96.0, 800.0) as usize);
        let greatest_angle = angle(least);
        let tables: Vec<(f32, BlurredTrt)> = (0..n_nodes)
            .map(|node| {
                let own = (first + node as f64 / nodes_per_unit).exp();
                let table = BlurredTrt::of_sections(width, rows, |r| {
                    let v = rows.v(r);
                    let effective = MIDDLE / (greatest_angle * v * v).clamp(1e-8, 1.57).tan();
                    section_of(hair, fresnel, own, effective)
                });
                (1.0 / normal_reflectance(own.hypot(1.0)) as f32, table)
            })
            .collect();
        let (_, shape) = &tables[0];
        let texels = (0..shape.texels.len()).flat_map(|at| {
            let of_node = move |(scale, table): &(f32, BlurredTrt)| {
                let [r, g, b, _] = table.texels[at];
                [r, g, b].map(|x| scale * x)
            };
            tables.iter().map(of_node)
        });
        let mut table = EllipticTrt {
            eta: hair.eta,
            eccentricity: hair.eccentricity,
            greatest_angle,
            first,
            nodes_per_unit,
            n_nodes,
            rows,
            n_phi: shape.n_phi,
            texels: texels.collect(),
            density_rows: Rows::new((6.0 / width).ceil().clamp(64.0, 400.0) as usize),
            densities: Vec::new(),
            swings: Vec::new(),
        };
        table.fill_densities(shape);
        table.fill_swings();
        table
    }

    fn eta_star(&self, twice_phi_h: f64) -> f64 {
        eta_star(self.eta, self.eccentricity, 0.5 * twice_phi_h)
    }

    /// The rows around the effective index that `excess(eta*)` has at theta_d, and their weights.
    fn rows_at(&self, excess: f64, theta_d: f64) -> (usize, [f64; 4]) {
        // eta_eff^2 - 1 = (eta^2 - 1) / cos^2 theta_d
        let effective = excess / theta_d.cos().abs();
        self.rows
            .at_v((angle(effective) / self.greatest_angle).sqrt())
    }

    /// `[N_TRT rgb, density of the sampler's azimuth]` at `theta_d` and `phi` (wrapped, +-pi), seen
    /// from the azimuth phi_o.
    pub fn at(&self, theta_d: f64, phi: f64, phi_o: f64) -> [f64; 4] {
        let [r, g, b] = self.azimuthal(theta_d, phi, phi_o);
        [r, g, b, self.density(theta_d, phi, phi_o)]
    }

    fn azimuthal(&self, theta_d: f64, phi: f64, phi_o: f64) -> [f64; 3] {
        // 2 phi_h = phi_o + phi_i = 2 phi_o - phi
        let eta = self.eta_star(2.0 * phi_o - phi);
        let excess = excess(eta);
        let place = ((excess.ln() - self.first) * self.nodes_per_unit).max(1.0);
        let node = (place as usize).min(self.n_nodes - 3);
        let node_weights = cubic(place - node as f64);
        let (row, row_weights) = self.rows_at(excess, theta_d);
        let (column, column_weights) = columns_at(self.n_phi, phi);
        let mut total = [0.0f64; 3];
        for (r, row_weight) in row_weights.into_iter().enumerate() {
            for (c, column_weight) in column_weights.into_iter().enumerate() {
                let at = ((row + r) * (self.n_phi + 2) + column + c) * self.n_nodes + node - 1;
                let weight = row_weight * column_weight;
                for (texel, node_weight) in self.texels[at..at + 4].iter().zip(node_weights) {
                    let weight = weight * node_weight;
                    for (sum, &x) in total.iter_mut().zip(texel) {
                        *sum += weight * f64::from(x);
                    }
                }
            }
        }
        // The cubic swings below zero beside a caustic.
        let scale = normal_reflectance(eta);
        total.map(|x| scale * x.max(0.0))
    }

    /// Density of [`EllipticTrt::sample`]'s azimuth.
    fn density(&self, theta_d: f64, phi: f64, phi_o: f64) -> f64 {
        let (turn, fraction) = turn_of(phi_o);
        let (row, row_weights) = self.density_rows.at(theta_d);
        let (column, column_weights) = columns_at(self.n_phi, phi);
        let mut total = 0.0;
        for (r, row_weight) in row_weights.into_iter().enumerate() {
            let start = (row + r) * (self.n_phi + 2) + column;
            for (texel, weight) in self.densities[start..start + 4].iter().zip(column_weights) {
                let [low, high] = [texel[turn], texel[turn + 1]].map(f64::from);
                total += row_weight * weight * ((1.0 - fraction) * low + fraction * high);
            }
        }
        total.max(0.0)
    }

    /// An index to draw a path of, seen from the azimuth phi_o: that of an azimuth phi near 0, or now and
    /// then of any.
    pub fn sample_eta(&self, phi_o: f64, uniform: &mut impl FnMut() -> f64) -> f64 {
        let (turn, fraction) = turn_of(phi_o);
        let turn = turn + usize::from(uniform() < fraction);
        self.eta_star(angle_of(turn) - proposed_phi(uniform()))
    }

    /// The densities of [`EllipticTrt::sample_eta`]'s paths: means over the azimuths that it takes indices
    /// for of the density of one index, which `one` has by effective index.
    fn fill_densities(&mut self, one: &BlurredTrt) {
        let n_columns = self.n_phi + 2;
        let mut densities = vec![[0.0; N_TURNS]; self.density_rows.len() * n_columns];
        let mut sums = vec![0.0f64; n_columns];
        // Caustics of neighbouring azimuths lie nearer than w_c.
        let n = (8.0 * self.n_phi as f64 / PI).clamp(64.0, 256.0) as usize;
        for r in 0..self.density_rows.len() {
            let theta_d = self.density_rows.theta_d(r);
            for turn in 0..N_TURNS {
                sums.fill(0.0);
                for ix in 0..n {
                    let phi = proposed_phi((ix as f64 + 0.5) / n as f64);
                    let excess = excess(self.eta_star(angle_of(turn) - phi));
                    let (row, weights) = self.rows_at(excess, theta_d);
                    for (r, weight) in weights.into_iter().enumerate() {
                        let weight = weight / n as f64;
                        let own = &one.texels[(row + r) * n_columns..][..n_columns];
                        for (sum, [.., density]) in sums.iter_mut().zip(own) {
                            *sum += weight * f64::from(*density);
                        }
                    }
                }
                let row = &mut densities[r * n_columns..][..n_columns];
                for (texel, &sum) in row.iter_mut().zip(&sums) {
                    texel[turn] = sum as f32;
                }
            }
        }
        self.densities = densities;
    }

    /// How far `Int N_TRT dphi` at `theta_d` seen from the azimuth phi_o is from its mean over all
    /// azimuths, per channel.
    pub fn energy_swing(&self, theta_d: f64, phi_o: f64) -> [f64; 3] {
        let (turn, fraction) = turn_of(phi_o);
        let (row, weights) = self.density_rows.at(theta_d);
        let mut total = [0.0; 3];
        for (turns, weight) in self.swings[row..row + 4].iter().zip(weights) {
            for (c, sum) in total.iter_mut().enumerate() {
                let [low, high] = [turns[turn][c], turns[turn + 1][c]];
                *sum += weight * ((1.0 - fraction) * low + fraction * high);
            }
        }
        total
    }

    fn fill_swings(&mut self) {
        // Two a width, which blurred lobes need no more than.
        let n = (self.n_phi / 2).max(24);
        let step = PI / n as f64;
        let of_row = |r: usize| {
            let theta_d = self.density_rows.theta_d(r);
            let mut turns: [[f64; 3]; N_TURNS] = std::array::from_fn(|turn| {
                let phi_o = 0.5 * angle_of(turn);
                let mut total = [0.0; 3];
                for ix in 0..2 * n {
                    let phi = step * ix as f64 - PI;
                    let n = self.azimuthal(theta_d, phi, phi_o);
                    total = std::array::from_fn(|c| total[c] + step * n[c]);
                }
                total
            });
            // Trapezoids, as look-ups see it.
            let weight = |turn: usize| match turn {
                0 => 0.5,
                turn if turn == N_TURNS - 1 => 0.5,
                _ => 1.0,
            };
            let mean: [f64; 3] = std::array::from_fn(|c| {
                let sum: f64 = (0..N_TURNS).map(|turn| weight(turn) * turns[turn][c]).sum();
                sum / (N_TURNS - 1) as f64
            });
            for turn in &mut turns {
                *turn = std::array::from_fn(|c| turn[c] - mean[c]);
            }
            turns
        };
        self.swings = (0..self.density_rows.len()).map(of_row).collect();
    }

    /// Size in bytes.
    #[cfg(test)]
    pub fn bytes(&self) -> usize {
        self.texels.len() * 12 + self.densities.len() * 4 * N_TURNS
    }
}

/// The section of the fibre of `excess(eta) = own` at the inclination where `effective` is that of its
/// effective index.
fn section_of(hair: &HairParams, fresnel: Fresnel, own: f64, effective: f64) -> FibreSection {
    let (eta, eta_eff) = (own.hypot(1.0), effective.hypot(1.0));
    let cos_theta_d = own / effective;
    FibreSection {
        eta_eff,
        cos_theta_d,
        sigma_eff: hair
            .sigma_a
            .map(|sigma| sigma * eta / (eta_eff * cos_theta_d)),
        ..FibreSection::of(hair, eta, 0.0, fresnel)
    }
}

/// The place below `2 phi_o` among the [`N_TURNS`], and the share of the way to the next. A mean over
/// azimuths on both sides is the same at -2 phi_o.
fn turn_of(phi_o: f64) -> (usize, f64) {
    let angle = crate::circular_gaussian::wrap(2.0 * phi_o).abs();
    let x = angle / PI * (N_TURNS - 1) as f64;
    let turn = (x as usize).min(N_TURNS - 2);
    (turn, x - turn as f64)
}

fn angle_of(turn: usize) -> f64 {
    PI * turn as f64 / (N_TURNS - 1) as f64
}

/// An azimuth that an index is taken for, as `u` in 0..1 goes.
fn proposed_phi(u: f64) -> f64 {
    match u < NEAR_SHARE {
        true => NEAR * (2.0 * u / NEAR_SHARE - 1.0),
        false => PI * (2.0 * (u - NEAR_SHARE) / (1.0 - NEAR_SHARE) - 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::azimuthal;
    use crate::hair::Lobe;
    use crate::random::R2;
    use std::time::Instant;

    /// Worst and root mean square error in units of the peak over phi, over `n` places.
    fn errors(hair: &HairParams, n: u32) -> [f64; 2] {
        let start = Instant::now();
        let table = EllipticTrt::new(hair, Fresnel::Dielectric);
        let seconds = start.elapsed().as_secs_f64();
        let step = |i: u32, step: f64| f64::from(i) * step % 1.0;
        // The light takes the part of the blur: quadrature of another way through.
        let kappa = crate::circular_gaussian::sharpness(hair.caustic_width);
        let scale = crate::circular_gaussian::circular_gaussian_integral(kappa);
        let (mut worst, mut squares) = ([0.0f64; 3], 0.0);
        for i in 1..=n {
            let u = step(i, R2[0]);
            let theta_d = if i % 3 == 0 { 0.9 * u } else { FRAC_PI_2 * u };
            let v = step(i, R2[1]);
            let phi = if i % 2 == 0 { 1.5 * v } else { PI * v };
            let phi_o = PI * step(i, 0.437_016_024_9);
            let plain = HairParams {
                eta: eta_star(hair.eta, hair.eccentricity, phi_o - 0.5 * phi),
                eccentricity: 1.0,
                caustic_width: 1e-4,
                ..*hair
            };
            let (lobe, width) = (Lobe::Trt, hair.caustic_width);
            let expected = azimuthal(lobe, width, phi, theta_d, &plain, Fresnel::Dielectric);
            let found = table.at(theta_d, phi, phi_o);
            // Of this index and inclination.
            let twice_phi_h = 2.0 * phi_o - phi;
            let peak = (0..200).fold([1e-30f64; 3], |peak, ix| {
                let phi = PI * f64::from(ix) / 200.0;
                let at = table.azimuthal(theta_d, phi, 0.5 * (twice_phi_h + phi));
                std::array::from_fn(|c| peak[c].max(at[c]))
            });
            for c in 0..3 {
                let off = (found[c] - expected[c] / scale).abs() / peak[c];
                worst[c] = worst[c].max(off);
                squares += off * off;
            }
        }
        let rms = (squares / f64::from(3 * n)).sqrt();
        let all: Vec<String> = worst.iter().map(|off| format!("{off:.1e}")).collect();
        println!(
            "eta {} sigma {:?} w_c {} a {}: worst {all:?}, rms {rms:.1e}, {} nodes, {} kB, {seconds:.2} s",
            hair.eta,
            hair.sigma_a,
            hair.caustic_width,
            hair.eccentricity,
            table.n_nodes,
            table.bytes() / 1000,
        );
        [worst.into_iter().fold(0.0, f64::max), rms]
    }

    #[test]
    fn the_table_against_quadrature() {
        let base = HairParams::default();
        let mut worst = 0.0f64;
        for (eta, sigma_a, caustic_width, eccentricity) in [
            (1.55, [0.0, 0.1, 0.3], 0.148, 0.85),
            (1.55, [0.2, 0.5, 1.0], 0.148, 1.25),
            (1.55, [0.1, 1.0, 3.5], 0.1, 0.5),
            (1.35, [0.0, 0.5, 2.0], 0.3, 2.0),
            (1.8, [0.02, 0.1, 0.5], 0.06, 1.4),
        ] {
            let hair = HairParams {
                eta,
                sigma_a,
                caustic_width,
                eccentricity,
                ..base
            };
            let [found, rms] = errors(&hair, 300);
            worst = worst.max(found);
            assert!(rms < 6e-4, "{rms:e}");
        }
        assert!(worst < 8e-3, "{worst:e}");
    }
}
