//! Meshes on the device: light at their vertices, and drawing them; and what all proxies of a scene
//! with meshes hide of the lights, which is found on the CPU and comes as bits.

use super::covering::covering;
use super::resources::{
    bind, buffer_of, compute, compute_pass, groups_of_64, module_with, shader, step, storage,
    submit, write,
};
use super::stamp::Stamp;
use crate::gpu::Context;
use glam::Vec3;
use std::collections::VecDeque;
use strandlight_scattering::closed_form::irradiance;
use strandlight_scene::RenderError;
use strandlight_scene::beside::{Beside, Places, Surface};
use strandlight_scene::scene::PreparedScene;
use strandlight_scene::volume::Grid;

/// Feature of the shaders that light is blocked in.
pub(super) const FEATURE: &str = "MESHES";

/// Threads that share the lights of a place on a surface out.
pub(super) const LANES: u32 = 8;

/// Pipelines and buffers of a scene's meshes.
pub(super) struct Meshes {
    beside: Beside,
    light: wgpu::ComputePipeline,
    draw: wgpu::RenderPipeline,
    /// Position, normal and albedo of the places that light is found at.
    surfaces: wgpu::Buffer,
    n_surfaces: u32,
    /// `[triangle][corner]`: which surface.
    corners: wgpu::Buffer,
    n_corners: u32,
    /// `[sweep][surface]`, `[sweep][voxel]`, `[point]` of one direction: a bit each.
    hidden_surfaces: wgpu::Buffer,
    hidden_voxels: wgpu::Buffer,
    hidden_points: wgpu::Buffer,
    points: Vec<Vec3>,
    places_of_points: Places,
    /// The directions that are asked for next, and what of the points is hidden from the first of them.
    awaited: VecDeque<Vec3>,
    hidden: VecDeque<Vec<u32>>,
}

/// What lighting the proxies reads besides.
pub(super) struct Light<'a> {
    pub view: &'a wgpu::Buffer,
    pub batch: &'a wgpu::Buffer,
    pub grid: &'a wgpu::Buffer,
    pub lit: &'a wgpu::Buffer,
    pub directions: &'a wgpu::Buffer,
    pub records: &'a wgpu::Buffer,
    pub volume: &'a wgpu::Buffer,
    /// Of the fibre: [`strandlight_scene::bounce::passed_weights`].
    pub passed: &'a wgpu::Buffer,
}

fn numbers(surface: &Surface) -> [[f32; 4]; 3] {
    let with = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
    [
        with(surface.position.to_array()),
        with(surface.normal.to_array()),
        with(surface.albedo),
    ]
}

impl Meshes {
    /// Those of `scene`, if it has any. [`Meshes::refresh`] has to follow.
    pub fn new(context: &Context, scene: &PreparedScene) -> Result<Option<Meshes>, RenderError> {
        let beside = scene.beside();
        if beside.meshes().is_empty() {
            return Ok(None);
        }
        let surfaces: Vec<_> = beside.surfaces().iter().map(numbers).collect();
        let (_, sweeps) = scene.light_records();
        let n_bits = surfaces.len().max(Grid::around(&scene.strands).n_voxels());
        let bytes = [
            ("vertices of [[proxy]]", size_of_val(&surfaces[..])),
            (
                "shadows of [[proxy]]",
                sweeps.len() * n_bits.div_ceil(32) * 4,
            ),
        ];
        let limit = context.device.limits().max_storage_buffer_binding_size;
        for (what, bytes) in bytes {
            if bytes as u64 > limit {
                return Err(RenderError::TooLarge {
                    what: what.to_owned(),
                    bytes: bytes as u64,
                    limit,
                });
            }
        }
        let mut first = surfaces.len() as u32;
        for mesh in beside.meshes() {
            first -= mesh.shape.mesh.positions.len() as u32;
        }
        let mut corners = Vec::new();
        for mesh in beside.meshes() {
            let triangles = mesh.shape.mesh.triangles.iter().flatten();
            corners.extend(triangles.map(|ix| first + ix));
            first += mesh.shape.mesh.positions.len() as u32;
        }
        let light = module_with(context, "pass/proxy_light", &[FEATURE])?;
        let drawn = shader(context, "pass/meshes")?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let points = u64::from(scene.strands.points.len().div_ceil(32) as u32) * 4;
        Ok(Some(Meshes {
            light: compute(context, &light, "light_proxies"),
            draw: covering(
                context,
                "meshes",
                &drawn,
                ["corner_of_triangle", "cover_triangle"],
                &[],
            ),
            n_surfaces: surfaces.len() as u32,
            surfaces: buffer_of(context, "surfaces", &surfaces, usage),
            n_corners: corners.len() as u32,
            corners: buffer_of(context, "corners", &corners, usage),
            hidden_surfaces: storage(context, "hidden surfaces", 4),
            hidden_voxels: storage(context, "hidden voxels", 4),
            hidden_points: storage(context, "hidden points", points),
            points: Vec::new(),
            places_of_points: Places::default(),
            awaited: VecDeque::new(),
            hidden: VecDeque::new(),
            beside,
        }))
    }

    /// Position, normal and albedo of the places, and which of them the corners of triangles are.
    pub fn shape(&self) -> [&wgpu::Buffer; 2] {
        [&self.surfaces, &self.corners]
    }

    /// Light of the places at first: that of `scene` in the open.
    pub fn open_light(&self, scene: &PreparedScene) -> Vec<[f32; 4]> {
        let of = |surface: &Surface| {
            let mut sum = [0.0; 4];
            for light in &scene.lights {
                let cos = surface.normal.dot(Vec3::from(light.direction));
                let arriving = irradiance(cos, light.lambda) * scene.radiance_scale();
                for (channel, sum) in sum.iter_mut().enumerate().take(3) {
                    let sent_back = surface.albedo[channel] * std::f32::consts::FRAC_1_PI;
                    *sum += sent_back * light.rgb[channel] * arriving;
                }
            }
            sum
        };
        self.beside.surfaces().iter().map(of).collect()
    }

