//! Single scattering of all lights at every point. Twin of `shaders/pass/shade.wgsl`.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_runtime::PreparedScene;
use strandlight_runtime::camera::ViewUniform;
use strandlight_runtime::scene::LightRecord;
use strandlight_runtime::volume::Grid;
use strandlight_scattering::closed_form::{DirectionInFrame, LightInFrame, single_scattering};

use super::project::screen_position;
use super::transmittance::mix;
use super::voxelise::{grid_position, voxel_index};

/// What one batch of lights came to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    pub points_skipped: u64,
    pub products: u64,
    pub products_skipped: u64,
}

/// Adds the lights of a batch to `radiance` (rgb, 0), times the view's radiance scale.
/// `transmittance` is `[light of the batch][voxel]`.
pub(super) fn shade(
    scene: &PreparedScene,
    view: &ViewUniform,
    grid: &Grid,
    lights: &[LightRecord],
    transmittance: &[f32],
    radiance: &mut [[f32; 4]],
) -> Counts {
    let strands = &scene.strands;
    let min_power = scene.min_power();
    let shading = scene.hair.optics().shading(scene.tables.view());
    radiance
        .par_iter_mut()
        .enumerate()
        .map(|(point, radiance)| {
            let [x, y, z, _] = strands.points[point];
            let position = Vec3::new(x, y, z);
            if !in_view(view, screen_position(view, position)) {
                return Counts {
                    points_skipped: 1,
                    ..Counts::default()
                };
            }
            let u = Vec3::from_slice(&strands.tangents[point]);
            let v = Vec3::from_slice(&strands.normals[point]);
            let w = u.cross(v);
            let in_frame = |d: Vec3| [u.dot(d), v.dot(d), w.dot(d)];
            let eye = DirectionInFrame::from_vector(in_frame(Vec3::from(view.eye) - position));
            let g = grid_position(grid, position);
            let mut sum = [0.0; 3];
            let mut skipped = 0;
            for (ix, light) in lights.iter().enumerate() {
                let first = ix * grid.n_voxels();
                let unblocked = transmittance_at(grid, &transmittance[first..], g);
                if unblocked * light.power < min_power {
                    skipped += 1;
                    continue;
                }
                let direction = in_frame(Vec3::from(light.direction));
                let source = LightInFrame::from_vector(direction, light.lambda);
                let scattered = single_scattering(&source, &eye, &shading);
                for channel in 0..3 {
                    sum[channel] += unblocked * light.rgb[channel] * scattered[channel];
                }
            }
            for channel in 0..3 {
                radiance[channel] += sum[channel] * view.radiance_scale;
            }
            Counts {
                points_skipped: 0,
                products: lights.len() as u64 - skipped,
                products_skipped: skipped,
            }
        })
        .reduce(Counts::default, |a, b| Counts {
            points_skipped: a.points_skipped + b.points_skipped,
            products: a.products + b.products,
            products_skipped: a.products_skipped + b.products_skipped,
        })
}

/// Whether a point at this place of the screen can touch the picture.
fn in_view(view: &ViewUniform, [x, y, depth]: [f32; 3]) -> bool {
    let inside = |at: f32, size: u32| at > -view.margin_px && at < size as f32 + view.margin_px;
    depth >= view.near && inside(x, view.size[0]) && inside(y, view.size[1])
}

/// Trilinear look-up in the volume of one light.
fn transmittance_at(grid: &Grid, volume: &[f32], g: Vec3) -> f32 {
    let base = g.as_uvec3();
    let f = g - base.as_vec3();
    let corner = voxel_index(grid, base.to_array());
    let row = grid.dims[0] as usize;
    let slice = row * grid.dims[1] as usize;
    let along_x = |at: usize| mix(volume[at], volume[at + 1], f.x);
    mix(
        mix(along_x(corner), along_x(corner + row), f.y),
        mix(along_x(corner + slice), along_x(corner + slice + row), f.y),
        f.z,
    )
}
