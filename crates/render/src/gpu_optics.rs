//! Optics of fibres on the device.

use std::mem::offset_of;

use strandlight_scattering::Lobe;
use strandlight_scattering::closed_form::{AverageTexel, LobeDecode};
use strandlight_scattering::lobes::LobeTexture;
use strandlight_scene::material::{EditReport, Part};
use strandlight_scene::optics::{Optics, ShadingUniform};

use crate::gpu::{Context, GpuError};

/// Optics of one or more fibres on the GPU.
#[derive(Debug)]
pub struct GpuOptics {
    /// [`ShadingUniform`] of each fibre; a uniform or a read-only storage buffer.
    pub shading: wgpu::Buffer,
    /// Lobes of TT, `rgba32uint`, two texels along x for each texel of a [`LobeTexture`], rows
    /// from each fibre's `first_row` on.
    pub tt: wgpu::TextureView,
    /// Lobes of TRT, likewise.
    pub trt: wgpu::TextureView,
    /// Averages, `rgba32float`, four texels along x for each inclination, fibres along y; one
    /// texel where no fibre has any.
    pub averages: wgpu::TextureView,
}

/// Most rows of a texture, as every WebGPU device takes.
pub const MAX_OPTICS: usize = 8192;

impl GpuOptics {
    /// Uploads the optics of `fibres`, 1..=[`MAX_OPTICS`] of them.
    ///
    /// # Errors
    /// None or too many.
    pub fn new(context: &Context, fibres: &[&Optics]) -> Result<GpuOptics, GpuError> {
        if !(1..=MAX_OPTICS).contains(&fibres.len()) {
            return Err(GpuError::Failed {
                what: "optics",
                source: format!("{} fibres, not 1..={MAX_OPTICS}", fibres.len()).into(),
            });
        }
        let lobes = |of: fn(&Optics) -> &LobeTexture| -> Vec<&LobeTexture> {
            fibres.iter().map(|&fibre| of(fibre)).collect()
        };
        let (tt, trt) = (lobes(|optics| &optics.tt), lobes(|optics| &optics.trt));
        let mut rows = [0; 2];
        let mut place = |texture: &LobeTexture, mode: usize| {
            let first_row = rows[mode] as u32;
            rows[mode] += texture.rows();
            LobeDecode {
                first_row,
                ..texture.decode
            }
        };
        let uniforms: Vec<ShadingUniform> = fibres
            .iter()
            .map(|optics| ShadingUniform {
                tt: place(&optics.tt, 0),
                trt: place(&optics.trt, 1),
                ..optics.uniform()
            })
            .collect();
        if let Some(rows) = rows.iter().find(|&&rows| rows > MAX_OPTICS) {
            return Err(GpuError::Failed {
                what: "optics",
                source: format!("{rows} rows of lobes, more than {MAX_OPTICS}").into(),
            });
        }
        let contents: &[u8] = bytemuck::cast_slice(&uniforms);
        let shading = context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("shading"),
            size: contents.len() as u64,
            usage: wgpu::BufferUsages::UNIFORM
                | wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_DST
                | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        context.write(&shading, 0, contents);
        Ok(GpuOptics {
            shading,
            tt: upload_lobes(context, "lobes TT", &tt),
            trt: upload_lobes(context, "lobes TRT", &trt),
            averages: upload_averages(context, fibres),
        })
    }

