//! Splatting the strands into the shadow volume. Twin of `shaders/pass/voxelise.wgsl`.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::wide::{Level, dispatch};
use strandlight_scene::strands::Strands;
use strandlight_scene::volume::{CHANNELS, Grid};

/// Segments that a thread splats at a time, some milliseconds. Each has a grid of sums of its own.
const CHUNK: usize = 1 << 12;

/// Area density and orientation of every voxel, x fastest: A, Qxx, Qyy, Qzz, Qxy, Qxz, Qyz, 0
/// in 1/cm. A is the sum of length times diameter over h^3, Q the same weighted by u u^T.
///
/// Sums are 64-bit fixed point, so their order does not matter.
pub fn voxelise(strands: &Strands, grid: &Grid) -> Vec<[f32; 8]> {
    let mut voxelising = Voxelising::new(strands, grid);
    while !voxelising.step(strands, grid) {}
    voxelising.finish(grid)
}

/// Most bytes of sums of all threads.
const MAX_SUMS_BYTES: usize = 128 << 20;

/// What [`voxelise`] answers, some segments at a time.
pub(super) struct Voxelising {
    /// By thread.
    sums: Vec<Vec<i64>>,
    n_done: usize,
}

impl Voxelising {
    /// Nothing yet.
    pub fn new(strands: &Strands, grid: &Grid) -> Voxelising {
        let n_chunks = strands.segments.len().div_ceil(CHUNK);
        let n_sums = grid.n_voxels() * CHANNELS as usize;
        let n_that_fit = MAX_SUMS_BYTES / (n_sums * size_of::<i64>());
        let n_threads = rayon::current_num_threads().min(n_chunks).min(n_that_fit);
        Voxelising {
            sums: vec![vec![0; n_sums]; n_threads.max(1)],
            n_done: 0,
        }
    }

    /// Splats the next segments; answers whether all are done.
    pub fn step(&mut self, strands: &Strands, grid: &Grid) -> bool {
        let rest = &strands.segments[self.n_done..];
        let rest = &rest[..rest.len().min(CHUNK * self.sums.len())];
        self.n_done += rest.len();
        self.sums
            .par_iter_mut()
            .zip(rest.par_chunks(CHUNK))
            .for_each(|(sums, segments)| {
                // For the processor's rounding.
                dispatch!(Level::new(), _simd => {
                    for &segment in segments {
                        let first = segment as usize;
                        let [a, b] = [first, first + 1].map(|ix| &strands.points[ix]);
                        splat(grid, sums, a, b);
                    }
                });
            });
        self.n_done == strands.segments.len()
    }

    /// The volume.
    pub fn finish(mut self, grid: &Grid) -> Vec<[f32; 8]> {
        let (first, others) = self.sums.split_at_mut(1);
        let n = CHANNELS as usize;
        let mut volume = vec![[0.0; 8]; grid.n_voxels()];
        volume
            .par_iter_mut()
            .zip(first[0].par_chunks_mut(n))
            .enumerate()
            .with_min_len(1024)
            .for_each(|(ix, (voxel, sums))| {
                for other in others.iter() {
                    for (sum, other) in sums.iter_mut().zip(&other[n * ix..]) {
                        *sum += other;
                    }
                }
                for (density, &sum) in voxel.iter_mut().zip(&*sums) {
                    *density = density_of(sum, grid);
                }
            });
        volume
    }
}

/// Adds one segment in pieces of at most a third of a voxel.
#[inline(always)]
fn splat(grid: &Grid, sums: &mut [i64], a: &[f32; 4], b: &[f32; 4]) {
    let (start, radius_a) = (Vec3::new(a[0], a[1], a[2]), a[3]);
    let along = Vec3::new(b[0], b[1], b[2]) - start;
    let length = along.length();
    if length <= 0.0 {
        return;
    }
    let u = along / length;
    let pieces = ((3.0 * length / grid.h).ceil() as u32).clamp(1, 1024);
    let quanta = (radius_a + b[3]) * length / pieces as f32 * grid.quanta_per_area;
    for piece in 0..pieces {
        let g = grid_position(grid, start + along * ((piece as f32 + 0.5) / pieces as f32));
        let base = g.as_uvec3();
        let f = g - base.as_vec3();
        for corner in 0..8_u32 {
            let offset = [corner & 1, (corner >> 1) & 1, corner >> 2];
            let weight = |axis: usize| {
                if offset[axis] == 1 {
                    f[axis]
                } else {
                    1.0 - f[axis]
                }
            };
            let value = quanta * (weight(0) * weight(1) * weight(2));
            let voxel = voxel_index(
                grid,
                [base.x + offset[0], base.y + offset[1], base.z + offset[2]],
            );
            let cell = CHANNELS as usize * voxel;
            let shares = [
                value,
                value * (u.x * u.x),
                value * (u.y * u.y),
                value * (u.z * u.z),
                value * (u.x * u.y),
                value * (u.x * u.z),
                value * (u.y * u.z),
            ];
            for (sum, share) in sums[cell..cell + 7].iter_mut().zip(shares) {
                // The shader rounds half to even.
                *sum += i64::from(share.round_ties_even() as i32);
            }
        }
    }
}

/// A sum as the shader converts it: the two words of its magnitude one by one.
fn density_of(sum: i64, grid: &Grid) -> f32 {
    let magnitude = sum.unsigned_abs();
    let value = (magnitude >> 32) as f32 * 4_294_967_296.0 + (magnitude as u32) as f32;
    value * grid.density_per_quantum * if sum < 0 { -1.0 } else { 1.0 }
}

/// Position in voxels from the centre of voxel (0, 0, 0), kept where eight neighbours exist.
#[inline(always)]
pub(super) fn grid_position(grid: &Grid, position: Vec3) -> Vec3 {
    let g = (position - Vec3::from(grid.origin)) / grid.h - 0.5;
    let high = Vec3::new(
        grid.dims[0] as f32,
        grid.dims[1] as f32,
        grid.dims[2] as f32,
    ) - 1.001;
    g.clamp(Vec3::ZERO, high)
}

/// Index of a voxel; x varies fastest.
#[inline(always)]
pub(super) fn voxel_index(grid: &Grid, [x, y, z]: [u32; 3]) -> usize {
    (x + grid.dims[0] * (y + grid.dims[1] * z)) as usize
}

/// For tests: voxels of 0.5 cm from 0, four by eight by four, the lowest `n_rows` of which along y hold hair that is as
/// dense in all directions and blocks sqrt(6) per cm.
#[cfg(test)]
pub(super) fn even_layer(n_rows: usize) -> (Grid, Vec<[f32; 8]>) {
    let grid = Grid {
        origin: [0.0; 3],
        h: 0.5,
        dims: [4, 8, 4],
        ..bytemuck::Zeroable::zeroed()
    };
    let hair = [3.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0];
    let in_layer = |ix: usize| ix / 4 % 8 < n_rows;
    let voxel = |ix| if in_layer(ix) { hair } else { [0.0; 8] };
    let volume = (0..grid.n_voxels()).map(voxel).collect();
    (grid, volume)
}
