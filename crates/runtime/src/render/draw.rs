//! Projecting the strands, rasterising the ribbons in passes of four samples, and composing the picture.

use super::lighting::Shading;
use super::resources::{
    StrandBuffers, bind, compute, dispatch, failed, read_back, shader, storage, submit, uniform,
};
use crate::camera::ViewUniform;
use crate::error::RenderError;
use crate::gpu::Context;
use crate::picture::Picture;
use crate::sampling::pass_jitter;
use crate::scene::PreparedScene;
use crate::stats::{LIGHTING_SHARE, Observer, Stats};
use strandlight_formats::Background;

const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Side of the viewport in pixels, with the picture in its middle; twin of `CLIP_PER_UNIT` in
/// `shaders/pass/strands.wgsl`. Software devices slow down wherever a triangle is clipped.
const VIEWPORT: f32 = 8192.0;

/// Segments whose corners share an index buffer: 96 MiB, below the 128 MiB every adapter binds.
const SEGMENT_CHUNK: u32 = 4 << 20;

const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

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
pub(super) struct Draw {
    project: wgpu::ComputePipeline,
    ribbons: wgpu::ComputePipeline,
    strands: wgpu::RenderPipeline,
    accumulate: wgpu::ComputePipeline,
    composite: wgpu::ComputePipeline,
}

/// What `project` and `ribbons` leave for the passes.
struct Ribbons {
    edges: wgpu::Buffer,
    depth_coverage: wgpu::Buffer,
    spines: wgpu::Buffer,
    /// Index buffers and how many indices each holds.
    corners: Vec<(wgpu::Buffer, u32)>,
}

impl Ribbons {
    fn bytes(&self) -> u64 {
        let points = [&self.edges, &self.depth_coverage, &self.spines];
        let corners = self.corners.iter().map(|(buffer, _)| buffer);
        points.into_iter().chain(corners).map(|b| b.size()).sum()
    }
}

/// What one picture is made of.
pub(super) struct Frame<'a> {
    pub scene: &'a PreparedScene,
    pub strands: &'a StrandBuffers,
    pub shading: &'a Shading,
    pub view: &'a ViewUniform,
    pub samples: u32,
    pub observer: Observer<'a>,
}

