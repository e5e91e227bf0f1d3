//! Light sets as maps whose texels hold means, so that narrow lights keep their energy.

use std::f64::consts::PI;
use std::ops::Range;

use rayon::prelude::*;
use strandlight_formats::SrbfLight;
use strandlight_images::LatLong;
use strandlight_scattering::special::bessel_i0_scaled;

use super::cells::srbf_solid_angle;
use super::sphere::normalize;

/// A light ends where its radiance is e^-32 of that on its axis.
const MAX_EXPONENT: f64 = 32.0;

/// How far the two points of Gauss's rule lie beside the middles of their halves, in halves:
/// 1 / sqrt(3) - 1 / 2.
const GAUSS_SHIFT: f64 = 0.077_350_269_189_625_76;

/// The map of `lights`: the mean radiance over each texel of `grid`, top row first. Its energy is
/// that of the lights, whatever the size; without texels it is empty.
pub fn texel_means(lights: &[SrbfLight], grid: LatLong) -> Vec<[f32; 3]> {
    if grid.width == 0 || grid.height == 0 {
        return Vec::new();
    }
    let lobes: Vec<Lobe> = lights
        .par_iter()
        .map(|light| Lobe::new(light, grid))
        .collect();
    let lobes = &lobes;
    let rows = (0..grid.height).into_par_iter().flat_map_iter(|j| {
        let mut sums = vec![[0.0; 3]; grid.width];
        for lobe in lobes {
            lobe.add_to_row(j, &mut sums);
        }
        let solid_angle = grid.solid_angle(j);
        sums.into_iter()
            .map(move |sum| sum.map(|x| (x / solid_angle) as f32))
    });
    rows.collect()
}

/// Samples along a side of a texel of `size` radians: the middle of texels far smaller than the
/// light, else the two points of Gauss's rule in parts of at most an eighth of its bandwidth.
fn samples(size: f64, lambda: f64) -> usize {
    // Over angles of one radian latitudes and longitudes matter, too.
    let lambda = lambda.min(1.0);
    match size <= lambda / 64.0 {
        true => 1,
        false => 2 * (8.0 * size / lambda).ceil() as usize,
    }
}

/// Where sample `ix` lies, in samples from the edge; `n` of [`samples`].
fn position(ix: usize, n: usize) -> f64 {
    let shift = match (n, ix % 2) {
        (1, _) => 0.0,
        (_, 0) => -GAUSS_SHIFT,
        _ => GAUSS_SHIFT,
    };
    ix as f64 + 0.5 + shift
}

/// Samples `from..to` of a circle of `count`, from 0 on: one range or two.
fn wrapped(from: f64, to: f64, count: usize) -> [Range<usize>; 2] {
    let length = to - from;
    if length >= count as f64 {
        return [0..count, 0..0];
    }
    let from = from.rem_euclid(count as f64) as usize;
    let to = from + length as usize;
    [from..to.min(count), 0..to.saturating_sub(count)]
}

/// The samples of one latitude.
struct Ring {
    /// Exponent of the light on its own meridian there.
    exponent: f64,
    /// What the exponent has more, over the squared sine of half the difference in longitude.
    sharpness: f64,
    /// Solid angle a radian of longitude.
    band: f64,
    /// Samples along a texel.
    parts: usize,
}

/// A light as it is summed: `rgb exp(-scale (sin^2(dlat / 2) + cos lat cos lat_0 sin^2(dlon / 2)))`,
/// which keeps its digits for narrow lights.
struct Lobe {
    lambda: f64,
    scale: f64,
    /// Amplitude, with the factor that makes the sum the exact energy.
    rgb: [f64; 3],
    latitude: f64,
    cos_latitude: f64,
    /// Where its axis is, of the map's width.
    across: f64,
    /// Rows of samples along a texel, and those that the light reaches.
    parts: usize,
    rows: Range<usize>,
    /// Squared sines of half the difference in longitude at the middles of the columns.
    squares: Vec<f64>,
    grid: LatLong,
}

