//! Hair on a device: its scene, edits, shadows and shading, drawn in render passes of others.
//!
//! Setters mark what is out of date in [`DirtyFlags`] and return at once. [`HairRenderer::begin`]
//! writes what was set to the device and plans a [`ShadingJob`]; [`HairRenderer::step`] runs one of
//! its steps. A job lights the radiance buffer that is not shown; when it is done, the two change
//! places. What is set during a job waits for the next one.

mod job;
mod prepare;
mod set;
mod shading;
mod view;
mod visible;
mod visible_list;

use crate::gpu::{Context, GpuError, ResourceCounts};
use crate::hair_options::HairOptions;
use crate::limits;
use crate::passes::DeviceBytes;
use crate::passes::clock::Clock;
use crate::passes::deform::Deform;
use crate::passes::draw::{Projection, Ribbons};
use crate::passes::lighting::Lighting;
use crate::passes::resources::StrandBuffers;
use crate::passes::strand_pass::{StrandFeatures, StrandPass};
use crate::passes::volume::Volume;
use strandlight_scene::RenderError;
use strandlight_scene::camera::{ViewUniform, view_uniform};
use strandlight_scene::interactive::RenderReport;
use strandlight_scene::motion::Wind;
use strandlight_scene::scene::PreparedScene;

pub(crate) use job::{DirtyFlags, ShadingJob, Stepped};
pub use view::{HairView, ViewError};
pub(crate) use visible::ListDrawn;
use visible_list::VisibleList;

/// Margin of pictures whose view may turn.
const MARGIN: f32 = 0.15;

/// Radiance buffers: one that is shown and one that is being lit.
pub(crate) const N_RADIANCE: usize = 2;

/// Why hair cannot be prepared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HairError {
    /// The view.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The device cannot do what is needed, or failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The scene does not fit, or the device refuses it.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Not 1 or 4 samples.
    #[error("{0} samples a pixel: hair is drawn with 1 or 4")]
    Samples(u32),
}

/// How much of the shading a call of [`HairRenderer::prepare`] does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PrepareBudget {
    /// All of it: the picture is that of the scene and view as set.
    #[default]
    Complete,
    /// At most so many steps: a shadow map, a direction of a batch of lights, or 32,768 points
    /// each. Hair keeps the shading of the last complete job meanwhile, and moves with the view.
    Steps(u32),
}

/// Draws hair in a host's render pass, on the host's device.
///
/// Nothing is submitted and no callback is set: commands go into the host's encoder and pass. The
/// order of a frame is [`HairRenderer::prepare`], then [`HairRenderer::draw`] in a pass recorded
/// later with the same encoder, then the host's submission. Proxies of the scene shade the hair and
/// are not drawn: the host draws its own meshes.
///
/// Besides the commands, setters and `prepare` write to buffers and textures through the queue,
/// which take effect when the host submits.
///
/// [`ProgressiveRenderer`](crate::ProgressiveRenderer) is a host as well: it draws its hair with
/// one of these into a film of its own.
pub struct HairRenderer {
    pub(crate) context: Context,
    pub(crate) scene: PreparedScene,
    pub(crate) volume: Volume,
    pub(crate) lighting: Lighting,
    pub(crate) ribbons: Ribbons,
    /// What was set since the last job began.
    pub(crate) dirty: DirtyFlags,
    pub(crate) job: Option<ShadingJob>,
    /// The buffer of radiance that is shown, and its scale; none before anything is lit.
    pub(crate) front: usize,
    pub(crate) front_scale: Option<f32>,
    /// The list whose points alone are lit in it; none where all are.
    front_list: Option<u64>,
    /// The ribbons are those of the points on the device and of the view.
    pub(crate) is_projected: bool,
    pub(crate) clock: Clock,
    pub(crate) report: RenderReport,
    /// What was made on the device before the last edit.
    pub(crate) counts_before: ResourceCounts,
    strands: StrandBuffers,
    projection: Projection,
    strand_pass: StrandPass,
    /// Of pictures that are drawn without samples.
    visible: Option<VisibleList>,
    /// Only the points that the list of a view has are shaded.
    draws_by_list: bool,
    /// The wind that bends the strands of the scene, and what does.
    wind: Option<Wind>,
    deform: Option<Deform>,
    /// Whether the shadow volume is that of the points.
    has_volume: bool,
    /// Share of the picture's longer side around it where points are lit too: they are there when
    /// the view turns.
    margin: f32,
    /// What the host's pass is like; none of the film of a progressive renderer.
    options: Option<HairOptions>,
    /// The host's view and the scale of its radiance, as the device has them.
    hosted: Option<(HairView, f32)>,
}

