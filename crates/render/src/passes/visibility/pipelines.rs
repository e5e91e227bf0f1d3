//! The pipelines of visibility lists.

use super::super::meshes;
use super::super::resources::{bind, compute, module_with};
use crate::gpu::Context;
use crate::limits::MOST_GROUPS;
use strandlight_scene::RenderError;

/// Threads of a group that goes through segments, triangles or a row.
pub(super) const GROUP: u32 = 256;

/// What all scenes need.
pub(super) struct Pipelines {
    pub place_points: wgpu::ComputePipeline,
    pub find_hits: wgpu::ComputePipeline,
    pub sum_rows: wgpu::ComputePipeline,
    pub place_rows: wgpu::ComputePipeline,
    pub place_pixels: wgpu::ComputePipeline,
    pub count_seen: wgpu::ComputePipeline,
    pub list_seen: wgpu::ComputePipeline,
}

impl Pipelines {
    pub fn new(context: &Context) -> Result<Pipelines, RenderError> {
        let module = module_with(context, "pass/visibility", &[])?;
        let pipeline = |entry| compute(context, &module, entry);
        Ok(Pipelines {
            place_points: pipeline("place_points"),
            find_hits: pipeline("find_hits"),
            sum_rows: pipeline("sum_rows"),
            place_rows: pipeline("place_rows"),
            place_pixels: pipeline("place_pixels"),
            count_seen: pipeline("count_seen"),
            list_seen: pipeline("list_seen"),
        })
    }
}

/// What depends on the lights, and on what is beside the hair.
pub(super) struct Kind {
    pub features: Vec<&'static str>,
    pub list_pixels: wgpu::ComputePipeline,
    pub resolve: wgpu::ComputePipeline,
    /// Where there are meshes: counts, places and sorts their triangles.
    pub triangles: Option<[wgpu::ComputePipeline; 3]>,
}

impl Kind {
    pub fn new(context: &Context, features: Vec<&'static str>) -> Result<Kind, RenderError> {
        let list = module_with(context, "pass/listed_pixels", &features)?;
        let picture = module_with(context, "pass/listed_picture", &features)?;
        let mut triangles = None;
        if features.contains(&meshes::FEATURE) {
            let module = module_with(context, "pass/listed_triangles", &[])?;
            let entries = ["count_triangles", "place_triangles", "sort_triangles"];
            triangles = Some(entries.map(|entry| compute(context, &module, entry)));
        }
        Ok(Kind {
            list_pixels: compute(context, &list, "list_pixels"),
            resolve: compute(context, &picture, "resolve"),
            triangles,
            features,
        })
    }
}

/// Groups of [`GROUP`] threads for `n`; more than one dimension takes go into the second.
pub(super) fn groups(n: u32) -> [u32; 2] {
    let groups = n.div_ceil(GROUP);
    let rows = groups.div_ceil(MOST_GROUPS).max(1);
    [groups.div_ceil(rows), rows]
}

/// Group 0 of `pipeline`: buffers by binding number.
pub(super) fn group(
    context: &Context,
    pipeline: &wgpu::ComputePipeline,
    buffers: &[(u32, &wgpu::Buffer)],
) -> wgpu::BindGroup {
    let resources = buffers
        .iter()
        .map(|(binding, buffer)| (*binding, buffer.as_entire_binding()));
    let resources: Vec<_> = resources.collect();
    bind(context, &pipeline.get_bind_group_layout(0), &resources)
}
