//! A map or a light set as points of energy: what sums over all pixels are made of.

use std::f64::consts::PI;

use rayon::prelude::*;
use strandlight_formats::{LightSet, SrbfLight};
pub(super) use strandlight_scattering::spherical_gaussian::solid_angle as srbf_solid_angle;

use super::sphere::{Vec3, combine, dot, normalize, tangents};
use strandlight_images::{LatLong, Map};

/// Columns of the grid on which sums are made: 1.4 degrees, a tenth of the narrowest lobe of the
/// fibre response. Divides the usual map widths.
pub(super) const COLUMNS: usize = 256;

/// Lights narrower than this are summed over a disc of their own: a grid of 256 x 128 resolves a
/// Gaussian of bandwidth lambda = 0.06 (standard deviation 1.7 cells) to 3e-5.
pub(super) const NARROW: f64 = 0.06;

/// A point of light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Unit vector towards it.
    pub direction: Vec3,
    /// Radiance times solid angle.
    pub energy: [f64; 3],
}

/// The map in cells of at least 1.4 degrees, each with its exact energy, at the centroid of its
/// luminance (so that a sun of one pixel stays where it is); cells without energy are left out.
pub(super) fn map_cells(map: &Map) -> Vec<Cell> {
    let block = (map.width() / COLUMNS).max(1);
    map_cells_of(map, block)
}

/// As [`map_cells`] with cells of `block` x `block` pixels; 1 is the map itself.
pub(super) fn map_cells_of(map: &Map, block: usize) -> Vec<Cell> {
    let grid = map.grid();
    let columns: Vec<[f64; 2]> = (0..map.width())
        .map(|i| {
            let lon = PI - 2.0 * PI * (i as f64 + 0.5) / map.width() as f64;
            [lon.sin(), lon.cos()]
        })
        .collect();
    (0..map.height().div_ceil(block))
        .into_par_iter()
        .map(|block_row| {
            let rows: Vec<(usize, f64, f64, f64)> = (block_row * block
                ..((block_row + 1) * block).min(map.height()))
                .map(|j| {
                    let lat = PI * (0.5 - (j as f64 + 0.5) / map.height() as f64);
                    (j, grid.solid_angle(j), lat.sin(), lat.cos())
                })
                .collect();
            let mut cells = Vec::with_capacity(map.width().div_ceil(block));
            for first in (0..map.width()).step_by(block) {
                let mut energy = [0.0; 3];
                let mut moment = [0.0; 3];
                for &(j, solid_angle, sin_lat, cos_lat) in &rows {
                    let last = (first + block).min(map.width());
                    let row = &map.pixels()[j * map.width()..(j + 1) * map.width()];
                    for (pixel, [sin_lon, cos_lon]) in
                        row[first..last].iter().zip(&columns[first..last])
                    {
                        let mut weight = 0.0;
                        for (sum, x) in energy.iter_mut().zip(pixel) {
                            let e = f64::from(*x) * solid_angle;
                            *sum += e;
                            weight += e;
                        }
                        moment[0] += weight * cos_lat * sin_lon;
                        moment[1] += weight * sin_lat;
                        moment[2] += weight * cos_lat * cos_lon;
                    }
                }
                if energy.iter().any(|e| *e > 0.0) {
                    cells.push(Cell {
                        direction: normalize(moment),
                        energy,
                    });
                }
            }
            cells
        })
        .collect::<Vec<_>>()
        .concat()
}

/// The light set on the grid of [`map_cells`], narrow lights on discs of their own. The energy
/// of each light is right to 3e-5.
pub(super) fn light_cells(set: &LightSet) -> Vec<Cell> {
    let (narrow, wide): (Vec<&SrbfLight>, Vec<&SrbfLight>) = set
        .lights
        .iter()
        .partition(|light| f64::from(light.lambda) < NARROW);
    let grid = LatLong {
        width: COLUMNS,
        height: COLUMNS / 2,
    };
    let mut cells = if wide.is_empty() {
        Vec::new()
    } else {
        (0..grid.height)
            .into_par_iter()
            .map(|j| {
                let solid_angle = grid.solid_angle(j);
                (0..grid.width)
                    .map(|i| {
                        let direction = grid.direction(i as f64 + 0.5, j as f64 + 0.5);
                        let radiance = radiance(wide.iter().copied(), direction);
                        Cell {
                            direction,
                            energy: radiance.map(|l| l * solid_angle),
                        }
                    })
                    .collect::<Vec<_>>()
            })
            .collect::<Vec<_>>()
            .concat()
    };
    cells.extend(narrow.into_iter().flat_map(disc));
    cells
}

