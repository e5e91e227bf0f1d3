//! Bounding volume hierarchies for rays.

use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::PlocBuilder;

/// A hierarchy over `boxes`.
///
/// As `obvhs::cwbvh::builder::build_cwbvh` makes it, which takes the time: pages have no clock of that kind, and it panics there.
#[doc(hidden)]
pub fn hierarchy(boxes: &[Aabb]) -> CwBvh {
    let config = BvhBuildParams::medium_build();
    let indices = (0..boxes.len() as u32).collect();
    let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
        config.ploc_search_distance,
        boxes,
        indices,
        config.sort_precision,
        config.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut binary, config.reinsertion_batch_ratio, None);
    let most = config.max_prims_per_leaf.clamp(1, 3);
    bvh2_to_cwbvh(&binary, most, true, false)
}
