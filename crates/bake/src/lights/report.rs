//! How far a light set is from its map.

use std::borrow::Cow;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use strandlight_formats::{FitReport, LightSet, SrbfLight};

use strandlight_scene::progress::Progress;
use strandlight_scene::volume::power;

use super::cells::{COLUMNS, Cell, NARROW, light_cells, map_cells, radiance};
use super::response::{FibreJudge, Response, relative_rms, squares};
use super::sphere::{dot, fibonacci, normalize};
use strandlight_images::{LatLong, Map};

/// Normals of the irradiance error.
const NORMALS: usize = 256;

/// Columns of the grid on which wide lights are evaluated for maps of at least twice as many:
/// 0.35 degrees, a tenth of the bandwidth of the narrowest of them.
const LATTICE_COLUMNS: usize = 1024;

/// Bandwidths within which a narrow light is added to a pixel: exp(-36) of it is left out.
const REACH: f64 = 6.0;

/// Compares a light set with a map; the same numbers for any number of threads.
///
/// - `rel_l2`: relative L2 difference of radiance over the sphere. Dominated by what no hair
///   resolves (the exact disc of the sun, texture): 0.1..1 is usual and says little.
/// - `energy_ratio`: energy of the lights over that of the map; 1 in a channel without light.
/// - `irradiance_error`: relative RMSE of irradiance over 256 normals.
/// - `fibre_error`: relative RMSE of what fibres make of them, defined in the module `response`.
///
/// RMSEs are over the three channels together. Sums over the map are made on cells of at least
/// 1.4 degrees with exact energy and centroid, which changes the fibre error of the sample maps by
/// at most 0.03 percent points against summing every pixel. `rel_l2` takes every pixel; for maps of
/// 2048 pixels and more across it interpolates the lights, but for narrow ones, between points 0.35
/// degrees apart, which changes it by at most 5e-4 of itself on the sample maps (enlarged).
pub fn evaluate(lights: &LightSet, map: &Map) -> FitReport {
    evaluate_with_progress(lights, map, &Progress::silent())
}

/// Steps of progress that comparing a light set with a map makes.
pub const EVALUATION_STEPS: u64 = 100;

/// As [`evaluate`]; reports [`EVALUATION_STEPS`] steps.
pub fn evaluate_with_progress(lights: &LightSet, map: &Map, progress: &Progress) -> FitReport {
    Judge::new(map, &Response::default()).report(lights, progress)
}

/// Reports how many rows of a map are done, in any order: they are most of the time.
pub(super) struct RowProgress<'a> {
    progress: &'a Progress,
    n_rows: u64,
    n_done: AtomicU64,
}

impl<'a> RowProgress<'a> {
    pub fn of(map: &Map, progress: &'a Progress) -> RowProgress<'a> {
        RowProgress {
            progress,
            n_rows: map.height() as u64,
            n_done: AtomicU64::new(0),
        }
    }

    pub fn advance(&self) {
        let n_done = self.n_done.fetch_add(1, Ordering::Relaxed) + 1;
        self.progress.reach(EVALUATION_STEPS * n_done / self.n_rows);
    }
}

/// A map made ready to be compared with any number of light sets, by the hair of one response.
pub(super) struct Judge<'a> {
    map: Cow<'a, Map>,
    energy: [f64; 3],
    fibres: FibreJudge,
    normals: Vec<[f64; 3]>,
    /// Irradiance from the map on each of `normals`.
    irradiance: Vec<[f64; 3]>,
}

/// The errors by which sets of one map are compared; see [`evaluate`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Errors {
    pub fibre: f64,
    pub irradiance: f64,
}

