//! Records of what hair leaves of each light, kept on the device between frames.
//!
//! They depend on the points, the fibres' diameter and the lights' directions and widths: another
//! camera or an edit of the hair leaves them as they are.

use super::meshes;
use super::proxies::Blocker;
use super::resources::{
    bind, buffer_of, compute_pass, grow, module_with, storage, submit, uniform,
};
use super::stamp::Stamp;
use super::volume::Volume;
use crate::gpu::{Context, ResourceCounters};
use strandlight_scattering::closed_form::PackedRecord;
use strandlight_scene::RenderError;
use strandlight_scene::budget::LIGHT_BATCH;
use strandlight_scene::volume::{Grid, MAX_DIRECTIONS};

/// Bytes from step to step in the uniform, as every adapter aligns them.
const STEP_STRIDE: u64 = 256;

/// Bytes of that uniform.
pub(super) const STEP_BYTES: u64 =
    STEP_STRIDE * MAX_DIRECTIONS as u64 * strandlight_scene::volume::GRID_SIDE as u64;

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
    pub max_local: f32,
    pub are_along: u32,
    pub are_listed: u32,
    pub pad: [u32; 2],
}

/// Which slice of the volume a dispatch sweeps, and along which of its lights' directions; mirrored
/// by `Step` in `shaders/pass/transmittance.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Step {
    k: u32,
    slice_ix: u32,
}

strandlight_scattering::mirrors! {
    Batch as "Batch" in "lib/light" {
        first_light, n_lights, first_point, end_point, min_power, density_forward, density_back,
        max_local, are_along, are_listed, pad,
    }
    Step as "Step" in "pass/transmittance" { k, slice_ix }
}

/// The pipeline of the sweep, and the records of all lights or room for those of one batch.
pub(super) struct Sweep {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    /// A [`Step`] for each slice and direction, slice by slice, direction by direction.
    steps: wgpu::Buffer,
    /// What blocks light besides strands.
    proxies: Option<Blocker>,
    leaving: wgpu::Buffer,
    records: Vec<wgpu::Buffer>,
    batches: Vec<SweptBatch>,
    is_kept: bool,
}

/// What the sweeps of one batch of lights read.
struct SweptBatch {
    group: wgpu::BindGroup,
    n_lights: u32,
}

/// The lights on the device, as the sweep reads them.
pub(super) struct SweptLights<'a> {
    pub lights: &'a wgpu::Buffer,
    pub directions: &'a wgpu::Buffer,
    pub n_lights: usize,
}

impl Sweep {
    pub fn new(context: &Context) -> Result<Self, RenderError> {
        let (pipeline, layout) = compiled(context, None)?;
        let mut steps = Vec::new();
        for k in 0..MAX_DIRECTIONS {
            for slice_ix in 0..strandlight_scene::volume::GRID_SIDE {
                let mut step = [0_u8; STEP_STRIDE as usize];
                step[..size_of::<Step>()]
                    .copy_from_slice(bytemuck::bytes_of(&Step { k, slice_ix }));
                steps.extend(step);
            }
        }
        Ok(Sweep {
            pipeline,
            layout,
            steps: buffer_of(context, "steps", &steps, wgpu::BufferUsages::UNIFORM),
            proxies: None,
            leaving: storage(context, "leaving", 0),
            records: Vec::new(),
            batches: Vec::new(),
            is_kept: false,
        })
    }

    /// Takes proxies that block light; [`Sweep::fit`] has to follow.
    pub fn set_proxies(
        &mut self,
        context: &Context,
        blocker: Option<Blocker>,
    ) -> Result<(), RenderError> {
        let feature = |blocker: &Option<Blocker>| blocker.as_ref().map(|blocker| blocker.feature);
        let wanted = feature(&blocker);
        if wanted != feature(&self.proxies) {
            (self.pipeline, self.layout) = compiled(context, wanted)?;
        }
        self.proxies = blocker;
        Ok(())
    }

    /// Takes another buffer of the same blocker; [`Sweep::fit`] has to follow.
    pub fn renew_blocker(&mut self, blocker: Blocker) {
        self.proxies = Some(blocker);
    }

    /// Makes room for the records of `lights` in `volume`: of all if they fit `budget` bytes, else
    /// of one batch. The lights or the volume may be other buffers than before.
    pub fn fit(&mut self, context: &Context, volume: &Volume, lights: &SweptLights, budget: u64) {
        let a_light = (volume.grid.n_voxels() * size_of::<PackedRecord>()) as u64;
        self.is_kept = a_light * lights.n_lights as u64 <= budget;
        let n_cells = u64::from(largest_slice(&volume.grid));
        let most = LIGHT_BATCH.min(lights.n_lights) as u64;
        grow(context, &mut self.leaving, 2 * 16 * n_cells * most);
        self.batches.clear();
        let firsts = (0..lights.n_lights.max(1)).step_by(LIGHT_BATCH);
        let n_buffers = if self.is_kept { firsts.len() } else { 1 };
        self.records.truncate(n_buffers);
        for (ix, first) in firsts.enumerate() {
            let n_lights = LIGHT_BATCH.min(lights.n_lights - first);
            let bytes = a_light * n_lights as u64;
            match self.records.get_mut(ix) {
                Some(records) => {
                    grow(context, records, bytes);
                }
                None if ix < n_buffers => self.records.push(storage(context, "records", bytes)),
                None => {}
            }
            let batch = Batch {
                first_light: first as u32,
                n_lights: n_lights as u32,
                ..bytemuck::Zeroable::zeroed()
            };
            let uniform = uniform(context, "batch", &batch);
            let group = self.bind(context, volume, lights, &uniform, ix);
            self.batches.push(SweptBatch {
                group,
                n_lights: n_lights as u32,
            });
        }
    }

