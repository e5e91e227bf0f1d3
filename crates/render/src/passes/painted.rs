//! Painted hair on the device: the paint of each point, and the tables that shading reads with it.

use std::ops::Range;

use super::resources::{self, uniform};
use crate::gpu::Context;
use strandlight_scattering::closed_form::{N_AVERAGE_COLUMNS, PaintTexel};
use strandlight_scattering::dual_scattering::PaintedAverageTable;
use strandlight_scattering::lobes::PaintedTexture;
use strandlight_scene::material::{EditReport, HairMaterial, Part};
use strandlight_scene::paint::PaintedPoint;

/// Texels a row of the paint; twin in `shaders/pass/shade.wgsl`. With the 8192 rows that every
/// device takes they are as many as there may be points.
const PAINT_WIDTH: usize = 1024;

/// Bytes of the texture of paint of so many points.
pub(super) fn paint_bytes(n_points: u64) -> u64 {
    let rows = n_points.div_ceil(PAINT_WIDTH as u64).max(1);
    rows * (PAINT_WIDTH * size_of::<PaintTexel>()) as u64
}

/// Paint and tables on the device.
pub(super) struct Painted {
    /// [`strandlight_scattering::closed_form::PaintedHair`].
    hair: wgpu::Buffer,
    tt: wgpu::TextureView,
    trt: wgpu::TextureView,
    averages: wgpu::TextureView,
    paint: wgpu::TextureView,
    /// As the device has it, whole rows.
    texels: Vec<PaintTexel>,
}

impl Painted {
    /// Uploads the paint of all points, and the tables of `hair`.
    pub fn new(context: &Context, hair: &HairMaterial, points: &[PaintedPoint]) -> Painted {
        let optics = hair.optics();
        let mut texels: Vec<PaintTexel> = points.iter().map(PaintedPoint::texel).collect();
        let rows = texels.len().div_ceil(PAINT_WIDTH).max(1);
        texels.resize(rows * PAINT_WIDTH, [0; 4]);
        let size = [PAINT_WIDTH as u32, rows as u32];
        let format = wgpu::TextureFormat::Rgba32Uint;
        let paint = texture(context, "paint", format, size);
        write_rows(context, paint.texture(), 0, bytemuck::cast_slice(&texels));
        Painted {
            hair: uniform(context, "painted hair", &optics.painted_hair()),
            tt: upload_painted(context, "painted lobes TT", &optics.painted.tt),
            trt: upload_painted(context, "painted lobes TRT", &optics.painted.trt),
            averages: upload_averages(context, &optics.painted.averages),
            paint,
            texels,
        }
    }

    /// Takes the paint of the points in `changed`. Rows of the texture that are other than they
    /// were are written. Answers the bytes of those.
    pub fn set_paint(
        &mut self,
        context: &Context,
        points: &[PaintedPoint],
        changed: Range<usize>,
    ) -> u64 {
        let end = changed.end.min(points.len()).min(self.texels.len());
        let changed = changed.start.min(end)..end;
        let mut bytes = 0;
        // Rows that are to be written, one after the other.
        let mut rows = 0..0;
        let write = |rows: &Range<usize>, texels: &[PaintTexel]| {
            let contents = &texels[rows.start * PAINT_WIDTH..rows.end * PAINT_WIDTH];
            let contents: &[u8] = bytemuck::cast_slice(contents);
            if !contents.is_empty() {
                write_rows(context, self.paint.texture(), rows.start as u32, contents);
            }
            contents.len() as u64
        };
        let mut first = changed.start;
        while first < changed.end {
            let row = first / PAINT_WIDTH;
            let end = ((row + 1) * PAINT_WIDTH).min(changed.end);
            let mut is_other = false;
            for (texel, point) in self.texels[first..end].iter_mut().zip(&points[first..end]) {
                let new = point.texel();
                is_other |= *texel != new;
                *texel = new;
            }
            if is_other {
                if rows.end != row {
                    bytes += write(&rows, &self.texels);
                    rows = row..row;
                }
                rows.end = row + 1;
            }
            first = end;
        }
        bytes + write(&rows, &self.texels)
    }

