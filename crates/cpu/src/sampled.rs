//! Pictures by samples, as a GPU draws them: every point is lit and shaded, and strands are rasterised.

use strandlight_scattering::closed_form::PackedRecord;
use strandlight_scene::beside::Beside;
use strandlight_scene::bounce::passed_weights;
use strandlight_scene::budget::{LIGHT_BATCH, check_frame};
use strandlight_scene::camera::{Camera, ViewUniform, view_uniform};
use strandlight_scene::progress::timed;
use strandlight_scene::sampling::PASS_SAMPLES;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::{NO_SLOT, ShadowPlan};
use strandlight_scene::stats::{LIGHTING_SHARE, Observer, Stage};
use strandlight_scene::volume::Grid;
use strandlight_scene::{Picture, PreparedScene, RenderError, Stats};

use super::axis_shares::AxisShares;
use super::bounce::BounceRays;
use super::composite::{before_composite, composite};
use super::project::project;
use super::proxies::Proxies;
use super::radiance::Radiance;
use super::raster::{draw, ribbons};
use super::screen_point::SAMPLED_WIDTH_PX;
use super::shade::{Counts, shade, shade_bounce};
use super::shadow_map::{Visibility, draw_maps, through_shares};
use super::stats_name::stats_name;
use super::transmittance::{Shadows, transmittance_beside};
use super::voxelise::voxelise;

/// Finds the packed records of some lights at every point of a scene, `[light][point]`.
pub type PointShadows<'a> =
    dyn Fn(&PreparedScene, &[LightRecord]) -> Vec<PackedRecord> + Send + Sync + 'a;

/// How the transmittance of lights is found.
#[derive(Clone, Copy)]
pub enum ShadowSource<'a> {
    /// Sweeps through a voxel volume, and shadow maps: as on the GPU.
    Sweep,
    /// Another way, at every point by itself; no shadow maps.
    Points(&'a PointShadows<'a>),
}

/// Draws `scene` as `camera` sees it, without a GPU.
///
/// # Errors
/// A size or number of samples out of range.
pub fn render(
    scene: &PreparedScene,
    camera: &Camera,
    size: [u32; 2],
    samples: u32,
) -> Result<(Picture, Stats), RenderError> {
    render_observed(scene, camera, size, samples, ShadowSource::Sweep, &|_| ())
}

/// [`render`] with transmittance from `shadows`; `observer` hears of the progress.
///
/// # Errors
/// As [`render`]; proxies, which only [`ShadowSource::Sweep`] knows.
pub(super) fn render_observed(
    scene: &PreparedScene,
    camera: &Camera,
    size: [u32; 2],
    samples: u32,
    shadows: ShadowSource,
    observer: Observer,
) -> Result<(Picture, Stats), RenderError> {
    check_frame(size, samples)?;
    let mut stats = scene.counts(stats_name());
    stats.samples = samples;
    stats.passes = samples.div_ceil(PASS_SAMPLES);
    let strands = &scene.strands;
    let grid = Grid::around(strands);
    let (volume, axis_shares) = stats.stage("voxelise", |_| {
        let volume = voxelise(strands, &grid);
        let axis_shares = AxisShares::if_drawn(scene, &grid, &volume);
        let bytes = 32 * volume.len() as u64 + axis_shares.as_ref().map_or(0, AxisShares::bytes);
        Ok::<_, RenderError>(((volume, axis_shares), bytes))
    })?;
    let view = view_uniform(camera, strands, size, scene.radiance_scale());
    let mut proxies = Proxies::new(scene);
    let of_light: Observer = &before_composite(observer);
    let radiance = light(
        scene,
        (&grid, &volume, axis_shares.as_ref()),
        &view,
        (shadows, true),
        &mut proxies,
        &mut stats,
        of_light,
    )?;
    proxies.look(&view);
    let mut picture = stats.stage("draw", |stats| {
        let projected = project(&view, strands, SAMPLED_WIDTH_PX);
        let even = scene.width_profile(&view, None).map(|profile| profile.even);
        let ribbons = ribbons(&view, strands, &projected, scene.is_close_up(&view));
        let lit = (&radiance, even);
        let of_view = (&view, &**strands, &projected[..], &ribbons[..]);
        let drawn = draw(of_view, lit, &proxies, samples, of_light);
        stats.pixels_visited = drawn.visited;
        let bytes = 24 * projected.len() as u64 + 16 * drawn.sums.len() as u64;
        Ok::<_, RenderError>((drawn.sums, bytes))
    })?;
    stats.stage("composite", |_| {
        composite(scene, &view, samples, &mut picture, observer);
        Ok::<_, RenderError>(((), 16 * picture.len() as u64))
    })?;
    let picture = Picture {
        width: size[0],
        height: size[1],
        rgba: picture,
    };
    Ok((picture, stats))
}

