//! Bounce light on the device: what the proxies send back to the hair, at the nodes of a grid, and to each other. A scene without
//! proxies, or with black ones, has none of this.

use super::interreflection::InterreflectionPass;
use super::resources::{
    bind, buffer_of, compute, compute_pass, groups_of_64, shader, step, storage, submit, uniform,
    write,
};
use super::stamp::Stamp;
use super::volume::Volume;
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::bounce::{Bounce, BounceHit, BounceLayout, N_LOBES};
use strandlight_scene::scene::PreparedScene;
use strandlight_scene::volume::Grid;

/// Feature of the shader that shades bounce light in place of lights.
pub(super) const FEATURE: &str = "BOUNCE";

/// Numbers of a lobe at a node, four each.
const N_VECTORS: usize = 3;

/// Pipeline and buffers of a scene's bounce light.
pub(super) struct BouncePass {
    pipeline: wgpu::ComputePipeline,
    /// That of the nodes.
    grid: wgpu::Buffer,
    sizes: wgpu::Buffer,
    n_nodes: u32,
    rays: wgpu::Buffer,
    nodes: wgpu::Buffer,
    hits: wgpu::Buffer,
    bounced: wgpu::Buffer,
    /// Where proxies light each other.
    between: Option<InterreflectionPass>,
    /// Is it that of other lights, proxies or strands?
    pub is_stale: bool,
}

impl BouncePass {
    /// That of `scene`, if it has any.
    pub fn new(
        context: &Context,
        scene: &PreparedScene,
    ) -> Result<Option<BouncePass>, RenderError> {
        let Some(bounce) = Bounce::new(scene) else {
            return Ok(None);
        };
        let rays: Vec<[f32; 4]> = bounce
            .rays
            .iter()
            .map(|ray| ray.extend(0.0).into())
            .collect();
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let layout: BounceLayout = bytemuck::Zeroable::zeroed();
        let grid: Grid = bytemuck::Zeroable::zeroed();
        let mut pass = BouncePass {
            pipeline: compute(context, &shader(context, "pass/bounce")?, "find_bounce"),
            grid: uniform(context, "bounce grid", &grid),
            sizes: uniform(context, "bounce", &layout),
            n_nodes: 0,
            rays: buffer_of(context, "bounce rays", &rays, wgpu::BufferUsages::UNIFORM),
            nodes: buffer_of::<[f32; 4]>(context, "bounce nodes", &[], usage),
            hits: buffer_of::<BounceHit>(context, "bounce hits", &[], usage),
            bounced: storage(context, "bounce light", 16),
            between: None,
            is_stale: true,
        };
        pass.take(context, scene, &bounce)?;
        Ok(Some(pass))
    }

    /// Takes other strands or proxies for those there were; answers whether there is bounce light.
    pub fn refresh(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
    ) -> Result<bool, RenderError> {
        let bounce = Bounce::new(scene);
        if let Some(bounce) = &bounce {
            self.take(context, scene, bounce)?;
        }
        Ok(bounce.is_some())
    }

    /// Is there light between proxies?
    pub fn has_interreflection(&self) -> bool {
        self.between.is_some()
    }

    /// The hair is another where proxies are those they were.
    pub fn stale_hair(&mut self) {
        self.is_stale = true;
        if let Some(between) = &mut self.between {
            between.is_stale = true;
        }
    }

    /// Adds to a light map what proxies send to each other: [`InterreflectionPass::reflect`].
    pub fn reflect(
        &mut self,
        context: &Context,
        volume: &Volume,
        light: (&wgpu::Buffer, &wgpu::Buffer),
        stamp: Stamp,
    ) {
        if let Some(between) = &mut self.between {
            between.reflect(context, volume, light, stamp);
        }
    }

    fn take(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        bounce: &Bounce,
    ) -> Result<(), RenderError> {
        let (mut nodes, mut hits) = (Vec::new(), Vec::new());
        for &node in &bounce.nodes {
            let start = bounce.start(node);
            nodes.push(start.extend(f32::from_bits(node)).to_array());
            hits.extend(bounce.rays.iter().map(|ray| bounce.hit(start, *ray)));
        }
        self.n_nodes = nodes.len() as u32;
        context.write(&self.grid, 0, bytemuck::bytes_of(&bounce.grid));
        context.write(&self.sizes, 0, bytemuck::bytes_of(&bounce.layout()));
        write(context, &mut self.nodes, &nodes);
        write(context, &mut self.hits, &hits);
        let dark = vec![[0.0_f32; 4]; bounce.grid.n_voxels() * N_LOBES * N_VECTORS];
        write(context, &mut self.bounced, &dark);
        match &mut self.between {
            _ if !scene.has_interreflection() => self.between = None,
            Some(between) => between.take(context, bounce),
            None => self.between = Some(InterreflectionPass::new(context, bounce)?),
        }
        self.is_stale = true;
        Ok(())
    }

    /// The grid of the nodes, and the light there.
    pub fn found(&self) -> [&wgpu::Buffer; 2] {
        [&self.grid, &self.bounced]
    }

    /// Finds the light where the proxies send back what `light_map` says.
    pub fn find(
        &mut self,
        context: &Context,
        volume: &Volume,
        light_map: &wgpu::Buffer,
        stamp: Stamp,
    ) {
        let group = bind(
            context,
            &self.pipeline.get_bind_group_layout(0),
            &[
                (0, volume.grid_buffer.as_entire_binding()),
                (1, self.sizes.as_entire_binding()),
                (2, self.rays.as_entire_binding()),
                (3, volume.buffer().as_entire_binding()),
                (4, self.nodes.as_entire_binding()),
                (5, self.hits.as_entire_binding()),
                (6, light_map.as_entire_binding()),
                (7, self.bounced.as_entire_binding()),
            ],
        );
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            step(
                &mut pass,
                &self.pipeline,
                &group,
                groups_of_64(self.n_nodes),
            );
        });
        self.is_stale = false;
    }

    pub fn bytes(&self) -> u64 {
        let buffers = [&self.nodes, &self.hits, &self.bounced];
        let between = self.between.as_ref().map_or(0, InterreflectionPass::bytes);
        between + buffers.into_iter().map(wgpu::Buffer::size).sum::<u64>()
    }
}