impl Lobe {
    fn new(light: &SrbfLight, grid: LatLong) -> Lobe {
        let lambda = f64::from(light.lambda);
        let [x, y, z] = normalize(light.direction.map(f64::from));
        let cos_latitude = x.hypot(z);
        let latitude = y.atan2(cos_latitude);
        let across = (PI - x.atan2(z)) / (2.0 * PI);
        let scale = 4.0 / (lambda * lambda);

        let parts = samples(PI / grid.height as f64, lambda);
        let n_rows = grid.height * parts;
        let step = PI / n_rows as f64;
        let reach = 2.0 * (MAX_EXPONENT / scale).sqrt().min(1.0).asin();
        let row = |latitude: f64| (0.5 * PI - latitude) / step;
        let from = row(latitude + reach).floor().max(0.0) as usize;
        let to = row(latitude - reach).ceil().max(0.0) as usize;

        let half_turn = |i: usize| PI * ((i as f64 + 0.5) / grid.width as f64 - across);
        let mut lobe = Lobe {
            lambda,
            scale,
            rgb: [0.0; 3],
            latitude,
            cos_latitude,
            across,
            parts,
            rows: from..to.min(n_rows),
            squares: (0..grid.width)
                .map(|i| half_turn(i).sin().powi(2))
                .collect(),
            grid,
        };
        // The mean of a ring is a Bessel function. What the latitudes miss is made good by a factor.
        let of_row = |row: usize| {
            let ring = lobe.ring(row);
            (-ring.exponent).exp() * ring.band * bessel_i0_scaled(0.5 * ring.sharpness)
        };
        let sum: f64 = 2.0 * PI * lobe.rows.clone().map(of_row).sum::<f64>();
        let factor = match sum > 0.0 {
            true => srbf_solid_angle(lambda) / sum,
            false => 1.0,
        };
        lobe.rgb = light.rgb.map(|x| factor * f64::from(x));
        lobe
    }

    fn ring(&self, row: usize) -> Ring {
        let step = PI / (self.grid.height * self.parts) as f64;
        let latitude = 0.5 * PI - step * position(row, self.parts);
        let cos = latitude.cos().max(0.0);
        let sine = (0.5 * (latitude - self.latitude)).sin();
        Ring {
            exponent: self.scale * sine * sine,
            sharpness: self.scale * cos * self.cos_latitude,
            band: 2.0 * cos * (0.5 * step).sin(),
            parts: samples(2.0 * PI / self.grid.width as f64 * cos, self.lambda),
        }
    }

