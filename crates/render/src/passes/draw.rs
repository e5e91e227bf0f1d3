//! Projecting the strands and rasterising the ribbons in passes of four samples.

use super::pieces::{PieceBuffers, Whole};
use super::resources::{
    StrandBuffers, bind, compute, compute_pass, labelled, shader, step, storage, submit, uniform,
};
use super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::sampling::{PASS_SAMPLES, pass_jitter};

/// Segments whose corners share an index buffer: 96 MiB, below the 128 MiB every adapter binds.
pub(super) const SEGMENT_CHUNK: u32 = 4 << 20;

/// Mirrored by `Pass` in `shaders/pass/strands.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Pass {
    jitter: [i32; 2],
    pass_ix: u32,
    n_samples: u32,
    even: [f32; 4],
}

/// Mirrored by `Chunk` in `shaders/lib/ribbon.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Chunk {
    first_segment: u32,
    n_segments: u32,
}

strandlight_scattering::mirrors! {
    Pass as "Pass" in "pass/strands" { jitter, pass_ix, n_samples, even }
    Chunk as "Chunk" in "lib/ribbon" { first_segment, n_segments }
}

/// Radiance of the points, and of narrow lights along the segments, where there is some.
pub(crate) type LitPoints<'a> = (&'a wgpu::Buffer, Option<&'a wgpu::Buffer>);

/// Pipelines that find where strands are on the screen.
pub(crate) struct Projection {
    project: wgpu::ComputePipeline,
    ribbons: wgpu::ComputePipeline,
}

/// The strands on the screen: what `project` and `ribbons` leave for the passes of a view.
pub(crate) struct Ribbons {
    view: wgpu::Buffer,
    pass: wgpu::Buffer,
    points: [wgpu::Buffer; 3],
    project: wgpu::BindGroup,
    chunks: Vec<RibbonChunk>,
    /// In close-ups.
    pieces: Option<PieceBuffers>,
    n_points: u32,
    /// Of wide strands over their width.
    pub even: [f32; 4],
}

/// Segments that share an index buffer.
struct RibbonChunk {
    /// Which these are, [`Chunk`].
    range: wgpu::Buffer,
    corners: wgpu::Buffer,
    group: wgpu::BindGroup,
    n_segments: u32,
}

