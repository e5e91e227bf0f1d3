//! Pictures of one size, or tiles of larger ones: samples, their sums, and the linear picture made
//! of these.

use std::sync::Arc;

use super::behind::seen;
use super::covering::{COLOR, DEPTH};
use super::draw::Ribbons;
use super::film::Film;
use super::resources::{bind, compute_pass, step, storage, submit, texture, uniform};
use super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_formats::{Background, Panorama};
use strandlight_scene::PreparedScene;
use strandlight_scene::panorama::TurnedPanorama;
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
    factor: [f32; 3],
    turn: f32,
}

strandlight_scattering::mirrors! {
    Backdrop as "Backdrop" in "pass/composite" {
        color, kind, n_lights, n_samples, pad, factor, turn,
    }
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

/// The samples of a pass.
struct Samples {
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
    accumulate: wgpu::BindGroup,
}

impl Samples {
    /// Room for those of pictures of `size`, and what adds them to `sums`.
    fn new(
        context: &Context,
        film: &Film,
        ribbons: &Ribbons,
        size: [u32; 2],
        sums: &wgpu::Buffer,
    ) -> Samples {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let to_read = usage | wgpu::TextureUsages::TEXTURE_BINDING;
        let color = texture(context, "samples", size, 4, COLOR, to_read);
        let resources = [
            (0, ribbons.view().as_entire_binding()),
            (1, wgpu::BindingResource::TextureView(&color)),
            (2, sums.as_entire_binding()),
            (3, ribbons.current().as_entire_binding()),
        ];
        let layout = film.accumulate.get_bind_group_layout(0);
        Samples {
            accumulate: bind(context, &layout, &resources),
            depth: texture(context, "depth", size, 4, DEPTH, usage),
            color,
        }
    }

    fn begin_pass<'encoder>(
        &self,
        encoder: &'encoder mut wgpu::CommandEncoder,
        [width, height]: [u32; 2],
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
        let n_rows = band.end.min(height) - band.start;
        pass.set_scissor_rect(0, band.start, width, n_rows);
        pass
    }
}

/// What pictures of one size are drawn into.
pub(crate) struct Target {
    size: [u32; 2],
    /// Once there was a pass.
    samples: Option<Samples>,
    sums: wgpu::Buffer,
    picture: wgpu::Buffer,
    backdrop: wgpu::Buffer,
    composite: wgpu::BindGroup,
    /// The lights that `composite` is bound to.
    lights: wgpu::Buffer,
    /// The map behind the hair that it is bound to.
    map: Option<Arc<Panorama>>,
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
        let bytes = u64::from(size[0]) * u64::from(size[1]) * 16;
        let sums = storage(context, "sums", bytes);
        let picture = storage(context, "picture", bytes);
        let backdrop: Backdrop = bytemuck::Zeroable::zeroed();
        let backdrop = uniform(context, "backdrop", &backdrop);
        let buffers = [ribbons.view(), &backdrop, lights, &sums, &picture];
        Target {
            composite: bind_composite(context, film, buffers),
            size,
            samples: None,
            sums,
            picture,
            backdrop,
            lights: lights.clone(),
            map: film.behind.as_ref().map(|behind| behind.map.clone()),
        }
    }

    /// Samples in the next passes are the first.
    pub fn clear(&self, context: &Context) {
        submit(context, |encoder| encoder.clear_buffer(&self.sums, 0, None));
    }

    /// Draws a band of four samples a pixel with `draw`; the last band adds those that count to
    /// the sums. `stamp` is for passes of one band.
    pub fn pass(
        &mut self,
        context: &Context,
        (film, ribbons): (&Film, &Ribbons),
        of_pass: PassSamples,
        band: &Band,
        stamp: Stamp,
        draw: impl FnOnce(&mut wgpu::RenderPass),
    ) {
        ribbons.set_pass(context, of_pass.pass_ix, of_pass.n);
        let (size, sums) = (self.size, &self.sums);
        let samples = self
            .samples
            .get_or_insert_with(|| Samples::new(context, film, ribbons, size, sums));
        submit(context, |encoder| {
            draw(&mut samples.begin_pass(encoder, size, band, &stamp.clone().first()));
            if band.end < size[1] {
                return;
            }
            let mut pass = compute_pass(context, encoder, stamp.last());
            let groups = size.map(|n| n.div_ceil(8));
            step(&mut pass, &film.accumulate, &samples.accumulate, groups);
        });
    }

    /// Turns the sums of `samples` samples into the linear picture, before the background of `scene`: a colour, the
    /// first `n_lights` of `lights`, or the map of [`Film::set_behind`].
    pub fn composite(
        &mut self,
        context: &Context,
        film: &Film,
        ribbons: &Ribbons,
        (scene, samples): (&PreparedScene, u32),
        (lights, n_lights): (&wgpu::Buffer, u32),
        stamp: Stamp,
    ) {
        let behind = film.behind.as_ref();
        let map = behind.and_then(|_| seen(scene));
        let (kind, color) = match scene.background {
            Background::None => (0, [0.0; 3]),
            Background::Color(color) => (1, color),
            Background::Panorama if map.is_some() => (3, [0.0; 3]),
            Background::Lights | Background::Panorama => (2, [0.0; 3]),
        };
        let (factor, turn) = map.map_or(([0.0; 3], 0.0), TurnedPanorama::uniform);
        let backdrop = Backdrop {
            color,
            kind,
            n_lights,
            n_samples: samples,
            pad: [0; 2],
            factor,
            turn,
        };
        let bytes = bytemuck::bytes_of(&backdrop);
        context.write(&self.backdrop, 0, bytes);
        let map = behind.map(|behind| &behind.map);
        let is_bound = match (map, &self.map) {
            (Some(map), Some(bound)) => Arc::ptr_eq(map, bound),
            (map, bound) => map.is_none() && bound.is_none(),
        };
        if self.lights != *lights || !is_bound {
            let buffers = [
                ribbons.view(),
                &self.backdrop,
                lights,
                &self.sums,
                &self.picture,
            ];
            self.composite = bind_composite(context, film, buffers);
            self.lights = lights.clone();
            self.map = map.cloned();
        }
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            let groups = self.size.map(|n| n.div_ceil(8));
            let pipeline = behind.map_or(&film.composite, |behind| &behind.composite);
            step(&mut pass, pipeline, &self.composite, groups);
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
        let samples = self.samples.as_ref().map_or(0, |_| samples * 12);
        self.sums.size() + self.picture.size() + samples
    }
}

fn bind_composite(context: &Context, film: &Film, buffers: [&wgpu::Buffer; 5]) -> wgpu::BindGroup {
    let buffers = buffers.iter().map(|buffer| buffer.as_entire_binding());
    let texels = film.behind.as_ref().map(|behind| &behind.texels);
    let resources: Vec<_> = (0..)
        .zip(buffers.chain(texels.map(wgpu::BindingResource::TextureView)))
        .collect();
    let pipeline = film.behind.as_ref().map(|behind| &behind.composite);
    let layout = pipeline.unwrap_or(&film.composite).get_bind_group_layout(0);
    bind(context, &layout, &resources)
}
