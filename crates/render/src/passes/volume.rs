//! The shadow volume on the device.

use super::resources::{
    StrandBuffers, bind, compute, compute_pass, groups_of_64, grow, shader, step, storage, submit,
    texture_3d, uniform,
};
use super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::strands::Strands;
use strandlight_scene::volume::{CHANNELS, GRID_SIDE, Grid};

/// Bytes of [`Volume::axis_shares`].
pub(crate) const AXIS_SHARES_BYTES: u64 = 4 * 3 * (GRID_SIDE as u64).pow(3);

/// Area density and orientation of the hair, `[voxel][8]` f32.
pub(crate) struct Volume {
    pub grid: Grid,
    pub grid_buffer: wgpu::Buffer,
    buffer: wgpu::Buffer,
    sums: wgpu::Buffer,
    /// How open the hair is along the axes, three texels a voxel, for grids of up to [`GRID_SIDE`] voxels a side.
    axis_shares: wgpu::TextureView,
    pipelines: [wgpu::ComputePipeline; 3],
    groups: [wgpu::BindGroup; 3],
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
        let axis_shares = texture_3d(
            context,
            "axis shares",
            [3 * GRID_SIDE, GRID_SIDE, GRID_SIDE],
            wgpu::TextureFormat::R32Uint,
        );
        let pipelines =
            ["splat", "resolve", "find_axis_shares"].map(|entry| compute(context, &module, entry));
        let groups = groups(
            context,
            &pipelines,
            buffers,
            (&grid_buffer, &axis_shares),
            [&sums, &buffer],
        );
        Ok(Volume {
            grid,
            grid_buffer,
            buffer,
            sums,
            axis_shares,
            pipelines,
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
            &self.pipelines,
            buffers,
            (&self.grid_buffer, &self.axis_shares),
            [&self.sums, &self.buffer],
        );
        true
    }

    /// Splats the strands, and finds how open the hair is.
    pub fn fill(&self, context: &Context, stamp: Stamp) {
        submit(context, |encoder| {
            encoder.clear_buffer(&self.sums, 0, None);
            let mut pass = compute_pass(context, encoder, stamp);
            let [x, y, z] = self.grid.dims;
            let n_columns = y * z + x * z + x * y;
            let sizes = [
                groups_of_64(self.grid.n_segments),
                [(self.grid.n_voxels() as u32).div_ceil(64), 1],
                [n_columns.div_ceil(64), 1],
            ];
            for ((pipeline, group), size) in self.pipelines.iter().zip(&self.groups).zip(sizes) {
                step(&mut pass, pipeline, group, size);
            }
        });
    }

    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// `r32uint`, see `find_axis_shares` of the pass.
    pub fn axis_shares(&self) -> &wgpu::TextureView {
        &self.axis_shares
    }

    pub fn bytes(&self) -> u64 {
        self.buffer.size() + self.sums.size() + AXIS_SHARES_BYTES
    }
}

/// Bytes of the sums, two words each, and of the volume.
fn sizes(grid: &Grid) -> [u64; 2] {
    let n_voxels = grid.n_voxels() as u64;
    [n_voxels * u64::from(CHANNELS) * 8, n_voxels * 32]
}

fn groups(
    context: &Context,
    [splat, resolve, find_axis_shares]: &[wgpu::ComputePipeline; 3],
    strands: &StrandBuffers,
    (grid, axis_shares): (&wgpu::Buffer, &wgpu::TextureView),
    [sums, volume]: [&wgpu::Buffer; 2],
) -> [wgpu::BindGroup; 3] {
    let of = |pipeline: &wgpu::ComputePipeline, resources: &[(u32, wgpu::BindingResource)]| {
        bind(context, &pipeline.get_bind_group_layout(0), resources)
    };
    let grid = || (0, grid.as_entire_binding());
    [
        of(
            splat,
            &[
                grid(),
                (1, strands.points.as_entire_binding()),
                (2, strands.segments.as_entire_binding()),
                (3, sums.as_entire_binding()),
            ],
        ),
        of(
            resolve,
            &[
                grid(),
                (3, sums.as_entire_binding()),
                (4, volume.as_entire_binding()),
            ],
        ),
        of(
            find_axis_shares,
            &[
                grid(),
                (4, volume.as_entire_binding()),
                (5, wgpu::BindingResource::TextureView(axis_shares)),
            ],
        ),
    ]
}
