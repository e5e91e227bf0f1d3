//! Shadow maps on the device: drawn and sampled one after another into a visibility buffer.

use super::proxies::Blocker;
use super::resources::{
    Groups, StrandBuffers, bind, compute, compute_pass, groups_of_64, grow, module_with, shader,
    step, step_over, storage, submit, uniform,
};
use super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::shadow_maps::{SHADOW_SIDE, SLOTS_PER_WORD, ShadowPlan, ShadowView};

/// The maps of a line of sight; mirrored by `Through` in `shaders/pass/through_shares.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Through {
    eye: [f32; 3],
    n_points: u32,
    n_maps: u32,
    n_rows: u32,
    are_listed: u32,
    pad: u32,
}

strandlight_scattering::mirrors! {
    Through as "Through" in "pass/through_shares" {
        eye, n_points, n_maps, n_rows, are_listed, pad,
    }
}

/// Pipelines of the maps, the current map and the visibility of all.
pub(super) struct ShadowMaps {
    cast: wgpu::ComputePipeline,
    receive: wgpu::ComputePipeline,
    share: wgpu::ComputePipeline,
    view: wgpu::Buffer,
    map: wgpu::Buffer,
    sums: wgpu::Buffer,
    visibility: wgpu::Buffer,
    /// `[map_index / 4][point]`, eight bits a map.
    answers: wgpu::Buffer,
    through: wgpu::Buffer,
    /// Of the mixture of all maps: `[map]`, and `[row][map]` of four slots.
    towards: wgpu::Buffer,
    weights: wgpu::Buffer,
    /// What blocks light besides strands.
    proxies: Option<Blocker>,
    /// To cast and receive.
    groups: Option<[wgpu::BindGroup; 2]>,
    /// To share, with the counters that it is bound to.
    share_group: Option<(wgpu::Buffer, wgpu::BindGroup)>,
    n_points: u32,
    n_segments: u32,
}

impl ShadowMaps {
    pub fn new(context: &Context, strands: &StrandBuffers) -> Result<Self, RenderError> {
        let module = shader(context, "pass/shadow_map")?;
        let shares = shader(context, "pass/through_shares")?;
        let through: Through = bytemuck::Zeroable::zeroed();
        let view: ShadowView = bytemuck::Zeroable::zeroed();
        Ok(ShadowMaps {
            cast: compute(context, &module, "cast_shadows"),
            receive: compute(context, &module, "receive_shadows"),
            share: compute(context, &shares, "through_shares"),
            view: uniform(context, "shadow view", &view),
            map: storage(context, "shadow map", 0),
            sums: storage(context, "unblocked sums", 0),
            visibility: storage(context, "unblocked", 0),
            answers: storage(context, "lit places", 0),
            through: uniform(context, "line of sight", &through),
            towards: storage(context, "directions of maps", 0),
            weights: storage(context, "weights of maps", 0),
            proxies: None,
            groups: None,
            share_group: None,
            n_points: strands.n_points,
            n_segments: strands.n_segments,
        })
    }

    /// Takes proxies that block light; [`ShadowMaps::fit`] has to follow.
    pub fn set_proxies(
        &mut self,
        context: &Context,
        blocker: Option<Blocker>,
    ) -> Result<(), RenderError> {
        let feature = |blocker: &Option<Blocker>| blocker.as_ref().map(|blocker| blocker.feature);
        let wanted = feature(&blocker);
        if wanted != feature(&self.proxies) {
            let module = module_with(context, "pass/shadow_map", wanted.as_slice())?;
            self.receive = compute(context, &module, "receive_shadows");
        }
        self.proxies = blocker;
        self.groups = None;
        Ok(())
    }

    /// Makes room for the maps of `plan`. Returns whether what shading reads of them was replaced,
    /// which puts bind groups out of date.
    pub fn fit(&mut self, context: &Context, strands: &StrandBuffers, plan: &ShadowPlan) -> bool {
        if plan.views.is_empty() {
            return false;
        }
        let visibility = plan.n_words(self.n_points as usize) as u64 * 4;
        let through = u64::from(SHADOW_SIDE).pow(2) * 4;
        let map = plan.views.iter().map(bytes).fold(through, u64::max);
        let sums = u64::from(self.n_points) * 4;
        let answers = plan.n_answer_words(self.n_points as usize) as u64 * 4;
        let n_maps = plan.n_maps() as u64;
        let is_other = grow(context, &mut self.visibility, visibility)
            | grow(context, &mut self.answers, answers);
        let has_grown = grow(context, &mut self.map, map)
            | grow(context, &mut self.sums, sums)
            | grow(context, &mut self.towards, 16 * n_maps)
            | grow(
                context,
                &mut self.weights,
                16 * n_maps * n_rows(plan) as u64,
            )
            | is_other;
        if has_grown || self.groups.is_none() {
            self.groups = Some(self.bind(context, strands));
            self.share_group = None;
        }
        is_other
    }

