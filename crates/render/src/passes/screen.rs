//! The picture on the screen: tone-mapped and encoded.

use std::sync::Arc;

use super::draw::Ribbons;
use super::resources::{
    bind, buffer_of, compute, compute_pass, shader, step, submit, texture, uniform,
};
#[cfg(not(target_arch = "wasm32"))]
use super::resources::{failed, labelled};
use super::stamp::Stamp;
use super::target::Target;
use crate::gpu::Context;
use strandlight_formats::Cube;
use strandlight_scene::lut::{LUT_LINEAR, LUT_LOG2, LUT_SRGB, Lut, LutInput};
use strandlight_scene::tone::{TONE_AGX, TONE_FILMIC, TONE_LUT, TONE_NONE, ToneMap};
use strandlight_scene::{DisplayTransform, RenderError};

/// Mirrored by `Grade` in `shaders/pass/display.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Grade {
    scale: f32,
    tone_map: u32,
    lut_input: u32,
    curve_size: u32,
    curve_low: [f32; 3],
    grid_size: u32,
    curve_high: [f32; 3],
    pad: u32,
    grid_low: [f32; 3],
    pad2: u32,
    grid_high: [f32; 3],
    pad3: u32,
}

strandlight_scattering::mirrors! {
    Grade as "Grade" in "pass/display" {
        scale, tone_map, lut_input, curve_size, curve_low, grid_size, curve_high, pad, grid_low,
        pad2, grid_high, pad3,
    }
}

impl Grade {
    fn new(exposure: f32, display: &DisplayTransform) -> Grade {
        let tone_map = match display {
            DisplayTransform::ToneMap(ToneMap::None) => TONE_NONE,
            DisplayTransform::ToneMap(ToneMap::Filmic) => TONE_FILMIC,
            DisplayTransform::ToneMap(ToneMap::Agx) => TONE_AGX,
            DisplayTransform::ToneMap(ToneMap::Aces2) | DisplayTransform::Lut(_) => TONE_LUT,
        };
        let plain = Grade {
            scale: exposure.exp2(),
            tone_map,
            ..bytemuck::Zeroable::zeroed()
        };
        let Some(Lut { cube, input }) = display.lut() else {
            return plain;
        };
        let mut grade = Grade {
            lut_input: match input {
                LutInput::Log2 => LUT_LOG2,
                LutInput::Srgb => LUT_SRGB,
                LutInput::Linear => LUT_LINEAR,
            },
            ..plain
        };
        if let Some(curves) = &cube.curves {
            grade.curve_size = curves.size;
            (grade.curve_low, grade.curve_high) = (curves.low, curves.high);
        }
        if let Some(grid) = &cube.grid {
            grade.grid_size = grid.size;
            (grade.grid_low, grade.grid_high) = (grid.low, grid.high);
        }
        grade
    }
}

/// The pipeline of the last pass.
pub(crate) struct DisplayPipeline {
    pipeline: wgpu::ComputePipeline,
    grade: wgpu::Buffer,
    lut: LutOnDevice,
}

/// Samples of the LUT that is in use; a single zero without one.
struct LutOnDevice {
    of: Option<Arc<Cube>>,
    samples: wgpu::Buffer,
    /// Goes up with every other buffer, which puts bind groups out of date.
    version: u64,
}

impl LutOnDevice {
    fn samples(context: &Context, of: Option<&Cube>) -> wgpu::Buffer {
        let tables = of.into_iter().flat_map(|cube| [&cube.curves, &cube.grid]);
        let samples = tables.flatten().flat_map(|table| &table.samples);
        let samples: Vec<[f32; 3]> = samples.copied().collect();
        let values: &[f32] = bytemuck::cast_slice(&samples);
        buffer_of(context, "LUT", values, wgpu::BufferUsages::STORAGE)
    }

    fn set(&mut self, context: &Context, display: &DisplayTransform) {
        let cube = display.lut().map(|lut| &lut.cube);
        if self.of.as_ref().map(Arc::as_ptr) != cube.map(Arc::as_ptr) {
            self.samples = LutOnDevice::samples(context, cube.map(|cube| &**cube));
            self.of = cube.cloned();
            self.version += 1;
        }
    }
}

impl DisplayPipeline {
    pub fn new(context: &Context) -> Result<DisplayPipeline, RenderError> {
        let grade: Grade = bytemuck::Zeroable::zeroed();
        Ok(DisplayPipeline {
            pipeline: compute(context, &shader(context, "pass/display")?, "show"),
            grade: uniform(context, "grade", &grade),
            lut: LutOnDevice {
                of: None,
                samples: LutOnDevice::samples(context, None),
                version: 0,
            },
        })
    }
}

/// A picture for the screen: sRGB multiplied by alpha, `rgba8unorm`.
pub(crate) struct Screen {
    view: wgpu::TextureView,
    /// With the version of the LUT in it.
    group: Option<(u64, wgpu::BindGroup)>,
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
        show: &mut DisplayPipeline,
        (ribbons, target): (&Ribbons, &Target),
        (exposure, display): (f32, &DisplayTransform),
        stamp: Stamp,
    ) {
        let grade = Grade::new(exposure, display);
        let bytes = bytemuck::bytes_of(&grade);
        context.write(&show.grade, 0, bytes);
        show.lut.set(context, display);
        let version = show.lut.version;
        self.group = self.group.take().filter(|(of, _)| *of == version);
        let (_, group) = self.group.get_or_insert_with(|| {
            let group = bind(
                context,
                &show.pipeline.get_bind_group_layout(0),
                &[
                    (0, ribbons.view().as_entire_binding()),
                    (1, show.grade.as_entire_binding()),
                    (2, target.picture().as_entire_binding()),
                    (3, wgpu::BindingResource::TextureView(&self.view)),
                    (4, show.lut.samples.as_entire_binding()),
                ],
            );
            (version, group)
        });
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            let groups = target.size().map(|n| n.div_ceil(8));
            step(&mut pass, &show.pipeline, group, groups);
        });
    }
}
