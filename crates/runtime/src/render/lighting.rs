//! Shading of the points, in batches of lights.

use web_time::Instant;

use super::LIGHT_BATCH;
use super::resources::{
    StrandBuffers, bind, buffer_of, compute_with, dispatch, failed, read_back, shader, storage,
    submit, uniform,
};
use super::shadow_map::ShadowMaps;
use super::shadows::{Batch, Records, Sweep, SweptLights};
use super::volume::Volume;
use crate::camera::ViewUniform;
use crate::edit::{EditReport, HairTextures};
use crate::error::RenderError;
use crate::gpu::Context;
use crate::scene::{LightRecord, PreparedScene};
use crate::shadow_maps::ShadowPlan;
use crate::stats::{LIGHTING_SHARE, Observer, Stage, Stats};
use strandlight_scattering::closed_form::PackedRecord;

/// Points shaded by one dispatch: at most some seconds of work on a software device.
const POINT_CHUNK: u32 = 1 << 15;

/// Pipelines and buffers that do not depend on the view.
pub(super) struct Lighting {
    sweep: Sweep,
    shade: wgpu::ComputePipeline,
    lights: wgpu::Buffer,
    directions: wgpu::Buffer,
    scattering: super::scattering::Scattering,
    records: Records,
    shadow_maps: ShadowMaps,
    /// Unblocked shares by shadow maps, and the milliseconds that drawing them took.
    answers: (wgpu::Buffer, f64),
    plan: ShadowPlan,
    n_lights: usize,
    n_directions: u32,
    record_budget: u64,
    min_power: f32,
    densities: [f32; 2],
    most_local: f32,
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
    /// Uploads the lights of `scene` and sweeps them through `volume`.
    pub fn new(
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        strands: &StrandBuffers,
    ) -> Result<Self, RenderError> {
        let shadow_maps = ShadowMaps::new(context)?;
        let plan = scene.shadow_plan();
        let answers = draw_shadow_maps(&shadow_maps, context, &plan, strands)?;
        let sweep = Sweep::new(context)?;
        let module = shader(context, "pass/shade")?;
        let terms = [("TERMS", f64::from(scene.terms()))];
        let shade = compute_with(context, &module, "shade", &terms);
        let (lights, sweeps) = scene.light_records();
        let usage = wgpu::BufferUsages::STORAGE;
        let (n_lights, n_directions) = (lights.len(), most_directions(&lights));
        let lights = buffer_of(context, "lights", &lights, usage);
        let directions = buffer_of(context, "directions", &sweeps, usage);
        let swept = SweptLights {
            lights: &lights,
            directions: &directions,
            n_lights,
            n_directions,
        };
        let records = sweep.prepare(context, volume, &swept, scene.record_budget)?;
        Ok(Lighting {
            sweep,
            shade,
            shadow_maps,
            answers,
            plan,
            records,
            n_lights,
            n_directions,
            lights,
            directions,
            scattering: super::scattering::Scattering::new(context, scene)?,
            record_budget: scene.record_budget,
            min_power: scene.min_power(),
            densities: scene.densities,
            most_local: scene.most_local(&scene.hair),
        })
    }

    /// Takes the lights of `scene` for those there were and sweeps them through `volume`.
    pub fn set_lights(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        strands: &StrandBuffers,
    ) -> Result<(), RenderError> {
        let (lights, sweeps) = scene.light_records();
        let usage = wgpu::BufferUsages::STORAGE;
        (self.n_lights, self.n_directions) = (lights.len(), most_directions(&lights));
        self.lights = buffer_of(context, "lights", &lights, usage);
        self.directions = buffer_of(context, "directions", &sweeps, usage);
        self.min_power = scene.min_power();
        self.shadow_again(context, scene, volume, strands)
    }

