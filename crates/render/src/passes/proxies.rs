//! Proxies on the device: their records, the light that they send back, and drawing them. A scene
//! without any has none of this.

use super::covering::covering;
use super::resources::{bind, compute, compute_pass, shader, step, storage, submit, uniform};
use super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::proxy::{LIGHT_MAP_SIDE, ProxyRecords};
use strandlight_scene::scene::PreparedScene;

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
}

/// What lighting the proxies reads besides.
pub(super) struct Light<'a> {
    pub view: &'a wgpu::Buffer,
    pub batch: &'a wgpu::Buffer,
    pub grid: &'a wgpu::Buffer,
    pub lit: &'a wgpu::Buffer,
    pub directions: &'a wgpu::Buffer,
    pub records: &'a wgpu::Buffer,
}

impl Proxies {
    /// Those of `scene`, if it has any, with light maps for `n_radiance` buffers of radiance.
    pub fn new(
        context: &Context,
        scene: &PreparedScene,
        n_radiance: usize,
    ) -> Result<Option<Proxies>, RenderError> {
        let records = scene.proxy_records();
        if records.n == 0 {
            return Ok(None);
        }
        let module = shader(context, "pass/proxy_light")?;
        let drawn = shader(context, "pass/proxies")?;
        let bytes = u64::from(records.n * LIGHT_MAP_SIDE * LIGHT_MAP_SIDE) * 16;
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
                .map(|_| storage(context, "light maps", bytes))
                .collect(),
            n: records.n,
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

    /// Writes the same number of proxies again; `false` if it is another number.
    pub fn write(&self, context: &Context, records: &ProxyRecords) -> bool {
        if records.n == self.n {
            let bytes = bytemuck::bytes_of(records);
            context.write(&self.records, 0, bytes);
        }
        records.n == self.n
    }

    /// Adds a batch of lights to light map `into`.
    pub fn light(&self, context: &Context, light: &Light, into: usize, stamp: Stamp) {
        let group = bind(
            context,
            &self.light.get_bind_group_layout(0),
            &[
                (0, light.view.as_entire_binding()),
                (1, light.batch.as_entire_binding()),
                (2, light.grid.as_entire_binding()),
                (3, self.records.as_entire_binding()),
                (4, light.lit.as_entire_binding()),
                (5, light.directions.as_entire_binding()),
                (6, light.records.as_entire_binding()),
                (7, self.maps[into].as_entire_binding()),
            ],
        );
        submit(context, |encoder| {
            let mut pass = compute_pass(encoder, stamp);
            let groups = [(LIGHT_MAP_SIDE * LIGHT_MAP_SIDE).div_ceil(64), self.n];
            step(&mut pass, &self.light, &group, groups);
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
        }
    }

    pub fn bytes(&self) -> u64 {
        self.maps.iter().map(wgpu::Buffer::size).sum()
    }
}

/// Proxies ready to be drawn before the strands.
pub(super) struct DrawnProxies {
    pipeline: wgpu::RenderPipeline,
    /// By buffer of radiance.
    groups: Vec<wgpu::BindGroup>,
    n: u32,
}

impl DrawnProxies {
    /// Draws them into a picture of `size`.
    pub fn draw(&self, pass: &mut wgpu::RenderPass, size: [u32; 2], radiance: usize) {
        let [width, height] = size.map(|n| n as f32);
        pass.set_viewport(0.0, 0.0, width, height, 0.0, 1.0);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.groups[radiance], &[]);
        pass.draw(0..3, 0..self.n);
    }
}