impl HairRenderer {
    /// Puts `scene` on the host's device, to be drawn in passes as `options` say. The scene's
    /// camera, size and samples are the host's affair and are not used.
    ///
    /// # Errors
    /// Limits of the device that are too low: see [`required_limits`]. Samples other than 1 or 4.
    /// Whatever the device refuses.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: PreparedScene,
        options: HairOptions,
    ) -> Result<HairRenderer, HairError> {
        if ![1, 4].contains(&options.sample_count) {
            return Err(HairError::Samples(options.sample_count));
        }
        required_limits(&device.limits())?;
        let context = Context::from_host(device, queue);
        Ok(HairRenderer::on(
            &context,
            fitting(&context, scene)?,
            Clock::none(),
            Some(options),
        )?)
    }

    /// Puts `scene` on the device of `context`; nothing is lit yet. Without `options` it is drawn
    /// into films.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub(crate) fn on(
        context: &Context,
        scene: PreparedScene,
        clock: Clock,
        options: Option<HairOptions>,
    ) -> Result<HairRenderer, RenderError> {
        let context = &context.with_own_commands();
        let counts_before = context.counts();
        let strands = StrandBuffers::new(context, &scene.strands);
        let volume = Volume::new(context, &scene.strands, &strands)?;
        let lighting = Lighting::new(context, &scene, &volume, &strands, N_RADIANCE)?;
        let projection = Projection::new(context)?;
        let ribbons = Ribbons::new(context, &projection, &strands);
        let lit = lighting.lit_points();
        let drawn = StrandFeatures {
            is_narrow: lit.iter().any(|(_, along)| along.is_some()),
            is_wide: false,
            is_close_up: false,
        };
        let strand_pass = StrandPass::new(context, options.as_ref(), &ribbons, &lit, drawn)?;
        Ok(HairRenderer {
            context: context.clone(),
            volume,
            lighting,
            ribbons,
            dirty: DirtyFlags::all(),
            job: None,
            front: 0,
            front_scale: None,
            front_list: None,
            is_projected: false,
            clock,
            report: RenderReport::default(),
            counts_before,
            strands,
            projection,
            strand_pass,
            visible: None,
            draws_by_list: false,
            wind: None,
            deform: None,
            has_volume: false,
            margin: MARGIN,
            options,
            hosted: None,
            scene,
        })
    }

    /// Replaces the scene.
    ///
    /// # Errors
    /// Whatever the device refuses; nothing is changed then.
    pub fn set_scene(&mut self, scene: PreparedScene) -> Result<(), RenderError> {
        let scene = fitting(&self.context, scene)?;
        *self = HairRenderer::on(&self.context, scene, Clock::none(), self.options)?;
        Ok(())
    }

    /// The scene as last set.
    pub fn scene(&self) -> &PreparedScene {
        &self.scene
    }

    /// Is the hair that [`HairRenderer::draw`] draws lit as last set? If not, another
    /// [`HairRenderer::prepare`] goes on.
    pub fn is_complete(&self) -> bool {
        self.front_scale.is_some() && self.job.is_none() && self.dirty.is_clean()
    }

    /// Are only the points lit, of the radiance that is shown, that some view shows?
    pub(crate) fn is_partly_lit(&self) -> bool {
        self.front_list.is_some()
    }

    /// What was made on the device; submissions of a host stay 0.
    #[doc(hidden)]
    pub fn counts(&self) -> ResourceCounts {
        self.context.counts()
    }

    /// Draws the hair into `pass`, whose attachments are those of [`HairOptions`] and whose
    /// viewport is that of the last [`HairRenderer::prepare`]. Writes linear radiance and alpha 1
    /// to the samples that strands cover; sets pipeline, bind group 0 and index buffer.
    pub fn draw(&self, pass: &mut wgpu::RenderPass) {
        if self.is_projected {
            self.strand_pass.draw(pass, &self.ribbons, self.front);
        }
    }

    /// The view of the scene's camera, with the scale of the radiance that is shown.
    pub(crate) fn view(&self) -> ViewUniform {
        let scale = self.front_scale.unwrap_or(1.0);
        let scene = &self.scene;
        view_uniform(&scene.camera, &scene.strands, scene.size, scale)
    }

    /// Projects the strands for `view`.
    pub(crate) fn project(&mut self, view: &ViewUniform) {
        self.ribbons.set_view(&self.context, view);
        let stamp = self.clock.stamp("project");
        self.ribbons.project(&self.context, &self.projection, stamp);
        self.is_projected = true;
    }

    /// Bytes of the buffers on the device.
    pub(crate) fn bytes(&self) -> u64 {
        let lighting = self.lighting.bytes().map(|(_, bytes)| bytes);
        let fixed = self.strands.bytes() + self.volume.bytes() + self.ribbons.bytes();
        fixed + self.list_bytes() + lighting.iter().sum::<u64>()
    }
}

/// The limits that a host asks its adapter for, which offers `offered`: WebGPU's defaults, or less
/// where the adapter has less and hair needs no more.
///
/// # Errors
/// The first limit that is too low for hair.
pub fn required_limits(offered: &wgpu::Limits) -> Result<wgpu::Limits, GpuError> {
    limits::to_ask_for(offered, limits::Demand::Least).map_err(|reason| GpuError::Unsuitable {
        adapter: "of the host".to_owned(),
        reason,
    })
}

/// `scene` as it fits the device of a host, which has pictures of its own.
fn fitting(context: &Context, scene: PreparedScene) -> Result<PreparedScene, RenderError> {
    DeviceBytes::fit(scene, [1; 2], &context.device.limits(), u64::MAX)
}
