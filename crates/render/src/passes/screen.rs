//! The picture on the screen: tone-mapped and encoded.

use super::draw::Ribbons;
use super::resources::{bind, compute, compute_pass, shader, step, submit, uniform};
#[cfg(not(target_arch = "wasm32"))]
use super::resources::{failed, labelled};
use super::stamp::Stamp;
use super::target::{Target, texture};
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::tone::{TONE_AGX, TONE_FILMIC, TONE_NONE, ToneMap};

/// Mirrored by `Grade` in `shaders/pass/display.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Grade {
    scale: f32,
    tone_map: u32,
    pad: [u32; 2],
}

strandlight_scattering::mirrors! {
    Grade as "Grade" in "pass/display" { scale, tone_map, pad }
}

/// The pipeline of the last pass.
pub(crate) struct DisplayPipeline {
    pipeline: wgpu::ComputePipeline,
    grade: wgpu::Buffer,
}

impl DisplayPipeline {
    pub fn new(context: &Context) -> Result<DisplayPipeline, RenderError> {
        let grade: Grade = bytemuck::Zeroable::zeroed();
        Ok(DisplayPipeline {
            pipeline: compute(context, &shader(context, "pass/display")?, "show"),
            grade: uniform(context, "grade", &grade),
        })
    }
}

/// A picture for the screen: sRGB multiplied by alpha, `rgba8unorm`.
pub(crate) struct Screen {
    view: wgpu::TextureView,
    group: Option<wgpu::BindGroup>,
}

impl Screen {
    /// A black one without alpha, at least a pixel wide and high.
    pub fn new(context: &Context, size: [u32; 2]) -> Screen {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let size = size.map(|n| n.max(1));
        Screen {
            view: texture(context, "display", size, 1, format, usage),
            group: None,
        }
    }

    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// The texels, row by row.
    ///
    /// # Errors
    /// The device failed.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn read(&self, context: &Context) -> Result<Vec<[u8; 4]>, RenderError> {
        let texture = self.view.texture();
        let row_bytes = 4 * texture.width();
        // Rows of copies start at multiples of 256 bytes.
        let pitch = row_bytes.next_multiple_of(256);
        let bytes = u64::from(pitch) * u64::from(texture.height());
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let staging = labelled(context, "display read back", bytes, usage);
        submit(context, |encoder| {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(pitch),
                rows_per_image: None,
            };
            let buffer = &staging;
            let to = wgpu::TexelCopyBufferInfo { buffer, layout };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), to, texture.size());
        });
        let bytes = context.read_buffer("display", &staging).map_err(failed)?;
        let rows = bytes.chunks_exact(pitch as usize);
        Ok(rows
            .flat_map(|row| bytemuck::pod_collect_to_vec::<u8, [u8; 4]>(&row[..row_bytes as usize]))
            .collect())
    }

    /// Shows the picture of `target`, which is as large as this and always the same.
    pub fn show(
        &mut self,
        context: &Context,
        show: &DisplayPipeline,
        (ribbons, target): (&Ribbons, &Target),
        exposure: f32,
        tone_map: ToneMap,
        stamp: Stamp,
    ) {
        let grade = Grade {
            scale: exposure.exp2(),
            tone_map: match tone_map {
                ToneMap::None => TONE_NONE,
                ToneMap::Filmic => TONE_FILMIC,
                ToneMap::Agx => TONE_AGX,
            },
            pad: [0; 2],
        };
        let bytes = bytemuck::bytes_of(&grade);
        context.write(&show.grade, 0, bytes);
        let group = self.group.get_or_insert_with(|| {
            bind(
                context,
                &show.pipeline.get_bind_group_layout(0),
                &[
                    (0, ribbons.view().as_entire_binding()),
                    (1, show.grade.as_entire_binding()),
                    (2, target.picture().as_entire_binding()),
                    (3, wgpu::BindingResource::TextureView(&self.view)),
                ],
            )
        });
        submit(context, |encoder| {
            let mut pass = compute_pass(encoder, stamp);
            let groups = target.size().map(|n| n.div_ceil(8));
            step(&mut pass, &show.pipeline, group, groups);
        });
    }
}
