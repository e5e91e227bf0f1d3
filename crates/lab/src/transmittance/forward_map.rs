//! Forward scattering maps (Zinke 2008 section 4.1.2): rays from the light through the strands, and
//! in every voxel the mean over the rays that meet it.
//!
//! One direction stands for the light, as its lights are points or directions.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::ShadowRecord;
use strandlight_scene::strands::Strands;
use strandlight_scene::volume::Grid;

use super::ray::{shares_of_count, sin_theta};
use strandlight_reference::rays::{Rays, Start};

/// Distance of rays, and of samples along them, in voxels.
const SPACING: f32 = 0.5;

/// Shares, crossings and their sum of sin^2 in every voxel.
pub struct ForwardMap {
    /// `[voxel]`, x fastest: shares at a record's exponents, crossings, their sum of sin^2.
    voxels: Vec<[f32; 5]>,
}

impl ForwardMap {
    /// Shoots rays along `direction` (towards the light) through `grid`.
    pub fn new(strands: &Strands, rays: &Rays, grid: &Grid, direction: [f32; 3]) -> ForwardMap {
        let towards = Vec3::from(direction);
        let (x, y) = towards.any_orthonormal_pair();
        let dims = Vec3::from(grid.dims.map(|n| n as f32));
        let centre = Vec3::from(grid.origin) + 0.5 * grid.h * dims;
        let reach = 0.5 * grid.h * dims.length();
        let step = SPACING * grid.h;
        let n = (2.0 * reach / step).ceil() as i32;
        let place = |ix: i32| (ix as f32 + 0.5) * step - reach;
        // Samples of a row of rays; rows are added in order.
        let row = |j: i32| {
            let mut samples: Vec<(usize, [f32; 5])> = Vec::new();
            let mut found: Vec<(f32, f32)> = Vec::new();
            for i in 0..n {
                let from = centre + place(i) * x + place(j) * y + reach * towards;
                found.clear();
                rays.crossings(&Start::camera(from), -towards, |crossing| {
                    let sin = sin_theta(strands, crossing.segment, direction);
                    found.push((crossing.t, sin * sin));
                });
                found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
                let (mut crossed, mut sin_2) = (0, 0.0);
                for k in 0..n {
                    let t = (k as f32 + 0.5) * step;
                    while found.get(crossed).is_some_and(|crossing| crossing.0 < t) {
                        sin_2 += found[crossed].1;
                        crossed += 1;
                    }
                    if let Some(voxel) = voxel_of(grid, from - t * towards) {
                        let [a, b, c] = shares_of_count(crossed as i32).map(|x| x as f32);
                        samples.push((voxel, [a, b, c, crossed as f32, sin_2]));
                    }
                }
            }
            samples
        };
        let rows: Vec<_> = (0..n).into_par_iter().map(row).collect();
        let mut voxels = vec![[0.0; 5]; grid.n_voxels()];
        let mut counts = vec![0.0_f32; grid.n_voxels()];
        for (voxel, values) in rows.into_iter().flatten() {
            counts[voxel] += 1.0;
            for (sum, value) in voxels[voxel].iter_mut().zip(values) {
                *sum += value;
            }
        }
        for (voxel, count) in voxels.iter_mut().zip(counts) {
            if count == 0.0 {
                // Met by no ray; with two along a voxel's side there is none.
                *voxel = [1.0, 1.0, 1.0, 0.0, 0.0];
            } else {
                *voxel = voxel.map(|sum| sum / count);
            }
        }
        ForwardMap { voxels }
    }

    /// Trilinear look-up.
    pub fn record(&self, grid: &Grid, [x, y, z, _]: [f32; 4]) -> ShadowRecord {
        let g = (Vec3::new(x, y, z) - Vec3::from(grid.origin)) / grid.h - 0.5;
        let high = Vec3::from(grid.dims.map(|n| n as f32)) - 1.001;
        let g = g.clamp(Vec3::ZERO, high);
        let base = g.as_uvec3();
        let f = g - base.as_vec3();
        let mut sum = [0.0; 5];
        for corner in 0..8 {
            let offset = [corner & 1, (corner >> 1) & 1, corner >> 2];
            let mut weight = 1.0;
            let mut index = [0; 3];
            for axis in 0..3 {
                weight *= if offset[axis] == 1 {
                    f[axis]
                } else {
                    1.0 - f[axis]
                };
                index[axis] = base[axis] + offset[axis];
            }
            for (sum, value) in sum.iter_mut().zip(self.voxels[flat(grid, index)]) {
                *sum += weight * value;
            }
        }
        let [a, b, c, crossed, sin_2] = sum;
        ShadowRecord {
            shares: [a, b, c],
            sin_theta: (sin_2 / crossed.max(1e-6)).clamp(0.0, 1.0).sqrt(),
        }
    }
}

/// Index of a voxel; x varies fastest.
fn flat(grid: &Grid, [x, y, z]: [u32; 3]) -> usize {
    (x + grid.dims[0] * (y + grid.dims[1] * z)) as usize
}

/// The voxel around `position`.
fn voxel_of(grid: &Grid, position: Vec3) -> Option<usize> {
    let g = (position - Vec3::from(grid.origin)) / grid.h;
    let inside = (0..3).all(|axis| g[axis] >= 0.0 && g[axis] < grid.dims[axis] as f32);
    inside.then(|| flat(grid, g.as_uvec3().to_array()))
}