/// Radiance of `lights` from the unit vector `direction`, RGB: the sum of
/// `rgb exp(2 (direction . axis - 1) / lambda^2)` (Xu 2011 Eq 1).
pub fn radiance<'a>(
    lights: impl IntoIterator<Item = &'a SrbfLight>,
    direction: [f64; 3],
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for light in lights {
        let lambda = f64::from(light.lambda);
        let axis = light.direction.map(f64::from);
        // The chord form keeps its digits for narrow lights: 2 (cos gamma - 1) = -|d - axis|^2.
        let chord = [0, 1, 2].map(|k| direction[k] - axis[k]);
        let value = (-dot(chord, chord) / (lambda * lambda)).exp();
        for (sum, a) in sum.iter_mut().zip(light.rgb) {
            *sum += f64::from(a) * value;
        }
    }
    sum
}

/// A narrow light as rings of points of equal energy: the radii are the midpoints of equal parts
/// of the light's energy.
fn disc(light: &SrbfLight) -> Vec<Cell> {
    const RINGS: usize = 6;
    const SPOKES: usize = 8;
    let lambda = f64::from(light.lambda);
    let axis = normalize(light.direction.map(f64::from));
    let [a, b] = tangents(axis);
    let share = srbf_solid_angle(lambda) / (RINGS * SPOKES) as f64;
    let energy = light.rgb.map(|x| f64::from(x) * share);
    let sharpness = 2.0 / (lambda * lambda);
    let mut cells = Vec::with_capacity(RINGS * SPOKES);
    for ring in 0..RINGS {
        let u = (ring as f64 + 0.5) / RINGS as f64;
        // Inverse of the energy inside gamma: (1 - exp(k (cos gamma - 1))) / (1 - exp(-2 k)).
        let cos = 1.0 + (1.0 - u * -(-2.0 * sharpness).exp_m1()).ln() / sharpness;
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        for spoke in 0..SPOKES {
            let turn = 2.0 * PI * (spoke as f64 + 0.5 * (ring % 2) as f64) / SPOKES as f64;
            let direction = combine(axis, cos, a, sin * turn.cos(), b, sin * turn.sin());
            cells.push(Cell { direction, energy });
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    fn total(cells: &[Cell]) -> [f64; 3] {
        [0, 1, 2].map(|c| cells.iter().map(|cell| cell.energy[c]).sum())
    }

    #[test]
    fn cells_keep_energy_and_centroid() {
        let (width, height) = (512, 256);
        let pixels = (0..width * height)
            .map(|ix| [(ix % 7) as f32, (ix % 13) as f32 * 0.5, 1.0])
            .collect();
        let map = Map::new(width, height, pixels).unwrap();
        let (coarse, fine) = (map_cells(&map), map_cells_of(&map, 1));
        assert_eq!(coarse.len() * 4, fine.len());
        let energy = map.energy();
        for cells in [coarse, fine] {
            let sum = total(&cells);
            for c in 0..3 {
                assert!((sum[c] / energy[c] - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn lights_of_every_width_keep_their_energy() {
        for lambda in [0.002f32, 0.05, 0.06, 0.061, 0.3, 1.0, 2.5] {
            let light = SrbfLight {
                direction: [0.6, 0.0, 0.8],
                lambda,
                rgb: [1.0, 2.0, 0.5],
            };
            let lights = vec![light];
            let set = LightSet {
                lights,
                ..LightSet::default()
            };
            let sum = total(&light_cells(&set));
            let expected = srbf_solid_angle(f64::from(lambda));
            for (sum, a) in sum.iter().zip(light.rgb) {
                let ratio = sum / (expected * f64::from(a));
                assert!((ratio - 1.0).abs() < 5e-5, "lambda {lambda}: {ratio}");
            }
        }
    }
}