impl Draw {
    pub fn new(context: &Context) -> Result<Self, RenderError> {
        let project = compute(context, &shader(context, "pass/project")?, "project");
        let ribbons = compute(context, &shader(context, "pass/ribbons")?, "ribbons");
        let accumulate = compute(context, &shader(context, "pass/accumulate")?, "accumulate");
        let composite = compute(context, &shader(context, "pass/composite")?, "composite");
        let module = shader(context, "pass/strands")?;
        let strands = context
            .device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("strands"),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("ribbon"),
                    compilation_options: Default::default(),
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
            accumulate,
            composite,
        })
    }

    /// Draws the frame and reads it back.
    pub fn run(
        &self,
        context: &Context,
        frame: &Frame,
        stats: &mut Stats,
    ) -> Result<Picture, RenderError> {
        let [width, height] = frame.view.size;
        let picture = storage(
            context,
            "picture",
            u64::from(width) * u64::from(height) * 16,
        );
        let view = uniform(context, "view", frame.view);
        stats.stage("draw", |_| {
            let bytes = self.passes(context, frame, &view, &picture)?;
            Ok::<_, RenderError>(((), bytes + picture.size()))
        })?;
        let rgba = stats.stage("composite", |_| {
            let rgba = self.finish(context, frame, &view, &picture)?;
            Ok::<_, RenderError>((rgba, picture.size()))
        })?;
        Ok(Picture {
            width,
            height,
            rgba,
        })
    }

    fn passes(
        &self,
        context: &Context,
        frame: &Frame,
        view: &wgpu::Buffer,
        picture: &wgpu::Buffer,
    ) -> Result<u64, RenderError> {
        let ribbons = self.ribbons(context, frame, view);
        let [width, height] = frame.view.size;
        let target = |label, format, usage| {
            let texture = context.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width,
                    height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 4,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        let color = target("samples", COLOR, wgpu::TextureUsages::TEXTURE_BINDING);
        let depth = target("depth", DEPTH, wgpu::TextureUsages::empty());
        let zero = Pass {
            jitter: [0; 2],
            pass_ix: 0,
            pad: 0,
        };
        let pass_buffer = uniform(context, "pass", &zero);
        let strands_group = bind(
            context,
            &self.strands.get_bind_group_layout(0),
            &[
                (0, view.as_entire_binding()),
                (1, pass_buffer.as_entire_binding()),
                (2, ribbons.edges.as_entire_binding()),
                (3, ribbons.depth_coverage.as_entire_binding()),
                (4, ribbons.spines.as_entire_binding()),
                (5, frame.shading.radiance().as_entire_binding()),
            ],
        );
        let accumulate_group = bind(
            context,
            &self.accumulate.get_bind_group_layout(0),
            &[
                (0, view.as_entire_binding()),
                (1, wgpu::BindingResource::TextureView(&color)),
                (2, picture.as_entire_binding()),
            ],
        );
        for pass_ix in 0..frame.samples / 4 {
            let pass = Pass {
                jitter: pass_jitter(pass_ix),
                pass_ix,
                pad: 0,
            };
            context
                .queue
                .write_buffer(&pass_buffer, 0, bytemuck::bytes_of(&pass));
            submit(context, |encoder| {
                self.rasterise(
                    encoder,
                    &strands_group,
                    &color,
                    &depth,
                    &ribbons.corners,
                    frame,
                );
                let groups = [width.div_ceil(8), height.div_ceil(8)];
                dispatch(encoder, &self.accumulate, &accumulate_group, groups);
            });
            // One pass at a time: a software device takes a second for some of them.
            context.wait("draw").map_err(failed)?;
            let done = f64::from(4 * (pass_ix + 1)) / f64::from(frame.samples);
            (frame.observer)(LIGHTING_SHARE + (1.0 - LIGHTING_SHARE) * done);
        }
        let samples = u64::from(width) * u64::from(height) * 4;
        Ok(ribbons.bytes() + samples * 12)
    }

    /// Projects the points and prepares the segments, once for all passes.
    fn ribbons(&self, context: &Context, frame: &Frame, view: &wgpu::Buffer) -> Ribbons {
        let n_points = frame.strands.n_points;
        let a_point = |label| storage(context, label, u64::from(n_points) * 16);
        let edges = a_point("edges");
        let depth_coverage = a_point("depth and coverage");
        let spines = a_point("spines");
        let project_group = bind(
            context,
            &self.project.get_bind_group_layout(0),
            &[
                (0, view.as_entire_binding()),
                (1, frame.strands.points.as_entire_binding()),
                (2, frame.strands.tangents.as_entire_binding()),
                (3, edges.as_entire_binding()),
                (4, depth_coverage.as_entire_binding()),
            ],
        );
        submit(context, |encoder| {
            let groups = [n_points.div_ceil(256), 1];
            dispatch(encoder, &self.project, &project_group, groups);
        });
        let mut corners = Vec::new();
        for first_segment in (0..frame.strands.n_segments).step_by(SEGMENT_CHUNK as usize) {
            let n_segments = SEGMENT_CHUNK.min(frame.strands.n_segments - first_segment);
            let chunk = Chunk {
                first_segment,
                n_segments,
            };
            let chunk = uniform(context, "chunk", &chunk);
            let indices = context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("corners"),
                size: u64::from(n_segments) * 24,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDEX,
                mapped_at_creation: false,
            });
            let group = bind(
                context,
                &self.ribbons.get_bind_group_layout(0),
                &[
                    (0, view.as_entire_binding()),
                    (1, chunk.as_entire_binding()),
                    (2, frame.strands.segments.as_entire_binding()),
                    (3, edges.as_entire_binding()),
                    (4, depth_coverage.as_entire_binding()),
                    (5, spines.as_entire_binding()),
                    (6, indices.as_entire_binding()),
                ],
            );
            submit(context, |encoder| {
                let groups = [n_segments.div_ceil(256), 1];
                dispatch(encoder, &self.ribbons, &group, groups);
            });
            corners.push((indices, 6 * n_segments));
        }
        Ribbons {
            edges,
            depth_coverage,
            spines,
            corners,
        }
    }

    fn rasterise(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        group: &wgpu::BindGroup,
        color: &wgpu::TextureView,
        depth: &wgpu::TextureView,
        corners: &[(wgpu::Buffer, u32)],
        frame: &Frame,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("strands"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.strands);
        pass.set_bind_group(0, group, &[]);
        let [left, top] = frame.view.size.map(|n| 0.5 * (n as f32 - VIEWPORT));
        pass.set_viewport(left, top, VIEWPORT, VIEWPORT, 0.0, 1.0);
        for (indices, n_corners) in corners {
            pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..*n_corners, 0, 0..1);
        }
    }

    fn finish(
        &self,
        context: &Context,
        frame: &Frame,
        view: &wgpu::Buffer,
        picture: &wgpu::Buffer,
    ) -> Result<Vec<[f32; 4]>, RenderError> {
        let (kind, color) = match frame.scene.background {
            Background::None => (0, [0.0; 3]),
            Background::Color(color) => (1, color),
            Background::Lights => (2, [0.0; 3]),
        };
        let backdrop = Backdrop {
            color,
            kind,
            n_lights: frame.scene.lights.len() as u32,
            n_samples: frame.samples,
            pad: [0; 2],
        };
        let backdrop = uniform(context, "backdrop", &backdrop);
        let group = bind(
            context,
            &self.composite.get_bind_group_layout(0),
            &[
                (0, view.as_entire_binding()),
                (1, backdrop.as_entire_binding()),
                (2, frame.shading.lights().as_entire_binding()),
                (3, picture.as_entire_binding()),
            ],
        );
        let [width, height] = frame.view.size;
        submit(context, |encoder| {
            let groups = [width.div_ceil(8), height.div_ceil(8)];
            dispatch(encoder, &self.composite, &group, groups);
        });
        read_back(context, "picture", picture)
    }
}