    /// Adds its energy in the texels of row `j` to theirs.
    fn add_to_row(&self, j: usize, sums: &mut [[f64; 3]]) {
        let first = self.rows.start.max(j * self.parts);
        let last = self.rows.end.min((j + 1) * self.parts);
        for row in first..last {
            let ring = self.ring(row);
            // Squared sine of half the longitude that it reaches.
            let reached = (MAX_EXPONENT - ring.exponent) / ring.sharpness;
            if reached <= 0.0 {
                continue;
            }
            let count = self.grid.width * ring.parts;
            let ranges = match reached < 1.0 {
                true => {
                    let n = count as f64;
                    let (middle, reach) = (self.across * n, reached.sqrt().asin() / PI * n);
                    wrapped((middle - reach).floor(), (middle + reach).ceil(), count)
                }
                false => [0..count, 0..0],
            };
            let weight = (-ring.exponent).exp() * ring.band * 2.0 * PI / count as f64;
            let rgb = self.rgb.map(|x| weight * x);
            let add = |sum: &mut [f64; 3], square: f64| {
                let value = (-ring.sharpness * square).exp();
                for (sum, x) in sum.iter_mut().zip(rgb) {
                    *sum += x * value;
                }
            };
            for range in ranges {
                if ring.parts == 1 {
                    let squares = &self.squares[range.clone()];
                    for (sum, square) in sums[range].iter_mut().zip(squares) {
                        add(sum, *square);
                    }
                    continue;
                }
                for ix in range {
                    let across = position(ix, ring.parts) / count as f64 - self.across;
                    add(&mut sums[ix / ring.parts], (PI * across).sin().powi(2));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cells::radiance;
    use super::*;

    fn grid(width: usize) -> LatLong {
        LatLong {
            width,
            height: (width / 2).max(1),
        }
    }

    /// Lights of `lambdas` in odd directions, at the poles and about the seam.
    fn lights(lambdas: &[f32]) -> Vec<SrbfLight> {
        let directions = [
            [0.6, 0.64, 0.48],
            [-0.31, -0.9, 0.2],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.02, 0.999, 0.01],
            [0.0, 0.0, -1.0],
            [0.001, 0.3, -1.0],
            [0.3, 0.0, 0.95],
        ];
        let all = lambdas.iter().enumerate().flat_map(|(k, &lambda)| {
            directions.iter().enumerate().map(move |(ix, direction)| {
                let direction = normalize(*direction).map(|x| x as f32);
                let n = (1 + k + ix) as f32;
                SrbfLight {
                    direction,
                    lambda,
                    rgb: [n, 1.0 / n, 0.25 + (ix % 3) as f32],
                }
            })
        });
        all.collect()
    }

    #[test]
    fn maps_of_every_width_have_the_energy_of_the_lights() {
        for lambdas in [&[0.004, 0.05, 0.3, 1.2][..], &[0.004], &[0.05], &[10.0]] {
            let lights = lights(lambdas);
            let wanted = [0, 1, 2].map(|c| {
                let energy = |light: &SrbfLight| {
                    f64::from(light.rgb[c]) * srbf_solid_angle(f64::from(light.lambda))
                };
                lights.iter().map(energy).sum::<f64>()
            });
            for width in [2, 3, 16, 64, 256, 1024] {
                let grid = grid(width);
                let map = texel_means(&lights, grid);
                assert_eq!(map.len(), width * grid.height);
                let found = grid.energy(map.chunks_exact(width));
                for (found, wanted) in found.into_iter().zip(wanted) {
                    let ratio = found / wanted;
                    assert!((ratio - 1.0).abs() < 1e-5, "{lambdas:?}, {width}: {ratio}");
                }
                assert!(map == texel_means(&lights, grid), "the same every time");
            }
        }
    }

    #[test]
    fn texels_hold_means() {
        const FINE: usize = 60;
        let grid = grid(16);
        for light in lights(&[0.2, 1.2]) {
            let map = texel_means(&[light], grid);
            let largest = map.iter().map(|texel| texel[0]).fold(0.0, f32::max);
            for (ix, texel) in map.iter().enumerate() {
                let (mut sum, mut area) = (0.0, 0.0);
                for sample in 0..FINE * FINE {
                    let part = |ix: usize| (ix as f64 + 0.5) / FINE as f64;
                    let x = (ix % 16) as f64 + part(sample % FINE);
                    let y = (ix / 16) as f64 + part(sample / FINE);
                    let direction = grid.direction(x, y);
                    let weight = direction[0].hypot(direction[2]);
                    sum += weight * radiance([&light], direction)[0];
                    area += weight;
                }
                let difference = (f64::from(texel[0]) - sum / area) / f64::from(largest);
                assert!(difference.abs() < 1e-3, "{light:?}, {ix}: {difference}");
            }
        }
    }

    #[test]
    fn wide_lights_are_the_same_as_at_the_middles_of_small_texels() {
        let lights = lights(&[0.3, 1.2]);
        let grid = grid(1024);
        let map = texel_means(&lights, grid);
        let largest = [0, 1, 2].map(|c| {
            let values = map.iter().map(|texel| f64::from(texel[c]));
            values.fold(0.0, f64::max)
        });
        let mut n_checked = 0;
        for ix in (0..map.len()).step_by(37) {
            let direction = grid.direction((ix % 1024) as f64 + 0.5, (ix / 1024) as f64 + 0.5);
            let wanted = radiance(&lights, direction);
            for c in 0..3 {
                let difference = (f64::from(map[ix][c]) - wanted[c]) / largest[c];
                assert!(difference.abs() < 1e-3, "{ix}, {c}: {difference}");
                n_checked += 1;
            }
        }
        assert!(n_checked > 40_000, "{n_checked}");
    }

    #[test]
    fn a_light_narrower_than_a_texel_lies_where_it_points() {
        let light = SrbfLight {
            direction: [0.6, 0.64, 0.48],
            lambda: 0.001,
            rgb: [1.0; 3],
        };
        let grid = grid(64);
        let map = texel_means(&[light], grid);
        let [x, y] = grid.position(light.direction.map(f64::from));
        let ix = y as usize * 64 + x as usize;
        let energy = f64::from(map[ix][0]) * grid.solid_angle(y as usize);
        assert!((energy / srbf_solid_angle(f64::from(0.001f32)) - 1.0).abs() < 1e-4);
        // On the seam it lies on both sides.
        let light = SrbfLight {
            direction: [0.0, 0.0, -1.0],
            ..light
        };
        let map = texel_means(&[light], grid);
        let at = |row: usize, column: usize| map[64 * row + column][1];
        assert!(at(16, 0) > 0.0 && (at(16, 0) / at(15, 63) - 1.0).abs() < 1e-4);
        assert_eq!(map.iter().filter(|texel| texel[0] > 0.0).count(), 4);
    }

    #[test]
    fn without_texels_there_is_nothing() {
        for (width, height) in [(0, 0), (0, 4), (4, 0)] {
            assert!(texel_means(&lights(&[0.3]), LatLong { width, height }).is_empty());
        }
    }
}
