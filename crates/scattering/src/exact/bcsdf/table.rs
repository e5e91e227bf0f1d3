//! Tables over theta_d: N_TRT blurred by w_c, and the masses of N_t.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::circular_gaussian::{circular_gaussian, circular_gaussian_integral, sharpness};
use crate::exact::azimuthal::residual;
use crate::exact::{FibreSection, energy, eta_star};
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe};
use crate::quadrature::GaussLegendre;

/// Weights of the cubic through values at -1, 0, 1, 2, at `t` in 0..=1.
pub(super) fn cubic(t: f64) -> [f64; 4] {
    let (a, b, c) = (t + 1.0, t - 1.0, t - 2.0);
    [
        -t * b * c / 6.0,
        0.5 * a * b * c,
        -0.5 * a * t * c,
        a * t * b / 6.0,
    ]
}

/// Rows over |theta_d|, denser towards pi/2 where Fresnel's term turns: row `r` is at
/// `v = (r - 1) / (n - 1)`, `theta_d = pi/2 (1 - v^2)`. One row more at each end for the cubic;
/// what is tabulated is even in theta_d, so it is smooth in v across both ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rows {
    n: usize,
}

impl Rows {
    /// `n` rows for v in 0..=1, two or more.
    pub fn new(n: usize) -> Self {
        Rows { n }
    }

    pub fn len(self) -> usize {
        self.n + 2
    }

    /// v of row `r`; outside 0..=1 in the first and the last row.
    pub fn v(self, r: usize) -> f64 {
        (r as f64 - 1.0) / (self.n as f64 - 1.0)
    }

    /// theta_d of row `r`; below 0 in the last row, which lies across the end.
    pub fn theta_d(self, r: usize) -> f64 {
        let v = self.v(r);
        FRAC_PI_2 * (1.0 - v * v)
    }

    /// The first of the four rows around `theta_d`, and their weights.
    pub fn at(self, theta_d: f64) -> (usize, [f64; 4]) {
        self.at_v((1.0 - theta_d.abs() / FRAC_PI_2).max(0.0).sqrt())
    }

    /// The same around `v`, at least 0.
    pub fn at_v(self, v: f64) -> (usize, [f64; 4]) {
        let x = v * (self.n as f64 - 1.0);
        let first = (x as usize).min(self.n - 2);
        (first, cubic(x - first as f64))
    }
}

/// N_TRT blurred by w_c over (theta_d, phi), per channel, and the same without attenuation: the
/// density of the azimuth when h is drawn evenly and w_c added.
///
/// Cubic look-up; error below 3e-4 of the table's peak for every parameter in range (tested
/// against quadrature at random places).
#[derive(Clone, Debug)]
pub(super) struct BlurredTrt {
    pub rows: Rows,
    /// Texels over 0..=pi; one more at each end.
    pub n_phi: usize,
    /// `[row][phi]`: rgb, density.
    pub texels: Vec<[f32; 4]>,
}

/// Texels of phi per w_c: the cubic's error of a Gaussian is `0.28 / PHI_PER_WIDTH^4`.
const PHI_PER_WIDTH: f64 = 5.0;

/// Where the circular Gaussian counts, in widths: `exp(-6^2)` is left out.
const REACH: f64 = 6.0;

impl BlurredTrt {
    /// Sums the circular Gaussians of many paths through the fibre: 0.1 s, 2 s for the narrowest
    /// w_c.
    pub fn new(hair: &HairParams, fresnel: Fresnel) -> Self {
        let width = hair.caustic_width;
        let rows = Rows {
            n: (6.0 / width).ceil().clamp(64.0, 400.0) as usize,
        };
        BlurredTrt::of_sections(width, rows, |r| {
            FibreSection::of(hair, hair.eta, rows.theta_d(r), fresnel)
        })
    }

    /// The same with other sections in its rows, blurred by `width`.
    pub fn of_sections(
        width: f64,
        rows: Rows,
        section_of_row: impl Fn(usize) -> FibreSection,
    ) -> Self {
        let n_phi = (PI * PHI_PER_WIDTH / width).ceil().max(48.0) as usize + 1;
        // Neighbouring paths leave less than w_c apart.
        let rule = GaussLegendre::new((20.0 / width).ceil().max(192.0) as usize);
        let paths: Vec<(f64, f64)> = rule.on(0.0, 1.0).collect();
        let mut table = BlurredTrt {
            rows,
            n_phi,
            texels: vec![[0.0; 4]; rows.len() * (n_phi + 2)],
        };
        let mut sums = vec![[0.0; 4]; n_phi];
        for r in 0..rows.len() {
            sums.fill([0.0; 4]);
            table.add_paths(&section_of_row(r), width, &paths, &mut sums);
            let row = &mut table.texels[r * (n_phi + 2)..(r + 1) * (n_phi + 2)];
            for (texel, sum) in row[1..].iter_mut().zip(&sums) {
                *texel = sum.map(|x| x as f32);
            }
            // Even around 0 and around pi.
            row[0] = row[2];
            row[n_phi + 1] = row[n_phi - 1];
        }
        table
    }

