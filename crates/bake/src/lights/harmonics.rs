//! Real spherical harmonics up to degree 48 about the map's vertical axis.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::sphere::Vec3;
use super::sun::Rest;

/// Number of degrees kept. Beyond it the power of the narrowest lobe (TT: exp(-(0.12 l)^2) ) is
/// below 1e-14 of degree 0.
pub(super) const DEGREES: usize = 49;

/// Pairs (l, m) with 0 <= m <= l < DEGREES.
const PAIRS: usize = DEGREES * (DEGREES + 1) / 2;

/// Rows and columns of a map are averaged in blocks down to this width before they are analysed:
/// 0.7 degrees blur by 0.0035 rad, a thousandth (in variance) of the narrowest lobe of a fibre.
const COLUMNS: usize = 512;

/// Index of (l, m), for each m the degrees l = m, m + 1, ... in a row.
pub(super) const fn pair(l: usize, m: usize) -> usize {
    m * DEGREES - m * (m + 1) / 2 + l
}

/// The associated Legendre functions with the normalisation of spherical harmonics,
/// `int_{-1}^{1} P_lm^2 dx = 1 / (2 pi)`, at `x`, by [`pair`].
pub(super) fn legendre_table(x: f64) -> Vec<f64> {
    let mut table = vec![0.0; PAIRS];
    let sin2 = (1.0 - x * x).max(0.0);
    let mut diagonal = (1.0 / (4.0 * PI)).sqrt();
    for m in 0..DEGREES {
        if m > 0 {
            diagonal *= ((2 * m + 1) as f64 / (2 * m) as f64 * sin2).sqrt();
        }
        let (mut p, mut before) = (diagonal, 0.0);
        let mut b = 0.0;
        for l in m..DEGREES {
            table[pair(l, m)] = p;
            // P_{l+1} = a_{l+1} (x P_l - b_l P_{l-1}), and b_{l+1} = 1 / a_{l+1}.
            let (n, m) = ((l + 1) as f64, m as f64);
            let a = ((4.0 * n * n - 1.0) / (n * n - m * m)).sqrt();
            let next = a * (x * p - b * before);
            b = 1.0 / a;
            before = p;
            p = next;
        }
    }
    table
}

/// Coefficients of a map: for each channel and [`pair`], of `P_lm cos(m lon)` and
/// `P_lm sin(m lon)` (both twice for m > 0, which makes them the expansion of the map).
pub(super) struct Harmonics {
    coefficients: Vec<[[f64; 2]; 3]>,
}

impl Harmonics {
    /// Analyses a map, less what was taken out of it.
    pub fn analyse(map: &Rest) -> Harmonics {
        let grid = map.grid();
        let block = (grid.width / COLUMNS).max(1);
        let columns = grid.width.div_ceil(block);
        // cos and sin of m lon at the centre of each block of columns.
        let waves: Vec<Vec<[f64; 2]>> = (0..DEGREES)
            .map(|m| {
                (0..columns)
                    .map(|i| {
                        let last = ((i + 1) * block).min(grid.width);
                        let middle = 0.5 * (i * block + last) as f64;
                        let lon = PI - 2.0 * PI * middle / grid.width as f64;
                        let (sin, cos) = (m as f64 * lon).sin_cos();
                        [cos, sin]
                    })
                    .collect()
            })
            .collect();
        let rows: Vec<Vec<[[f64; 2]; 3]>> = (0..grid.height.div_ceil(block))
            .into_par_iter()
            .map(|row| {
                // Energy of each block of pixels, channel by channel.
                let mut energy = [0; 3].map(|_| vec![0.0f64; columns]);
                let (first, last) = (row * block, ((row + 1) * block).min(grid.height));
                for j in first..last {
                    let solid_angle = grid.solid_angle(j);
                    for (i, pixel) in map.row(j).iter().enumerate() {
                        for (sum, x) in energy.iter_mut().zip(pixel) {
                            sum[i / block] += solid_angle * f64::from(*x);
                        }
                    }
                }
                let lat = PI * (0.5 - 0.5 * (first + last) as f64 / grid.height as f64);
                let legendre = legendre_table(lat.sin());
                let mut out = vec![[[0.0; 2]; 3]; PAIRS];
                for (m, wave) in waves.iter().enumerate() {
                    let twice = if m == 0 { 1.0 } else { 2.0 };
                    for (c, energy) in energy.iter().enumerate() {
                        let mut sum = [0.0; 2];
                        for (e, w) in energy.iter().zip(wave) {
                            sum[0] += e * w[0];
                            sum[1] += e * w[1];
                        }
                        for l in m..DEGREES {
                            let p = twice * legendre[pair(l, m)];
                            out[pair(l, m)][c] = sum.map(|s| s * p);
                        }
                    }
                }
                out
            })
            .collect();
        let mut coefficients = vec![[[0.0; 2]; 3]; PAIRS];
        for row in rows {
            for (sum, own) in coefficients.iter_mut().zip(row) {
                for (sum, own) in sum.as_flattened_mut().iter_mut().zip(own.as_flattened()) {
                    *sum += own;
                }
            }
        }
        Harmonics { coefficients }
    }

