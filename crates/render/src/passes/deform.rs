//! Bending the strands in the wind on the device.

use super::resources::{
    StrandBuffers, bind, buffer_of, compute, compute_pass, groups_of_64, shader, step, submit,
    uniform,
};
use super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::motion::Wind;
use strandlight_scene::strands::Strands;

/// The strands at rest, and the pass that moves those on the device.
pub(crate) struct Deform {
    pipeline: wgpu::ComputePipeline,
    wind: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl Deform {
    /// Of `strands` at rest; `buffers` are written.
    pub fn new(
        context: &Context,
        strands: &Strands,
        buffers: &StrandBuffers,
    ) -> Result<Self, RenderError> {
        let pipeline = compute(context, &shader(context, "pass/deform")?, "deform");
        let none: Wind = bytemuck::Zeroable::zeroed();
        let wind = uniform(context, "wind", &none);
        let ranges: Vec<[u32; 2]> = strands.ranges().collect();
        let usage = wgpu::BufferUsages::STORAGE;
        let rest = buffer_of(context, "points at rest", &strands.points, usage);
        let ranges = buffer_of(context, "strands", &ranges, usage);
        let group = bind(
            context,
            &pipeline.get_bind_group_layout(0),
            &[
                (0, wind.as_entire_binding()),
                (1, rest.as_entire_binding()),
                (2, ranges.as_entire_binding()),
                (3, buffers.points.as_entire_binding()),
                (4, buffers.tangents.as_entire_binding()),
                (5, buffers.normals.as_entire_binding()),
            ],
        );
        Ok(Deform {
            pipeline,
            wind,
            group,
        })
    }

    /// Moves the strands to where they are in `wind`.
    pub fn run(&self, context: &Context, wind: &Wind, stamp: Stamp) {
        let bytes = bytemuck::bytes_of(wind);
        context.write(&self.wind, 0, bytes);
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            let groups = groups_of_64(wind.n_strands);
            step(&mut pass, &self.pipeline, &self.group, groups);
        });
    }
}