    /// Adds `1/2 A(h) g^c(phi - phi(2, h)) dh` of all `paths` (place and weight in 0..=1, taken
    /// to gamma = pi/2 (1 - s^2), dense near grazing) and of their mirror images.
    fn add_paths(
        &self,
        section: &FibreSection,
        width: f64,
        paths: &[(f64, f64)],
        sums: &mut [[f64; 4]],
    ) {
        let kappa = sharpness(width);
        let scale = 1.0 / circular_gaussian_integral(kappa);
        let step = PI / (self.n_phi as f64 - 1.0);
        for &(s, weight) in paths {
            let gamma = FRAC_PI_2 * (1.0 - s * s);
            let (sin, cos) = gamma.sin_cos();
            let factor = 0.5 * cos * PI * s * weight * scale;
            let kept = section.attenuation(Lobe::Trt, sin, cos);
            let value = [kept[0], kept[1], kept[2], 1.0].map(|x| factor * x);
            // Both signs of gamma, folded into 0..=pi, and what reaches across 0 and pi.
            let centre = crate::circular_gaussian::wrap(section.exit_azimuth(Lobe::Trt, gamma));
            for centre in [centre, -centre] {
                for turn in [-2.0 * PI, 0.0, 2.0 * PI] {
                    let at = centre + turn;
                    let first = ((at - REACH * width) / step).ceil().max(0.0);
                    let last = ((at + REACH * width) / step).floor();
                    if last < first || first > self.n_phi as f64 - 1.0 {
                        continue;
                    }
                    let last = (last as usize).min(self.n_phi - 1);
                    let first = first as usize;
                    for (ix, sum) in sums[first..=last].iter_mut().enumerate() {
                        let x = (first + ix) as f64 * step - at;
                        // Wide Gaussians reach round the circle: each turn takes its half.
                        if x.abs() > PI {
                            continue;
                        }
                        let g = circular_gaussian(x, kappa);
                        for (sum, value) in sum.iter_mut().zip(value) {
                            *sum += g * value;
                        }
                    }
                }
            }
        }
    }

    /// `[N_TRT rgb, density]` at `theta_d` and `phi` (wrapped, +-pi).
    pub fn at(&self, theta_d: f64, phi: f64) -> [f64; 4] {
        let (row, row_weights) = self.rows.at(theta_d);
        let (column, column_weights) = columns_at(self.n_phi, phi);
        let mut total = [0.0f64; 4];
        for (r, row_weight) in row_weights.into_iter().enumerate() {
            let start = (row + r) * (self.n_phi + 2) + column;
            for (texel, weight) in self.texels[start..start + 4].iter().zip(column_weights) {
                let weight = row_weight * weight;
                for c in 0..4 {
                    total[c] += weight * f64::from(texel[c]);
                }
            }
        }
        // The cubic swings below zero beside a caustic.
        total.map(|x| x.max(0.0))
    }

    /// Size in bytes.
    #[cfg(test)]
    pub fn bytes(&self) -> usize {
        self.texels.len() * 16
    }
}

/// The first of four of `n_phi` columns (and one more at each end) around `phi`, and their weights.
pub(super) fn columns_at(n_phi: usize, phi: f64) -> (usize, [f64; 4]) {
    let x = phi.abs().min(PI) / PI * (n_phi as f64 - 1.0);
    let column = (x as usize).min(n_phi - 2);
    (column, cubic(x - column as f64))
}

/// Half angles that the mean mass is taken over: a smooth, even function of their cosine.
const N_HALF_ANGLES: u32 = 12;

/// `Int N_TRT dphi` of an elliptic fibre at `theta_d`, per channel, its mean over all half angles:
/// what it comes to on the mean over all azimuths phi_o.
fn mean_energy(theta_d: f64, hair: &HairParams, fresnel: Fresnel) -> [f64; 3] {
    let mut total = [0.0; 3];
    for ix in 0..N_HALF_ANGLES {
        let phi_h = FRAC_PI_2 * (f64::from(ix) + 0.5) / f64::from(N_HALF_ANGLES);
        let round = HairParams {
            eta: eta_star(hair.eta, hair.eccentricity, phi_h),
            eccentricity: 1.0,
            ..*hair
        };
        let own = energy(Lobe::Trt, theta_d, &round, fresnel);
        for (total, own) in total.iter_mut().zip(own) {
            *total += own / f64::from(N_HALF_ANGLES);
        }
    }
    total
}

/// Masses of N_t over theta_d, per lobe and channel ([`energy`]; of an elliptic fibre TRT's mean over all
/// azimuths), and of the orders beyond TRT that its own holds.
#[derive(Clone, Debug)]
pub(super) struct Energies {
    rows: Rows,
    texels: Vec<[[f64; 3]; 4]>,
}