    /// Writes what an edit of the hair recomputed. Answers whether a texture is another one, which
    /// puts bind groups out of date.
    pub fn update(&mut self, context: &Context, hair: &HairMaterial, report: &EditReport) -> bool {
        let optics = hair.optics();
        let mut is_other = false;
        for part in report.rebuilt() {
            let (view, texels, width) = match part.part {
                Part::PaintedTt => lobes(&mut self.tt, &optics.painted.tt),
                Part::PaintedTrt => lobes(&mut self.trt, &optics.painted.trt),
                Part::PaintedAverages => (
                    &mut self.averages,
                    bytemuck::pod_collect_to_vec(&optics.painted.averages.texels),
                    N_AVERAGE_COLUMNS,
                ),
                _ => continue,
            };
            let size = [width as u32, (texels.len() / width / 16) as u32];
            let old = view.texture();
            if [old.width(), old.height()] != size {
                *view = texture(context, part.name, old.format(), size);
                is_other = true;
            }
            write_rows(context, view.texture(), 0, &texels);
        }
        // Some hundred bytes, of which an edit changes most.
        let uniform = optics.painted_hair();
        let bytes = bytemuck::bytes_of(&uniform);
        context.write(&self.hair, 0, bytes);
        is_other
    }

    /// Bindings of the shading pass, besides the table C.
    pub fn bindings(&self) -> [(u32, wgpu::BindingResource<'_>); 5] {
        let view = wgpu::BindingResource::TextureView;
        [
            (3, self.hair.as_entire_binding()),
            (13, view(&self.tt)),
            (14, view(&self.trt)),
            (15, view(&self.averages)),
            (20, view(&self.paint)),
        ]
    }
}

/// A texture of lobes with what is to be in it, and its width.
fn lobes<'a>(
    view: &'a mut wgpu::TextureView,
    lobes: &PaintedTexture,
) -> (&'a mut wgpu::TextureView, Vec<u8>, usize) {
    let texels = bytemuck::pod_collect_to_vec(&lobes.texels());
    (view, texels, lobes.shapes.len())
}

/// The texture of painted lobes, `rgba32uint`.
pub(crate) fn upload_painted(
    context: &Context,
    label: &'static str,
    lobes: &PaintedTexture,
) -> wgpu::TextureView {
    let texels = lobes.texels();
    let width = lobes.shapes.len();
    let size = [width as u32, (texels.len() / width) as u32];
    let view = texture(context, label, wgpu::TextureFormat::Rgba32Uint, size);
    write_rows(context, view.texture(), 0, bytemuck::cast_slice(&texels));
    view
}

/// The texture of painted averages, `rgba32float`.
pub(crate) fn upload_averages(
    context: &Context,
    averages: &PaintedAverageTable,
) -> wgpu::TextureView {
    let rows = averages.texels.len() / N_AVERAGE_COLUMNS;
    let size = [N_AVERAGE_COLUMNS as u32, rows as u32];
    let format = wgpu::TextureFormat::Rgba32Float;
    let view = texture(context, "painted averages", format, size);
    write_rows(
        context,
        view.texture(),
        0,
        bytemuck::cast_slice(&averages.texels),
    );
    view
}

/// One that is written by rows.
fn texture(
    context: &Context,
    label: &'static str,
    format: wgpu::TextureFormat,
    size: [u32; 2],
) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    resources::texture(context, label, size, 1, format, usage)
}

/// Writes whole rows of 16 byte texels, from row `first` on.
fn write_rows(context: &Context, texture: &wgpu::Texture, first: u32, texels: &[u8]) {
    let row_bytes = 16 * texture.width();
    let mut to = texture.as_image_copy();
    to.origin.y = first;
    context.write_texture(
        to,
        texels,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row_bytes),
            rows_per_image: None,
        },
        wgpu::Extent3d {
            width: texture.width(),
            height: texels.len() as u32 / row_bytes,
            depth_or_array_layers: 1,
        },
    );
}
