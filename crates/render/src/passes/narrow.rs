//! Narrow lights: single scattering of them along segments, see `shaders/lib/along_segments.wgsl`.

use super::resources::{
    Groups, bind, buffer_of, compute_pass, compute_with, step_over, storage, submit, write,
};
use super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::BYTES_ALONG;

/// The narrow lights that are not black, and room for their radiance.
pub(crate) struct NarrowLights {
    /// Are they shaded along segments, or at points?
    pub are_along: bool,
    lights: wgpu::Buffer,
    n: u32,
    /// By buffer of radiance, `[point][half]`; none until there are such lights.
    along: Vec<wgpu::Buffer>,
}

impl NarrowLights {
    /// None yet.
    pub fn new(context: &Context) -> NarrowLights {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        NarrowLights {
            are_along: true,
            lights: buffer_of::<LightRecord>(context, "narrow lights", &[], usage),
            n: 0,
            along: Vec::new(),
        }
    }

    /// Takes those of `lit`, and makes room for so many points in so many buffers when there are first some.
    /// Answers whether a buffer is another one, which puts bind groups out of date.
    pub fn write(
        &mut self,
        context: &Context,
        lit: &[LightRecord],
        (n_points, n_buffers): (u32, usize),
    ) -> bool {
        let is_narrow = |light: &&LightRecord| light.is_narrow();
        let narrow: Vec<LightRecord> = lit.iter().filter(is_narrow).copied().collect();
        self.n = narrow.len() as u32;
        if self.n == 0 {
            return false;
        }
        let is_first = self.along.is_empty();
        if is_first {
            let bytes = BYTES_ALONG as u64 * u64::from(n_points);
            self.along = (0..n_buffers)
                .map(|_| storage(context, "radiance along segments", bytes))
                .collect();
        }
        write(context, &mut self.lights, &narrow) | is_first
    }

    /// How many there are.
    pub fn n(&self) -> u32 {
        self.n
    }

    /// Is there room for their radiance, since there were some once?
    pub fn have_room(&self) -> bool {
        !self.along.is_empty()
    }

    /// Their radiance, by buffer of radiance, if there is room.
    pub fn along(&self) -> &[wgpu::Buffer] {
        &self.along
    }

    /// Makes one of the buffers black.
    pub fn clear(&self, context: &Context, into: usize) {
        if let Some(along) = self.along.get(into) {
            submit(context, |encoder| encoder.clear_buffer(along, 0, None));
        }
    }
}

/// What shades segments with narrow lights.
pub(super) struct NarrowPass {
    pipeline: wgpu::ComputePipeline,
    /// By buffer of radiance.
    groups: Vec<wgpu::BindGroup>,
}

impl NarrowPass {
    /// Of the shader of shading, for the modes of its fibre, with the `bindings` that do not depend on the lights. Where
    /// strands are wide it adds to the `radiance` of points.
    pub fn new(
        context: &Context,
        (module, modes): (&wgpu::ShaderModule, u32),
        (lights, radiance): (&NarrowLights, Option<&[wgpu::Buffer]>),
        bindings: &[(u32, wgpu::BindingResource)],
    ) -> NarrowPass {
        let constants = [("MODES", f64::from(modes))];
        let pipeline = compute_with(context, module, "shade_narrow", &constants);
        let layout = pipeline.get_bind_group_layout(0);
        let of_along = |(ix, along): (usize, &wgpu::Buffer)| {
            let mut bindings = bindings.to_vec();
            bindings.push((7, lights.lights.as_entire_binding()));
            bindings.push((24, along.as_entire_binding()));
            bindings.extend(radiance.map(|buffers| (9, buffers[ix].as_entire_binding())));
            bind(context, &layout, &bindings)
        };
        NarrowPass {
            groups: lights.along.iter().enumerate().map(of_along).collect(),
            pipeline,
        }
    }

    /// Shades the segments about points, by so many groups of 64.
    pub fn run(&self, context: &Context, groups: Groups, into: usize, stamp: Stamp) {
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            step_over(&mut pass, &self.pipeline, &self.groups[into], groups);
        });
    }
}
