//! Bent segments and tips of close-ups in pieces, which are drawn in place of whole segments.

use super::resources::{
    ComputePass, StrandBuffers, bind, compute, labelled, shader, step, storage,
};
use crate::gpu::Context;
use strandlight_scene::RenderError;

/// Turns them on in drawing.
pub(super) const FEATURE: &str = "CLOSE_UP";

/// Most pieces of a view: 12 MiB.
const MOST: u32 = 1 << 18;

/// Segments whose pieces are counted together.
const BLOCK: u32 = 256;

/// Mirrored by `Piece` in `shaders/lib/piece.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Piece {
    begin: [i32; 4],
    end: [i32; 4],
    depth: [f32; 2],
    first: u32,
    part: u32,
}

strandlight_scattering::mirrors! {
    Piece as "Piece" in "lib/piece" { begin, end, depth, first, part }
}

/// What is there of whole segments on the screen.
pub(super) struct Whole<'a> {
    pub view: &'a wgpu::Buffer,
    pub edges: &'a wgpu::Buffer,
    pub depth_coverage: &'a wgpu::Buffer,
    /// By chunk of segments: which these are, and their corners.
    pub chunks: Vec<[&'a wgpu::Buffer; 2]>,
}

/// Room for the pieces of a view, and what makes them.
pub(super) struct PieceBuffers {
    pieces: wgpu::Buffer,
    /// Of the draw.
    arguments: wgpu::Buffer,
    blocks: wgpu::Buffer,
    count: wgpu::ComputePipeline,
    place: wgpu::ComputePipeline,
    cut: wgpu::ComputePipeline,
    /// Of `count` and of `cut`, by chunk of segments.
    chunks: Vec<[wgpu::BindGroup; 2]>,
    place_group: wgpu::BindGroup,
}

/// Bytes on the device for strands of so many segments.
pub(super) fn bytes(n_segments: u64) -> u64 {
    room(n_segments) * size_of::<Piece>() as u64 + n_segments.div_ceil(u64::from(BLOCK)) * 4 + 16
}

/// Most pieces of strands of so many segments.
fn room(n_segments: u64) -> u64 {
    (18 * n_segments).min(u64::from(MOST))
}

impl PieceBuffers {
    /// Room for those of `strands`.
    pub fn new(
        context: &Context,
        strands: &StrandBuffers,
        whole: &Whole,
    ) -> Result<PieceBuffers, RenderError> {
        let n_segments = u64::from(strands.n_segments);
        let n_blocks = n_segments.div_ceil(u64::from(BLOCK));
        let pieces = storage(
            context,
            "pieces",
            room(n_segments) * size_of::<Piece>() as u64,
        );
        let blocks = storage(context, "blocks of pieces", n_blocks * 4);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT;
        let arguments = labelled(context, "arguments of pieces", 16, usage);
        let module = shader(context, "pass/pieces")?;
        let [count, place, cut] =
            ["count", "place", "cut_segments"].map(|entry| compute(context, &module, entry));
        let of_chunk = |[range, corners]: &[&wgpu::Buffer; 2]| {
            let resources = [
                (0, whole.view.as_entire_binding()),
                (1, range.as_entire_binding()),
                (2, strands.segments.as_entire_binding()),
                (3, whole.edges.as_entire_binding()),
                (5, strands.points.as_entire_binding()),
                (7, strands.tangents.as_entire_binding()),
                (8, blocks.as_entire_binding()),
                (4, whole.depth_coverage.as_entire_binding()),
                (6, corners.as_entire_binding()),
                (9, pieces.as_entire_binding()),
            ];
            let counted = bind(context, &count.get_bind_group_layout(0), &resources[..7]);
            [
                counted,
                bind(context, &cut.get_bind_group_layout(0), &resources),
            ]
        };
        let chunks = whole.chunks.iter().map(of_chunk).collect();
        let resources = [
            (8, blocks.as_entire_binding()),
            (9, pieces.as_entire_binding()),
            (10, arguments.as_entire_binding()),
        ];
        let place_group = bind(context, &place.get_bind_group_layout(0), &resources);
        Ok(PieceBuffers {
            pieces,
            arguments,
            blocks,
            count,
            place,
            cut,
            chunks,
            place_group,
        })
    }

    /// Makes those of the view, once its ribbons are there; of each chunk of segments its number.
    pub fn make(&self, pass: &mut ComputePass, n_segments: impl Iterator<Item = u32> + Clone) {
        let chunks = || self.chunks.iter().zip(n_segments.clone());
        for ([group, _], n) in chunks() {
            step(pass, &self.count, group, [n.div_ceil(BLOCK), 1]);
        }
        step(pass, &self.place, &self.place_group, [1, 1]);
        for ([_, group], n) in chunks() {
            step(pass, &self.cut, group, [n.div_ceil(BLOCK), 1]);
        }
    }

    /// Draws them with the pipeline and bindings that `pass` has.
    pub fn draw(&self, pass: &mut wgpu::RenderPass) {
        pass.draw_indirect(&self.arguments, 0);
    }

    /// What drawing reads.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.pieces
    }

    pub fn bytes(&self) -> u64 {
        self.pieces.size() + self.arguments.size() + self.blocks.size()
    }
}
