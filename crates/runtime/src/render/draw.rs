//! Projecting the strands, rasterising the ribbons in passes of four samples, and composing the
//! picture.

use super::clock::Stamp;
use super::lighting::Lighting;
use super::proxies::DrawnProxies;
use super::resources::{
    StrandBuffers, bind, compute, compute_pass, labelled, shader, step, storage, submit, uniform,
};
use crate::camera::ViewUniform;
use crate::error::RenderError;
use crate::gpu::{Context, Tally};
use crate::sampling::pass_jitter;
use strandlight_formats::Background;

pub(super) const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Side of the viewport in pixels, with the picture in its middle: a power of two, so that corners
/// come out the same whatever it is. Software devices slow down wherever a triangle is clipped; a
/// device with smaller textures gets a smaller one.
fn viewport_side(context: &Context) -> f32 {
    let most = context.device.limits().max_texture_dimension_2d;
    f32::from(1_u16 << most.clamp(1, super::MAX_SIDE).ilog2())
}

/// Segments whose corners share an index buffer: 96 MiB, below the 128 MiB every adapter binds.
pub(super) const SEGMENT_CHUNK: u32 = 4 << 20;

pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Mirrored by `Pass` in `shaders/pass/strands.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Pass {
    jitter: [i32; 2],
    pass_ix: u32,
    pad: u32,
}

/// Mirrored by `Chunk` in `shaders/pass/ribbons.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Chunk {
    first_segment: u32,
    n_segments: u32,
}

/// Mirrored by `Backdrop` in `shaders/pass/composite.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Backdrop {
    color: [f32; 3],
    kind: u32,
    n_lights: u32,
    n_samples: u32,
    pad: [u32; 2],
}

/// Pipelines of drawing.
pub(crate) struct Draw {
    project: wgpu::ComputePipeline,
    ribbons: wgpu::ComputePipeline,
    strands: wgpu::RenderPipeline,
    viewport: f32,
    accumulate: wgpu::ComputePipeline,
    composite: wgpu::ComputePipeline,
}

/// The strands on the screen: what `project` and `ribbons` leave for the passes of a view.
pub(crate) struct Ribbons {
    view: wgpu::Buffer,
    pass: wgpu::Buffer,
    points: [wgpu::Buffer; 3],
    project: wgpu::BindGroup,
    chunks: Vec<RibbonChunk>,
    /// By buffer of radiance.
    strands: Vec<wgpu::BindGroup>,
    /// Drawn before the strands, if there are any.
    proxies: Option<DrawnProxies>,
    n_points: u32,
}

/// Segments that share an index buffer.
struct RibbonChunk {
    corners: wgpu::Buffer,
    group: wgpu::BindGroup,
    n_segments: u32,
}

impl Ribbons {
    /// Room for `strands`, which are lit by one of the buffers of `radiance`.
    pub fn new(
        context: &Context,
        draw: &Draw,
        strands: &StrandBuffers,
        radiance: &[&wgpu::Buffer],
    ) -> Ribbons {
        let n_points = strands.n_points;
        let view: ViewUniform = bytemuck::Zeroable::zeroed();
        let view = uniform(context, "view", &view);
        let pass: Pass = bytemuck::Zeroable::zeroed();
        let pass = uniform(context, "pass", &pass);
        let points = ["edges", "depth and coverage", "spines"]
            .map(|label| storage(context, label, u64::from(n_points) * 16));
        let [edges, depth_coverage, spines] = &points;
        let project = bind(
            context,
            &draw.project.get_bind_group_layout(0),
            &[
                (0, view.as_entire_binding()),
                (1, strands.points.as_entire_binding()),
                (2, strands.tangents.as_entire_binding()),
                (3, edges.as_entire_binding()),
                (4, depth_coverage.as_entire_binding()),
            ],
        );
        let mut chunks = Vec::new();
        for first_segment in (0..strands.n_segments).step_by(SEGMENT_CHUNK as usize) {
            let n_segments = SEGMENT_CHUNK.min(strands.n_segments - first_segment);
            let chunk = Chunk {
                first_segment,
                n_segments,
            };
            let chunk = uniform(context, "chunk", &chunk);
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDEX;
            let corners = labelled(context, "corners", u64::from(n_segments) * 24, usage);
            let group = bind(
                context,
                &draw.ribbons.get_bind_group_layout(0),
                &[
                    (0, view.as_entire_binding()),
                    (1, chunk.as_entire_binding()),
                    (2, strands.segments.as_entire_binding()),
                    (3, edges.as_entire_binding()),
                    (4, depth_coverage.as_entire_binding()),
                    (5, spines.as_entire_binding()),
                    (6, corners.as_entire_binding()),
                ],
            );
            chunks.push(RibbonChunk {
                corners,
                group,
                n_segments,
            });
        }
        let of_radiance = |radiance: &&wgpu::Buffer| {
            bind(
                context,
                &draw.strands.get_bind_group_layout(0),
                &[
                    (0, view.as_entire_binding()),
                    (1, pass.as_entire_binding()),
                    (2, edges.as_entire_binding()),
                    (3, depth_coverage.as_entire_binding()),
                    (4, spines.as_entire_binding()),
                    (5, radiance.as_entire_binding()),
                ],
            )
        };
        let strands = radiance.iter().map(of_radiance).collect();
        Ribbons {
            view,
            pass,
            project,
            chunks,
            strands,
            points,
            proxies: None,
            n_points,
        }
    }