    /// Finds the shadows of other lights or in hair that has moved: `scene` has them.
    pub fn shadow_again(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        strands: &StrandBuffers,
    ) -> Result<(), RenderError> {
        self.plan = scene.shadow_plan();
        self.answers = draw_shadow_maps(&self.shadow_maps, context, &self.plan, strands)?;
        let lights = self.swept_lights();
        self.records = self
            .sweep
            .prepare(context, volume, &lights, self.record_budget)?;
        Ok(())
    }

    fn swept_lights(&self) -> SweptLights<'_> {
        SweptLights {
            lights: &self.lights,
            directions: &self.directions,
            n_lights: self.n_lights,
            n_directions: self.n_directions,
        }
    }

    /// Writes what an edit of the hair made anew.
    pub fn update(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        hair: &HairTextures,
        report: &EditReport,
    ) {
        self.most_local = scene.most_local(hair);
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
        let start = Instant::now();
        let through = self.plan.through(view.forward);
        self.shadow_maps
            .draw(context, strands, &through, &self.answers.0)?;
        let through_ms = 1e3 * start.elapsed().as_secs_f64();
        let radiance = storage(context, "radiance", u64::from(n_points) * 16);
        let counters = storage(context, "counters", 80);
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
            (9, radiance.as_entire_binding()),
            (10, counters.as_entire_binding()),
            (17, self.answers.0.as_entire_binding()),
        ];
        resources.extend(self.scattering.bindings());
        let (mut sweep_ms, mut shade_ms) = (self.records.milliseconds, 0.0);
        for (batch_ix, first) in (0..self.n_lights).step_by(LIGHT_BATCH).enumerate() {
            let n_lights = LIGHT_BATCH.min(self.n_lights - first);
            let records = self.records.batch(batch_ix);
            if !self.records.is_kept {
                let start = Instant::now();
                let lights = self.swept_lights();
                self.sweep.batch(context, volume, &lights, first, records)?;
                sweep_ms += 1e3 * start.elapsed().as_secs_f64();
            }

            let start = Instant::now();
            let mut resources = resources.clone();
            resources.push((8, records.as_entire_binding()));
            let shade_group = bind(context, &self.shade.get_bind_group_layout(0), &resources);
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
            name: "shadow maps",
            milliseconds: self.answers.1 + through_ms,
            bytes: self.answers.0.size(),
        });
        stats.stages.push(Stage {
            name: "transmittance",
            milliseconds: sweep_ms,
            bytes: self.records.bytes(),
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
        let terms: &[[u64; 2]] = bytemuck::cast_slice(&counts[1..9]);
        stats.set_terms(terms);
        Ok(Shading {
            radiance,
            lights: self.lights.clone(),
        })
    }

    /// Packed records of the first batch, `[light][voxel]`.
    pub fn first_records(
        &self,
        context: &Context,
        volume: &Volume,
    ) -> Result<Vec<PackedRecord>, RenderError> {
        let lights = self.swept_lights();
        self.sweep
            .read_first(context, volume, &lights, &self.records)
    }

    fn batch(&self, first: usize, n_lights: usize, first_point: u32, end_point: u32) -> Batch {
        Batch {
            first_light: first as u32,
            n_lights: n_lights as u32,
            first_point,
            end_point,
            min_power: self.min_power,
            density_forward: self.densities[0],
            density_back: self.densities[1],
            most_local: self.most_local,
        }
    }
}

/// The answers of the shadow maps, and the milliseconds that took.
fn draw_shadow_maps(
    shadow_maps: &ShadowMaps,
    context: &Context,
    plan: &ShadowPlan,
    strands: &StrandBuffers,
) -> Result<(wgpu::Buffer, f64), RenderError> {
    let start = Instant::now();
    let answers = shadow_maps.run(context, strands, plan)?;
    Ok((answers, 1e3 * start.elapsed().as_secs_f64()))
}

/// Directions of the light that has most.
fn most_directions(lights: &[LightRecord]) -> u32 {
    lights.iter().map(|light| light.n_sweeps).max().unwrap_or(0)
}
