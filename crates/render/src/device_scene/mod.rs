//! A prepared scene on a device: strands, shadows and the radiance of every point.
//!
//! Setters mark what is out of date in [`DirtyFlags`] and return at once. [`DeviceScene::begin`]
//! writes what was set to the device and plans a [`ShadingJob`]; [`DeviceScene::step`] runs one of
//! its steps. A job lights the radiance buffer that is not shown; when it is done, the two change
//! places. What is set during a job waits for the next one.

mod job;
mod set;

use crate::gpu::Context;
use crate::invalidation::Inputs;
use crate::passes::clock::Clock;
use crate::passes::deform::Deform;
use crate::passes::draw::{Projection, Ribbons};
use crate::passes::lighting::Lighting;
use crate::passes::resources::StrandBuffers;
use crate::passes::volume::Volume;
use crate::report::RenderReport;
use strandlight_scene::RenderError;
use strandlight_scene::camera::{ViewUniform, view_uniform};
use strandlight_scene::motion::Wind;
use strandlight_scene::scene::PreparedScene;

pub(crate) use job::{DirtyFlags, ShadingJob};

/// Margin of pictures whose view may turn.
const MARGIN: f32 = 0.15;

/// Radiance buffers: one that is shown and one that is being lit.
pub(crate) const N_RADIANCE: usize = 2;

/// A prepared scene on a device.
pub(crate) struct DeviceScene {
    pub context: Context,
    pub scene: PreparedScene,
    pub strands: StrandBuffers,
    pub volume: Volume,
    pub lighting: Lighting,
    pub projection: Projection,
    pub ribbons: Ribbons,
    /// The wind that bends the strands of the scene, and what does.
    pub wind: Option<Wind>,
    pub deform: Option<Deform>,
    /// What was set since the last job began.
    pub dirty: DirtyFlags,
    pub job: Option<ShadingJob>,
    /// The buffer of radiance that is shown, and its scale; none before anything is lit.
    pub front: usize,
    pub front_scale: Option<f32>,
    /// Whether the shadow volume is that of the points.
    pub has_volume: bool,
    /// Share of the picture's longer side around it where points are lit too: they are there when
    /// the view turns.
    margin: f32,
}

/// Where the work on a scene is written down.
pub(crate) struct Log<'a> {
    pub clock: &'a mut Clock,
    pub report: &'a mut RenderReport,
}

/// What a step of a job was.
pub(crate) enum Stepped {
    /// A step of a stage, of so many units, was submitted.
    Ran(&'static str, f64),
    /// An edit came early in the job, which began again.
    Restarted,
    /// The job is done and its radiance is shown.
    Done(Box<ShadingJob>),
}

impl DeviceScene {
    /// Puts `scene` on the device of `context`; nothing is lit yet.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn new(context: &Context, scene: PreparedScene) -> Result<DeviceScene, RenderError> {
        let strands = StrandBuffers::new(context, &scene.strands);
        let volume = Volume::new(context, &scene.strands, &strands)?;
        let lighting = Lighting::new(context, &scene, &volume, &strands, N_RADIANCE)?;
        let projection = Projection::new(context)?;
        let ribbons = Ribbons::new(context, &projection, &strands);
        Ok(DeviceScene {
            context: context.clone(),
            strands,
            volume,
            lighting,
            projection,
            ribbons,
            wind: None,
            deform: None,
            dirty: DirtyFlags::all(),
            job: None,
            front: 0,
            front_scale: None,
            has_volume: false,
            margin: MARGIN,
            scene,
        })
    }

    /// The buffers of radiance.
    pub fn radiance(&self) -> [&wgpu::Buffer; N_RADIANCE] {
        [0, 1].map(|ix| self.lighting.radiance(ix))
    }

    /// Is the radiance that is shown that of the scene and view as last set?
    pub fn is_lit(&self) -> bool {
        self.front_scale.is_some() && self.job.is_none() && self.dirty.is_clean()
    }

    /// The view of the scene's camera, with the scale of the radiance that is shown.
    pub fn view(&self) -> ViewUniform {
        let scale = self.front_scale.unwrap_or(1.0);
        let scene = &self.scene;
        view_uniform(&scene.camera, &scene.strands, scene.size, scale)
    }

    /// Bytes of the buffers on the device.
    pub fn bytes(&self) -> u64 {
        let lighting = self.lighting.bytes().map(|(_, bytes)| bytes);
        let fixed = self.strands.bytes() + self.volume.bytes() + self.ribbons.bytes();
        fixed + lighting.iter().sum::<u64>()
    }

