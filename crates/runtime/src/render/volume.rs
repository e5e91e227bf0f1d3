//! The shadow volume on the device.

use super::resources::{
    StrandBuffers, bind, compute, dispatch, failed, shader, storage, submit, uniform,
};
use crate::error::RenderError;
use crate::gpu::Context;
use crate::strands::Strands;
use crate::volume::{CHANNELS, Grid};

/// Area density and orientation of the hair, `[voxel][8]` f32.
pub(super) struct Volume {
    pub grid: Grid,
    pub grid_buffer: wgpu::Buffer,
    buffer: wgpu::Buffer,
    splat: wgpu::ComputePipeline,
    resolve: wgpu::ComputePipeline,
}

impl Volume {
    /// Splats `strands`.
    pub fn new(
        context: &Context,
        strands: &Strands,
        buffers: &StrandBuffers,
    ) -> Result<Self, RenderError> {
        let module = shader(context, "pass/voxelise")?;
        let grid = Grid::around(strands);
        let mut volume = Volume {
            grid,
            grid_buffer: uniform(context, "grid", &grid),
            buffer: storage(context, "volume", 0),
            splat: compute(context, &module, "splat"),
            resolve: compute(context, &module, "resolve"),
        };
        volume.fill(context, strands, buffers)?;
        Ok(volume)
    }

    /// Splats strands that have moved.
    pub fn fill(
        &mut self,
        context: &Context,
        strands: &Strands,
        buffers: &StrandBuffers,
    ) -> Result<(), RenderError> {
        let grid = Grid::around(strands);
        let n_voxels = grid.n_voxels() as u64;
        let grid_buffer = uniform(context, "grid", &grid);
        // Two words for each sum; wgpu zeroes new buffers.
        let sums = storage(context, "voxel sums", n_voxels * u64::from(CHANNELS) * 8);
        let buffer = storage(context, "volume", n_voxels * 32);
        let splat_group = bind(
            context,
            &self.splat.get_bind_group_layout(0),
            &[
                (0, grid_buffer.as_entire_binding()),
                (1, buffers.points.as_entire_binding()),
                (2, buffers.segments.as_entire_binding()),
                (3, sums.as_entire_binding()),
            ],
        );
        let resolve_group = bind(
            context,
            &self.resolve.get_bind_group_layout(0),
            &[
                (0, grid_buffer.as_entire_binding()),
                (3, sums.as_entire_binding()),
                (4, buffer.as_entire_binding()),
            ],
        );
        // More groups than one dimension takes go into the second.
        let groups = grid.n_segments.div_ceil(64);
        let rows = groups.div_ceil(32_768).max(1);
        submit(context, |encoder| {
            let size = [groups.div_ceil(rows), rows];
            dispatch(encoder, &self.splat, &splat_group, size);
            let groups = (n_voxels as u32).div_ceil(64);
            dispatch(encoder, &self.resolve, &resolve_group, [groups, 1]);
        });
        context.wait("voxelise").map_err(failed)?;
        (self.grid, self.grid_buffer, self.buffer) = (grid, grid_buffer, buffer);
        Ok(())
    }

    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    pub fn bytes(&self) -> u64 {
        self.buffer.size() + self.grid.n_voxels() as u64 * u64::from(CHANNELS) * 8
    }
}
