//! Tables on the device.

use strandlight_scattering::closed_form::TableAxes;
use strandlight_scene::tables::ShadingTables;

use crate::gpu::Context;

/// Bytes of a texel of any table.
const TEXEL_BYTES: usize = 16;

/// The tables on the GPU: three textures and a uniform with their axes.
#[derive(Debug)]
pub struct GpuTables {
    /// Texture of C, `rgba32uint`, eight unorm16 a texel.
    pub c: wgpu::TextureView,
    /// Texture of H_TT, `rgba32float`.
    pub h_tt: wgpu::TextureView,
    /// Texture of H_TRT, `rgba32float`.
    pub h_trt: wgpu::TextureView,
    /// Uniform buffer of [`TableAxes`].
    pub axes: wgpu::Buffer,
}

impl GpuTables {
    /// Uploads `tables`.
    pub fn new(context: &Context, tables: &ShadingTables) -> GpuTables {
        let tables = tables.view();
        let axes = &tables.axes;
        let upload = |label, format, texels: &[u8], rows: f32| {
            let height = rows as u32 + 1;
            let size = wgpu::Extent3d {
                width: (texels.len() / TEXEL_BYTES) as u32 / height,
                height,
                depth_or_array_layers: 1,
            };
            let texture = context.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            });
            context.write_texture(
                texture.as_image_copy(),
                texels,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(size.width * TEXEL_BYTES as u32),
                    rows_per_image: None,
                },
                size,
            );
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let uniform = context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("table axes"),
            size: size_of::<TableAxes>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        context.write(&uniform, 0, bytemuck::bytes_of(axes));
        let upload_h = |label, texels: &[[f32; 4]]| {
            let format = wgpu::TextureFormat::Rgba32Float;
            upload(
                label,
                format,
                bytemuck::cast_slice(texels),
                axes.h_rows.last,
            )
        };
        let format = wgpu::TextureFormat::Rgba32Uint;
        let shares = bytemuck::cast_slice(tables.c);
        GpuTables {
            c: upload("table C", format, shares, axes.c_rows.last),
            h_tt: upload_h("table H_TT", tables.h_tt),
            h_trt: upload_h("table H_TRT", tables.h_trt),
            axes: uniform,
        }
    }

    /// Layout of four bindings from `first` on: axes, C, H_TT, H_TRT.
    pub fn layout_entries(
        first: u32,
        visibility: wgpu::ShaderStages,
    ) -> [wgpu::BindGroupLayoutEntry; 4] {
        let texture = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        std::array::from_fn(|ix| wgpu::BindGroupLayoutEntry {
            binding: first + ix as u32,
            visibility,
            ty: match ix {
                0 => uniform,
                1 => texture(wgpu::TextureSampleType::Uint),
                _ => texture(wgpu::TextureSampleType::Float { filterable: false }),
            },
            count: None,
        })
    }

    /// The bindings of [`GpuTables::layout_entries`].
    pub fn entries(&self, first: u32) -> [wgpu::BindGroupEntry<'_>; 4] {
        let resources = [
            self.axes.as_entire_binding(),
            wgpu::BindingResource::TextureView(&self.c),
            wgpu::BindingResource::TextureView(&self.h_tt),
            wgpu::BindingResource::TextureView(&self.h_trt),
        ];
        let mut binding = first;
        resources.map(|resource| {
            let entry = wgpu::BindGroupEntry { binding, resource };
            binding += 1;
            entry
        })
    }
}
