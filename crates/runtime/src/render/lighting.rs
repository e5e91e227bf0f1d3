//! Transmittance of the lights and single scattering at the points, in batches of lights.

use std::time::Instant;

use super::LIGHT_BATCH;
use super::resources::{
    StrandBuffers, bind, buffer_of, compute, dispatch, failed, read_back, shader, storage, submit,
    uniform,
};
use super::volume::Volume;
use crate::camera::ViewUniform;
use crate::edit::{EditReport, HairTextures};
use crate::error::RenderError;
use crate::gpu::Context;
use crate::scene::PreparedScene;
use crate::stats::{LIGHTING_SHARE, Observer, Stage, Stats};

/// Points shaded by one dispatch: at most some seconds of work on a software device.
const POINT_CHUNK: u32 = 1 << 18;

/// Which lights and points a dispatch works on; mirrored by `Batch` in `shaders/lib/light.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Batch {
    first_light: u32,
    n_lights: u32,
    first_point: u32,
    end_point: u32,
    min_power: f32,
    pad: [u32; 3],
}

/// Pipelines and buffers that do not depend on the view.
pub(super) struct Lighting {
    sweep: wgpu::ComputePipeline,
    shade: wgpu::ComputePipeline,
    lights: wgpu::Buffer,
    sweeps: wgpu::Buffer,
    scattering: super::scattering::Scattering,
    n_lights: usize,
    min_power: f32,
}

/// What shading left on the device.
pub(super) struct Shading {
    radiance: wgpu::Buffer,
    lights: wgpu::Buffer,
}

impl Shading {
    /// `[point]` (rgb, 0), times the view's radiance scale.
    pub fn radiance(&self) -> &wgpu::Buffer {
        &self.radiance
    }

    /// The records of all lights.
    pub fn lights(&self) -> &wgpu::Buffer {
        &self.lights
    }
}

impl Lighting {
    pub fn new(context: &Context, scene: &PreparedScene) -> Result<Self, RenderError> {
        let (lights, sweeps) = scene.light_records();
        let usage = wgpu::BufferUsages::STORAGE;
        let module = shader(context, "pass/transmittance")?;
        let sweep = compute(context, &module, "sweep");
        let module = shader(context, "pass/shade")?;
        let shade = compute(context, &module, "shade");
        Ok(Lighting {
            sweep,
            shade,
            n_lights: lights.len(),
            lights: buffer_of(context, "lights", &lights, usage),
            sweeps: buffer_of(context, "sweeps", &sweeps, usage),
            scattering: super::scattering::Scattering::new(context, scene)?,
            min_power: scene.min_power(),
        })
    }

    /// Writes what an edit of the hair made anew.
    pub fn update(&mut self, context: &Context, hair: &HairTextures, report: &EditReport) {
        self.scattering.update(context, hair, report);
    }

