//! How open the hair is around every voxel, along the axes, which says how much hair there is behind a point. Twin of
//! `find_axis_shares` in `shaders/pass/voxelise.wgsl`.

use glam::Vec3;
use strandlight_scattering::closed_form::{TERM_GLOBAL, TERM_LOCAL};
use strandlight_scattering::wide::LANES;
use strandlight_scene::PreparedScene;
use strandlight_scene::volume::{Grid, SELF_LIFT, extinction};

use super::voxelise::{grid_position, voxel_index};

/// What 1 is in a share.
const ONE: f32 = 65_535.0;

/// Shares of the light that comes through the hair to the voxels along the axes.
#[derive(Clone, Debug)]
pub(super) struct AxisShares {
    grid: Grid,
    /// By voxel, x fastest: of light from +x, +y, +z, -x, -y, -z, unorm16; two numbers are not used.
    shares: Vec<[u16; LANES]>,
}

impl AxisShares {
    /// Of a `volume`, as [`super::voxelise`] answers it. A voxel's own hair counts as far as [`SELF_LIFT`] before its centre.
    pub fn new(grid: &Grid, volume: &[[f32; 8]]) -> AxisShares {
        // Where there is no hair.
        let mut shares = vec![[u16::MAX; LANES]; volume.len()];
        let n = grid.dims.map(|n| n as usize);
        let strides = [1, n[0], n[0] * n[1]];
        let mut depths = Vec::new();
        for axis in 0..3 {
            let (b, c) = (usize::from(axis == 0), 2 - usize::from(axis == 2));
            let direction = Vec3::AXES[axis];
            for column in 0..n[b] * n[c] {
                let first = strides[b] * (column % n[b]) + strides[c] * (column / n[b]);
                let voxels = (0..n[axis]).map(|ix| first + strides[axis] * ix);
                let depth = |ix: usize| grid.h * extinction(&volume[ix], direction)[0];
                depths.clear();
                depths.extend(voxels.clone().map(depth));
                let all: f32 = depths.iter().sum();
                if all <= 0.0 {
                    continue;
                }
                let mut below = 0.0;
                for (voxel, depth) in voxels.zip(&depths) {
                    let above = (all - below - depth).max(0.0);
                    let here = (0.5 - SELF_LIFT) * depth;
                    let pack = |depth: f32| ((-depth).exp() * ONE + 0.5) as u16;
                    shares[voxel][axis] = pack(above + here);
                    shares[voxel][3 + axis] = pack(below + here);
                    below += depth;
                }
            }
        }
        AxisShares {
            grid: *grid,
            shares,
        }
    }

    /// [`AxisShares::new`], if multiple scattering of `scene`, which alone reads them, is drawn.
    pub fn if_drawn(scene: &PreparedScene, grid: &Grid, volume: &[[f32; 8]]) -> Option<AxisShares> {
        (scene.terms() & (TERM_LOCAL | TERM_GLOBAL) != 0).then(|| AxisShares::new(grid, volume))
    }

    /// At a position, of light from +x, +y, +z, -x, -y, -z: trilinear look-up.
    #[inline(always)]
    pub fn at(&self, position: Vec3) -> [f32; 6] {
        let g = grid_position(&self.grid, position);
        let base = g.as_uvec3();
        let f = g - base.as_vec3();
        let first = voxel_index(&self.grid, base.to_array());
        let row = self.grid.dims[0] as usize;
        let slice = row * self.grid.dims[1] as usize;
        let mut sums = [0.0; LANES];
        for (iz, z) in [1.0 - f.z, f.z].into_iter().enumerate() {
            for (iy, y) in [1.0 - f.y, f.y].into_iter().enumerate() {
                for (ix, x) in [1.0 - f.x, f.x].into_iter().enumerate() {
                    let weight = x * y * z;
                    let shares = &self.shares[first + slice * iz + row * iy + ix];
                    for (sum, share) in sums.iter_mut().zip(shares) {
                        *sum += weight * f32::from(*share);
                    }
                }
            }
        }
        [0, 1, 2, 3, 4, 5].map(|ix: usize| sums[ix] * (1.0 / ONE))
    }

    /// Bytes of the shares.
    pub fn bytes(&self) -> u64 {
        size_of_val(&self.shares[..]) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::super::voxelise::even_layer;
    use super::*;

    #[test]
    fn each_axis_has_its_own_hair() {
        // One voxel, of fibres most of which run along z, fewer along y, in a grid of three sides.
        let grid = Grid {
            dims: [5, 6, 7],
            ..even_layer(0).0
        };
        let mut volume = vec![[0.0; 8]; grid.n_voxels()];
        let full = voxel_index(&grid, [2, 3, 4]);
        volume[full] = [4.0, 0.5, 1.0, 2.5, 0.0, 0.0, 0.0, 0.0];
        let found = AxisShares::new(&grid, &volume);
        let passing = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| {
            let [sigma_t, _] = extinction(&volume[full], axis);
            (-sigma_t * grid.h).exp()
        });
        for (axis, passing) in passing.into_iter().enumerate() {
            for (step, at) in [(1, axis + 3), (-1, axis)] {
                let mut beside = [2, 3, 4];
                beside[axis] = (beside[axis] as i32 + step) as u32;
                let shares = found.at(grid.centre(beside));
                for (ix, share) in shares.into_iter().enumerate() {
                    let expected = if ix == at { passing } else { 1.0 };
                    assert!(
                        (share - expected).abs() < 2e-5,
                        "{axis} {step} {ix}: {share}"
                    );
                }
            }
        }
        assert!(passing[0] < passing[1] && passing[1] < passing[2] && passing[2] < 0.5);
    }

    #[test]
    fn a_layer_is_closed_as_deep_as_it_is() {
        // Four voxels of 0.5 cm from the floor up.
        let (grid, volume) = even_layer(4);
        let shares = AxisShares::new(&grid, &volume);
        let [sigma_t, _] = extinction(&volume[0], Vec3::Y);
        let share = |cm: f32| (-sigma_t * cm).exp();
        let lift = SELF_LIFT * grid.h;
        for iy in 0..4 {
            let found = shares.at(grid.centre([1, iy, 1]));
            let above = grid.h * (3 - iy) as f32 + 0.5 * grid.h - lift;
            let below = grid.h * iy as f32 + 0.5 * grid.h - lift;
            // One voxel of the four is on the side of -x and -z, two are on the other.
            let sides = [2.0, 1.0].map(|n| share(n * grid.h + 0.5 * grid.h - lift));
            let expected = [
                sides[0],
                share(above),
                sides[0],
                sides[1],
                share(below),
                sides[1],
            ];
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 2e-5, "{iy}: {found} {expected}");
            }
        }
        // Over it light comes from everywhere but below.
        let over = shares.at(grid.centre([1, 6, 1]));
        assert_eq!(
            over.map(|share| share == 1.0),
            [true, true, true, true, false, true]
        );
        assert!((over[4] - share(4.0 * grid.h)).abs() < 2e-5);
    }
}
