//! Records of each light at every voxel. Twin of `shaders/pass/transmittance.wgsl`.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::{
    PackedRecord, ShadowRecord, add_to_record, pack_record, pass_through, unpack_record,
};
use strandlight_scattering::wide::{Level, dispatch};
use strandlight_scene::beside::{Beside, Places};
use strandlight_scene::scene::LightRecord;
use strandlight_scene::volume::Grid;

use super::voxelise::voxel_index;

/// In front of the first slice and beside the others all light is there.
const OPEN: [f32; 4] = [1.0, 1.0, 1.0, 0.0];

/// Records of a batch of lights, wherever they were found.
pub enum Shadows {
    /// `[light][voxel]`, to be interpolated; what [`transmittance`] answers.
    Volume(Vec<PackedRecord>),
    /// `[light][point]`, from [`ShadowSource::Points`](crate::ShadowSource::Points).
    Points(Vec<PackedRecord>),
}

impl Shadows {
    /// Bytes of the records.
    pub fn bytes(&self) -> u64 {
        let (Shadows::Volume(records) | Shadows::Points(records)) = self;
        size_of_val(&records[..]) as u64
    }
}

/// Packed records, `[light][voxel]`: means over each light's directions in `sweeps`; zeros for
/// black lights, which are never looked up. `volume` is what [`super::voxelise`] answers.
pub fn transmittance(
    grid: &Grid,
    volume: &[[f32; 8]],
    lights: &[LightRecord],
    sweeps: &[[f32; 4]],
) -> Vec<PackedRecord> {
    let beside = (&Beside::none(), &Places::default());
    transmittance_beside(grid, volume, lights, sweeps, beside)
}

/// [`transmittance`] with proxies that block light, and [`Beside::places_of_voxels`].
pub fn transmittance_beside(
    grid: &Grid,
    volume: &[[f32; 8]],
    lights: &[LightRecord],
    sweeps: &[[f32; 4]],
    beside: (&Beside, &Places),
) -> Vec<PackedRecord> {
    let n_voxels = grid.n_voxels();
    let mut result = vec![[0; 2]; n_voxels * lights.len()];
    result
        .par_chunks_mut(n_voxels)
        .zip(lights)
        .filter(|(_, light)| light.power > 0.0)
        .for_each(|(out, light)| {
            let first = light.first_sweep as usize;
            let directions = &sweeps[first..first + light.n_sweeps as usize];
            // For the processor's rounding.
            dispatch!(Level::new(), _simd => {
                for (k, &[x, y, z, _]) in directions.iter().enumerate() {
                    let turn = [k, directions.len()].map(|n| n as f32);
                    sweep((grid, volume), beside, [x, y, z], turn, out);
                }
            });
        });
    result
}

/// Marches slices from the light's side along the axis most along `d`, direction k of n, and adds
/// it to the records in `out`.
#[inline(always)]
fn sweep(
    (grid, volume): (&Grid, &[[f32; 8]]),
    (beside, places): (&Beside, &Places),
    d: [f32; 3],
    [k, n_directions]: [f32; 2],
    out: &mut [PackedRecord],
) {
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
    let is_beside = !beside.is_empty();
    let towards = beside.towards(Vec3::from(d));
    let mut leaving = vec![OPEN; (n_b * n_c) as usize];
    let mut next = leaving.clone();
    for slice_ix in 0..n {
        let slice = if d[axis] > 0.0 {
            n - 1 - slice_ix
        } else {
            slice_ix
        };
        let at = |b: i32, c: i32| {
            if b < 0 || c < 0 || b >= n_b as i32 || c >= n_c as i32 {
                OPEN
            } else {
                leaving[(b + n_b as i32 * c) as usize]
            }
        };
        for c in 0..n_c {
            for b in 0..n_b {
                let mut entering = OPEN;
                if slice_ix > 0 {
                    let (x, y) = (b as f32 + shift_b, c as f32 + shift_c);
                    let (x0, y0) = (x.floor(), y.floor());
                    let (fx, fy) = (x - x0, y - y0);
                    let (ix, iy) = (x0 as i32, y0 as i32);
                    let row_0 = mix_all(at(ix, iy), at(ix + 1, iy), fx);
                    let row_1 = mix_all(at(ix, iy + 1), at(ix + 1, iy + 1), fx);
                    entering = mix_all(row_0, row_1, fy);
                }
                let mut voxel = [0; 3];
                voxel[axis] = slice;
                voxel[axis_b] = b;
                voxel[axis_c] = c;
                let index = voxel_index(grid, voxel);
                let [a, xx, yy, zz, xy, xz, yz, _] = volume[index];
                // sigma_t = sqrt(A (A - d^T Q d)), and d^T Q d / A is the mean of sin^2 of the
                // inclination.
                let along = d[0] * d[0] * xx
                    + d[1] * d[1] * yy
                    + d[2] * d[2] * zz
                    + 2.0 * (d[0] * d[1] * xy + d[0] * d[2] * xz + d[1] * d[2] * yz);
                let sigma_t = (a * (a - along)).max(0.0).sqrt();
                let sin_2 = (along / a.max(1e-20)).clamp(0.0, 1.0);
                // Half a step from slice to slice before the voxel's centre and half behind it.
                let depth = 0.5 * grid.h * slope * sigma_t;
                let here = pass_through(entering, depth, sin_2);
                next[(b + n_b * c) as usize] = pass_through(here, depth, sin_2);
                let sum = if k > 0.0 {
                    unpack_record(&out[index])
                } else {
                    ShadowRecord::default()
                };
                let mut n_before = k;
                if is_beside {
                    if towards.is_blocked(places, index, grid.centre(voxel)) {
                        out[index] = pack_record(&sum);
                        continue;
                    }
                    // Directions behind proxies say nothing of the hair's inclination.
                    if sum.shares[2] <= 0.0 {
                        n_before = 0.0;
                    }
                }
                out[index] = pack_record(&add_to_record(&sum, here, n_before, n_directions));
            }
        }
        std::mem::swap(&mut leaving, &mut next);
    }
}

/// As WGSL's `mix`.
pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

/// [`mix`] of vectors.
pub(super) fn mix_all(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    [0, 1, 2, 3].map(|ix| mix(a[ix], b[ix], t))
}
