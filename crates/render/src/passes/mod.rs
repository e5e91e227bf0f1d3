//! The renderer: stages in the order they run, one file each.
//!
//! Once for the strands and the lights: `voxelise` (shadow volume) -> shadow maps,
//! `transmittance`. A frame: the maps towards the eye -> `shade`, in batches of lights -> `draw`
//! (project, ribbons, passes of four samples, accumulate) -> `composite`. [`Renderer`] waits for
//! each of these; [`crate::live::Live`] takes them one by one and shows (`display`) what there is.

pub(crate) mod clock;
pub(crate) mod deform;
pub(crate) mod draw;
mod first_look;
mod footprint;
pub(crate) mod lighting;
pub(crate) mod mail;
pub(crate) mod noise;
pub(crate) mod painted;
pub(crate) mod parts;
mod proxies;
pub(crate) mod resources;
mod scattering;
pub(crate) mod screen;
mod shadow_map;
mod shadows;
pub(crate) mod target;
pub(crate) mod volume;

pub use footprint::{DeviceBytes, DevicePart};
#[doc(hidden)]
pub use parts::PartLimits;

use std::borrow::Cow;
use std::cell::RefCell;
use std::ops::Range;

use strandlight_scene::budget::check_frame;

use web_time::Instant;

use crate::gpu::Context;
use strandlight_formats::SrbfLight;
use strandlight_scattering::HairParams;
use strandlight_scattering::closed_form::PackedRecord;
use strandlight_scattering::layout::Layout;
use strandlight_scene::camera::{Camera, ViewUniform, view_uniform};
use strandlight_scene::edit::{EditError, EditReport, HairTextures};
use strandlight_scene::paint::Paint;
use strandlight_scene::picture::Picture;
use strandlight_scene::sampling::PASS_SAMPLES;
use strandlight_scene::scene::{PreparedScene, check_lights};
use strandlight_scene::shadow_maps::ShadowPlan;
use strandlight_scene::stats::{LIGHTING_SHARE, Observer, Stage, Stats};
use strandlight_scene::strands::Strands;
use strandlight_scene::{RenderError, SceneError};

/// The structs here that shaders mirror.
pub(crate) fn layouts() -> Vec<Layout> {
    [
        draw::LAYOUTS,
        first_look::LAYOUTS,
        noise::LAYOUTS,
        screen::LAYOUTS,
        shadows::LAYOUTS,
        target::LAYOUTS,
    ]
    .concat()
}

/// The answers of the shadow maps of `plan` for `strands`, as
/// [`strandlight_scene::shadow_maps::unblocked_share`] reads them.
///
/// # Errors
/// Whatever the device refuses.
pub fn shadow_maps(
    context: &Context,
    strands: &Strands,
    plan: &ShadowPlan,
) -> Result<Vec<u32>, RenderError> {
    resources::guarded(context, || {
        let buffers = resources::StrandBuffers::new(context, strands);
        let mut maps = shadow_map::ShadowMaps::new(context, &buffers)?;
        maps.fit(context, &buffers, plan);
        for view in &plan.views {
            maps.draw(context, view, Default::default());
            context.wait("shadow map").map_err(resources::failed)?;
        }
        let mut answers = resources::read_back(context, "unblocked", maps.answers())?;
        // Buffers are never empty.
        answers.truncate(plan.n_words(strands.points.len()));
        Ok(answers)
    })
}

/// A prepared scene on a device.
pub struct Renderer<'a> {
    context: &'a Context,
    /// Its own copy once strands or lights were set.
    scene: Cow<'a, PreparedScene>,
    hair: HairTextures,
    strands: resources::StrandBuffers,
    volume: volume::Volume,
    /// What it remembers of one frame saves the next one work.
    lighting: RefCell<lighting::Lighting>,
    draw: draw::Draw,
    ribbons: draw::Ribbons,
    /// What preparing cost; starts the statistics of every frame.
    prepared: Stats,
    /// Milliseconds of finding the shadows of the lights, maps and sweeps.
    shadows_ms: [f64; 2],
    spread: parts::Spread,
    parts: PartLimits,
}