    /// Takes the proxies as `lighting` has them.
    pub fn set_proxies(&mut self, context: &Context, lighting: &Lighting) {
        let proxies = lighting.proxies();
        self.proxies = proxies.map(|proxies| proxies.drawn(context, &self.view, &self.pass));
    }

    /// Takes another view.
    pub fn set_view(&self, context: &Context, view: &ViewUniform) {
        let bytes = bytemuck::bytes_of(view);
        context.queue.write_buffer(&self.view, 0, bytes);
    }

    /// The view as the passes read it.
    pub fn view(&self) -> &wgpu::Buffer {
        &self.view
    }

    /// Projects the points and prepares the segments, once for all passes of a view.
    pub fn project(&self, context: &Context, draw: &Draw, stamp: Stamp) {
        submit(context, |encoder| {
            let mut pass = compute_pass(encoder, stamp);
            let groups = [self.n_points.div_ceil(256), 1];
            step(&mut pass, &draw.project, &self.project, groups);
            for chunk in &self.chunks {
                let groups = [chunk.n_segments.div_ceil(256), 1];
                step(&mut pass, &draw.ribbons, &chunk.group, groups);
            }
        });
    }

    pub fn bytes(&self) -> u64 {
        let points: u64 = self.points.iter().map(wgpu::Buffer::size).sum();
        let corners = self.chunks.iter().map(|chunk| chunk.corners.size());
        points + corners.sum::<u64>()
    }
}

/// What pictures of one size are drawn into.
pub(crate) struct Target {
    size: [u32; 2],
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
    sums: wgpu::Buffer,
    picture: wgpu::Buffer,
    backdrop: wgpu::Buffer,
    accumulate: wgpu::BindGroup,
    composite: wgpu::BindGroup,
    /// The lights that `composite` is bound to.
    lights: wgpu::Buffer,
}

impl Target {
    /// Room for pictures of `size`, none of whose sides is zero, with `lights` behind them.
    pub fn new(
        context: &Context,
        draw: &Draw,
        ribbons: &Ribbons,
        size: [u32; 2],
        lights: &wgpu::Buffer,
    ) -> Target {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let to_read = usage | wgpu::TextureUsages::TEXTURE_BINDING;
        let color = texture(context, "samples", size, 4, COLOR, to_read);
        let depth = texture(context, "depth", size, 4, DEPTH, usage);
        let bytes = u64::from(size[0]) * u64::from(size[1]) * 16;
        let sums = storage(context, "sums", bytes);
        let picture = storage(context, "picture", bytes);
        let backdrop: Backdrop = bytemuck::Zeroable::zeroed();
        let backdrop = uniform(context, "backdrop", &backdrop);
        let accumulate = bind(
            context,
            &draw.accumulate.get_bind_group_layout(0),
            &[
                (0, ribbons.view.as_entire_binding()),
                (1, wgpu::BindingResource::TextureView(&color)),
                (2, sums.as_entire_binding()),
            ],
        );
        let buffers = [&ribbons.view, &backdrop, lights, &sums, &picture];
        Target {
            composite: bind_composite(context, draw, buffers),
            size,
            color,
            depth,
            sums,
            picture,
            backdrop,
            accumulate,
            lights: lights.clone(),
        }
    }

    /// Samples in the next passes are the first.
    pub fn clear(&self, context: &Context) {
        submit(context, |encoder| encoder.clear_buffer(&self.sums, 0, None));
    }

    /// Draws four samples a pixel of the strands as `ribbons` has them, lit by the radiance buffer
    /// `radiance`, and adds them to the sums.
    pub fn pass(
        &self,
        context: &Context,
        draw: &Draw,
        ribbons: &Ribbons,
        radiance: usize,
        pass_ix: u32,
        stamp: Stamp,
    ) {
        let pass = Pass {
            jitter: pass_jitter(pass_ix),
            pass_ix,
            pad: 0,
        };
        let bytes = bytemuck::bytes_of(&pass);
        context.queue.write_buffer(&ribbons.pass, 0, bytes);
        submit(context, |encoder| {
            self.rasterise(encoder, draw, ribbons, radiance, stamp.first());
            let mut pass = compute_pass(encoder, stamp.last());
            let groups = self.size.map(|n| n.div_ceil(8));
            step(&mut pass, &draw.accumulate, &self.accumulate, groups);
        });
    }