    /// Takes up what was set since the last job began, and what one that is given up had taken, and
    /// plans the next job, which shades at most `chunk` points in a step. Answers whether the
    /// strands moved.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn begin(
        &mut self,
        given_up: DirtyFlags,
        is_second_try: bool,
        chunk: u32,
        log: &mut Log,
    ) -> Result<bool, RenderError> {
        let mut dirty = std::mem::take(&mut self.dirty);
        dirty.add(&given_up);
        let (context, scene) = (&self.context, &self.scene);
        let mut steps = Vec::new();
        if dirty.has(Inputs::POINTS) {
            match &self.wind {
                Some(wind) => {
                    let deform = match self.deform.take() {
                        Some(deform) => deform,
                        None => Deform::new(context, &scene.strands, &self.strands)?,
                    };
                    deform.run(context, wind, log.clock.stamp("deform"));
                    self.deform = Some(deform);
                    log.report.ran("deform");
                }
                None => self.strands.update(context, &scene.strands),
            }
            let is_other = self.volume.fit(context, &scene.strands, &self.strands);
            self.volume.fill(context, log.clock.stamp("voxelise"));
            self.has_volume = true;
            log.report.ran("voxelise");
            let lighting = &mut self.lighting;
            lighting.set_points(context, scene, &self.volume, &self.strands, is_other);
        }
        if dirty.has(Inputs::LIGHTS) {
            let lighting = &mut self.lighting;
            lighting.set_lights(context, scene, &self.volume, &self.strands);
        } else if dirty.has(Inputs::LIGHT_COLORS)
            && self.lighting.set_colors(context, scene, &self.strands)
        {
            steps.extend(self.lighting.map_steps());
        }
        if dirty.has(Inputs::PROXIES) {
            let (volume, strands) = (&self.volume, &self.strands);
            self.lighting.set_proxies(context, scene, volume, strands)?;
        }
        if dirty.is_stale("transmittance") {
            steps = self.lighting.shadow_steps();
        }
        if let Some(range) = &dirty.paint {
            let lighting = &mut self.lighting;
            lighting.set_paint(context, scene, &scene.hair, range.clone());
        }
        if let Some(report) = &dirty.hair {
            let hair = &scene.hair;
            self.lighting.set_hair(context, scene, hair, report);
        }
        if dirty.has(Inputs::DENSITIES) {
            self.lighting.set_densities(scene);
        }
        if dirty.has(Inputs::TERMS) {
            self.lighting.set_kind(context, scene)?;
        }
        let mut view = view_uniform(
            &scene.camera,
            &scene.strands,
            scene.size,
            scene.radiance_scale(),
        );
        view.margin_px += self.margin * scene.size[0].max(scene.size[1]) as f32;
        self.lighting.begin(context, &view);
        steps.extend(self.lighting.through_steps(view.forward));
        steps.extend(self.lighting.shade_steps(chunk));
        let has_moved = dirty.has(Inputs::POINTS);
        self.job = Some(ShadingJob {
            dirty,
            view,
            n_steps: steps.len(),
            steps: steps.into(),
            is_second_try,
        });
        Ok(has_moved)
    }

    /// Lights all points of the shown buffer by a guess, so that there is something to see before
    /// the first job is done.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn preview(&mut self, log: &mut Log) -> Result<(), RenderError> {
        let Some(job) = &self.job else {
            return Ok(());
        };
        self.front_scale = Some(job.view.radiance_scale);
        let stamp = log.clock.stamp("first look");
        self.lighting
            .take_preview(&self.context, &self.scene, &self.strands, self.front, stamp)
    }

    /// Runs the next step of the job, or ends it. [`None`] if there is no job.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn step(&mut self, chunk: u32, log: &mut Log) -> Result<Option<Stepped>, RenderError> {
        let Some(job) = &mut self.job else {
            return Ok(None);
        };
        if self.dirty.is_edited() && job.may_restart() {
            let dirty = std::mem::take(&mut job.dirty);
            self.lighting.forget_through();
            self.begin(dirty, true, chunk, log)?;
            return Ok(Some(Stepped::Restarted));
        }
        if !self.has_volume {
            // After the preview, which needs none.
            self.has_volume = true;
            self.volume.fill(&self.context, log.clock.stamp("voxelise"));
            log.report.ran("voxelise");
        }
        let Some(step) = job.steps.pop_front() else {
            self.front = 1 - self.front;
            self.front_scale = Some(job.view.radiance_scale);
            log.report.stats.scattering = self.scene.scattering().name();
            log.report.stats.skipped = self.scene.skipped();
            log.report.shadings += 1;
            return Ok(self.job.take().map(|job| Stepped::Done(Box::new(job))));
        };
        let stage = step.stage();
        let units = self.lighting.units(&step);
        let stamp = log.clock.stamp(stage);
        let (strands, volume) = (&self.strands, &self.volume);
        let back = 1 - self.front;
        self.lighting
            .submit(&self.context, strands, volume, &step, back, stamp);
        Ok(Some(Stepped::Ran(stage, units)))
    }
}
