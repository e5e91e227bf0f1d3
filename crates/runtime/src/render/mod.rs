//! The renderer: stages in the order they run, one file each.
//!
//! Once for the strands and the lights: `voxelise` (shadow volume) -> `transmittance`. A frame:
//! `shade`, in batches of lights -> `draw` (project, ribbons, passes of four samples, accumulate)
//! -> `composite`.

mod draw;
mod lighting;
pub(crate) mod resources;
mod scattering;
mod shadow_map;
mod shadows;
mod volume;

use std::borrow::Cow;

use crate::camera::{Camera, view_uniform};
use crate::edit::{EditError, EditReport, HairTextures};
use crate::error::RenderError;
use crate::gpu::Context;
use crate::picture::Picture;
use crate::scene::{PreparedScene, check_lights};
use crate::shadow_maps::ShadowPlan;
use crate::stats::{Observer, Stats};
use crate::strands::Strands;
use strandlight_formats::SrbfLight;
use strandlight_scattering::HairParams;
use strandlight_scattering::closed_form::PackedRecord;

/// Most pixels of a picture: 16 bytes each fill the 128 MiB that every adapter binds.
pub const MAX_PIXELS: u32 = 8 << 20;

/// Longest side of a picture, as every adapter renders it.
pub const MAX_SIDE: u32 = 8192;

/// Most samples a pixel.
pub const MAX_SAMPLES: u32 = 65_536;

/// Lights whose records share a buffer: at the largest grid the 128 MiB that every adapter binds.
pub const LIGHT_BATCH: usize = 64;

/// The smallest number of samples that makes whole passes of four, for at least `samples`.
pub fn whole_passes(samples: u32) -> u32 {
    samples.clamp(1, MAX_SAMPLES).next_multiple_of(4)
}

/// Refuses pictures that cannot be made.
///
/// # Errors
/// A side of zero or beyond [`MAX_SIDE`], more than [`MAX_PIXELS`], or samples that are not a
/// multiple of four in 4..=[`MAX_SAMPLES`].
pub fn check_frame(size: [u32; 2], samples: u32) -> Result<(), RenderError> {
    let [width, height] = size;
    let sides = (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height);
    if !sides || width * height > MAX_PIXELS {
        return Err(RenderError::Size { width, height });
    }
    if !samples.is_multiple_of(4) || !(4..=MAX_SAMPLES).contains(&samples) {
        return Err(RenderError::Samples { samples });
    }
    Ok(())
}

/// The answers of the shadow maps of `plan` for `strands`, as
/// [`crate::shadow_maps::unblocked_share`] reads them.
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
        let maps = shadow_map::ShadowMaps::new(context)?;
        let unblocked = maps.run(context, &buffers, plan)?;
        resources::read_back(context, "unblocked", &unblocked)
    })
}

/// What [`crate::live::Live`] draws with.
pub(crate) struct Parts {
    strands: resources::StrandBuffers,
    volume: volume::Volume,
    lighting: lighting::Lighting,
    draw: draw::Draw,
}

impl Parts {
    pub fn new(
        context: &Context,
        scene: &PreparedScene,
        stats: &mut Stats,
    ) -> Result<Self, RenderError> {
        *stats = scene.counts(format!(
            "gpu: {} ({})",
            context.adapter_name, context.backend
        ));
        let strands = resources::StrandBuffers::new(context, &scene.strands);
        let volume = volume::Volume::new(context, &scene.strands, &strands)?;
        let lighting = lighting::Lighting::new(context, scene, &volume, &strands)?;
        Ok(Parts {
            strands,
            volume,
            lighting,
            draw: draw::Draw::new(context)?,
        })
    }

    pub fn update(&mut self, context: &Context, scene: &PreparedScene, report: &EditReport) {
        self.lighting.update(context, scene, &scene.hair, report);
    }

    pub fn draw(
        &self,
        context: &Context,
        scene: &PreparedScene,
        view: &crate::camera::ViewUniform,
        samples: u32,
        stats: &mut Stats,
    ) -> Result<Picture, RenderError> {
        let (strands, volume) = (&self.strands, &self.volume);
        let shading = self
            .lighting
            .run(context, strands, volume, view, stats, &|_| ())?;
        let frame = draw::Frame {
            scene,
            strands,
            shading: &shading,
            view,
            samples,
            observer: &|_| (),
        };
        self.draw.run(context, &frame, stats)
    }
}