impl<'a> Judge<'a> {
    pub fn new(map: &'a Map, response: &Response) -> Judge<'a> {
        let map = map.subdivided(COLUMNS);
        let cells = map_cells(&map);
        let normals: Vec<[f64; 3]> = (0..NORMALS).map(|ix| fibonacci(ix, NORMALS, 0.0)).collect();
        Judge {
            energy: energy(&cells),
            fibres: FibreJudge::new(response, &cells),
            irradiance: irradiance(&cells, &normals),
            normals,
            map,
        }
    }

    /// All figures of a set.
    fn report(&self, lights: &LightSet, progress: &Progress) -> FitReport {
        let figures = self.figures(lights, None);
        FitReport {
            rel_l2: rel_l2(lights, &self.map, progress),
            ..figures
        }
    }

    /// The figures of a set, and a map beside it, but for `rel_l2`.
    pub fn figures(&self, lights: &LightSet, beside: Option<&Map>) -> FitReport {
        let mut cells = light_cells(lights);
        // Of lights in closed form: cells of those between narrow and wide are coarse near the poles.
        let mut set = [0.0; 3];
        for light in &lights.lights {
            set = add(set, power(light));
        }
        if let Some(map) = beside {
            let beside = map_cells(&map.subdivided(COLUMNS));
            set = add(set, energy(&beside));
            cells.extend(beside);
        }
        let energy_ratio = [0, 1, 2].map(|c| {
            if set[c] == self.energy[c] {
                1.0
            } else {
                set[c] / self.energy[c]
            }
        });
        let errors = self.errors_of(&cells);
        FitReport {
            rel_l2: 0.0,
            energy_ratio,
            irradiance_error: errors.irradiance,
            fibre_error: errors.fibre,
        }
    }

    /// Those figures of a set that cost little.
    pub fn errors(&self, lights: &LightSet) -> Errors {
        self.errors_of(&light_cells(lights))
    }

    fn errors_of(&self, cells: &[Cell]) -> Errors {
        let set = irradiance(cells, &self.normals);
        let sums: Vec<[f64; 2]> = set
            .iter()
            .zip(&self.irradiance)
            .map(|(set, map)| squares(*set, *map))
            .collect();
        Errors {
            fibre: self.fibres.error(cells),
            irradiance: relative_rms(&sums),
        }
    }
}

fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn energy(cells: &[Cell]) -> [f64; 3] {
    [0, 1, 2].map(|c| cells.iter().map(|cell| cell.energy[c]).sum())
}

/// Irradiance on a surface of each normal.
fn irradiance(cells: &[Cell], normals: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let on = |normal: &[f64; 3]| {
        let mut sum = [0.0; 3];
        for cell in cells {
            let cos = dot(cell.direction, *normal).max(0.0);
            for (sum, e) in sum.iter_mut().zip(cell.energy) {
                *sum += e * cos;
            }
        }
        sum
    };
    normals.par_iter().map(on).collect()
}

fn rel_l2(set: &LightSet, map: &Map, progress: &Progress) -> f64 {
    let grid = map.grid();
    let progress = RowProgress::of(map, progress);
    if grid.width < 2 * LATTICE_COLUMNS {
        let row = |j: usize| {
            let directions =
                (0..grid.width).map(move |i| grid.direction(i as f64 + 0.5, j as f64 + 0.5));
            directions
                .map(|direction| radiance(&set.lights, direction))
                .collect()
        };
        rel_l2_of_rows(map, row, &progress)
    } else {
        let lattice = Lattice::new(set, grid);
        rel_l2_of_rows(map, |j| lattice.row(j), &progress)
    }
}

/// The L2 difference of the map and a light set whose radiance at the pixels of a row `row` tells.
fn rel_l2_of_rows(
    map: &Map,
    row: impl Fn(usize) -> Vec<[f64; 3]> + Sync,
    progress: &RowProgress<'_>,
) -> f64 {
    let grid = map.grid();
    let rows: Vec<[f64; 2]> = (0..grid.height)
        .into_par_iter()
        .map(|j| {
            let solid_angle = grid.solid_angle(j);
            let pixels = &map.pixels()[j * grid.width..(j + 1) * grid.width];
            let mut sums = [0.0; 2];
            for (set, pixel) in row(j).iter().zip(pixels) {
                for c in 0..3 {
                    let reference = f64::from(pixel[c]);
                    sums[0] += (set[c] - reference).powi(2) * solid_angle;
                    sums[1] += reference * reference * solid_angle;
                }
            }
            progress.advance();
            sums
        })
        .collect();
    relative_rms(&rows)
}

/// A light set at the pixels of a large map: wide lights interpolated between the points of a
/// coarser grid, narrow ones exact.
///
/// The interpolation of a light of bandwidth lambda is off by at most `(h / lambda)^2 / 2` of its
/// amplitude at a spacing of h: 0.5 % for the narrowest wide ones.
struct Lattice<'a> {
    grid: LatLong,
    /// Radiance of the wide lights at latitude pi (0.5 - row / LATTICE_ROWS), longitude
    /// pi - 2 pi column / LATTICE_COLUMNS; the poles and both sides of the seam are in it.
    wide: Vec<[f64; 3]>,
    narrow: Vec<&'a SrbfLight>,
    /// sin and cos of the longitude of each column of `grid`.
    longitudes: Vec<[f64; 2]>,
}