impl Ribbons {
    /// Room for `strands`.
    pub fn new(context: &Context, projection: &Projection, strands: &StrandBuffers) -> Ribbons {
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
            &projection.project.get_bind_group_layout(0),
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
            let range = uniform(context, "chunk", &chunk);
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDEX;
            let corners = labelled(context, "corners", u64::from(n_segments) * 24, usage);
            let group = bind(
                context,
                &projection.ribbons.get_bind_group_layout(0),
                &[
                    (0, view.as_entire_binding()),
                    (1, range.as_entire_binding()),
                    (2, strands.segments.as_entire_binding()),
                    (3, edges.as_entire_binding()),
                    (4, depth_coverage.as_entire_binding()),
                    (5, spines.as_entire_binding()),
                    (6, corners.as_entire_binding()),
                ],
            );
            chunks.push(RibbonChunk {
                range,
                corners,
                group,
                n_segments,
            });
        }
        Ribbons {
            view,
            pass,
            project,
            chunks,
            pieces: None,
            points,
            n_points,
            even: [0.0; 4],
        }
    }

    /// Is the view a close-up from now on, whose bent segments and tips come in pieces? What draws them is to be bound
    /// anew where it was none or is none any more.
    pub fn set_close_up(
        &mut self,
        context: &Context,
        strands: &StrandBuffers,
        is_close_up: bool,
    ) -> Result<(), RenderError> {
        if is_close_up != self.pieces.is_some() {
            let [edges, depth_coverage, _] = &self.points;
            let chunks = self.chunks.iter();
            let whole = Whole {
                view: &self.view,
                edges,
                depth_coverage,
                chunks: chunks.map(|chunk| [&chunk.range, &chunk.corners]).collect(),
            };
            self.pieces = match is_close_up {
                true => Some(PieceBuffers::new(context, strands, &whole)?),
                false => None,
            };
        }
        Ok(())
    }

    /// The pieces of a close-up.
    pub(super) fn pieces(&self) -> Option<&PieceBuffers> {
        self.pieces.as_ref()
    }

    /// Bindings of a pipeline that draws the strands, one group for each buffer of radiance: without those in
    /// `unused`, with `further` ones.
    pub fn bind_strands(
        &self,
        context: &Context,
        layout: &wgpu::BindGroupLayout,
        lit: &[LitPoints],
        (unused, further): (&[u32], &[(u32, wgpu::BindingResource)]),
    ) -> Vec<wgpu::BindGroup> {
        let [edges, depth_coverage, spines] = &self.points;
        let of_lit = |(radiance, along): &LitPoints| {
            let mut resources = vec![
                (0, self.view.as_entire_binding()),
                (1, self.pass.as_entire_binding()),
                (2, edges.as_entire_binding()),
                (3, depth_coverage.as_entire_binding()),
                (4, spines.as_entire_binding()),
                (5, radiance.as_entire_binding()),
            ];
            resources.extend(along.map(|along| (7, along.as_entire_binding())));
            resources.extend_from_slice(further);
            resources.retain(|(binding, _)| !unused.contains(binding));
            bind(context, layout, &resources)
        };
        lit.iter().map(of_lit).collect()
    }

    /// Takes another view.
    pub fn set_view(&self, context: &Context, view: &ViewUniform) {
        let bytes = bytemuck::bytes_of(view);
        context.write(&self.view, 0, bytes);
    }

    /// What the passes read of themselves.
    pub(super) fn current(&self) -> &wgpu::Buffer {
        &self.pass
    }

    /// The view as the passes read it.
    pub fn view(&self) -> &wgpu::Buffer {
        &self.view
    }

    /// Projects the points and prepares the segments, once for all passes of a view.
    pub fn project(&self, context: &Context, projection: &Projection, stamp: Stamp) {
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            let groups = [self.n_points.div_ceil(256), 1];
            step(&mut pass, &projection.project, &self.project, groups);
            for chunk in &self.chunks {
                let groups = [chunk.n_segments.div_ceil(256), 1];
                step(&mut pass, &projection.ribbons, &chunk.group, groups);
            }
            if let Some(pieces) = &self.pieces {
                pieces.make(&mut pass, self.chunks.iter().map(|chunk| chunk.n_segments));
            }
        });
    }

    /// Chooses the samples of the next pass, of which the first `n_samples` count.
    pub(super) fn set_pass(&self, context: &Context, pass_ix: u32, n_samples: u32) {
        let pass = Pass {
            jitter: pass_jitter(pass_ix),
            pass_ix,
            n_samples,
            even: self.even,
        };
        let bytes = bytemuck::bytes_of(&pass);
        context.write(&self.pass, 0, bytes);
    }

    /// Chooses the samples of frame `frame` of a host, which moves the picture itself.
    pub fn set_frame(&self, context: &Context, frame: u32) {
        let pass = Pass {
            jitter: [0, 0],
            pass_ix: frame,
            n_samples: PASS_SAMPLES,
            even: self.even,
        };
        context.write(&self.pass, 0, bytemuck::bytes_of(&pass));
    }

    /// Draws all segments with the pipeline and bindings that `pass` has.
    pub fn draw_segments(&self, pass: &mut wgpu::RenderPass) {
        for chunk in &self.chunks {
            pass.set_index_buffer(chunk.corners.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..6 * chunk.n_segments, 0, 0..1);
        }
    }

    pub fn bytes(&self) -> u64 {
        let points: u64 = self.points.iter().map(wgpu::Buffer::size).sum();
        let corners = self.chunks.iter().map(|chunk| chunk.corners.size());
        points + corners.sum::<u64>() + self.pieces.as_ref().map_or(0, PieceBuffers::bytes)
    }
}

impl Projection {
    pub fn new(context: &Context) -> Result<Self, RenderError> {
        Ok(Projection {
            project: compute(context, &shader(context, "pass/project")?, "project"),
            ribbons: compute(context, &shader(context, "pass/ribbons")?, "ribbons"),
        })
    }
}