/// A prepared scene on a device.
pub struct Renderer<'a> {
    context: &'a Context,
    /// Its own copy once strands or lights were set.
    scene: Cow<'a, PreparedScene>,
    hair: HairTextures,
    strands: resources::StrandBuffers,
    volume: volume::Volume,
    lighting: lighting::Lighting,
    draw: draw::Draw,
    /// What preparing cost; starts the statistics of every frame.
    prepared: Stats,
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
                let bytes = volume.bytes();
                Ok::<_, RenderError>((volume, bytes))
            })?;
            let lighting = lighting::Lighting::new(context, scene, &volume, &strands)?;
            let draw = draw::Draw::new(context)?;
            Ok(Renderer {
                context,
                scene: Cow::Borrowed(scene),
                hair: scene.hair.clone(),
                strands,
                volume,
                lighting,
                draw,
                prepared: stats,
            })
        })
    }

    /// Edits the hair of the frames to come and writes on the device what that touches. The scene
    /// that this was made of keeps its own.
    ///
    /// # Errors
    /// The first parameter outside its range; nothing is changed then.
    pub fn edit(&mut self, hair: &HairParams) -> Result<EditReport, EditError> {
        let report = self.hair.apply(hair)?;
        self.lighting
            .update(self.context, &self.scene, &self.hair, &report);
        Ok(report)
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
            self.lighting
                .set_lights(self.context, &self.scene, &self.volume, &self.strands)
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
    /// [`Strands::points`]: crate::strands::Strands::points
    /// [`Strands::moved`]: crate::strands::Strands::moved
    pub fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError> {
        self.scene.to_mut().strands = self.scene.strands.moved(points)?;
        let (context, scene) = (self.context, &self.scene);
        resources::guarded(context, || {
            self.strands.update(context, &scene.strands);
            self.volume.fill(context, &scene.strands, &self.strands)?;
            self.lighting
                .shadow_again(context, scene, &self.volume, &self.strands)
        })?;
        self.count();
        Ok(())
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
            stats.passes = samples / 4;
            let view = view_uniform(
                camera,
                &self.scene.strands,
                size,
                self.scene.radiance_scale(),
            );
            let shading = self.shade(&view, &mut stats, observer)?;
            let frame = draw::Frame {
                scene: &self.scene,
                strands: &self.strands,
                shading: &shading,
                view: &view,
                samples,
                observer,
            };
            let picture = self.draw.run(self.context, &frame, &mut stats)?;
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

    fn shade(
        &self,
        view: &crate::camera::ViewUniform,
        stats: &mut Stats,
        observer: Observer,
    ) -> Result<lighting::Shading, RenderError> {
        self.lighting.run(
            self.context,
            &self.strands,
            &self.volume,
            view,
            stats,
            observer,
        )
    }

    /// The shadow volume as read back from the device, two entries a voxel: (A, Qxx, Qyy, Qzz),
    /// (Qxy, Qxz, Qyz, 0), 1/cm.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn volume(&self) -> Result<Vec<[f32; 4]>, RenderError> {
        resources::read_back(self.context, "volume", self.volume.buffer())
    }

    /// Packed records of the first lights, at most [`LIGHT_BATCH`], as `[light][voxel]`.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn records(&self) -> Result<Vec<PackedRecord>, RenderError> {
        resources::guarded(self.context, || {
            self.lighting.first_records(self.context, &self.volume)
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
        check_frame(size, 4)?;
        resources::guarded(self.context, || {
            let scale = self.scene.radiance_scale();
            let view = view_uniform(camera, &self.scene.strands, size, scale);
            let shading = self.shade(&view, &mut Stats::default(), &|_| ())?;
            let mut radiance: Vec<[f32; 4]> =
                resources::read_back(self.context, "radiance", shading.radiance())?;
            for value in radiance.iter_mut().flatten() {
                *value /= scale;
            }
            Ok(radiance)
        })
    }
}