impl<'a> Lattice<'a> {
    const ROWS: usize = LATTICE_COLUMNS / 2;

    fn new(set: &'a LightSet, grid: LatLong) -> Self {
        let (narrow, wide): (Vec<&SrbfLight>, Vec<&SrbfLight>) = set
            .lights
            .iter()
            .partition(|light| f64::from(light.lambda) < NARROW);
        let nodes = LatLong {
            width: LATTICE_COLUMNS,
            height: Lattice::ROWS,
        };
        let wide = (0..=nodes.height)
            .into_par_iter()
            .map(|j| {
                let direction = |i| nodes.direction(i as f64, j as f64);
                (0..=nodes.width)
                    .map(|i| radiance(wide.iter().copied(), direction(i)))
                    .collect::<Vec<_>>()
            })
            .collect::<Vec<_>>()
            .concat();
        let longitudes = (0..grid.width)
            .map(|i| {
                let lon = PI - 2.0 * PI * (i as f64 + 0.5) / grid.width as f64;
                [lon.sin(), lon.cos()]
            })
            .collect();
        Lattice {
            grid,
            wide,
            narrow,
            longitudes,
        }
    }

    /// Radiance at the centres of the pixels of row `j`.
    fn row(&self, j: usize) -> Vec<[f64; 3]> {
        let mix = |a: [f64; 3], b: [f64; 3], f: f64| [0, 1, 2].map(|c| a[c] + f * (b[c] - a[c]));
        // Place between two nodes, of `count` intervals.
        let place = |x: f64, count: usize| {
            let ix = (x as usize).min(count - 1);
            (ix, x - ix as f64)
        };
        let scale = Lattice::ROWS as f64 / self.grid.height as f64;
        let (row, f) = place((j as f64 + 0.5) * scale, Lattice::ROWS);
        let nodes = LATTICE_COLUMNS + 1;
        let (above, below) = self.wide[row * nodes..(row + 2) * nodes].split_at(nodes);
        let nodes: Vec<[f64; 3]> = above
            .iter()
            .zip(below)
            .map(|(above, below)| mix(*above, *below, f))
            .collect();
        let scale = LATTICE_COLUMNS as f64 / self.grid.width as f64;
        let mut out: Vec<[f64; 3]> = (0..self.grid.width)
            .map(|i| {
                let (column, f) = place((i as f64 + 0.5) * scale, LATTICE_COLUMNS);
                mix(nodes[column], nodes[column + 1], f)
            })
            .collect();
        let lat = PI * (0.5 - (j as f64 + 0.5) / self.grid.height as f64);
        let (sin_lat, cos_lat) = lat.sin_cos();
        for light in &self.narrow {
            let [x, y, z] = normalize(light.direction.map(f64::from));
            let lambda = f64::from(light.lambda);
            // exp(-REACH^2) of the amplitude is left out.
            let reach = REACH * lambda;
            if (lat - y.clamp(-1.0, 1.0).asin()).abs() > 1.01 * reach {
                continue;
            }
            let nearest = 1.0 - 0.5 * reach * reach;
            for (out, [sin_lon, cos_lon]) in out.iter_mut().zip(&self.longitudes) {
                let cos = sin_lat * y + cos_lat * (sin_lon * x + cos_lon * z);
                if cos > nearest {
                    let direction = [cos_lat * sin_lon, sin_lat, cos_lat * cos_lon];
                    let own = radiance([*light], direction);
                    for c in 0..3 {
                        out[c] += own[c];
                    }
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(direction: [f64; 3], lambda: f32, rgb: [f32; 3]) -> SrbfLight {
        SrbfLight {
            direction: normalize(direction).map(|x| x as f32),
            lambda,
            rgb,
        }
    }

    /// Lights of every width, about the poles and the seam too.
    fn lights() -> LightSet {
        let lights = vec![
            light([0.2, 1.0, 0.1], 0.9, [1.0, 1.2, 1.5]),
            light([0.0, -1.0, 0.0], 0.061, [3.0, 2.0, 4.0]),
            light([0.0, 1.0, 0.0], 0.02, [30.0, 20.0, 40.0]),
            light([0.01, 0.1, -1.0], 0.07, [5.0, 5.0, 2.0]),
            light([-0.001, -0.3, -1.0], 0.004, [4000.0, 3000.0, 900.0]),
            light([0.7, 0.2, 0.4], 0.1, [2.0, 4.0, 6.0]),
        ];
        LightSet {
            lights,
            ..LightSet::default()
        }
    }

    /// The set itself, a tenth darker where x > 0 and rippled everywhere.
    fn map_like(set: &LightSet, width: usize) -> Map {
        let grid = LatLong {
            width,
            height: width / 2,
        };
        let pixels = (0..width * width / 2).into_par_iter().map(|ix| {
            let (i, j) = (ix % width, ix / width);
            let direction = grid.direction(i as f64 + 0.5, j as f64 + 0.5);
            let gain = if direction[0] > 0.0 { 0.9 } else { 1.0 };
            let ripple = 1.0 + 0.03 * (40.0 * direction[1]).sin();
            radiance(&set.lights, direction).map(|x| (gain * ripple * x) as f32)
        });
        Map::new(width, width / 2, pixels.collect()).unwrap()
    }

    fn rel_l2_in_silence(set: &LightSet, map: &Map) -> f64 {
        rel_l2(set, map, &Progress::silent())
    }

    fn rel_l2_of_every_pixel(set: &LightSet, map: &Map) -> f64 {
        let grid = map.grid();
        let row = |j: usize| {
            (0..grid.width)
                .map(|i| {
                    let direction = grid.direction(i as f64 + 0.5, j as f64 + 0.5);
                    radiance(&set.lights, direction)
                })
                .collect()
        };
        let silent = Progress::silent();
        rel_l2_of_rows(map, row, &RowProgress::of(map, &silent))
    }

    #[test]
    fn large_maps_are_judged_as_by_every_pixel() {
        let set = lights();
        let map = map_like(&set, 2 * LATTICE_COLUMNS);
        let (fast, exact) = (
            rel_l2_in_silence(&set, &map),
            rel_l2_of_every_pixel(&set, &map),
        );
        assert!((0.02..0.2).contains(&exact), "{exact}");
        assert!((fast / exact - 1.0).abs() < 2e-3, "{fast} {exact}");
        // Every row, so that errors in a few cannot hide: the poles, the seam, narrow lights.
        let grid = map.grid();
        let lattice = Lattice::new(&set, grid);
        let mut compared = 0;
        for j in (0..grid.height).step_by(31).chain([grid.height - 1]) {
            for (i, found) in lattice.row(j).iter().enumerate() {
                let direction = grid.direction(i as f64 + 0.5, j as f64 + 0.5);
                let exact = radiance(&set.lights, direction);
                for c in 0..3 {
                    let off = (found[c] - exact[c]).abs();
                    assert!(
                        off < 0.006 * 4.0,
                        "({i}, {j}) {c}: {} {}",
                        found[c],
                        exact[c]
                    );
                }
                compared += 1;
            }
        }
        assert!(compared > 60_000);
    }

    #[test]
    fn slow_large_maps_give_the_same_figures_on_any_number_of_threads() {
        let set = lights();
        let map = map_like(&set, 2 * LATTICE_COLUMNS);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap().install(|| evaluate(&set, &map))
        };
        let one = on(1);
        assert_eq!(one, on(2));
        assert_eq!(one, on(3));
    }

    /// What the interpolation changes on real maps, enlarged to where it is used.
    #[test]
    #[ignore = "takes minutes; measures the figure that `evaluate` documents"]
    fn interpolation_on_sample_maps() {
        use crate::lights::{FitOptions, fit};
        let folder =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/env");
        let Ok(files) = std::fs::read_dir(folder) else {
            return;
        };
        let mut worst = 0.0f64;
        for path in files
            .flatten()
            .map(|file| file.path())
            .filter(|path| path.is_file())
        {
            let map = Map::read(&path).unwrap();
            let fitted = fit(&map, FitOptions::default(), &Progress::silent()).unwrap();
            let map = map.subdivided(2 * LATTICE_COLUMNS);
            let set = &fitted.lights;
            let (fast, exact) = (
                rel_l2_in_silence(set, &map),
                rel_l2_of_every_pixel(set, &map),
            );
            worst = worst.max((fast / exact - 1.0).abs());
            println!(
                "{}: {fast} {exact}, {:e}",
                path.display(),
                fast / exact - 1.0
            );
        }
        println!("worst {worst:e}");
        assert!(worst < 0.01);
    }
}