impl<'a> Renderer<'a> {
    /// Uploads `scene` and fills its shadow volume.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn new(context: &'a Context, scene: &'a PreparedScene) -> Result<Self, RenderError> {
        resources::guarded(context, || {
            let backend = format!("gpu: {} ({})", context.adapter_name, context.backend);
            let mut stats = scene.counts(backend);
            let strands = stats.stage("upload", |_| {
                let strands = resources::StrandBuffers::new(context, &scene.strands);
                context.wait("upload").map_err(resources::failed)?;
                let bytes = strands.bytes();
                Ok::<_, RenderError>((strands, bytes))
            })?;
            let volume = stats.stage("voxelise", |_| {
                let volume = volume::Volume::new(context, &scene.strands, &strands)?;
                volume.fill(context, Default::default());
                context.wait("voxelise").map_err(resources::failed)?;
                let bytes = volume.bytes();
                Ok::<_, RenderError>((volume, bytes))
            })?;
            let lighting = lighting::Lighting::new(context, scene, &volume, &strands, 1)?;
            let draw = draw::Draw::new(context)?;
            let mut ribbons = draw::Ribbons::new(context, &draw, &strands, &[lighting.radiance(0)]);
            ribbons.set_proxies(context, &lighting);
            let mut renderer = Renderer {
                context,
                scene: Cow::Borrowed(scene),
                hair: scene.hair.clone(),
                strands,
                volume,
                lighting: RefCell::new(lighting),
                draw,
                ribbons,
                prepared: stats,
                shadows_ms: [0.0; 2],
                spread: parts::Spread::of(&scene.strands),
                parts: PartLimits::default(),
            };
            renderer.find_shadows()?;
            Ok(renderer)
        })
    }

    /// Edits the hair of the frames to come and writes on the device what that touches. The scene
    /// that this was made of keeps its own.
    ///
    /// # Errors
    /// The first parameter outside its range; nothing is changed then.
    pub fn edit(&mut self, hair: &HairParams) -> Result<EditReport, EditError> {
        let report = self.hair.apply(hair)?;
        let (context, scene) = (self.context, &self.scene);
        let lighting = self.lighting.get_mut();
        lighting.set_hair(context, scene, &self.hair, &report);
        Ok(report)
    }

    /// Takes the paint of the groom's points in `changed`; of the others `paint` must be as it was.
    ///
    /// # Errors
    /// As [`PreparedScene::repaint`], nothing being changed then, or whatever the device refuses.
    pub fn set_paint(&mut self, paint: &Paint, changed: Range<usize>) -> Result<(), RenderError> {
        let (range, report) = self.scene.to_mut().repaint(paint, changed)?;
        resources::guarded(self.context, || {
            let (context, scene) = (self.context, &self.scene);
            let lighting = self.lighting.get_mut();
            if report.is_some() {
                let kinds = scene.hair.paint();
                let report = self.hair.enable_paint(kinds);
                let report = report.map_err(|error| SceneError::File(error.to_string()))?;
                lighting.set_hair(context, scene, &self.hair, &report);
                lighting.set_kind(context, scene)?;
            }
            lighting.set_paint(context, scene, &self.hair, range);
            Ok(())
        })
    }

    /// Takes `lights` for those there were, without voxelising again: another set, or the same
    /// one turned.
    ///
    /// # Errors
    /// The first light with a value outside its range, nothing being changed then, or whatever
    /// the device refuses.
    pub fn set_lights(&mut self, lights: &[SrbfLight]) -> Result<(), RenderError> {
        check_lights(lights)?;
        self.scene.to_mut().lights = lights.to_vec();
        resources::guarded(self.context, || {
            let (context, scene) = (self.context, &self.scene);
            let lighting = self.lighting.get_mut();
            lighting.plan_for(&scene.lights);
            lighting.set_lights(context, scene, &self.volume, &self.strands);
            self.find_shadows()
        })?;
        self.count();
        Ok(())
    }

    /// Moves the hair: `points` are x, y, z and fibre radius in cm, one for each of
    /// [`Strands::points`] in the same order. Voxelises and sweeps again, in a time that the
    /// number of segments, voxels and directions bounds.
    ///
    /// # Errors
    /// As [`Strands::moved`], nothing being changed then, or whatever the device refuses.
    ///
    /// [`Strands::points`]: strandlight_scene::strands::Strands::points
    /// [`Strands::moved`]: strandlight_scene::strands::Strands::moved
    pub fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError> {
        self.scene.to_mut().strands = self.scene.strands.moved(points)?;
        self.spread = parts::Spread::of(&self.scene.strands);
        resources::guarded(self.context, || {
            let (context, scene, strands) = (self.context, &self.scene, &self.strands);
            strands.update(context, &scene.strands);
            let is_other = self.volume.fit(context, &scene.strands, strands);
            self.volume.fill(context, Default::default());
            let lighting = self.lighting.get_mut();
            lighting.set_points(context, scene, &self.volume, strands, is_other);
            self.find_shadows()
        })?;
        self.count();
        Ok(())
    }

    /// Draws in parts no larger than `limits`.
    #[doc(hidden)]
    pub fn set_parts(&mut self, limits: PartLimits) {
        self.parts = limits;
    }

    /// Draws the scene as `camera` sees it.
    ///
    /// # Errors
    /// A size or number of samples out of range, or whatever the device refuses.
    pub fn render(
        &self,
        camera: &Camera,
        size: [u32; 2],
        samples: u32,
    ) -> Result<(Picture, Stats), RenderError> {
        self.render_observed(camera, size, samples, &|_| ())
    }

    /// [`Renderer::render`], telling `observer` of its progress.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_observed(
        &self,
        camera: &Camera,
        size: [u32; 2],
        samples: u32,
        observer: Observer,
    ) -> Result<(Picture, Stats), RenderError> {
        check_frame(size, samples)?;
        resources::guarded(self.context, || {
            let mut stats = self.prepared.clone();
            stats.passes = samples.div_ceil(PASS_SAMPLES);
            let view = view_uniform(
                camera,
                &self.scene.strands,
                size,
                self.scene.radiance_scale(),
            );
            self.shade(&view, &mut stats, observer)?;
            let picture = self.draw(&view, samples, &mut stats, observer)?;
            Ok((picture, stats))
        })
    }

    /// Brings the counts of the scene up to date.
    fn count(&mut self) {
        let stages = std::mem::take(&mut self.prepared.stages);
        let backend = std::mem::take(&mut self.prepared.backend);
        self.prepared = Stats {
            stages,
            ..self.scene.counts(backend)
        };
    }

    /// Runs `steps` of lighting, one at a time: a software device takes part of a second for some
    /// of them. Answers the milliseconds of maps, of sweeps and of shading.
    fn run(
        &self,
        steps: &[lighting::Step],
        mut observer: impl FnMut(f64),
    ) -> Result<[f64; 3], RenderError> {
        let mut milliseconds = [0.0; 3];
        let mut lighting = self.lighting.borrow_mut();
        for (ix, step) in steps.iter().enumerate() {
            let start = Instant::now();
            let (strands, volume) = (&self.strands, &self.volume);
            lighting.submit(self.context, strands, volume, step, 0, Default::default());
            self.context.wait(step.stage()).map_err(resources::failed)?;
            let stage = match step {
                lighting::Step::Map(_) => 0,
                lighting::Step::Sweep { .. } => 1,
                lighting::Step::Shade { .. } | lighting::Step::Proxies { .. } => 2,
            };
            milliseconds[stage] += 1e3 * start.elapsed().as_secs_f64();
            observer((ix + 1) as f64 / steps.len() as f64);
        }
        Ok(milliseconds)
    }

    /// Finds the shadows of the lights.
    fn find_shadows(&mut self) -> Result<(), RenderError> {
        let steps = self.lighting.get_mut().shadow_steps();
        let [maps, sweeps, _] = self.run(&steps, |_| ())?;
        self.shadows_ms = [maps, sweeps];
        Ok(())
    }

    /// Lights every point towards the eye of `view`.
    fn shade(
        &self,
        view: &ViewUniform,
        stats: &mut Stats,
        observer: Observer,
    ) -> Result<(), RenderError> {
        let mut steps = {
            let mut lighting = self.lighting.borrow_mut();
            lighting.begin(self.context, view);
            lighting.clear(self.context, 0);
            lighting.through_steps(view.forward)
        };
        let lighting = self.lighting.borrow();
        steps.extend(lighting.shade_steps(lighting::POINT_CHUNK));
        drop(lighting);
        let times = self.run(&steps, |done| observer(LIGHTING_SHARE * done))?;
        let lighting = self.lighting.borrow();
        let before = [self.shadows_ms[0], self.shadows_ms[1], 0.0];
        for (ix, (name, bytes)) in lighting.bytes().into_iter().enumerate() {
            stats.stages.push(Stage {
                name,
                milliseconds: before[ix] + times[ix],
                bytes,
            });
        }
        let counts = resources::read_back(self.context, "counters", lighting.counters())?;
        stats.set_counters(&counts, lighting.n_batches());
        Ok(())
    }

    /// Draws the lit strands, tile by tile where the device draws no larger ones, and reads the
    /// picture back.
    fn draw(
        &self,
        view: &ViewUniform,
        samples: u32,
        stats: &mut Stats,
        observer: Observer,
    ) -> Result<Picture, RenderError> {
        let (context, draw, ribbons) = (self.context, &self.draw, &self.ribbons);
        let lighting = self.lighting.borrow();
        let lit = lighting.lit();
        let [width, height] = view.size;
        let tiles = parts::tiles(view.size, &context.device.limits(), &self.parts);
        let mut rgba = Vec::new();
        if tiles.len() > 1 {
            rgba.resize(width as usize * height as usize, [0.0; 4]);
        }
        let mut kept: Option<target::Target> = None;
        let (mut draw_ms, mut composite_ms, mut bytes) = (0.0, 0.0, [0, 0]);
        for (ix, tile) in tiles.iter().enumerate() {
            let start = Instant::now();
            let view = tile.of(view);
            let mut target = match kept.take() {
                Some(target) if target.size() == tile.extent => target,
                other => {
                    // One at a time on the device.
                    drop(other);
                    target::Target::new(context, draw, ribbons, tile.extent, lit.0)
                }
            };
            target.clear(context);
            ribbons.set_view(context, &view);
            ribbons.project(context, draw, Default::default());
            let ends = parts::bands(&view, &self.scene.strands, &self.spread, &self.parts);
            for pass_ix in 0..stats.passes {
                let of_pass = target::PassSamples::of(pass_ix, samples);
                for ix in 0..ends.len() {
                    let band = target::band(&ends, ix);
                    let drawn = (draw, ribbons);
                    target.pass(context, drawn, 0, of_pass, &band, Default::default());
                    // One at a time: a software device takes a second for some of them.
                    context.wait("draw").map_err(resources::failed)?;
                    stats.draws += 1;
                }
                let done = f64::from(pass_ix + 1) / f64::from(stats.passes);
                let done = (ix as f64 + done) / tiles.len() as f64;
                observer(LIGHTING_SHARE + (1.0 - LIGHTING_SHARE) * done);
            }
            draw_ms += 1e3 * start.elapsed().as_secs_f64();
            let start = Instant::now();
            let background = (&self.scene.background, samples);
            target.composite(context, draw, ribbons, background, lit, Default::default());
            let pixels = resources::read_back(context, "picture", target.picture())?;
            match tiles.len() {
                1 => rgba = pixels,
                _ => tile.place(&pixels, width, &mut rgba),
            }
            composite_ms += 1e3 * start.elapsed().as_secs_f64();
            bytes = [target.bytes() + ribbons.bytes(), target.picture().size()];
            kept = Some(target);
        }
        for (name, milliseconds, bytes) in [
            ("draw", draw_ms, bytes[0]),
            ("composite", composite_ms, bytes[1]),
        ] {
            stats.stages.push(Stage {
                name,
                milliseconds,
                bytes,
            });
        }
        Ok(Picture {
            width,
            height,
            rgba,
        })
    }

    /// The shadow volume as read back from the device, two entries a voxel: (A, Qxx, Qyy, Qzz),
    /// (Qxy, Qxz, Qyz, 0), 1/cm.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn volume(&self) -> Result<Vec<[f32; 4]>, RenderError> {
        let mut volume = resources::read_back(self.context, "volume", self.volume.buffer())?;
        volume.truncate(2 * self.volume.grid.n_voxels());
        Ok(volume)
    }

    /// Packed records of the first lights, at most [`LIGHT_BATCH`], as `[light][voxel]`.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn records(&self) -> Result<Vec<PackedRecord>, RenderError> {
        resources::guarded(self.context, || {
            let lighting = self.lighting.borrow();
            lighting.first_records(self.context, &self.volume)
        })
    }

    /// Radiance of every point towards the camera: rgb, and zero. Points outside the view are
    /// black.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn point_radiance(
        &self,
        camera: &Camera,
        size: [u32; 2],
    ) -> Result<Vec<[f32; 4]>, RenderError> {
        check_frame(size, 1)?;
        resources::guarded(self.context, || {
            let scale = self.scene.radiance_scale();
            let view = view_uniform(camera, &self.scene.strands, size, scale);
            self.shade(&view, &mut Stats::default(), &|_| ())?;
            let lighting = self.lighting.borrow();
            let mut radiance: Vec<[f32; 4]> =
                resources::read_back(self.context, "radiance", lighting.radiance(0))?;
            for value in radiance.iter_mut().flatten() {
                *value /= scale;
            }
            Ok(radiance)
        })
    }
}
