//! Tables of multiple scattering on the device, which fills them.

use super::resources::{
    bind, buffer_of, compute, compute_pass, groups_of_64, grow, shader, step, storage, submit,
    texture_3d, uniform, write,
};
use super::stamp::Stamp;
use crate::gpu::Context;
use crate::gpu_optics::{GpuOptics, upload, write_texels};
use strandlight_scattering::multiple_tables::MultipleSource;
use strandlight_scene::RenderError;

/// Bytes of a texel.
const TEXEL_BYTES: u64 = 8;

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

fn texels([x, y, z]: [u32; 3]) -> u64 {
    u64::from(x) * u64::from(y) * u64::from(z)
}

/// Bytes of the rows before they are rounded.
fn scratch_bytes(source: &MultipleSource) -> u64 {
    16 * texels(source.rows_size()).max(texels(source.direct_size()))
}

/// The functions of an elliptic fibre, two texels each.
fn upload_elliptic(context: &Context, source: &MultipleSource) -> Option<wgpu::TextureView> {
    let functions = &source.elliptic;
    let texels = bytemuck::cast_slice(functions);
    let size = [2, functions.len() as u32];
    let format = wgpu::TextureFormat::Rgba32Float;
    source
        .is_elliptic()
        .then(|| upload(context, "functions of elliptic hair", size, format, texels))
}

/// Bytes of both textures, and of the largest buffer that they are made with.
pub(super) fn multiple_bytes(source: &MultipleSource) -> [u64; 2] {
    let textures = texels(source.rows_size()) + texels(source.direct_size());
    [TEXEL_BYTES * textures, scratch_bytes(source)]
}

/// Of pipelines that read tables of an elliptic fibre.
pub(crate) const ELLIPTIC: &str = "ELLIPTIC_TABLES";

/// What fills tables: rows, their balance, direct rows, their balance.
pub(crate) struct Fill([wgpu::ComputePipeline; 4]);

impl Fill {
    /// # Errors
    /// A shader the device refuses.
    pub fn new(context: &Context) -> Result<Fill, RenderError> {
        let module = shader(context, "pass/multiple_tables")?;
        let entries = ["fill_rows", "balance_rows", "fill_direct", "balance_direct"];
        Ok(Fill(entries.map(|entry| compute(context, &module, entry))))
    }
}

/// The tables of one fibre.
pub(crate) struct Multiple {
    /// [`strandlight_scattering::multiple_tables::MultipleLayout`].
    layout: wgpu::Buffer,
    profiles: wgpu::Buffer,
    /// Rows before they are balanced and rounded.
    scratch: wgpu::Buffer,
    rows: wgpu::TextureView,
    direct: wgpu::TextureView,
    sampler: wgpu::Sampler,
    /// Functions of an elliptic fibre.
    elliptic: Option<wgpu::TextureView>,
    /// Of [`Fill`], once they were needed.
    groups: Option<[wgpu::BindGroup; 4]>,
    /// The textures are those of another fibre.
    is_stale: bool,
}