    /// Multiplies each degree with its factor.
    pub fn filter(&mut self, factors: &[f64; DEGREES]) {
        for m in 0..DEGREES {
            for (l, factor) in factors.iter().enumerate().skip(m) {
                for x in self.coefficients[pair(l, m)].as_flattened_mut() {
                    *x *= factor;
                }
            }
        }
    }

    /// Power of each degree of the first channel: the squared L2 norm of that part.
    #[cfg(test)]
    pub fn power(&self) -> [f64; DEGREES] {
        let mut power = [0.0; DEGREES];
        for m in 0..DEGREES {
            for (l, power) in power.iter_mut().enumerate().skip(m) {
                let [cos, sin] = self.coefficients[pair(l, m)][0];
                // Stored doubled for m > 0; P cos(m lon) there has norm 1 / 2.
                let half = if m == 0 { 1.0 } else { 0.5 };
                *power += half * (cos * cos + sin * sin);
            }
        }
        power
    }

    /// The sum of all harmonics in a direction.
    pub fn value(&self, direction: Vec3) -> [f64; 3] {
        let legendre = legendre_table(direction[1]);
        let lon = direction[0].atan2(direction[2]);
        let mut value = [0.0; 3];
        for m in 0..DEGREES {
            let range = pair(m, m)..pair(DEGREES - 1, m) + 1;
            let mut sum = [[0.0; 2]; 3];
            for (p, own) in legendre[range.clone()]
                .iter()
                .zip(&self.coefficients[range])
            {
                for c in 0..3 {
                    sum[c][0] += p * own[c][0];
                    sum[c][1] += p * own[c][1];
                }
            }
            let (sin, cos) = (m as f64 * lon).sin_cos();
            for (value, sum) in value.iter_mut().zip(sum) {
                *value += cos * sum[0] + sin * sum[1];
            }
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::cells::map_cells_of;
    use crate::lights::response::Response;
    use crate::lights::spectrum::Filter;
    use crate::lights::sphere::{Random, dot, fibonacci};
    use strandlight_images::Map;

    #[test]
    fn harmonics_add_up_to_legendre() {
        // The addition theorem: (2 l + 1) / (4 pi) = sum over m of Y_lm^2.
        for x in [-0.99, -0.3, 0.0, 0.7, 1.0] {
            let table = legendre_table(x);
            for l in 0..DEGREES {
                let sum: f64 = (0..=l)
                    .map(|m| if m == 0 { 1.0 } else { 2.0 } * table[pair(l, m)].powi(2))
                    .sum();
                let expected = (2 * l + 1) as f64 / (4.0 * PI);
                assert!((sum / expected - 1.0).abs() < 1e-10, "{x} {l}");
            }
        }
    }

    /// The harmonics of a map against the direct sum over its pixels of the filter's profile.
    #[test]
    fn filtered_maps_match_the_direct_convolution() {
        for (width, tolerance) in [(128, 5e-4), (1024, 2e-3)] {
            let height = width / 2;
            let mut random = Random::new(5);
            let pixels: Vec<[f32; 3]> = (0..width * height)
                .map(|_| [0; 3].map(|_| random.uniform().powi(20) as f32))
                .collect();
            let map = Map::new(width, height, pixels).unwrap();
            let filter = Filter::new(&[Response::default()]);
            let mut harmonics = Harmonics::analyse(&Rest::new(&map));
            harmonics.filter(&filter.factors);
            let profile = filter.point_profile();
            let cells = map_cells_of(&map, 1);
            for ix in 0..20 {
                let p = fibonacci(ix, 20, 0.1);
                let mut expected = 0.0;
                for cell in &cells {
                    let value = profile.at(dot(p, cell.direction) as f32)[0];
                    expected += f64::from(value) * cell.energy[1];
                }
                let value = harmonics.value(p)[1];
                assert!(
                    (value - expected).abs() < tolerance * expected,
                    "{width}: {value} {expected}"
                );
            }
        }
    }
}
