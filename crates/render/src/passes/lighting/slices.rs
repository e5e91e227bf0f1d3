//! Dispatches over the points of a list: their number is known to the device before anybody has read it.

use std::ops::Range;

use super::super::resources::{
    Groups, bind, compute, compute_pass, groups_of_64, grow, labelled, shader, step, submit,
    uniform,
};
use super::super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_scene::RenderError;

/// Words of counters, before the number of points that are shaded where these are listed.
pub(crate) const N_SHADED: u32 = 20;

/// Words before these points.
pub(crate) const FIRST_SHADED: u32 = 21;

/// Bytes of the arguments of a dispatch.
const ARGUMENT_BYTES: u64 = 12;

/// Fewest points of a slice: those of a group.
const LEAST_SLICE: u32 = 64;

/// What a list is cut into; mirrored by `Slices` in `shaders/pass/slices.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Slices {
    n_slices: u32,
    slice_points: u32,
}

strandlight_scattering::mirrors! {
    Slices as "Slices" in "pass/slices" { n_slices, slice_points }
}

/// So many points in slices of at most `chunk`.
pub(super) fn slices(n_points: u32, chunk: u32) -> impl Iterator<Item = Range<u32>> {
    let chunk = chunk.max(LEAST_SLICE);
    let firsts = (0..n_points).step_by(chunk as usize);
    firsts.map(move |first| first..(first + chunk).min(n_points))
}

/// Has the device write the workgroups for a list, and for [`slices`] of it.
pub(super) struct SlicePass {
    pipeline: wgpu::ComputePipeline,
    slices: wgpu::Buffer,
    arguments: wgpu::Buffer,
    /// With the counters that it is bound to.
    group: Option<(wgpu::Buffer, wgpu::BindGroup)>,
    /// Points of a slice.
    chunk: u32,
}

impl SlicePass {
    pub fn new(context: &Context) -> Result<SlicePass, RenderError> {
        let slices: Slices = bytemuck::Zeroable::zeroed();
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::INDIRECT
            | wgpu::BufferUsages::COPY_SRC;
        Ok(SlicePass {
            pipeline: compute(context, &shader(context, "pass/slices")?, "find_arguments"),
            slices: uniform(context, "slices", &slices),
            arguments: labelled(context, "workgroups of slices", 0, usage),
            group: None,
            chunk: LEAST_SLICE,
        })
    }

    /// For the list whose number of points, at most `n_points`, is in `counters`, in slices of `chunk`.
    pub fn find(&mut self, context: &Context, counters: &wgpu::Buffer, n_points: u32, chunk: u32) {
        self.chunk = chunk.max(LEAST_SLICE);
        let n_slices = n_points.div_ceil(self.chunk);
        let bytes = ARGUMENT_BYTES * (1 + u64::from(n_slices));
        if grow(context, &mut self.arguments, bytes) {
            self.group = None;
        }
        let slices = Slices {
            n_slices,
            slice_points: self.chunk,
        };
        context.write(&self.slices, 0, bytemuck::bytes_of(&slices));
        let is_bound = (self.group.as_ref()).is_some_and(|(bound, _)| bound == counters);
        if !is_bound {
            let resources = [&self.slices, counters, &self.arguments];
            let resources = resources.map(wgpu::Buffer::as_entire_binding);
            let resources: Vec<_> = (0..).zip(resources).collect();
            let group = bind(context, &self.pipeline.get_bind_group_layout(0), &resources);
            self.group = Some((counters.clone(), group));
        }
        let Some((_, group)) = &self.group else {
            return;
        };
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, Stamp::default());
            step(&mut pass, &self.pipeline, group, groups_of_64(n_slices + 1));
        });
    }

    /// Workgroups for all points of the list.
    pub fn of_all(&self) -> Groups<'_> {
        Groups::Written(&self.arguments, 0)
    }

    /// Workgroups for one of its [`slices`].
    pub fn of_slice(&self, points: &Range<u32>) -> Groups<'_> {
        let ix = 1 + u64::from(points.start / self.chunk);
        Groups::Written(&self.arguments, ARGUMENT_BYTES * ix)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passes::resources::{read_back, storage};

    /// What the device makes of a number of points is what the host makes of it: none, few, and more than a row of
    /// groups has threads.
    #[test]
    fn gpu_the_device_cuts_lists_as_the_host_does() {
        let context = Context::new().unwrap();
        let mut pass = SlicePass::new(&context).unwrap();
        let counters = storage(&context, "counters", 4 * u64::from(FIRST_SHADED));
        for (n_points, n_listed, chunk) in [
            (500, 0, 1024),
            (500, 1, 1),
            (500, 65, 64),
            (500, 500, 200),
            (9_000_000, 4_194_305, 1 << 20),
            (9_000_000, 9_000_000, 1 << 15),
        ] {
            context.write(
                &counters,
                4 * u64::from(N_SHADED),
                bytemuck::bytes_of(&n_listed),
            );
            pass.find(&context, &counters, n_points, chunk);
            let arguments: Vec<[u32; 3]> =
                read_back(&context, "workgroups", &pass.arguments).unwrap();
            let at = |groups: Groups| match groups {
                Groups::Written(_, bytes) => arguments[(bytes / ARGUMENT_BYTES) as usize],
                Groups::Known(_) => panic!("the host does not know it"),
            };
            let expected = |n| {
                let [x, y] = groups_of_64(n);
                assert!(x.max(y) <= 65_535);
                [x, y, 1]
            };
            assert_eq!(at(pass.of_all()), expected(n_listed));
            let known: Vec<_> = slices(n_listed, chunk).collect();
            for (ix, slice) in slices(n_points, chunk).enumerate() {
                let n = known.get(ix).map_or(0, |known| known.end - known.start);
                assert_eq!(
                    at(pass.of_slice(&slice)),
                    expected(n),
                    "{n_listed} {slice:?}"
                );
            }
        }
    }
}