    fn bind(&self, context: &Context, strands: &StrandBuffers) -> [wgpu::BindGroup; 2] {
        let cast = bind(
            context,
            &self.cast.get_bind_group_layout(0),
            &[
                (0, self.view.as_entire_binding()),
                (1, strands.points.as_entire_binding()),
                (2, strands.segments.as_entire_binding()),
                (3, self.map.as_entire_binding()),
            ],
        );
        let mut resources = vec![
            (0, self.view.as_entire_binding()),
            (1, strands.points.as_entire_binding()),
            (3, self.map.as_entire_binding()),
            (4, strands.tangents.as_entire_binding()),
            (5, strands.normals.as_entire_binding()),
            (6, self.sums.as_entire_binding()),
            (7, self.visibility.as_entire_binding()),
            (10, self.answers.as_entire_binding()),
        ];
        let blockers = self.proxies.iter();
        resources.extend(blockers.map(|one| (one.binding, one.buffer.as_entire_binding())));
        let layout = self.receive.get_bind_group_layout(0);
        [cast, bind(context, &layout, &resources)]
    }

    fn bind_share(
        &self,
        context: &Context,
        strands: &StrandBuffers,
        counters: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        let resources = [
            &self.through,
            &strands.points,
            &strands.tangents,
            &strands.normals,
            &self.towards,
            &self.weights,
            &self.answers,
            &self.visibility,
            counters,
        ];
        let resources = resources.map(wgpu::Buffer::as_entire_binding);
        let resources: Vec<_> = (0..).zip(resources).collect();
        bind(context, &self.share.get_bind_group_layout(0), &resources)
    }

    /// Draws one map of a plan that there is room for, and writes its row of the visibility buffer.
    pub fn draw(&self, context: &Context, view: &ShadowView, stamp: Stamp) {
        let Some([cast, receive]) = &self.groups else {
            return;
        };
        context.write(&self.view, 0, bytemuck::bytes_of(view));
        submit(context, |encoder| {
            encoder.clear_buffer(&self.map, 0, Some(bytes(view)));
            let mut pass = compute_pass(context, encoder, stamp);
            step(&mut pass, &self.cast, cast, groups_of_64(self.n_segments));
            step(
                &mut pass,
                &self.receive,
                receive,
                groups_of_64(self.n_points),
            );
        });
    }

    /// Finds TT's shares for an eye that looks along `forward`, once all maps of a plan that there is
    /// room for are drawn: at all points of `strands`, or at those that are listed after
    /// `counters`, with so many groups.
    pub fn share(
        &mut self,
        context: &Context,
        plan: &ShadowPlan,
        (eye, forward): ([f32; 3], [f32; 3]),
        strands: &StrandBuffers,
        (counters, listed): (&wgpu::Buffer, Option<Groups>),
        stamp: Stamp,
    ) {
        let mixture = plan.mixture(forward);
        let n_maps = mixture.towards.len();
        let towards: Vec<[f32; 4]> = mixture
            .towards
            .iter()
            .map(|[x, y, z]| [*x, *y, *z, 0.0])
            .collect();
        let mut weights = vec![[0.0_f32; 4]; n_maps * n_rows(plan)];
        for (slot, row) in mixture.weights.chunks_exact(n_maps.max(1)).enumerate() {
            for (map, weight) in row.iter().enumerate() {
                weights[slot / 4 * n_maps + map][slot % 4] = *weight;
            }
        }
        let through = Through {
            eye,
            n_points: self.n_points,
            n_maps: n_maps as u32,
            n_rows: n_rows(plan) as u32,
            are_listed: u32::from(listed.is_some()),
            pad: 0,
        };
        context.write(&self.through, 0, bytemuck::bytes_of(&through));
        context.write(&self.towards, 0, bytemuck::cast_slice(&towards));
        context.write(&self.weights, 0, bytemuck::cast_slice(&weights));
        let is_bound = (self.share_group.as_ref()).is_some_and(|(bound, _)| bound == counters);
        if !is_bound {
            let group = self.bind_share(context, strands, counters);
            self.share_group = Some((counters.clone(), group));
        }
        let Some((_, group)) = &self.share_group else {
            return;
        };
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            let groups = listed.unwrap_or(Groups::Known(groups_of_64(self.n_points)));
            step_over(&mut pass, &self.share, group, groups);
        });
    }

    /// Unblocked shares, as [`strandlight_scene::shadow_maps::unblocked_share`] reads them.
    pub fn visibility(&self) -> &wgpu::Buffer {
        &self.visibility
    }

    /// Lit places about every point, by map.
    pub fn answers(&self) -> &wgpu::Buffer {
        &self.answers
    }

    pub fn bytes(&self) -> u64 {
        self.visibility.size() + self.answers.size() + self.map.size() + self.sums.size()
    }
}

/// Rows of four slots.
fn n_rows(plan: &ShadowPlan) -> usize {
    plan.n_slots.div_ceil(SLOTS_PER_WORD) as usize
}

/// Bytes of a map.
fn bytes(view: &ShadowView) -> u64 {
    u64::from(view.side).pow(2) * 4
}
