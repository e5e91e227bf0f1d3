//! Single scattering of all lights at every point. Twin of `shaders/pass/shade.wgsl`.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_runtime::PreparedScene;
use strandlight_runtime::camera::ViewUniform;
use strandlight_runtime::scene::LightRecord;
use strandlight_runtime::volume::Grid;
use strandlight_scattering::closed_form::{
    DirectionInFrame, LightInFrame, PackedRecord, ShadowRecord, single_scattering, unpack_record,
};

use super::project::screen_position;
use super::transmittance::{Shadows, mix_all};
use super::voxelise::{grid_position, voxel_index};

/// What one batch of lights came to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    pub points_skipped: u64,
    pub products: u64,
    pub products_skipped: u64,
}

/// Adds the lights of a batch to `radiance` (rgb, 0), times the view's radiance scale.
/// `shadows` are those of the batch.
pub(super) fn shade(
    scene: &PreparedScene,
    view: &ViewUniform,
    grid: &Grid,
    lights: &[LightRecord],
    shadows: &Shadows,
    radiance: &mut [[f32; 4]],
) -> Counts {
    let strands = &scene.strands;
    let (n_points, n_voxels) = (strands.points.len(), grid.n_voxels());
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
                let record = match shadows {
                    Shadows::Volume(records) => record_at(grid, &records[ix * n_voxels..], g),
                    Shadows::Points(records) => unpack_record(&records[ix * n_points + point]),
                };
                let unblocked = record.shares[0];
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

/// The record of one light at a point (x, y, z, radius), from that light's packed records
/// `[voxel]`.
pub fn record_at_point(grid: &Grid, records: &[PackedRecord], point: &[f32; 4]) -> ShadowRecord {
    record_at(grid, records, grid_position(grid, Vec3::from_slice(point)))
}

/// Trilinear look-up in the records of one light.
fn record_at(grid: &Grid, records: &[PackedRecord], g: Vec3) -> ShadowRecord {
    let base = g.as_uvec3();
    let f = g - base.as_vec3();
    let corner = voxel_index(grid, base.to_array());
    let row = grid.dims[0] as usize;
    let above = corner + row * grid.dims[1] as usize;
    let numbers = |at: usize| {
        let ShadowRecord {
            shares: [a, b, c],
            sin_theta,
        } = unpack_record(&records[at]);
        [a, b, c, sin_theta]
    };
    let along_x = |at: usize| mix_all(numbers(at), numbers(at + 1), f.x);
    let [a, b, c, sin_theta] = mix_all(
        mix_all(along_x(corner), along_x(corner + row), f.y),
        mix_all(along_x(above), along_x(above + row), f.y),
        f.z,
    );
    ShadowRecord {
        shares: [a, b, c],
        sin_theta,
    }
}