/// Radiance of every point towards the camera: rgb, and of wide strands how much brighter the right edge is than the
/// middle (mean over the channels), else zero. Points outside the view are black.
///
/// # Errors
/// As [`render`].
pub fn point_radiance(
    scene: &PreparedScene,
    camera: &Camera,
    size: [u32; 2],
) -> Result<Vec<[f32; 4]>, RenderError> {
    check_frame(size, 1)?;
    let grid = Grid::around(&scene.strands);
    let volume = voxelise(&scene.strands, &grid);
    let axis_shares = AxisShares::if_drawn(scene, &grid, &volume);
    let scale = scene.radiance_scale();
    let view = view_uniform(camera, &scene.strands, size, scale);
    let stats = &mut Stats::default();
    let mut radiance = light(
        scene,
        (&grid, &volume, axis_shares.as_ref()),
        &view,
        (ShadowSource::Sweep, false),
        &mut Proxies::new(scene),
        stats,
        &|_| (),
    )?
    .at;
    for value in radiance.iter_mut().flatten() {
        *value /= scale;
    }
    Ok(radiance)
}

/// Draws the shadow maps of a plan, and those through to the eye.
fn seen_by_maps(
    scene: &PreparedScene,
    view: &ViewUniform,
    (plan, beside): (&ShadowPlan, &Beside),
    stats: &mut Stats,
) -> Visibility {
    let (visibility, seconds) = timed(|| {
        let strands = &scene.strands;
        let mut visibility = Visibility::new(plan, strands.points.len());
        for views in [&plan.views, &plan.through(view.forward)] {
            stats.texels_visited += draw_maps(strands, views, beside, &mut visibility);
        }
        let mixture = plan.mixture(view.forward);
        through_shares(strands, view.eye, &mixture, &mut visibility);
        visibility
    });
    let bytes = 4 * (visibility.shares.len() + visibility.answers.len()) as u64;
    stats.stages.push(stage("shadow maps", seconds, bytes));
    visibility
}

/// A stage that ran once.
fn stage(name: &'static str, seconds: f64, bytes: u64) -> Stage {
    Stage {
        name,
        milliseconds: 1e3 * seconds,
        bytes,
        runs: 1,
        gpu_milliseconds: None,
    }
}

/// Transmittance and shading, in batches of lights. The shadows of narrow lights are found along segments, or else
/// at points.
fn light(
    scene: &PreparedScene,
    (grid, volume, axis_shares): (&Grid, &[[f32; 8]], Option<&AxisShares>),
    view: &ViewUniform,
    (shadows, are_along): (ShadowSource, bool),
    proxies: &mut Proxies,
    stats: &mut Stats,
    observer: Observer,
) -> Result<Radiance, RenderError> {
    let beside = scene.beside();
    if !beside.is_empty() && matches!(shadows, ShadowSource::Points(_)) {
        return Err(RenderError::ProxiesNeedSweeps);
    }
    let (mut lights, sweeps) = scene.light_records();
    if let ShadowSource::Points(_) = shadows {
        for light in &mut lights {
            (light.shadow_index, light.first_map, light.n_maps) = (NO_SLOT, 0, 0);
        }
    }
    let has_narrow = are_along && lights.iter().any(LightRecord::is_narrow);
    let mut radiance = Radiance::black(scene.strands.points.len(), has_narrow);
    let (mut sweep_s, mut shade_s, mut bytes) = (0.0, 0.0, 0);
    let mut counts = Counts::default();
    let mut done = 0;
    // Baselines find transmittance by themselves.
    let plan = match shadows {
        ShadowSource::Sweep => scene.shadow_plan(),
        ShadowSource::Points(_) => ShadowPlan::default(),
    };
    let visibility = seen_by_maps(scene, view, (&plan, &beside), stats);
    let voxels = beside.places_of_voxels(grid);
    for batch in lights.chunks(LIGHT_BATCH) {
        let ((found, n_open), seconds) = timed(|| match shadows {
            ShadowSource::Sweep => {
                let blocking = (&beside, &voxels);
                let swept = transmittance_beside(grid, volume, batch, &sweeps, blocking);
                (Shadows::Volume(swept.packed), swept.n_open)
            }
            ShadowSource::Points(find) => (Shadows::Points(find(scene, batch)), Vec::new()),
        });
        sweep_s += seconds;
        bytes = bytes.max(found.bytes());
        let (batch_counts, seconds) = timed(|| {
            let around = (grid, axis_shares);
            shade(
                scene,
                view,
                around,
                batch,
                &found,
                &visibility,
                &mut radiance,
            )
        });
        shade_s += seconds;
        if let Shadows::Volume(packed) = &found {
            let of_view = (view, &passed_weights(scene));
            let of_voxels = (&packed[..], &n_open[..]);
            proxies.light(of_view, (grid, volume), batch, &sweeps, of_voxels);
        }
        done += batch.len();
        observer(LIGHTING_SHARE * done as f64 / lights.len() as f64);
        // Each batch of lights counts the same points.
        counts.points_skipped = 0;
        counts = counts.and(batch_counts);
    }
    if let (Some(mut rays), ShadowSource::Sweep) = (BounceRays::new(scene), shadows) {
        let ((), seconds) = timed(|| {
            while !rays.is_found() {
                rays.step(grid, volume);
            }
            rays.reflect(&passed_weights(scene), proxies);
            let bounce = rays.light(proxies.at_surfaces());
            shade_bounce(scene, view, axis_shares, &bounce, &mut radiance);
        });
        shade_s += seconds;
    }
    stats.stages.push(stage("transmittance", sweep_s, bytes));
    stats.stages.push(stage("shade", shade_s, radiance.bytes()));
    stats.points_skipped = counts.points_skipped;
    stats.set_terms(&counts.terms);
    Ok(radiance)
}
