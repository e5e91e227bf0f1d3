//! Unblocked share of each light at every voxel. Twin of `shaders/pass/transmittance.wgsl`.

use rayon::prelude::*;
use strandlight_runtime::scene::LightRecord;
use strandlight_runtime::volume::Grid;

use super::voxelise::voxel_index;

/// `[light][voxel]`, 0..=1: the mean over each light's directions in `sweeps` of the light that
/// arrives unblocked. `volume` is what [`super::voxelise`] answers.
pub fn transmittance(
    grid: &Grid,
    volume: &[[f32; 8]],
    lights: &[LightRecord],
    sweeps: &[[f32; 4]],
) -> Vec<f32> {
    let n_voxels = grid.n_voxels();
    let mut result = vec![0.0; n_voxels * lights.len()];
    result
        .par_chunks_mut(n_voxels)
        .zip(lights)
        .for_each(|(out, light)| {
            let first = light.first_sweep as usize;
            let directions = &sweeps[first..first + light.n_sweeps as usize];
            let weight = 1.0 / light.n_sweeps as f32;
            for &[x, y, z, _] in directions {
                sweep(grid, volume, [x, y, z], weight, out);
            }
        });
    result
}

/// Marches slices from the light's side along the axis most along `d` and adds `weight` times
/// the transmittance at every voxel to `out`.
fn sweep(grid: &Grid, volume: &[[f32; 8]], d: [f32; 3], weight: f32, out: &mut [f32]) {
    let mut axis = 0;
    if d[1].abs() > d[axis].abs() {
        axis = 1;
    }
    if d[2].abs() > d[axis].abs() {
        axis = 2;
    }
    let (axis_b, axis_c) = ((axis + 1) % 3, (axis + 2) % 3);
    let n = grid.dims[axis];
    let (n_b, n_c) = (grid.dims[axis_b], grid.dims[axis_c]);
    let slope = 1.0 / d[axis].abs();
    let (shift_b, shift_c) = (d[axis_b] * slope, d[axis_c] * slope);
    // Half a step from slice to slice.
    let half_step = 0.5 * grid.h * slope;
    let mut leaving = vec![1.0_f32; (n_b * n_c) as usize];
    let mut next = leaving.clone();
    for slice_ix in 0..n {
        let slice = if d[axis] > 0.0 {
            n - 1 - slice_ix
        } else {
            slice_ix
        };
        let at = |b: i32, c: i32| {
            if b < 0 || c < 0 || b >= n_b as i32 || c >= n_c as i32 {
                1.0
            } else {
                leaving[(b + n_b as i32 * c) as usize]
            }
        };
        for c in 0..n_c {
            for b in 0..n_b {
                let mut entering = 1.0;
                if slice_ix > 0 {
                    let (x, y) = (b as f32 + shift_b, c as f32 + shift_c);
                    let (x0, y0) = (x.floor(), y.floor());
                    let (fx, fy) = (x - x0, y - y0);
                    let (ix, iy) = (x0 as i32, y0 as i32);
                    let row_0 = mix(at(ix, iy), at(ix + 1, iy), fx);
                    let row_1 = mix(at(ix, iy + 1), at(ix + 1, iy + 1), fx);
                    entering = mix(row_0, row_1, fy);
                }
                let mut voxel = [0; 3];
                voxel[axis] = slice;
                voxel[axis_b] = b;
                voxel[axis_c] = c;
                let index = voxel_index(grid, voxel);
                let [a, xx, yy, zz, xy, xz, yz, _] = volume[index];
                // sigma_t = sqrt(A (A - d^T Q d))
                let along = d[0] * d[0] * xx
                    + d[1] * d[1] * yy
                    + d[2] * d[2] * zz
                    + 2.0 * (d[0] * d[1] * xy + d[0] * d[2] * xz + d[1] * d[2] * yz);
                let sigma_t = (a * (a - along)).max(0.0).sqrt();
                let half_pass = (-half_step * sigma_t).exp();
                let here = entering * half_pass;
                next[(b + n_b * c) as usize] = here * half_pass;
                out[index] += weight * here;
            }
        }
        std::mem::swap(&mut leaving, &mut next);
    }
}

/// As WGSL's `mix`.
pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}
