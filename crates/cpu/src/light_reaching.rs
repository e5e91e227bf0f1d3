//! How much of the lights reaches the strands that are seen.

use rayon::prelude::*;
use strandlight_scene::budget::{LIGHT_BATCH, check_frame};
use strandlight_scene::camera::{Camera, view_uniform};
use strandlight_scene::volume::Grid;
use strandlight_scene::{PreparedScene, RenderError};

use super::data_layers::seen_of_points;
use super::shade::Reaching;
use super::shadow_map::{Visibility, draw_maps};
use super::transmittance::{Shadows, transmittance_beside};
use super::voxelise::voxelise;

/// Share of the lights' power, 0 to 1, that comes unblocked by hair and proxies to the strand at the centre of each
/// pixel, as single scattering has it, for `scene` as `camera` sees it: rows, top first; none where no strand is
/// seen. A light that is off has no power; without any that is on all shares are 0.
///
/// # Errors
/// A size out of range.
pub fn transmittance_seen(
    scene: &PreparedScene,
    camera: &Camera,
    size: [u32; 2],
) -> Result<Vec<Option<f32>>, RenderError> {
    check_frame(size, 1)?;
    let view = view_uniform(camera, &scene.strands, size, 1.0);
    let values = at_points(scene);
    Ok(seen_of_points(
        &scene.strands,
        &scene.beside(),
        &view,
        &values,
    ))
}

/// That share at every point of the strands.
fn at_points(scene: &PreparedScene) -> Vec<f32> {
    let (strands, beside) = (&scene.strands, scene.beside());
    let grid = Grid::around(strands);
    let volume = voxelise(strands, &grid);
    let (lights, sweeps) = scene.light_records();
    let plan = scene.shadow_plan();
    let mut visibility = Visibility::new(&plan, strands.points.len());
    draw_maps(strands, &plan.views, &beside, &mut visibility);
    let voxels = beside.places_of_voxels(&grid);
    let all: f32 = lights.iter().map(|light| light.power).sum();
    let mut values = vec![0.0; strands.points.len()];
    if all <= 0.0 {
        return values;
    }
    for batch in lights.chunks(LIGHT_BATCH) {
        let blocking = (&beside, &voxels);
        let swept = transmittance_beside(&grid, &volume, batch, &sweeps, blocking);
        let shadows = Shadows::Volume(swept.packed);
        let reaching = Reaching::new(scene, &grid, &shadows, &visibility);
        values.par_iter_mut().enumerate().for_each(|(point, sum)| {
            for (ix, light) in batch.iter().enumerate() {
                if light.power > 0.0 {
                    let (_, unblocked, _) = reaching.at(point, ix, light);
                    *sum += light.power / all * unblocked;
                }
            }
        });
    }
    values
}
