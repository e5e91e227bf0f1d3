//! The shadow volume on the device.

use super::resources::{
    StrandBuffers, bind, compute, compute_pass, groups_of_64, grow, shader, step, storage, submit,
    uniform,
};
use super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::strands::Strands;
use strandlight_scene::volume::{CHANNELS, Grid};

/// Area density and orientation of the hair, `[voxel][8]` f32.
pub(crate) struct Volume {
    pub grid: Grid,
    pub grid_buffer: wgpu::Buffer,
    buffer: wgpu::Buffer,
    sums: wgpu::Buffer,
    splat: wgpu::ComputePipeline,
    resolve: wgpu::ComputePipeline,
    groups: [wgpu::BindGroup; 2],
}

impl Volume {
    /// Room for `strands`; [`Volume::fill`] splats them.
    pub fn new(
        context: &Context,
        strands: &Strands,
        buffers: &StrandBuffers,
    ) -> Result<Self, RenderError> {
        let module = shader(context, "pass/voxelise")?;
        let grid = Grid::around(strands);
        let grid_buffer = uniform(context, "grid", &grid);
        let [sums, buffer] = [("voxel sums", 0), ("volume", 1)]
            .map(|(label, ix)| storage(context, label, sizes(&grid)[ix]));
        let splat = compute(context, &module, "splat");
        let resolve = compute(context, &module, "resolve");
        let groups = groups(
            context,
            &[&splat, &resolve],
            buffers,
            &grid_buffer,
            &sums,
            &buffer,
        );
        Ok(Volume {
            grid,
            grid_buffer,
            buffer,
            sums,
            splat,
            resolve,
            groups,
        })
    }

    /// Lays the grid around strands that have moved. Answers whether the volume is another buffer,
    /// which puts bind groups out of date.
    pub fn fit(&mut self, context: &Context, strands: &Strands, buffers: &StrandBuffers) -> bool {
        self.grid = Grid::around(strands);
        let bytes = bytemuck::bytes_of(&self.grid);
        context.write(&self.grid_buffer, 0, bytes);
        let [sums, volume] = sizes(&self.grid);
        // Hair that moves a little grows a little: not a new buffer for every frame.
        if self.buffer.size() >= volume {
            return false;
        }
        grow(context, &mut self.sums, sums / 4 * 5);
        grow(context, &mut self.buffer, volume / 4 * 5);
        self.groups = groups(
            context,
            &[&self.splat, &self.resolve],
            buffers,
            &self.grid_buffer,
            &self.sums,
            &self.buffer,
        );
        true
    }

    /// Splats the strands.
    pub fn fill(&self, context: &Context, stamp: Stamp) {
        submit(context, |encoder| {
            encoder.clear_buffer(&self.sums, 0, None);
            let mut pass = compute_pass(context, encoder, stamp);
            let [splat, resolve] = &self.groups;
            let size = groups_of_64(self.grid.n_segments);
            step(&mut pass, &self.splat, splat, size);
            let groups = (self.grid.n_voxels() as u32).div_ceil(64);
            step(&mut pass, &self.resolve, resolve, [groups, 1]);
        });
    }

    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    pub fn bytes(&self) -> u64 {
        self.buffer.size() + self.sums.size()
    }
}

/// Bytes of the sums, two words each, and of the volume.
fn sizes(grid: &Grid) -> [u64; 2] {
    let n_voxels = grid.n_voxels() as u64;
    [n_voxels * u64::from(CHANNELS) * 8, n_voxels * 32]
}

fn groups(
    context: &Context,
    [splat, resolve]: &[&wgpu::ComputePipeline; 2],
    strands: &StrandBuffers,
    grid: &wgpu::Buffer,
    sums: &wgpu::Buffer,
    volume: &wgpu::Buffer,
) -> [wgpu::BindGroup; 2] {
    let splat = bind(
        context,
        &splat.get_bind_group_layout(0),
        &[
            (0, grid.as_entire_binding()),
            (1, strands.points.as_entire_binding()),
            (2, strands.segments.as_entire_binding()),
            (3, sums.as_entire_binding()),
        ],
    );
    let resolve = bind(
        context,
        &resolve.get_bind_group_layout(0),
        &[
            (0, grid.as_entire_binding()),
            (3, sums.as_entire_binding()),
            (4, volume.as_entire_binding()),
        ],
    );
    [splat, resolve]
}
