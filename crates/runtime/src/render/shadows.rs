//! Records of what hair leaves of each light, kept on the device between frames.
//!
//! They depend on the points, the fibres' diameter and the lights' directions and widths: another
//! camera or an edit of the hair leaves them as they are.

use web_time::Instant;

use super::LIGHT_BATCH;
use super::resources::{bind, failed, read_back, shader, storage, submit, uniform};
use super::volume::Volume;
use crate::error::RenderError;
use crate::gpu::Context;
use crate::volume::{Grid, MAX_DIRECTIONS};
use strandlight_scattering::closed_form::PackedRecord;

/// Bytes from step to step in the uniform, as every adapter aligns them.
const STEP_STRIDE: u64 = 256;

/// Which lights and points a dispatch works on; mirrored by `Batch` in `shaders/lib/light.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Batch {
    pub first_light: u32,
    pub n_lights: u32,
    pub first_point: u32,
    pub end_point: u32,
    pub min_power: f32,
    pub density_forward: f32,
    pub density_back: f32,
    pub most_local: f32,
}

/// The pipeline of the sweep.
pub(super) struct Sweep {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    /// `Step` of `shaders/pass/transmittance.wgsl`, slice by slice, direction by direction.
    steps: wgpu::Buffer,
}

/// The lights on the device, as the sweep reads them.
pub(super) struct SweptLights<'a> {
    pub lights: &'a wgpu::Buffer,
    pub directions: &'a wgpu::Buffer,
    pub n_lights: usize,
    /// Directions of the light that has most.
    pub n_directions: u32,
}

/// Records of all lights, or room for those of one batch.
pub(super) struct Records {
    buffers: Vec<wgpu::Buffer>,
    /// All lights are there.
    pub is_kept: bool,
    /// Wall-clock time of the sweeps.
    pub milliseconds: f64,
}

impl Records {
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().map(wgpu::Buffer::size).sum()
    }

    /// Packed records `[light of the batch][voxel]` of batch `ix`, or where they are to go.
    pub fn batch(&self, ix: usize) -> &wgpu::Buffer {
        &self.buffers[if self.is_kept { ix } else { 0 }]
    }
}

impl Sweep {
    pub fn new(context: &Context) -> Result<Self, RenderError> {
        use wgpu::BufferBindingType::{Storage, Uniform};
        let buffer = |binding: u32, ty, has_dynamic_offset| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty,
                has_dynamic_offset,
                min_binding_size: None,
            },
            count: None,
        };
        let read = Storage { read_only: true };
        let write = Storage { read_only: false };
        let kinds = [Uniform, Uniform, read, read, read, write, write];
        let mut entries: Vec<_> = (0..)
            .zip(kinds)
            .map(|(ix, ty)| buffer(ix, ty, false))
            .collect();
        entries.push(buffer(7, Uniform, true));
        let device = &context.device;
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("sweep"),
            entries: &entries,
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("sweep"),
            bind_group_layouts: &[Some(&layout)],
            ..Default::default()
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("sweep"),
            layout: Some(&pipeline_layout),
            module: &shader(context, "pass/transmittance")?,
            entry_point: Some("sweep"),
            compilation_options: Default::default(),
            cache: None,
        });
        let mut steps = Vec::new();
        for k in 0..MAX_DIRECTIONS {
            for slice in 0..crate::volume::GRID_SIDE {
                let mut step = [0_u32; STEP_STRIDE as usize / 4];
                (step[0], step[1]) = (k, slice);
                steps.extend(step);
            }
        }
        Ok(Sweep {
            pipeline,
            layout,
            steps: super::resources::buffer_of(
                context,
                "steps",
                &steps,
                wgpu::BufferUsages::UNIFORM,
            ),
        })
    }

    /// Sweeps all lights if their records fit the budget in bytes; else makes room for one batch.
    pub fn prepare(
        &self,
        context: &Context,
        volume: &Volume,
        lights: &SweptLights,
        budget: u64,
    ) -> Result<Records, RenderError> {
        let start = Instant::now();
        let a_light = (volume.grid.n_voxels() * size_of::<PackedRecord>()) as u64;
        let is_kept = a_light * lights.n_lights as u64 <= budget;
        let mut buffers = Vec::new();
        for first in (0..lights.n_lights.max(1)).step_by(LIGHT_BATCH) {
            let n_lights = LIGHT_BATCH.min(lights.n_lights - first);
            let records = storage(context, "records", a_light * n_lights as u64);
            if is_kept {
                self.batch(context, volume, lights, first, &records)?;
            }
            buffers.push(records);
            if !is_kept {
                break;
            }
        }
        Ok(Records {
            buffers,
            is_kept,
            milliseconds: 1e3 * start.elapsed().as_secs_f64(),
        })
    }

    /// Fills `records` for the batch of lights from `first` on.
    pub fn batch(
        &self,
        context: &Context,
        volume: &Volume,
        lights: &SweptLights,
        first: usize,
        records: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        let n_lights = LIGHT_BATCH.min(lights.n_lights - first);
        if n_lights == 0 {
            return Ok(());
        }
        let batch = Batch {
            first_light: first as u32,
            n_lights: n_lights as u32,
            ..bytemuck::Zeroable::zeroed()
        };
        let batch = uniform(context, "batch", &batch);
        let n_cells = largest_slice(&volume.grid);
        let leaving = storage(
            context,
            "leaving",
            2 * 16 * u64::from(n_cells) * n_lights as u64,
        );
        let a_step = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.steps,
            offset: 0,
            size: wgpu::BufferSize::new(16),
        });
        let group = bind(
            context,
            &self.layout,
            &[
                (0, volume.grid_buffer.as_entire_binding()),
                (1, batch.as_entire_binding()),
                (2, volume.buffer().as_entire_binding()),
                (3, lights.lights.as_entire_binding()),
                (4, lights.directions.as_entire_binding()),
                (5, records.as_entire_binding()),
                (6, leaving.as_entire_binding()),
                (7, a_step),
            ],
        );
        let n_slices = volume.grid.dims.into_iter().max().unwrap_or(0);
        for k in 0..lights.n_directions {
            submit(context, |encoder| {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&self.pipeline);
                for slice in 0..n_slices {
                    let step = u64::from(k * crate::volume::GRID_SIDE + slice) * STEP_STRIDE;
                    pass.set_bind_group(0, &group, &[step as u32]);
                    pass.dispatch_workgroups(n_cells.div_ceil(64), n_lights as u32, 1);
                }
            });
            // One direction at a time: a software device takes a second for some of them.
            context.wait("transmittance").map_err(failed)?;
        }
        Ok(())
    }

    /// The packed records of the first batch of lights, `[light][voxel]`.
    pub fn read_first(
        &self,
        context: &Context,
        volume: &Volume,
        lights: &SweptLights,
        records: &Records,
    ) -> Result<Vec<PackedRecord>, RenderError> {
        if !records.is_kept {
            self.batch(context, volume, lights, 0, records.batch(0))?;
        }
        let mut packed = read_back(context, "records", records.batch(0))?;
        // Buffers are never empty.
        packed.truncate(volume.grid.n_voxels() * LIGHT_BATCH.min(lights.n_lights));
        Ok(packed)
    }
}

/// Cells of the largest slice across any axis.
fn largest_slice(grid: &Grid) -> u32 {
    let [x, y, z] = grid.dims;
    (x * y).max(y * z).max(z * x)
}
