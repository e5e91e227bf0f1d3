//! Strands in a render pass: of a host, with its formats, its samples and its depth, or of a film.

use super::covering::covering;
use super::draw::{LitPoints, Ribbons};
use super::film::viewport_side;
use super::profile;
use super::resources::{module_with, uniform};
use crate::gpu::{Context, ResourceCounters};
use crate::hair_options::HairOptions;
use strandlight_scene::RenderError;

/// Turns on what strands in a host's pass take.
const HOSTED: &str = "HOSTED";

/// Turns on light of narrow lights along segments.
const NARROW: &str = "NARROW";

/// Entry points of the vertices and the fragments.
const ENTRIES: [&str; 2] = ["ribbon", "cover"];

/// How the host projects; mirrored by `Host` in `shaders/pass/strands.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Host {
    /// The host's depth is `depth[0] + depth[1] / d`, where d cm is the depth along the line of
    /// sight.
    pub depth: [f32; 2],
    /// What the projection moves the picture by, in halves of its sides, x to the right and y
    /// upwards.
    pub shift: [f32; 2],
    /// Upper left corner of the viewport, pixels.
    pub corner: [f32; 2],
    /// Factor from the radiance of the points to linear radiance.
    pub scale: f32,
    /// Not used.
    pub pad: f32,
}

strandlight_scattering::mirrors! {
    Host as "Host" in "pass/strands" { depth, shift, corner, scale, pad }
}

/// Draws strands into passes.
pub(crate) struct StrandPass {
    pipeline: wgpu::RenderPipeline,
    /// How the host projects; none for a film.
    host: Option<wgpu::Buffer>,
    /// By buffer of radiance.
    groups: Vec<wgpu::BindGroup>,
    /// Does it draw light of narrow lights?
    pub is_narrow: bool,
    /// Have wide strands a profile?
    pub is_wide: bool,
}

fn is_narrow(lit: &[LitPoints]) -> bool {
    lit.iter().any(|(_, along)| along.is_some())
}

/// What the shader is to have.
fn features(lit: &[LitPoints], is_wide: bool, hosted: Option<&'static str>) -> Vec<&'static str> {
    let narrow = is_narrow(lit).then_some(NARROW);
    let wide = is_wide.then_some(profile::FEATURE);
    hosted.into_iter().chain(narrow).chain(wide).collect()
}

impl StrandPass {
    /// Draws `ribbons`, lit by one of `lit`, as `options` of a host say, or else into films; where some are wide with a
    /// profile.
    pub fn new(
        context: &Context,
        options: Option<&HairOptions>,
        ribbons: &Ribbons,
        lit: &[LitPoints],
        is_wide: bool,
    ) -> Result<StrandPass, RenderError> {
        match options {
            Some(options) => StrandPass::for_host(context, options, ribbons, lit, is_wide),
            None => StrandPass::for_film(context, ribbons, lit, is_wide),
        }
    }

    /// Draws `ribbons`, lit by one of `lit`, into films.
    fn for_film(
        context: &Context,
        ribbons: &Ribbons,
        lit: &[LitPoints],
        is_wide: bool,
    ) -> Result<StrandPass, RenderError> {
        let module = module_with(context, "pass/strands", &features(lit, is_wide, None))?;
        // Corners are in 1/256 px from the middle.
        let clip_per_unit = 1.0 / (128.0 * f64::from(viewport_side(context)));
        let constants = [("CLIP_PER_UNIT", clip_per_unit)];
        let pipeline = covering(context, "strands", &module, ENTRIES, &constants);
        let layout = pipeline.get_bind_group_layout(0);
        Ok(StrandPass {
            groups: ribbons.bind_strands(context, &layout, lit, &[]),
            is_narrow: is_narrow(lit),
            is_wide,
            pipeline,
            host: None,
        })
    }

    /// Draws `ribbons`, lit by one of `lit`, as `options` say.
    fn for_host(
        context: &Context,
        options: &HairOptions,
        ribbons: &Ribbons,
        lit: &[LitPoints],
        is_wide: bool,
    ) -> Result<StrandPass, RenderError> {
        let features = features(lit, is_wide, Some(HOSTED));
        let module = module_with(context, "pass/strands", &features)?;
        ResourceCounters::add(&context.resource_counters().pipelines);
        let compare = match options.reverse_z {
            true => wgpu::CompareFunction::Greater,
            false => wgpu::CompareFunction::Less,
        };
        let descriptor = wgpu::RenderPipelineDescriptor {
            label: Some("hair"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(ENTRIES[0]),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: options.depth_format,
                depth_write_enabled: Some(true),
                depth_compare: Some(compare),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: wgpu::MultisampleState {
                count: options.sample_count,
                ..Default::default()
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(ENTRIES[1]),
                compilation_options: Default::default(),
                targets: &[Some(options.color_format.into())],
            }),
            multiview_mask: None,
            cache: None,
        };
        let pipeline = context.device.create_render_pipeline(&descriptor);
        let host: Host = bytemuck::Zeroable::zeroed();
        let host = uniform(context, "host", &host);
        let layout = pipeline.get_bind_group_layout(0);
        let further = [(6, host.as_entire_binding())];
        let groups = ribbons.bind_strands(context, &layout, lit, &further);
        Ok(StrandPass {
            is_narrow: is_narrow(lit),
            is_wide,
            pipeline,
            host: Some(host),
            groups,
        })
    }

    /// Takes another projection of the host.
    pub fn set_host(&self, context: &Context, host: &Host) {
        if let Some(buffer) = &self.host {
            context.write(buffer, 0, bytemuck::bytes_of(host));
        }
    }

    /// Draws the strands, lit by the radiance buffer `radiance`, into the viewport of `pass`.
    pub fn draw(&self, pass: &mut wgpu::RenderPass, ribbons: &Ribbons, radiance: usize) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.groups[radiance], &[]);
        ribbons.draw_segments(pass);
    }
}