    /// Finds again what is hidden: after other strands, another volume or other directions.
    pub fn refresh(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        grid: &Grid,
        directions: &[[f32; 4]],
    ) {
        self.forget_directions();
        // The ground's light map lies below the hair.
        self.beside = scene.beside();
        let surfaces = self.beside.surfaces();
        if surfaces.len() != self.n_surfaces as usize {
            // Others are about to take the place of these.
            return;
        }
        let rows: Vec<_> = surfaces.iter().map(numbers).collect();
        context.write(&self.surfaces, 0, bytemuck::cast_slice(&rows));
        let points = scene.strands.points.iter();
        self.points = points.map(|point| Vec3::from_slice(point)).collect();
        self.places_of_points = self.beside.places(self.points.len(), |ix| self.points[ix]);
        let places = self
            .beside
            .places(surfaces.len(), |ix| surfaces[ix].position);
        let voxels = self.beside.places_of_voxels(grid);
        let (of_surfaces, of_voxels) =
            (self.beside).hidden_along(directions, (&surfaces, &places), (grid, &voxels));
        write(context, &mut self.hidden_surfaces, &of_surfaces);
        write(context, &mut self.hidden_voxels, &of_voxels);
    }

    /// Says that [`Meshes::hide_points`] is asked for these directions after those which it was said of before, in this
    /// order: what is hidden from several of them is found at once.
    pub fn await_directions(&mut self, directions: impl Iterator<Item = Vec3>) {
        self.awaited.extend(directions);
    }

    /// [`Meshes::hide_points`] is not asked for the directions that it was said of.
    pub fn forget_directions(&mut self) {
        self.awaited.clear();
        self.hidden.clear();
    }

    /// Writes which points are hidden from a light in `direction`.
    pub fn hide_points(&mut self, context: &Context, direction: Vec3) {
        while self.awaited.front().is_some_and(|&next| next != direction) {
            // Of a job that was given up.
            self.awaited.pop_front();
            self.hidden.pop_front();
        }
        if self.awaited.is_empty() {
            self.awaited.push_back(direction);
        }
        if self.hidden.is_empty() {
            let (awaited, points) = (self.awaited.make_contiguous(), &self.points);
            let hidden = self
                .beside
                .hidden_points(awaited, points, &self.places_of_points);
            self.hidden = hidden.into();
        }
        self.awaited.pop_front();
        if let Some(hidden) = self.hidden.pop_front() {
            context.write(&self.hidden_points, 0, bytemuck::cast_slice(&hidden));
        }
    }

    /// `[sweep][voxel]`
    pub fn hidden_voxels(&self) -> &wgpu::Buffer {
        &self.hidden_voxels
    }

    /// `[point]`, of the direction last asked for.
    pub fn hidden_points(&self) -> &wgpu::Buffer {
        &self.hidden_points
    }

    /// Adds a batch of lights to the light of all places.
    pub fn light(&self, context: &Context, light: &Light, into: &wgpu::Buffer, stamp: Stamp) {
        let group = bind(
            context,
            &self.light.get_bind_group_layout(0),
            &[
                (0, light.view.as_entire_binding()),
                (1, light.batch.as_entire_binding()),
                (2, light.grid.as_entire_binding()),
                (3, light.lit.as_entire_binding()),
                (4, light.directions.as_entire_binding()),
                (5, light.records.as_entire_binding()),
                (6, into.as_entire_binding()),
                (7, self.surfaces.as_entire_binding()),
                (8, self.hidden_surfaces.as_entire_binding()),
                (9, self.hidden_voxels.as_entire_binding()),
                (10, light.passed.as_entire_binding()),
                (11, light.volume.as_entire_binding()),
            ],
        );
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            step(
                &mut pass,
                &self.light,
                &group,
                groups_of_64(LANES * self.n_surfaces),
            );
        });
    }

    /// What drawing them takes, in passes of `view` and `pass`, by light map.
    pub fn drawn(
        &self,
        context: &Context,
        view: &wgpu::Buffer,
        pass: &wgpu::Buffer,
        maps: &[wgpu::Buffer],
    ) -> DrawnMeshes {
        let layout = self.draw.get_bind_group_layout(0);
        let of_map = |map: &wgpu::Buffer| {
            let resources = [
                (0, view.as_entire_binding()),
                (1, pass.as_entire_binding()),
                (2, self.surfaces.as_entire_binding()),
                (3, self.corners.as_entire_binding()),
                (4, map.as_entire_binding()),
            ];
            bind(context, &layout, &resources)
        };
        DrawnMeshes {
            pipeline: self.draw.clone(),
            groups: maps.iter().map(of_map).collect(),
            n_corners: self.n_corners,
        }
    }

    pub fn bytes(&self) -> u64 {
        let buffers = [
            &self.surfaces,
            &self.corners,
            &self.hidden_surfaces,
            &self.hidden_voxels,
            &self.hidden_points,
        ];
        buffers.into_iter().map(wgpu::Buffer::size).sum()
    }
}

/// Meshes ready to be drawn before the strands.
pub(super) struct DrawnMeshes {
    pipeline: wgpu::RenderPipeline,
    groups: Vec<wgpu::BindGroup>,
    n_corners: u32,
}

impl DrawnMeshes {
    /// Draws them into the viewport that is set.
    pub fn draw(&self, pass: &mut wgpu::RenderPass, radiance: usize) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.groups[radiance], &[]);
        pass.draw(0..self.n_corners, 0..1);
    }
}
