//! What visibility lists are made of on the device.

use super::super::resources::{StrandBuffers, grow, storage, uniform};
use super::pipelines::GROUP;
use crate::gpu::Context;
use strandlight_scene::camera::ViewUniform;

/// Surfaces of a pixel that are kept: two proxies and a triangle.
const N_BEHIND: u32 = 3;

/// Bytes of a hit or an entry.
pub(super) const HIT_BYTES: u64 = 12;

/// Bytes of two totals.
pub(super) const TOTALS_BYTES: u64 = 8;

/// Mirrored by `ListLayout` in `shaders/lib/visible_list.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct ListLayout {
    pub n_tiles: [u32; 2],
    pub first_row: u32,
    pub end_row: u32,
    pub n_segments: u32,
    pub is_writing: u32,
    pub is_draft: u32,
    pub is_keeping: u32,
    pub even: [f32; 4],
}

/// Mirrored by `Pixel` there.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Pixel {
    pub n_hits: u32,
    pub next: u32,
    pub n_entries: u32,
    pub pad: u32,
}

/// Mirrored by `SeenSurface` there.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct SeenSurface {
    pub surface: u32,
    pub weight: f32,
    pub moved: u32,
    pub depth: f32,
}

/// Mirrored by `Triangle` there.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Triangle {
    pub sides: [[f32; 4]; 3],
    pub corners: [u32; 3],
    pub depth: f32,
}

strandlight_scattering::mirrors! {
    ListLayout as "ListLayout" in "lib/visible_list" {
        n_tiles, first_row, end_row, n_segments, is_writing, is_draft, is_keeping, even,
    }
    Pixel as "Pixel" in "lib/visible_list" { n_hits, next, n_entries, pad }
    SeenSurface as "SeenSurface" in "lib/visible_list" { surface, weight, moved, depth }
    Triangle as "Triangle" in "lib/visible_list" { sides, corners, depth }
}

/// What lists are made of.
pub(super) struct Buffers {
    pub view: wgpu::Buffer,
    pub layout: wgpu::Buffer,
    pub points: wgpu::Buffer,
    pub pixels: wgpu::Buffer,
    /// Of each row its hits, then the hits before it in its band; after them `totals` of the triangles.
    pub rows: wgpu::Buffer,
    pub hits: wgpu::Buffer,
    /// Entries of all bands, where there are several.
    pub entries: wgpu::Buffer,
    pub seen: wgpu::Buffer,
    /// The points among `seen`, in order.
    pub seen_points: wgpu::Buffer,
    /// Two totals, then the points of each group of words of `seen`.
    pub totals: wgpu::Buffer,
    /// Of proxies.
    pub behind: wgpu::Buffer,
    /// Of meshes.
    pub triangles: wgpu::Buffer,
    pub tiles: wgpu::Buffer,
}

impl Buffers {
    /// For `strands`; there is no room yet for what depends on the view.
    pub fn new(context: &Context, strands: &StrandBuffers) -> Buffers {
        let view: ViewUniform = bytemuck::Zeroable::zeroed();
        let layout: ListLayout = bytemuck::Zeroable::zeroed();
        let n_points = strands.n_points;
        let empty = |label| storage(context, label, 0);
        // A bit for each point, and the number of entries.
        let seen_bytes = (u64::from(n_seen_words(n_points)) + 1) * 4;
        let totals_bytes = TOTALS_BYTES + 4 * u64::from(n_seen_words(n_points).div_ceil(GROUP));
        Buffers {
            view: uniform(context, "view", &view),
            layout: uniform(context, "layout of a list", &layout),
            points: empty("points on the screen"),
            pixels: empty("pixels"),
            rows: empty("rows"),
            hits: empty("hits"),
            entries: empty("entries"),
            seen: storage(context, "seen points", seen_bytes),
            seen_points: storage(context, "points of a list", 4 * u64::from(n_points)),
            totals: storage(context, "totals of a list", totals_bytes),
            behind: empty("surfaces behind"),
            triangles: empty("triangles"),
            tiles: empty("tiles"),
        }
    }

    /// Makes room for what does not depend on the number of hits of a picture of `extent`, behind whose hair there are
    /// proxies or not, and so many triangles. Answers whether it fits the device.
    pub fn fit(
        &mut self,
        context: &Context,
        [n_points, n_triangles]: [u32; 2],
        extent: [u32; 2],
        has_proxies: bool,
    ) -> bool {
        let [width, height] = extent.map(u64::from);
        let n_pixels = width * height;
        let of_behind = match has_proxies {
            true => n_pixels * u64::from(N_BEHIND) * size_of::<SeenSurface>() as u64,
            false => 0,
        };
        let of_triangles = u64::from(n_triangles) * size_of::<Triangle>() as u64;
        let room = [
            (&mut self.points, u64::from(n_points) * 32),
            (&mut self.pixels, n_pixels * size_of::<Pixel>() as u64),
            (&mut self.rows, 2 * height * 4 + TOTALS_BYTES),
            (&mut self.behind, of_behind),
            (&mut self.triangles, of_triangles),
        ];
        let limit = limit(context);
        for (buffer, bytes) in room {
            if bytes > limit {
                return false;
            }
            grow(context, buffer, bytes);
        }
        true
    }

    pub fn bytes(&self) -> u64 {
        let Buffers {
            points,
            pixels,
            rows,
            hits,
            entries,
            seen,
            seen_points,
            behind,
            triangles,
            tiles,
            ..
        } = self;
        let of_hair = [points, pixels, rows, hits, entries, seen, seen_points];
        let beside = [behind, triangles, tiles];
        let all = of_hair.iter().chain(&beside);
        all.map(|buffer| buffer.size()).sum()
    }
}

/// Words with a bit for each point.
pub(super) fn n_seen_words(n_points: u32) -> u32 {
    n_points.div_ceil(32)
}

/// Bytes of the largest buffer that can be bound.
pub(super) fn limit(context: &Context) -> u64 {
    let limits = context.device.limits();
    limits
        .max_storage_buffer_binding_size
        .min(limits.max_buffer_size)
}
