//! Proxies on the device: their records, the light that they send back, and drawing them. A scene
//! without any has none of this.

use super::covering::covering;
use super::meshes::{self, DrawnMeshes, LANES, Light, Meshes};
use super::resources::{
    bind, buffer_of, compute, compute_pass, groups_of_64, shader, step, submit, uniform,
};
use super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::proxy::{LIGHT_MAP_SIDE, ProxyRecords};
use strandlight_scene::scene::PreparedScene;
use strandlight_scene::volume::Grid;

/// Feature of the shaders that light is blocked in.
pub(super) const FEATURE: &str = "PROXIES";

/// Pipelines and buffers of a scene's proxies.
pub(super) struct Proxies {
    light: wgpu::ComputePipeline,
    draw: wgpu::RenderPipeline,
    records: wgpu::Buffer,
    /// By buffer of radiance: `[proxy][row][column]`.
    maps: Vec<wgpu::Buffer>,
    n: u32,
    /// Where there are meshes, these find the light of all.
    meshes: Option<Meshes>,
}

/// What blocks light besides strands, as the shaders of the shadows read it.
#[derive(Clone)]
pub(super) struct Blocker {
    pub feature: &'static str,
    pub binding: u32,
    pub buffer: wgpu::Buffer,
}

impl Proxies {
    /// Those of `scene`, if it has any, with light maps for `n_radiance` buffers of radiance.
    pub fn new(
        context: &Context,
        scene: &PreparedScene,
        n_radiance: usize,
    ) -> Result<Option<Proxies>, RenderError> {
        let records = scene.proxy_records();
        let meshes = Meshes::new(context, scene)?;
        if records.n == 0 && meshes.is_none() {
            return Ok(None);
        }
        let module = shader(context, "pass/proxy_light")?;
        let drawn = shader(context, "pass/proxies")?;
        let maps = match &meshes {
            Some(meshes) => meshes.open_light(scene),
            None => vec![[0.0; 4]; (records.n * LIGHT_MAP_SIDE * LIGHT_MAP_SIDE) as usize],
        };
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        Ok(Some(Proxies {
            light: compute(context, &module, "light_proxies"),
            draw: covering(
                context,
                "proxies",
                &drawn,
                ["whole_picture", "cover_proxy"],
                &[],
            ),
            records: uniform(context, "proxies", &records),
            maps: (0..n_radiance)
                .map(|_| buffer_of(context, "light maps", &maps, usage))
                .collect(),
            n: records.n,
            meshes,
        }))
    }

    /// The records as the passes read them.
    pub fn records(&self) -> &wgpu::Buffer {
        &self.records
    }

    /// Light map `ix`.
    pub fn light_map(&self, ix: usize) -> &wgpu::Buffer {
        &self.maps[ix]
    }

    /// How many there are.
    pub fn n(&self) -> u32 {
        self.n
    }

    /// What blocks light in the shadow maps, and in the sweeps.
    pub fn blockers(&self) -> [Blocker; 2] {
        let [of_maps, of_sweeps] = match &self.meshes {
            Some(meshes) => [meshes.hidden_points(), meshes.hidden_voxels()],
            None => [&self.records, &self.records],
        };
        let (feature, binding) = match &self.meshes {
            Some(_) => (meshes::FEATURE, 9),
            None => (FEATURE, 8),
        };
        [of_maps, of_sweeps].map(|buffer| Blocker {
            feature,
            binding,
            buffer: buffer.clone(),
        })
    }

    /// The meshes, if there are any.
    pub fn meshes(&self) -> Option<&Meshes> {
        self.meshes.as_ref()
    }

    /// The same.
    pub fn meshes_mut(&mut self) -> Option<&mut Meshes> {
        self.meshes.as_mut()
    }

    /// See [`Meshes::refresh`]; answers whether there are any.
    pub fn refresh(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        grid: &Grid,
        directions: &[[f32; 4]],
    ) -> bool {
        let Some(meshes) = &mut self.meshes else {
            return false;
        };
        meshes.refresh(context, scene, grid, directions);
        true
    }

    /// Writes the same number of proxies again; `false` if it is another number, or there are meshes.
    pub fn write(&self, context: &Context, records: &ProxyRecords) -> bool {
        if records.n == self.n {
            let bytes = bytemuck::bytes_of(records);
            context.write(&self.records, 0, bytes);
        }
        records.n == self.n && self.meshes.is_none()
    }

    /// Adds a batch of lights to light map `into`.
    pub fn light(&self, context: &Context, light: &Light, into: usize, stamp: Stamp) {
        if let Some(meshes) = &self.meshes {
            meshes.light(context, light, &self.maps[into], stamp);
            return;
        }
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
                (6, self.maps[into].as_entire_binding()),
                (7, self.records.as_entire_binding()),
                (10, light.passed.as_entire_binding()),
                (11, light.volume.as_entire_binding()),
            ],
        );
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            let n_texels = LIGHT_MAP_SIDE * LIGHT_MAP_SIDE;
            step(
                &mut pass,
                &self.light,
                &group,
                groups_of_64(LANES * self.n * n_texels),
            );
        });
    }

    /// What drawing them takes, in passes of `view` and `pass`.
    pub fn drawn(
        &self,
        context: &Context,
        view: &wgpu::Buffer,
        pass: &wgpu::Buffer,
    ) -> DrawnProxies {
        let layout = self.draw.get_bind_group_layout(0);
        let of_map = |map: &wgpu::Buffer| {
            let resources = [
                (0, view.as_entire_binding()),
                (1, pass.as_entire_binding()),
                (2, self.records.as_entire_binding()),
                (3, map.as_entire_binding()),
            ];
            bind(context, &layout, &resources)
        };
        DrawnProxies {
            pipeline: self.draw.clone(),
            groups: self.maps.iter().map(of_map).collect(),
            n: self.n,
            meshes: (self.meshes.as_ref())
                .map(|meshes| meshes.drawn(context, view, pass, &self.maps)),
        }
    }

    pub fn bytes(&self) -> u64 {
        let maps: u64 = self.maps.iter().map(wgpu::Buffer::size).sum();
        maps + self.meshes.as_ref().map_or(0, Meshes::bytes)
    }
}

/// Proxies ready to be drawn before the strands.
pub(super) struct DrawnProxies {
    pipeline: wgpu::RenderPipeline,
    /// By buffer of radiance.
    groups: Vec<wgpu::BindGroup>,
    n: u32,
    meshes: Option<DrawnMeshes>,
}

impl DrawnProxies {
    /// Draws them into a picture of `size`.
    pub fn draw(&self, pass: &mut wgpu::RenderPass, size: [u32; 2], radiance: usize) {
        let [width, height] = size.map(|n| n as f32);
        pass.set_viewport(0.0, 0.0, width, height, 0.0, 1.0);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.groups[radiance], &[]);
        if self.n > 0 {
            pass.draw(0..3, 0..self.n);
        }
        if let Some(meshes) = &self.meshes {
            meshes.draw(pass, radiance);
        }
    }
}
