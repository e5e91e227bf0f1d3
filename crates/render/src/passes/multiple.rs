//! Tables of multiple scattering on the device, which fills them.

use super::resources::{
    bind, buffer_of, compute, compute_pass, groups_of_64, grow, shader, step, storage, submit,
    uniform, write,
};
use super::stamp::Stamp;
use crate::gpu::Context;
use crate::gpu_optics::GpuOptics;
use strandlight_scattering::multiple_tables::{MultipleSource, ROW_TEXELS};
use strandlight_scene::RenderError;

/// Bytes of a texel.
const TEXEL_BYTES: u64 = 8;

fn texels([x, y, z]: [u32; 3]) -> u64 {
    u64::from(x) * u64::from(y) * u64::from(z)
}

/// Bytes of the rows before they are rounded.
fn scratch_bytes(source: &MultipleSource) -> u64 {
    16 * texels(source.rows_size()).max(texels(source.direct_size()))
}

/// Bytes of both textures, and of the largest buffer that they are made with.
pub(super) fn multiple_bytes(source: &MultipleSource) -> [u64; 2] {
    let textures = texels(source.rows_size()) + texels(source.direct_size());
    [TEXEL_BYTES * textures, scratch_bytes(source)]
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
    /// Rows, their balance, direct rows, their balance.
    pipelines: [wgpu::ComputePipeline; 4],
    /// The textures are those of another fibre.
    is_stale: bool,
}

impl Multiple {
    /// Room for the tables of `source`; [`Multiple::fill`] fills it.
    ///
    /// # Errors
    /// A shader the device refuses.
    pub fn new(context: &Context, source: &MultipleSource) -> Result<Multiple, RenderError> {
        let module = shader(context, "pass/multiple_tables")?;
        let entries = ["fill_rows", "balance_rows", "fill_direct", "balance_direct"];
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let profiles = buffer_of(context, "profiles", &source.profiles, usage);
        let sampler = context.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("linear"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Ok(Multiple {
            layout: uniform(context, "layout of multiple scattering", &source.layout),
            profiles,
            scratch: storage(context, "rows", scratch_bytes(source)),
            rows: texture(context, "multiple scattering", source.rows_size()),
            direct: texture(context, "direct local scattering", source.direct_size()),
            sampler,
            pipelines: entries.map(|entry| compute(context, &module, entry)),
            is_stale: true,
        })
    }

    /// Takes what an edit made. Answers whether a texture is another one, which puts bind groups out
    /// of date.
    pub fn update(&mut self, context: &Context, source: &MultipleSource) -> bool {
        self.is_stale = true;
        context.write(&self.layout, 0, bytemuck::bytes_of(&source.layout));
        write(context, &mut self.profiles, &source.profiles);
        grow(context, &mut self.scratch, scratch_bytes(source));
        let mut is_other = false;
        for (view, size) in [
            (&mut self.rows, source.rows_size()),
            (&mut self.direct, source.direct_size()),
        ] {
            if size_of(view) != size {
                *view = texture(context, "multiple scattering", size);
                is_other = true;
            }
        }
        is_other
    }

    /// Does [`Multiple::fill`] have to run before the next shading?
    pub fn is_stale(&self) -> bool {
        self.is_stale
    }

    /// Fills the tables, for the fibre of `optics`.
    pub fn fill(&mut self, context: &Context, optics: &GpuOptics, stamp: Stamp) {
        self.is_stale = false;
        let groups = [&self.rows, &self.direct].map(|to| {
            let [x, y, z] = size_of(to);
            x * y * z
        });
        let [rows, direct] = groups;
        let averages = wgpu::BindingResource::TextureView(&optics.averages);
        let target = wgpu::BindingResource::TextureView;
        let common = || {
            vec![
                (0, self.layout.as_entire_binding()),
                (4, self.scratch.as_entire_binding()),
            ]
        };
        let of_fibre = [(1, optics.shading.as_entire_binding()), (2, averages)];
        let profiles = [(3, self.profiles.as_entire_binding())];
        let bindings = [
            [common(), of_fibre.to_vec(), profiles.to_vec()].concat(),
            [common(), vec![(5, target(&self.rows))]].concat(),
            // Local scattering reads nothing of the fibre but its averages.
            [common(), of_fibre[1..].to_vec()].concat(),
            [common(), vec![(5, target(&self.direct))]].concat(),
        ];
        let n_threads = [rows / ROW_TEXELS as u32, rows, direct, direct];
        submit(context, |encoder| {
            let mut pass = compute_pass(encoder, stamp);
            for ((pipeline, bindings), n) in self.pipelines.iter().zip(&bindings).zip(n_threads) {
                let group = bind(context, &pipeline.get_bind_group_layout(0), bindings);
                step(&mut pass, pipeline, &group, groups_of_64(n));
            }
        });
    }

    /// Bindings of the shading pass.
    pub fn bindings(&self) -> [(u32, wgpu::BindingResource<'_>); 4] {
        let view = wgpu::BindingResource::TextureView;
        [
            (18, self.layout.as_entire_binding()),
            (19, view(&self.rows)),
            (21, view(&self.direct)),
            (22, wgpu::BindingResource::Sampler(&self.sampler)),
        ]
    }

    /// Bytes of all of it.
    pub fn bytes(&self) -> u64 {
        let buffers = [&self.layout, &self.profiles, &self.scratch].map(wgpu::Buffer::size);
        let textures = [&self.rows, &self.direct].map(|view| TEXEL_BYTES * texels(size_of(view)));
        buffers.iter().chain(&textures).sum()
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

fn texture(context: &Context, label: &'static str, [x, y, z]: [u32; 3]) -> wgpu::TextureView {
    context
        .resource_counters()
        .add_texture(TEXEL_BYTES * texels([x, y, z]));
    let texture = context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width: x,
            height: y,
            depth_or_array_layers: z,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
