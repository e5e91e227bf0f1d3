//! How open the hair is around every voxel, along the axes: what hair behind a point can send back of a light. Twin of
//! `axis_shares` in `shaders/pass/voxelise.wgsl`.

use glam::Vec3;
use strandlight_scattering::closed_form::TERM_LOCAL;
use strandlight_scattering::wide::LANES;
use strandlight_scene::PreparedScene;
use strandlight_scene::volume::{Grid, SELF_LIFT};

use super::voxelise::{grid_position, voxel_index};

/// What 1 is in a share.
const ONE: f32 = 65_535.0;

/// Shares of the light that comes through the hair to the voxels along the axes.
#[derive(Clone, Debug)]
pub(super) struct AxisShares {
    grid: Grid,
    /// By voxel, x fastest: of light from +x, +y, +z, -x, -y, -z, unorm16, and two zeros.
    shares: Vec<[u16; LANES]>,
}

/// What of the light along an axis a voxel leaves: up to where shares are looked up, and behind it.
#[derive(Clone, Copy)]
struct Left {
    here: f32,
    behind: f32,
}

/// What a voxel of `h` cm leaves along an axis of light that half of it, but for what lies about the point itself, is in front of.
fn left(voxel: &[f32; 8], axis: usize, h: f32) -> Left {
    let [area, along] = [voxel[0], voxel[1 + axis]];
    if area <= 0.0 {
        return Left {
            here: 1.0,
            behind: 1.0,
        };
    }
    // `extinction` along an axis.
    let depth = h * (area * (area - along)).max(0.0).sqrt();
    Left {
        here: (-(0.5 - SELF_LIFT) * depth).exp(),
        behind: (-depth).exp(),
    }
}

impl AxisShares {
    /// Of a `volume`, as [`super::voxelise`] answers it.
    pub fn new(grid: &Grid, volume: &[[f32; 8]]) -> AxisShares {
        let mut shares = vec![[0; LANES]; volume.len()];
        let [n_x, n_y, n_z] = grid.dims.map(|n| n as usize);
        let n_slice = n_x * n_y;
        // From +x, then from -x, and so on: slices along z are passed through one after the other, and within a slice each by itself.
        for side in 0..2 {
            let is_from_high = side == 0;
            let in_order = |n: usize, ix: usize| if is_from_high { n - 1 - ix } else { ix };
            let mut along_z = vec![1.0_f32; n_slice];
            for ix in 0..n_z {
                let first = n_slice * in_order(n_z, ix);
                let voxels = &volume[first..first + n_slice];
                let shares = &mut shares[first..first + n_slice];
                let mut along_y = vec![1.0_f32; n_x];
                for iy in 0..n_y {
                    let row = n_x * in_order(n_y, iy);
                    let mut along_x = 1.0_f32;
                    for column in 0..n_x {
                        let column = in_order(n_x, column);
                        let voxel = row + column;
                        let before = [&mut along_x, &mut along_y[column], &mut along_z[voxel]];
                        for (axis, before) in before.into_iter().enumerate() {
                            let left = left(&voxels[voxel], axis, grid.h);
                            let share = *before * left.here;
                            shares[voxel][3 * side + axis] = (share * ONE + 0.5) as u16;
                            *before *= left.behind;
                        }
                    }
                }
            }
        }
        AxisShares {
            grid: *grid,
            shares,
        }
    }

    /// [`AxisShares::new`], if local scattering of `scene`, which alone reads them, is drawn.
    pub fn if_drawn(scene: &PreparedScene, grid: &Grid, volume: &[[f32; 8]]) -> Option<AxisShares> {
        (scene.terms() & TERM_LOCAL != 0).then(|| AxisShares::new(grid, volume))
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
    use strandlight_scene::volume::extinction;

    use super::super::voxelise::even_layer;
    use super::*;

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