    fn bind(
        &self,
        context: &Context,
        volume: &Volume,
        lights: &SweptLights,
        batch: &wgpu::Buffer,
        ix: usize,
    ) -> wgpu::BindGroup {
        let a_step = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.steps,
            offset: 0,
            size: wgpu::BufferSize::new(16),
        });
        let mut resources = vec![
            (0, volume.grid_buffer.as_entire_binding()),
            (1, batch.as_entire_binding()),
            (2, volume.buffer().as_entire_binding()),
            (3, lights.lights.as_entire_binding()),
            (4, lights.directions.as_entire_binding()),
            (5, self.records(ix).as_entire_binding()),
            (6, self.leaving.as_entire_binding()),
            (7, a_step),
        ];
        let blockers = self.proxies.iter();
        resources.extend(blockers.map(|one| (one.binding, one.buffer.as_entire_binding())));
        bind(context, &self.layout, &resources)
    }

    /// Is there room for records in `grid` as there is now, without other buffers?
    pub fn has_room(&self, grid: &Grid, n_lights: usize, budget: u64) -> bool {
        let a_light = (grid.n_voxels() * size_of::<PackedRecord>()) as u64;
        let n_most = LIGHT_BATCH.min(n_lights) as u64;
        let is_kept = a_light * n_lights as u64 <= budget;
        let leaving = 2 * 16 * u64::from(largest_slice(grid)) * n_most;
        let fits = |(ix, records): (usize, &wgpu::Buffer)| {
            let n = LIGHT_BATCH.min(n_lights.saturating_sub(ix * LIGHT_BATCH)) as u64;
            records.size() >= a_light * n
        };
        is_kept == self.is_kept
            && self.leaving.size() >= leaving
            && self.records.iter().enumerate().all(fits)
    }

    /// Are the records of all lights kept?
    pub fn is_kept(&self) -> bool {
        self.is_kept
    }

    /// Packed records `[light of the batch][voxel]` of batch `ix`, or where they are to go.
    pub fn records(&self, ix: usize) -> &wgpu::Buffer {
        &self.records[if self.is_kept { ix } else { 0 }]
    }

    /// Sweeps batch `ix` along the `k`-th direction of its lights. All directions, the first one
    /// first, make the records.
    pub fn sweep(&self, context: &Context, grid: &Grid, ix: usize, k: u32, stamp: Stamp) {
        let batch = &self.batches[ix];
        if batch.n_lights == 0 {
            return;
        }
        let n_slices = grid.dims.into_iter().max().unwrap_or(0);
        let groups = largest_slice(grid).div_ceil(64);
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            pass.set_pipeline(&self.pipeline);
            for slice in 0..n_slices {
                let step =
                    u64::from(k * strandlight_scene::volume::GRID_SIDE + slice) * STEP_STRIDE;
                pass.set_group(&batch.group, &[step as u32]);
                pass.dispatch([groups, batch.n_lights]);
            }
        });
    }

    /// The packed records of the first batch of lights, `[light][voxel]`, as they are.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn read_first(
        &self,
        context: &Context,
        grid: &Grid,
    ) -> Result<Vec<PackedRecord>, RenderError> {
        let mut packed = super::resources::read_back(context, "records", self.records(0))?;
        // Buffers are never empty, and may have been larger.
        packed.truncate(grid.n_voxels() * self.batches[0].n_lights as usize);
        Ok(packed)
    }

    pub fn bytes(&self) -> u64 {
        let records: u64 = self.records.iter().map(wgpu::Buffer::size).sum();
        records + self.leaving.size() + self.steps.size()
    }
}

/// The pipeline with or without a feature, and its layout.
fn compiled(
    context: &Context,
    feature: Option<&str>,
) -> Result<(wgpu::ComputePipeline, wgpu::BindGroupLayout), RenderError> {
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
    entries.extend(feature.map(|feature| match feature {
        meshes::FEATURE => buffer(9, read, false),
        _ => buffer(8, Uniform, false),
    }));
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
    ResourceCounters::add(&context.resource_counters().pipelines);
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("sweep"),
        layout: Some(&pipeline_layout),
        module: &module_with(context, "pass/transmittance", feature.as_slice())?,
        entry_point: Some("sweep"),
        compilation_options: Default::default(),
        cache: None,
    });
    Ok((pipeline, layout))
}

/// Cells of the largest slice across any axis.
fn largest_slice(grid: &Grid) -> u32 {
    let [x, y, z] = grid.dims;
    (x * y).max(y * z).max(z * x)
}
