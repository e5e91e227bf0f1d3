//! Light that proxies send to each other, on the device. A scene with fewer than two that send light back has none
//! of this.

use super::resources::{
    bind, buffer_of, compute, compute_pass, groups_of_64, grow, shader, step, storage, submit,
    write,
};
use super::stamp::Stamp;
use super::volume::Volume;
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::bounce::Bounce;
use strandlight_scene::interreflection::{N_ROUNDS, ReflectingSurface, SurfaceRays};

/// Pipelines and buffers of light between proxies.
pub(super) struct InterreflectionPass {
    find: wgpu::ComputePipeline,
    reflect: wgpu::ComputePipeline,
    /// What was taken.
    rays: Option<SurfaceRays>,
    places: Vec<ReflectingSurface>,
    reflecting: wgpu::Buffer,
    n_surfaces: u32,
    /// By ray that meets a surface, the way to it, which it is, and what the hair before it lets pass.
    ways: wgpu::Buffer,
    met: wgpu::Buffer,
    passing: wgpu::Buffer,
    /// What the surfaces send back of the lights, and of each other as well after rounds 1, 3 and so on.
    direct: wgpu::Buffer,
    between: wgpu::Buffer,
    /// Is `passing` that of other hair?
    pub is_stale: bool,
}

impl InterreflectionPass {
    /// That of what `bounce` has.
    pub fn new(context: &Context, bounce: &Bounce) -> Result<InterreflectionPass, RenderError> {
        let module = shader(context, "pass/bounce")?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let mut pass = InterreflectionPass {
            find: compute(context, &module, "find_passing"),
            reflect: compute(context, &module, "reflect_light"),
            rays: None,
            places: Vec::new(),
            reflecting: buffer_of::<ReflectingSurface>(context, "reflecting", &[], usage),
            n_surfaces: 0,
            ways: buffer_of::<[f32; 4]>(context, "ways between proxies", &[], usage),
            met: buffer_of::<u32>(context, "met between proxies", &[], usage),
            passing: storage(context, "passing between proxies", 4),
            direct: storage(context, "direct light of proxies", 16),
            between: storage(context, "light between proxies", 16),
            is_stale: true,
        };
        pass.take(context, bounce);
        Ok(pass)
    }

    /// Takes other proxies, or other hair beside these, for those there were.
    pub fn take(&mut self, context: &Context, bounce: &Bounce) {
        self.is_stale = true;
        let limit = context.device.limits().max_storage_buffer_binding_size;
        let rays = SurfaceRays::new(bounce, (limit / size_of::<[f32; 4]>() as u64) as usize);
        let is_met = (self.rays.as_ref()).is_some_and(|before| rays.meet_the_same_as(before));
        if is_met {
            let weights = rays.surfaces.iter().map(|surface| rays.weight_of(surface));
            for (place, weight) in self.places.iter_mut().zip(weights) {
                place.weight = weight;
            }
            context.write(&self.reflecting, 0, bytemuck::cast_slice(&self.places));
            self.rays = Some(rays);
            return;
        }
        let (places, met) = rays.all_met(bounce);
        let ways = met.iter().map(|met| met.direction.extend(met.distance));
        let ways: Vec<[f32; 4]> = ways.map(Into::into).collect();
        let met: Vec<u32> = met.iter().map(|met| met.surface).collect();
        // One entry a surface: the shader reads its length.
        let usage = self.reflecting.usage();
        self.reflecting = buffer_of(context, "reflecting", &places, usage);
        write(context, &mut self.ways, &ways);
        write(context, &mut self.met, &met);
        self.n_surfaces = places.len() as u32;
        grow(context, &mut self.passing, 4 * met.len() as u64);
        for buffer in [&mut self.direct, &mut self.between] {
            grow(context, buffer, 16 * places.len() as u64);
        }
        (self.rays, self.places) = (Some(rays), places);
    }

    /// Adds to `light_map`, what the surfaces send back of the lights, what arrives from others; `passed` are the weights of the
    /// fibre.
    pub fn reflect(
        &mut self,
        context: &Context,
        volume: &Volume,
        (light_map, passed): (&wgpu::Buffer, &wgpu::Buffer),
        stamp: Stamp,
    ) {
        let groups = groups_of_64(self.n_surfaces);
        let find = bind(
            context,
            &self.find.get_bind_group_layout(0),
            &[
                (0, volume.grid_buffer.as_entire_binding()),
                (3, volume.buffer().as_entire_binding()),
                (8, self.reflecting.as_entire_binding()),
                (9, self.ways.as_entire_binding()),
                (11, self.passing.as_entire_binding()),
            ],
        );
        let layout = self.reflect.get_bind_group_layout(0);
        let round = |[before, after]: [&wgpu::Buffer; 2]| {
            let resources = [
                (6, before.as_entire_binding()),
                (8, self.reflecting.as_entire_binding()),
                (10, self.met.as_entire_binding()),
                (11, self.passing.as_entire_binding()),
                (12, self.direct.as_entire_binding()),
                (13, after.as_entire_binding()),
                (14, passed.as_entire_binding()),
            ];
            bind(context, &layout, &resources)
        };
        let rounds = [[light_map, &self.between], [&self.between, light_map]].map(round);
        submit(context, |encoder| {
            let bytes = light_map.size().min(self.direct.size());
            encoder.copy_buffer_to_buffer(light_map, 0, &self.direct, 0, bytes);
            let mut pass = compute_pass(context, encoder, stamp);
            if self.is_stale {
                step(&mut pass, &self.find, &find, groups);
            }
            for _ in 0..N_ROUNDS / 2 {
                for round in &rounds {
                    step(&mut pass, &self.reflect, round, groups);
                }
            }
        });
        self.is_stale = false;
    }

    pub fn bytes(&self) -> u64 {
        let buffers = [
            &self.reflecting,
            &self.ways,
            &self.met,
            &self.passing,
            &self.direct,
            &self.between,
        ];
        buffers.into_iter().map(wgpu::Buffer::size).sum()
    }
}
