//! Shadow maps on the device: drawn and looked up one after the other, the answers kept.

use super::resources::{
    StrandBuffers, bind, compute, dispatch, failed, shader, storage, submit, uniform,
};
use crate::error::RenderError;
use crate::gpu::Context;
use crate::shadow_maps::{ShadowPlan, ShadowView};

/// Pipelines of the maps.
pub(super) struct ShadowMaps {
    cast: wgpu::ComputePipeline,
    receive: wgpu::ComputePipeline,
}

impl ShadowMaps {
    pub fn new(context: &Context) -> Result<Self, RenderError> {
        let module = shader(context, "pass/shadow_map")?;
        Ok(ShadowMaps {
            cast: compute(context, &module, "cast_shadows"),
            receive: compute(context, &module, "receive_shadows"),
        })
    }

    /// Unblocked share of the lights with maps at every point, as
    /// [`crate::shadow_maps::unblocked_share`] reads it.
    pub fn run(
        &self,
        context: &Context,
        strands: &StrandBuffers,
        plan: &ShadowPlan,
    ) -> Result<wgpu::Buffer, RenderError> {
        let bytes = plan.n_words(strands.n_points as usize) as u64 * 4;
        let answers = storage(context, "unblocked", bytes);
        self.draw(context, strands, &plan.views, &answers)?;
        Ok(answers)
    }

    /// Draws maps and writes their slots of `answers`. The map itself goes again.
    pub fn draw(
        &self,
        context: &Context,
        strands: &StrandBuffers,
        views: &[ShadowView],
        answers: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        let Some(first) = views.first() else {
            return Ok(());
        };
        let sums = storage(context, "unblocked sums", u64::from(strands.n_points) * 4);
        let bytes = |view: &ShadowView| u64::from(view.side).pow(2) * 4;
        let largest = views.iter().map(bytes).max().unwrap_or_default();
        let map = storage(context, "shadow map", largest);
        let view = uniform(context, "shadow view", first);
        let cast = bind(
            context,
            &self.cast.get_bind_group_layout(0),
            &[
                (0, view.as_entire_binding()),
                (1, strands.points.as_entire_binding()),
                (2, strands.segments.as_entire_binding()),
                (3, map.as_entire_binding()),
            ],
        );
        let receive = bind(
            context,
            &self.receive.get_bind_group_layout(0),
            &[
                (0, view.as_entire_binding()),
                (1, strands.points.as_entire_binding()),
                (3, map.as_entire_binding()),
                (4, strands.tangents.as_entire_binding()),
                (5, strands.normals.as_entire_binding()),
                (6, sums.as_entire_binding()),
                (7, answers.as_entire_binding()),
            ],
        );
        // More groups than one dimension takes go into the second.
        let grouped = |n: u32| {
            let groups = n.div_ceil(64);
            let rows = groups.div_ceil(32_768).max(1);
            [groups.div_ceil(rows), rows]
        };
        for one in views {
            context
                .queue
                .write_buffer(&view, 0, bytemuck::bytes_of(one));
            submit(context, |encoder| {
                encoder.clear_buffer(&map, 0, Some(bytes(one)));
                dispatch(encoder, &self.cast, &cast, grouped(strands.n_segments));
                dispatch(encoder, &self.receive, &receive, grouped(strands.n_points));
            });
            // One map at a time: a software device takes part of a second for each.
            context.wait("shadow map").map_err(failed)?;
        }
        Ok(())
    }
}
