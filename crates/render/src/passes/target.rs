//! Pictures of one size, or tiles of larger ones: samples, their sums, and the linear picture made
//! of these.

use super::covering::{COLOR, DEPTH};
use super::draw::Ribbons;
use super::film::Film;
use super::resources::{bind, compute_pass, step, storage, submit, uniform};
use super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_formats::Background;
use strandlight_scene::sampling::PASS_SAMPLES;

/// Mirrored by `Backdrop` in `shaders/pass/composite.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Backdrop {
    color: [f32; 3],
    kind: u32,
    n_lights: u32,
    n_samples: u32,
    pad: [u32; 2],
}

strandlight_scattering::mirrors! {
    Backdrop as "Backdrop" in "pass/composite" { color, kind, n_lights, n_samples, pad }
}

/// Rows of a target that a submission draws.
pub(crate) type Band = std::ops::Range<u32>;

/// The rows of bands that end at `ends`.
pub(crate) fn band(ends: &[u32], ix: usize) -> Band {
    let start = ix.checked_sub(1).and_then(|before| ends.get(before));
    start.copied().unwrap_or(0)..ends.get(ix).copied().unwrap_or(u32::MAX)
}

/// Which pass it is, and how many of its samples count.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PassSamples {
    pub pass_ix: u32,
    pub n: u32,
}

impl PassSamples {
    /// Those of a picture of `samples` a pixel.
    pub fn of(pass_ix: u32, samples: u32) -> PassSamples {
        let n = samples.saturating_sub(PASS_SAMPLES * pass_ix);
        let n = n.min(PASS_SAMPLES);
        PassSamples { pass_ix, n }
    }
}

/// What pictures of one size are drawn into.
pub(crate) struct Target {
    size: [u32; 2],
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
    sums: wgpu::Buffer,
    picture: wgpu::Buffer,
    backdrop: wgpu::Buffer,
    accumulate: wgpu::BindGroup,
    composite: wgpu::BindGroup,
    /// The lights that `composite` is bound to.
    lights: wgpu::Buffer,
}

impl Target {
    /// Room for pictures of `size`, none of whose sides is zero, with `lights` behind them.
    pub fn new(
        context: &Context,
        film: &Film,
        ribbons: &Ribbons,
        size: [u32; 2],
        lights: &wgpu::Buffer,
    ) -> Target {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let to_read = usage | wgpu::TextureUsages::TEXTURE_BINDING;
        let color = texture(context, "samples", size, 4, COLOR, to_read);
        let depth = texture(context, "depth", size, 4, DEPTH, usage);
        let bytes = u64::from(size[0]) * u64::from(size[1]) * 16;
        let sums = storage(context, "sums", bytes);
        let picture = storage(context, "picture", bytes);
        let backdrop: Backdrop = bytemuck::Zeroable::zeroed();
        let backdrop = uniform(context, "backdrop", &backdrop);
        let accumulate = bind(
            context,
            &film.accumulate.get_bind_group_layout(0),
            &[
                (0, ribbons.view().as_entire_binding()),
                (1, wgpu::BindingResource::TextureView(&color)),
                (2, sums.as_entire_binding()),
                (3, ribbons.current().as_entire_binding()),
            ],
        );
        let buffers = [ribbons.view(), &backdrop, lights, &sums, &picture];
        Target {
            composite: bind_composite(context, film, buffers),
            size,
            color,
            depth,
            sums,
            picture,
            backdrop,
            accumulate,
            lights: lights.clone(),
        }
    }

    /// Samples in the next passes are the first.
    pub fn clear(&self, context: &Context) {
        submit(context, |encoder| encoder.clear_buffer(&self.sums, 0, None));
    }

    /// Draws a band of four samples a pixel with `draw`; the last band adds those that count to
    /// the sums. `stamp` is for passes of one band.
    pub fn pass(
        &self,
        context: &Context,
        (film, ribbons): (&Film, &Ribbons),
        samples: PassSamples,
        band: &Band,
        stamp: Stamp,
        draw: impl FnOnce(&mut wgpu::RenderPass),
    ) {
        ribbons.set_pass(context, samples.pass_ix, samples.n);
        submit(context, |encoder| {
            draw(&mut self.begin_pass(encoder, band, &stamp.clone().first()));
            if band.end < self.size[1] {
                return;
            }
            let mut pass = compute_pass(encoder, stamp.last());
            let groups = self.size.map(|n| n.div_ceil(8));
            step(&mut pass, &film.accumulate, &self.accumulate, groups);
        });
    }

    fn begin_pass<'encoder>(
        &self,
        encoder: &'encoder mut wgpu::CommandEncoder,
        band: &Band,
        stamp: &Stamp,
    ) -> wgpu::RenderPass<'encoder> {
        let load = match band.start {
            0 => wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
            _ => wgpu::LoadOp::Load,
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("strands"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load,
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: stamp.render_writes(),
            ..Default::default()
        });
        let n_rows = band.end.min(self.size[1]) - band.start;
        pass.set_scissor_rect(0, band.start, self.size[0], n_rows);
        pass
    }

    /// Turns the sums of `samples` samples into the linear picture, before `background` or the
    /// first `n_lights` of `lights`.
    pub fn composite(
        &mut self,
        context: &Context,
        film: &Film,
        ribbons: &Ribbons,
        (background, samples): (&Background, u32),
        (lights, n_lights): (&wgpu::Buffer, u32),
        stamp: Stamp,
    ) {
        let (kind, color) = match *background {
            Background::None => (0, [0.0; 3]),
            Background::Color(color) => (1, color),
            Background::Lights => (2, [0.0; 3]),
        };
        let backdrop = Backdrop {
            color,
            kind,
            n_lights,
            n_samples: samples,
            pad: [0; 2],
        };
        let bytes = bytemuck::bytes_of(&backdrop);
        context.write(&self.backdrop, 0, bytes);
        if self.lights != *lights {
            let buffers = [
                ribbons.view(),
                &self.backdrop,
                lights,
                &self.sums,
                &self.picture,
            ];
            self.composite = bind_composite(context, film, buffers);
            self.lights = lights.clone();
        }
        submit(context, |encoder| {
            let mut pass = compute_pass(encoder, stamp);
            let groups = self.size.map(|n| n.div_ceil(8));
            step(&mut pass, &film.composite, &self.composite, groups);
        });
    }

    /// What [`Target::composite`] left: linear rgb times alpha, and alpha, row by row.
    pub fn picture(&self) -> &wgpu::Buffer {
        &self.picture
    }

    /// Sums of all samples so far.
    pub fn sums(&self) -> &wgpu::Buffer {
        &self.sums
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    pub fn bytes(&self) -> u64 {
        let samples = u64::from(self.size[0]) * u64::from(self.size[1]) * 4;
        self.sums.size() + self.picture.size() + samples * 12
    }
}

fn bind_composite(context: &Context, film: &Film, buffers: [&wgpu::Buffer; 5]) -> wgpu::BindGroup {
    let resources = [0, 1, 2, 3, 4].map(|ix| (ix as u32, buffers[ix].as_entire_binding()));
    let layout = film.composite.get_bind_group_layout(0);
    bind(context, &layout, &resources)
}

/// A texture's whole, none of its sides being zero.
pub(crate) fn texture(
    context: &Context,
    label: &'static str,
    [width, height]: [u32; 2],
    sample_count: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureView {
    let texel = u64::from(format.block_copy_size(None).unwrap_or(4));
    let n_texels = u64::from(width) * u64::from(height) * u64::from(sample_count);
    context.resource_counters().add_texture(n_texels * texel);
    let texture = context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}
