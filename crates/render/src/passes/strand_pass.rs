//! Strands in a render pass: of a host, with its formats, its samples and its depth, or of a film.

use super::covering::covering;
use super::draw::{LitPoints, Ribbons};
use super::film::viewport_side;
use super::pieces::{self, PieceBuffers};
use super::profile;
use super::resources::{module_with, uniform};
use crate::gpu::{Context, ResourceCounters};
use crate::hair_options::HairOptions;
use strandlight_scene::RenderError;

/// Turns on what strands in a host's pass take.
const HOSTED: &str = "HOSTED";

/// Turns on light of narrow lights along segments.
const NARROW: &str = "NARROW";

/// Entry points of the vertices: of segments, and of their pieces in close-ups.
const VERTICES: [&str; 2] = ["ribbon", "piece"];

/// Entry point of the fragments.
const FRAGMENTS: &str = "cover";

/// Bindings of what [`Ribbons`] have of segments.
const EDGES: u32 = 2;
const SPINES: u32 = 4;

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

/// What of strands is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StrandFeatures {
    /// Light of narrow lights along them.
    pub is_narrow: bool,
    /// The profile of wide ones.
    pub is_wide: bool,
    /// Pieces of bent segments and of tips.
    pub is_close_up: bool,
}

impl StrandFeatures {
    /// What the shader is to have.
    fn features(self, hosted: Option<&'static str>) -> Vec<&'static str> {
        let further = [
            (self.is_narrow, NARROW),
            (self.is_wide, profile::FEATURE),
            (self.is_close_up, pieces::FEATURE),
        ];
        let further = further.into_iter().filter(|(is_on, _)| *is_on);
        hosted
            .into_iter()
            .chain(further.map(|(_, name)| name))
            .collect()
    }
}

/// Draws strands into passes.
pub(crate) struct StrandPass {
    segments: Drawing,
    /// In close-ups.
    pieces: Option<Drawing>,
    /// How the host projects; none for a film.
    host: Option<wgpu::Buffer>,
    /// What it was made for.
    pub drawn: StrandFeatures,
}

/// A pipeline with its bindings by buffer of radiance.
struct Drawing {
    pipeline: wgpu::RenderPipeline,
    groups: Vec<wgpu::BindGroup>,
}

impl StrandPass {
    /// Draws `ribbons`, lit by one of `lit`, as `options` of a host say, or else into films.
    pub fn new(
        context: &Context,
        options: Option<&HairOptions>,
        ribbons: &Ribbons,
        lit: &[LitPoints],
        drawn: StrandFeatures,
    ) -> Result<StrandPass, RenderError> {
        let features = drawn.features(options.map(|_| HOSTED));
        let module = module_with(context, "pass/strands", &features)?;
        let host = options.map(|_| {
            let host: Host = bytemuck::Zeroable::zeroed();
            uniform(context, "host", &host)
        });
        // Corners are in 1/256 px from the middle.
        let clip_per_unit = 1.0 / (128.0 * f64::from(viewport_side(context)));
        let constants = [("CLIP_PER_UNIT", clip_per_unit)];
        let drawing = |vertices: &'static str, pieces: Option<&wgpu::Buffer>| {
            let pipeline = match options {
                Some(options) => hosted(context, options, &module, vertices),
                None => {
                    let entries = [vertices, FRAGMENTS];
                    covering(context, vertices, &module, entries, &constants)
                }
            };
            // Pieces have edges and spines of their own; the profile is as wide as the segment.
            let unused: &[u32] = match (pieces.is_some(), drawn.is_wide) {
                (false, _) => &[],
                (true, true) => &[SPINES],
                (true, false) => &[EDGES, SPINES],
            };
            let host = host.as_ref().map(|host| (6, host.as_entire_binding()));
            let pieces = pieces.map(|pieces| (8, pieces.as_entire_binding()));
            let further: Vec<_> = host.into_iter().chain(pieces).collect();
            let layout = pipeline.get_bind_group_layout(0);
            Drawing {
                groups: ribbons.bind_strands(context, &layout, lit, (unused, &further)),
                pipeline,
            }
        };
        let pieces = ribbons.pieces().map(PieceBuffers::buffer);
        Ok(StrandPass {
            segments: drawing(VERTICES[0], None),
            pieces: pieces.map(|pieces| drawing(VERTICES[1], Some(pieces))),
            host,
            drawn,
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
        self.segments.set(pass, radiance);
        ribbons.draw_segments(pass);
        if let (Some(drawing), Some(pieces)) = (&self.pieces, ribbons.pieces()) {
            drawing.set(pass, radiance);
            pieces.draw(pass);
        }
    }
}

impl Drawing {
    fn set(&self, pass: &mut wgpu::RenderPass, radiance: usize) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.groups[radiance], &[]);
    }
}

/// A pipeline for the passes of a host.
fn hosted(
    context: &Context,
    options: &HairOptions,
    module: &wgpu::ShaderModule,
    vertices: &'static str,
) -> wgpu::RenderPipeline {
    ResourceCounters::add(&context.resource_counters().pipelines);
    let compare = match options.reverse_z {
        true => wgpu::CompareFunction::Greater,
        false => wgpu::CompareFunction::Less,
    };
    let descriptor = wgpu::RenderPipelineDescriptor {
        label: Some("hair"),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertices),
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
            module,
            entry_point: Some(FRAGMENTS),
            compilation_options: Default::default(),
            targets: &[Some(options.color_format.into())],
        }),
        multiview_mask: None,
        cache: None,
    };
    context.device.create_render_pipeline(&descriptor)
}