    fn rasterise(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        draw: &Draw,
        ribbons: &Ribbons,
        radiance: usize,
        stamp: Stamp,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("strands"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: stamp.of_render(),
            ..Default::default()
        });
        if let Some(proxies) = &ribbons.proxies {
            proxies.draw(&mut pass, self.size, radiance);
        }
        pass.set_pipeline(&draw.strands);
        pass.set_bind_group(0, &ribbons.strands[radiance], &[]);
        let [left, top] = self.size.map(|n| 0.5 * (n as f32 - draw.viewport));
        pass.set_viewport(left, top, draw.viewport, draw.viewport, 0.0, 1.0);
        for chunk in &ribbons.chunks {
            pass.set_index_buffer(chunk.corners.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..6 * chunk.n_segments, 0, 0..1);
        }
    }

    /// Turns the sums of `samples` samples into the linear picture, before `background` or the
    /// first `n_lights` of `lights`.
    pub fn composite(
        &mut self,
        context: &Context,
        draw: &Draw,
        ribbons: &Ribbons,
        (background, samples): (&Background, u32),
        (lights, n_lights): (&wgpu::Buffer, u32),
        stamp: Stamp,
    ) {
        let (kind, color) = match *background {
            Background::None => (0, [0.0; 3]),
            Background::Color(color) => (1, color),
            Background::Lights => (2, [0.0; 3]),
        };
        let backdrop = Backdrop {
            color,
            kind,
            n_lights,
            n_samples: samples,
            pad: [0; 2],
        };
        let bytes = bytemuck::bytes_of(&backdrop);
        context.queue.write_buffer(&self.backdrop, 0, bytes);
        if self.lights != *lights {
            let buffers = [
                &ribbons.view,
                &self.backdrop,
                lights,
                &self.sums,
                &self.picture,
            ];
            self.composite = bind_composite(context, draw, buffers);
            self.lights = lights.clone();
        }
        submit(context, |encoder| {
            let mut pass = compute_pass(encoder, stamp);
            let groups = self.size.map(|n| n.div_ceil(8));
            step(&mut pass, &draw.composite, &self.composite, groups);
        });
    }

    /// What [`Target::composite`] left: linear rgb times alpha, and alpha, row by row.
    pub fn picture(&self) -> &wgpu::Buffer {
        &self.picture
    }

    /// Sums of all samples so far.
    pub fn sums(&self) -> &wgpu::Buffer {
        &self.sums
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    pub fn bytes(&self) -> u64 {
        let samples = u64::from(self.size[0]) * u64::from(self.size[1]) * 4;
        self.sums.size() + self.picture.size() + samples * 12
    }
}

fn bind_composite(context: &Context, draw: &Draw, buffers: [&wgpu::Buffer; 5]) -> wgpu::BindGroup {
    let resources = [0, 1, 2, 3, 4].map(|ix| (ix as u32, buffers[ix].as_entire_binding()));
    let layout = draw.composite.get_bind_group_layout(0);
    bind(context, &layout, &resources)
}

/// A texture's whole, none of its sides being zero.
pub(crate) fn texture(
    context: &Context,
    label: &'static str,
    [width, height]: [u32; 2],
    sample_count: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureView {
    let texel = u64::from(format.block_copy_size(None).unwrap_or(4));
    let n_texels = u64::from(width) * u64::from(height) * u64::from(sample_count);
    context.tally().add_texture(n_texels * texel);
    let texture = context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

impl Draw {
    pub fn new(context: &Context) -> Result<Self, RenderError> {
        let project = compute(context, &shader(context, "pass/project")?, "project");
        let ribbons = compute(context, &shader(context, "pass/ribbons")?, "ribbons");
        let accumulate = compute(context, &shader(context, "pass/accumulate")?, "accumulate");
        let composite = compute(context, &shader(context, "pass/composite")?, "composite");
        let module = shader(context, "pass/strands")?;
        let viewport = viewport_side(context);
        // Corners are in 1/256 px from the middle.
        let constants = [("CLIP_PER_UNIT", 1.0 / (128.0 * f64::from(viewport)))];
        Tally::add(&context.tally().pipelines);
        let strands = context
            .device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("strands"),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("ribbon"),
                    compilation_options: wgpu::PipelineCompilationOptions {
                        constants: &constants,
                        ..Default::default()
                    },
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::Less),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: wgpu::MultisampleState {
                    count: 4,
                    ..Default::default()
                },
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("cover"),
                    compilation_options: Default::default(),
                    targets: &[Some(COLOR.into())],
                }),
                multiview_mask: None,
                cache: None,
            });
        Ok(Draw {
            project,
            ribbons,
            strands,
            viewport,
            accumulate,
            composite,
        })
    }
}