    /// Lights every point towards the eye of `view`.
    pub fn run(
        &self,
        context: &Context,
        strands: &StrandBuffers,
        volume: &Volume,
        view: &ViewUniform,
        stats: &mut Stats,
        observer: Observer,
    ) -> Result<Shading, RenderError> {
        let n_points = strands.n_points;
        let radiance = storage(context, "radiance", u64::from(n_points) * 16);
        let counters = storage(context, "counters", 32);
        let transmittance = self.transmittance_buffer(context, volume);
        let view_buffer = uniform(context, "view", view);
        let batch_buffer = uniform(context, "batch", &self.batch(0, 0, 0, 0));
        let mut resources = vec![
            (0, view_buffer.as_entire_binding()),
            (1, batch_buffer.as_entire_binding()),
            (2, volume.grid_buffer.as_entire_binding()),
            (4, strands.points.as_entire_binding()),
            (5, strands.tangents.as_entire_binding()),
            (6, strands.normals.as_entire_binding()),
            (7, self.lights.as_entire_binding()),
            (8, transmittance.as_entire_binding()),
            (9, radiance.as_entire_binding()),
            (10, counters.as_entire_binding()),
        ];
        resources.extend(self.scattering.bindings());
        let shade_group = bind(context, &self.shade.get_bind_group_layout(0), &resources);
        let (mut sweep_ms, mut shade_ms) = (0.0, 0.0);
        for first in (0..self.n_lights).step_by(LIGHT_BATCH) {
            let n_lights = LIGHT_BATCH.min(self.n_lights - first);
            let start = Instant::now();
            self.sweep_batch(context, volume, &transmittance, first, n_lights)?;
            sweep_ms += 1e3 * start.elapsed().as_secs_f64();

            let start = Instant::now();
            for first_point in (0..n_points).step_by(POINT_CHUNK as usize) {
                let end_point = (first_point + POINT_CHUNK).min(n_points);
                let batch = self.batch(first, n_lights, first_point, end_point);
                context
                    .queue
                    .write_buffer(&batch_buffer, 0, bytemuck::bytes_of(&batch));
                submit(context, |encoder| {
                    let groups = (end_point - first_point).div_ceil(64);
                    dispatch(encoder, &self.shade, &shade_group, [groups, 1]);
                });
                context.wait("shade").map_err(failed)?;
                let points = first * n_points as usize + n_lights * end_point as usize;
                let all = self.n_lights * n_points as usize;
                observer(LIGHTING_SHARE * points as f64 / all as f64);
            }
            shade_ms += 1e3 * start.elapsed().as_secs_f64();
        }
        stats.stages.push(Stage {
            name: "transmittance",
            milliseconds: sweep_ms,
            bytes: transmittance.size(),
        });
        stats.stages.push(Stage {
            name: "shade",
            milliseconds: shade_ms,
            bytes: radiance.size(),
        });
        let counts: Vec<u64> = read_back(context, "counters", &counters)?;
        // Each batch of lights counts the same points.
        let batches = self.n_lights.div_ceil(LIGHT_BATCH).max(1) as u64;
        stats.points_skipped = counts[0] / batches;
        stats.products = counts[1];
        stats.products_skipped = counts[2];
        Ok(Shading {
            radiance,
            lights: self.lights.clone(),
        })
    }

    /// Transmittance of the first batch, `[light][voxel]`.
    pub fn first_transmittance(
        &self,
        context: &Context,
        volume: &Volume,
    ) -> Result<Vec<f32>, RenderError> {
        let transmittance = self.transmittance_buffer(context, volume);
        let n_lights = LIGHT_BATCH.min(self.n_lights);
        self.sweep_batch(context, volume, &transmittance, 0, n_lights)?;
        read_back(context, "transmittance", &transmittance)
    }

    fn transmittance_buffer(&self, context: &Context, volume: &Volume) -> wgpu::Buffer {
        let lights = self.n_lights.min(LIGHT_BATCH) as u64;
        let bytes = volume.grid.n_voxels() as u64 * lights * 4;
        storage(context, "transmittance", bytes)
    }

    fn sweep_batch(
        &self,
        context: &Context,
        volume: &Volume,
        transmittance: &wgpu::Buffer,
        first: usize,
        n_lights: usize,
    ) -> Result<(), RenderError> {
        if n_lights == 0 {
            return Ok(());
        }
        let batch = uniform(context, "batch", &self.batch(first, n_lights, 0, 0));
        let group = bind(
            context,
            &self.sweep.get_bind_group_layout(0),
            &[
                (0, volume.grid_buffer.as_entire_binding()),
                (1, batch.as_entire_binding()),
                (2, volume.buffer().as_entire_binding()),
                (3, self.lights.as_entire_binding()),
                (4, self.sweeps.as_entire_binding()),
                (5, transmittance.as_entire_binding()),
            ],
        );
        submit(context, |encoder| {
            dispatch(encoder, &self.sweep, &group, [n_lights as u32, 1]);
        });
        context.wait("transmittance").map_err(failed)
    }

    fn batch(&self, first: usize, n_lights: usize, first_point: u32, end_point: u32) -> Batch {
        Batch {
            first_light: first as u32,
            n_lights: n_lights as u32,
            first_point,
            end_point,
            min_power: self.min_power,
            pad: [0; 3],
        }
    }
}