impl Multiple {
    /// Room for the tables of `source`; [`Multiple::fill`] fills it.
    pub fn new(context: &Context, source: &MultipleSource) -> Multiple {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let profiles = buffer_of(context, "profiles", &source.profiles, usage);
        let sampler = context.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("linear"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Multiple {
            layout: uniform(context, "layout of multiple scattering", &source.layout),
            profiles,
            scratch: storage(context, "rows", scratch_bytes(source)),
            rows: texture_3d(context, "multiple scattering", source.rows_size(), FORMAT),
            direct: texture_3d(
                context,
                "direct local scattering",
                source.direct_size(),
                FORMAT,
            ),
            sampler,
            elliptic: upload_elliptic(context, source),
            groups: None,
            is_stale: true,
        }
    }

    /// Takes what an edit made. Answers whether a texture is another one, which puts bind groups out
    /// of date.
    pub fn update(&mut self, context: &Context, source: &MultipleSource) -> bool {
        self.is_stale = true;
        context.write(&self.layout, 0, bytemuck::bytes_of(&source.layout));
        let mut has_grown = write(context, &mut self.profiles, &source.profiles);
        has_grown |= grow(context, &mut self.scratch, scratch_bytes(source));
        let mut is_other = false;
        for (label, view, size) in [
            ("multiple scattering", &mut self.rows, source.rows_size()),
            (
                "direct local scattering",
                &mut self.direct,
                source.direct_size(),
            ),
        ] {
            if size_of(view) != size {
                *view = texture_3d(context, label, size, FORMAT);
                is_other = true;
            }
        }
        if has_grown || is_other {
            self.forget_groups();
        }
        match &self.elliptic {
            Some(view) if source.is_elliptic() => {
                write_texels(
                    context,
                    view.texture(),
                    bytemuck::cast_slice(&source.elliptic),
                );
            }
            _ => {
                is_other |= self.elliptic.is_some() || source.is_elliptic();
                self.elliptic = upload_elliptic(context, source);
            }
        }
        is_other
    }

    /// The averages of the fibre are in another texture.
    pub fn forget_groups(&mut self) {
        self.groups = None;
    }

    /// Does [`Multiple::fill`] have to run before the next shading?
    pub fn is_stale(&self) -> bool {
        self.is_stale
    }

    /// Fills the tables, for the fibre of `optics`.
    pub fn fill(&mut self, context: &Context, fill: &Fill, optics: &GpuOptics, stamp: Stamp) {
        self.is_stale = false;
        let groups = match self.groups.take() {
            Some(groups) => groups,
            None => self.bind(context, fill, optics),
        };
        let [rows, direct] = [&self.rows, &self.direct].map(|to| {
            let [x, y, z] = size_of(to);
            x * y * z
        });
        // Rows have four texels a half.
        let n_threads = [rows / 4, rows, direct, direct];
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            for ((pipeline, group), n) in fill.0.iter().zip(&groups).zip(n_threads) {
                step(&mut pass, pipeline, group, groups_of_64(n));
            }
        });
        self.groups = Some(groups);
    }

    fn bind(&self, context: &Context, fill: &Fill, optics: &GpuOptics) -> [wgpu::BindGroup; 4] {
        let view = wgpu::BindingResource::TextureView;
        let layout = (0, self.layout.as_entire_binding());
        let fibre = (1, optics.shading.as_entire_binding());
        let averages = (2, view(&optics.averages));
        let profiles = (3, self.profiles.as_entire_binding());
        let scratch = (4, self.scratch.as_entire_binding());
        let [rows, direct] = [&self.rows, &self.direct].map(|to| (5, view(to)));
        let group = |ix: usize, bindings: &[(u32, wgpu::BindingResource)]| {
            bind(context, &fill.0[ix].get_bind_group_layout(0), bindings)
        };
        [
            group(
                0,
                &[
                    layout.clone(),
                    fibre,
                    averages.clone(),
                    profiles,
                    scratch.clone(),
                ],
            ),
            group(1, &[layout.clone(), scratch.clone(), rows]),
            // Local scattering reads nothing of the fibre but its averages.
            group(2, &[layout.clone(), averages, scratch.clone()]),
            group(3, &[layout, scratch, direct]),
        ]
    }

    /// Bindings of the shading pass.
    pub fn bindings(&self) -> Vec<(u32, wgpu::BindingResource<'_>)> {
        let view = wgpu::BindingResource::TextureView;
        let mut bindings = vec![
            (18, self.layout.as_entire_binding()),
            (19, view(&self.rows)),
            (21, view(&self.direct)),
            (22, wgpu::BindingResource::Sampler(&self.sampler)),
        ];
        bindings.extend(self.elliptic.as_ref().map(|elliptic| (28, view(elliptic))));
        bindings
    }

    /// Bytes of all of it.
    pub fn bytes(&self) -> u64 {
        let buffers = [&self.layout, &self.profiles, &self.scratch].map(wgpu::Buffer::size);
        let textures = [&self.rows, &self.direct].map(|view| TEXEL_BYTES * texels(size_of(view)));
        let elliptic = self
            .elliptic
            .as_ref()
            .map(|view| 16 * texels(size_of(view)));
        buffers.iter().chain(&textures).chain(&elliptic).sum()
    }
}

fn size_of(view: &wgpu::TextureView) -> [u32; 3] {
    let wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers,
    } = view.texture().size();
    [width, height, depth_or_array_layers]
}