impl Energies {
    pub fn new(hair: &HairParams, fresnel: Fresnel) -> Self {
        let rows = Rows { n: 160 };
        let texels = (0..rows.len())
            .map(|r| {
                let theta_d = rows.theta_d(r);
                let [a, b, c] = Lobe::ALL.map(|lobe| match lobe {
                    Lobe::Trt if hair.eccentricity != 1.0 => mean_energy(theta_d, hair, fresnel),
                    _ => energy(lobe, theta_d, hair, fresnel),
                });
                let section = FibreSection::of(hair, hair.eta, theta_d, fresnel);
                [a, b, c, residual(Lobe::Trt, hair, &section)]
            })
            .collect();
        Energies { rows, texels }
    }

    /// `Int N_t dphi` at `theta_d`; error below 1e-4.
    pub fn at(&self, lobe: Lobe, theta_d: f64) -> [f64; 3] {
        self.column_at(lobe as usize, theta_d)
    }

    /// What of TRT's are orders beyond it; nothing of model `marschner`.
    pub fn further_at(&self, theta_d: f64) -> [f64; 3] {
        self.column_at(Lobe::ALL.len(), theta_d)
            .map(|kept| kept.max(0.0))
    }

    fn column_at(&self, column: usize, theta_d: f64) -> [f64; 3] {
        let (row, weights) = self.rows.at(theta_d);
        let mut total = [0.0; 3];
        for (texel, weight) in self.texels[row..row + 4].iter().zip(weights) {
            for (sum, x) in total.iter_mut().zip(texel[column]) {
                *sum += weight * x;
            }
        }
        total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::azimuthal;
    use crate::random::R2;

    /// Worst error of the table in units of its peak, over `n` places of Halton's sequence.
    fn worst_error(hair: &HairParams, n: u32) -> (f64, BlurredTrt) {
        let table = BlurredTrt::new(hair, Fresnel::Dielectric);
        let peak = table.texels.iter().fold([0.0f64; 4], |peak, t| {
            std::array::from_fn(|c| peak[c].max(f64::from(t[c])))
        });
        let scale = circular_gaussian_integral(sharpness(hair.caustic_width));
        let mut worst = 0.0f64;
        for i in 1..=n {
            let u = f64::from(i) * R2[0] % 1.0;
            let v = f64::from(i) * R2[1] % 1.0;
            // A third of the places near the caustics of a usual fibre.
            let theta_d = if i % 3 == 0 { 0.9 * u } else { FRAC_PI_2 * u };
            let phi = if i % 3 == 0 { 0.5 * v } else { PI * v };
            // The light takes the part of the blur: quadrature of another way through.
            let mut plain = *hair;
            plain.caustic_width = 1e-4;
            let expected = azimuthal(
                Lobe::Trt,
                hair.caustic_width,
                phi,
                theta_d,
                &plain,
                Fresnel::Dielectric,
            );
            let got = table.at(theta_d, phi);
            for c in 0..3 {
                worst = worst.max((got[c] - expected[c] / scale).abs() / peak[c].max(1e-30));
            }
        }
        (worst, table)
    }

    #[test]
    fn blurred_trt_against_quadrature() {
        let base = HairParams::default();
        for (eta, caustic_width) in [(1.55, 0.148), (1.55, 0.05), (1.35, 0.3), (2.5, 1.5)] {
            let hair = HairParams {
                eta,
                caustic_width,
                ..base
            };
            let (worst, table) = worst_error(&hair, 120);
            println!("{eta} {caustic_width}: {worst:e}, {} bytes", table.bytes());
            assert!(worst < 3e-4, "{eta} {caustic_width}: {worst:e}");
        }
    }

    #[test]
    fn extremes_of_the_ranges() {
        let base = HairParams::default();
        for (eta, sigma, caustic_width) in [
            (1.0001, 0.1, 0.1),
            (3.0, 0.0, 0.02),
            (1.55, 50.0, 0.1),
            (1.55, 0.2, 0.01),
        ] {
            let hair = HairParams {
                eta,
                sigma_a: [sigma; 3],
                caustic_width,
                ..base
            };
            let (worst, table) = worst_error(&hair, 60);
            println!(
                "{eta} {sigma} {caustic_width}: {worst:e}, {} bytes",
                table.bytes()
            );
            assert!(worst < 3e-4, "{eta} {sigma} {caustic_width}: {worst:e}");
        }
    }

    #[test]
    fn energies_between_the_rows() {
        for eta in [1.0001, 1.55, 3.0] {
            let hair = HairParams {
                eta,
                ..HairParams::default()
            };
            let table = Energies::new(&hair, Fresnel::Dielectric);
            let mut worst = 0.0f64;
            for i in 0..200 {
                let theta_d = FRAC_PI_2 * (f64::from(i) + 0.37) / 200.0;
                for lobe in Lobe::ALL {
                    let expected = energy(lobe, theta_d, &hair, Fresnel::Dielectric);
                    let got = table.at(lobe, theta_d);
                    worst = worst.max((got[0] - expected[0]).abs());
                }
            }
            println!("{eta}: {worst:e}");
            assert!(worst < 1e-4, "{eta}: {worst:e}");
        }
    }
}