    /// Writes what an edit recomputed, and nothing else; `self` holds one fibre as it was before.
    pub fn update(&mut self, context: &Context, optics: &Optics, report: &EditReport) -> Written {
        let mut written = Written::default();
        let uniform = optics.uniform();
        for part in report.rebuilt() {
            let (offset, bytes) = match part.part {
                Part::Fibre => (
                    offset_of!(ShadingUniform, fibre),
                    bytemuck::bytes_of(&uniform.fibre),
                ),
                Part::Reflectance => (
                    offset_of!(ShadingUniform, reflectance),
                    bytemuck::bytes_of(&uniform.reflectance),
                ),
                Part::LobesTt => {
                    written.lobes(context, &mut self.tt, "lobes TT", &optics.tt);
                    (
                        offset_of!(ShadingUniform, tt),
                        bytemuck::bytes_of(&uniform.tt),
                    )
                }
                Part::LobesTrt => {
                    written.lobes(context, &mut self.trt, "lobes TRT", &optics.trt);
                    (
                        offset_of!(ShadingUniform, trt),
                        bytemuck::bytes_of(&uniform.trt),
                    )
                }
                Part::Averages => {
                    written.averages(context, &mut self.averages, optics);
                    continue;
                }
                // These stay in memory.
                _ => continue,
            };
            context.write(&self.shading, offset as u64, bytes);
            written.bytes += bytes.len();
        }
        written
    }

    /// The first fibre's uniform as the device has it.
    ///
    /// # Errors
    /// The device was lost.
    pub fn read_uniform(&self, context: &Context) -> Result<ShadingUniform, GpuError> {
        let size = size_of::<ShadingUniform>() as u64;
        let bytes = read_back(context, size, |encoder, staging| {
            encoder.copy_buffer_to_buffer(&self.shading, 0, staging, 0, size);
        })?;
        Ok(bytemuck::pod_read_unaligned(&bytes))
    }

    /// The lobes of TT or TRT as the device has them, row by row.
    ///
    /// # Errors
    /// The device was lost.
    pub fn read_lobes(&self, context: &Context, mode: Lobe) -> Result<Vec<[u32; 8]>, GpuError> {
        let view = match mode {
            Lobe::Trt => &self.trt,
            _ => &self.tt,
        };
        let texture = view.texture();
        let row_bytes = 16 * texture.width();
        // Rows of copies start at multiples of 256 bytes.
        let pitch = row_bytes.next_multiple_of(256);
        let size = u64::from(pitch) * u64::from(texture.height());
        let bytes = read_back(context, size, |encoder, staging| {
            let staging = wgpu::TexelCopyBufferInfo {
                buffer: staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(pitch),
                    rows_per_image: None,
                },
            };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), staging, texture.size());
        })?;
        let rows = bytes.chunks_exact(pitch as usize);
        Ok(rows
            .flat_map(|row| {
                bytemuck::pod_collect_to_vec::<u8, [u32; 8]>(&row[..row_bytes as usize])
            })
            .collect())
    }

    /// The averages of the first fibre as the device has them.
    ///
    /// # Errors
    /// The device was lost.
    pub fn read_averages(&self, context: &Context) -> Result<Vec<AverageTexel>, GpuError> {
        let texture = self.averages.texture();
        let row_bytes = 16 * texture.width();
        let bytes = read_back(context, u64::from(row_bytes), |encoder, staging| {
            let staging = wgpu::TexelCopyBufferInfo {
                buffer: staging,
                layout: wgpu::TexelCopyBufferLayout::default(),
            };
            let row = wgpu::Extent3d {
                height: 1,
                ..texture.size()
            };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), staging, row);
        })?;
        let n_texels = bytes.len() / size_of::<AverageTexel>();
        Ok(bytemuck::pod_collect_to_vec(
            &bytes[..n_texels * size_of::<AverageTexel>()],
        ))
    }

    /// Layout of the binding of the averages.
    pub fn averages_layout_entry(
        binding: u32,
        visibility: wgpu::ShaderStages,
    ) -> wgpu::BindGroupLayoutEntry {
        wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        }
    }

    /// Layout of the bindings from `first` on: lobes of TT and of TRT.
    pub fn layout_entries(
        first: u32,
        visibility: wgpu::ShaderStages,
    ) -> [wgpu::BindGroupLayoutEntry; 2] {
        [first, first + 1].map(|binding| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        })
    }

    /// The bindings of [`GpuOptics::layout_entries`].
    pub fn entries(&self, first: u32) -> [wgpu::BindGroupEntry<'_>; 2] {
        [(first, &self.tt), (first + 1, &self.trt)].map(|(binding, view)| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::TextureView(view),
        })
    }
}

/// What [`GpuOptics::update`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Bytes written.
    pub bytes: usize,
    /// A texture has another size: bind groups that hold [`GpuOptics::entries`] are out of date.
    pub needs_rebind: bool,
}

impl Written {
    /// Writes the averages, into a new texture where there were none before.
    fn averages(&mut self, context: &Context, view: &mut wgpu::TextureView, optics: &Optics) {
        self.bytes += size_of_val(&optics.averages[..]);
        let texture = view.texture();
        if texture.width() as usize == 4 * optics.averages.len() {
            write_texels(context, texture, bytemuck::cast_slice(&optics.averages));
        } else {
            *view = upload_averages(context, &[optics]);
            self.needs_rebind = true;
        }
    }

    /// Writes one mode's lobes, into a new texture where the size differs.
    fn lobes(
        &mut self,
        context: &Context,
        view: &mut wgpu::TextureView,
        label: &str,
        lobes: &LobeTexture,
    ) {
        self.bytes += size_of_val(&lobes.texels[..]);
        let texture = view.texture();
        let size = (2 * lobes.width() as u32, lobes.rows() as u32);
        if (texture.width(), texture.height()) == size {
            write_texels(context, texture, bytemuck::cast_slice(&lobes.texels));
        } else {
            *view = upload_lobes(context, label, &[lobes]);
            self.needs_rebind = true;
        }
    }
}

/// What `copy` writes into a buffer of `size` bytes.
fn read_back(
    context: &Context,
    size: u64,
    copy: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer),
) -> Result<Vec<u8>, GpuError> {
    let staging = context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("optics read back"),
        size,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    context.submit(|encoder| copy(encoder, &staging));
    context.read_buffer("optics", &staging)
}

/// Writes the whole of a texture of 16 byte texels.
pub(crate) fn write_texels(context: &Context, texture: &wgpu::Texture, texels: &[u8]) {
    context.write_texture(
        texture.as_image_copy(),
        texels,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(texture.width() * 16),
            rows_per_image: None,
        },
        texture.size(),
    );
}

/// The rows of all textures, as wide as the widest.
fn upload_lobes(context: &Context, label: &str, lobes: &[&LobeTexture]) -> wgpu::TextureView {
    let width = lobes.iter().map(|lobes| lobes.width()).max();
    let width = width.unwrap_or(1).max(1);
    let height: usize = lobes.iter().map(|lobes| lobes.rows()).sum();
    let mut texels = vec![[0u32; 8]; width * height];
    let rows = lobes
        .iter()
        .flat_map(|lobes| lobes.texels.chunks_exact(lobes.width()));
    for (to, from) in texels.chunks_exact_mut(width).zip(rows) {
        to[..from.len()].copy_from_slice(from);
    }
    let size = [2 * width as u32, height as u32];
    let format = wgpu::TextureFormat::Rgba32Uint;
    upload(context, label, size, format, bytemuck::cast_slice(&texels))
}

/// The averages of all fibres, a row each.
fn upload_averages(context: &Context, fibres: &[&Optics]) -> wgpu::TextureView {
    let width = fibres.iter().map(|optics| optics.averages.len()).max();
    let width = width.unwrap_or(0);
    let format = wgpu::TextureFormat::Rgba32Float;
    if width == 0 {
        return upload(context, "averages", [1, 1], format, &[0; 16]);
    }
    let mut texels = vec![[0.0f32; 16]; width * fibres.len()];
    for (to, from) in texels.chunks_exact_mut(width).zip(fibres) {
        to[..from.averages.len()].copy_from_slice(&from.averages);
    }
    let size = [4 * width as u32, fibres.len() as u32];
    let texels = bytemuck::cast_slice(&texels);
    upload(context, "averages", size, format, texels)
}

/// A texture of 16 byte texels.
pub(crate) fn upload(
    context: &Context,
    label: &str,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    texels: &[u8],
) -> wgpu::TextureView {
    let size = wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: 1,
    };
    context.resource_counters().add_texture(texels.len() as u64);
    let texture = context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    write_texels(context, &texture, texels);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
