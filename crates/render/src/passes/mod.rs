//! The renderer: stages in the order they run, one file each.
//!
//! Once for the strands and the lights: `voxelise` (shadow volume) -> shadow maps,
//! `transmittance`. A frame: the maps towards the eye -> `shade`, in batches of lights -> `draw`
//! (project, ribbons, in close-ups pieces, passes of four samples, accumulate) -> `composite`. `strand_pass` draws the
//! ribbons, into the passes of a film or of a host, which accumulates and composes itself.

mod behind;
mod bounce;
pub(crate) mod clock;
mod covering;
pub(crate) mod deform;
pub(crate) mod draw;
pub(crate) mod film;
mod interreflection;
pub(crate) mod lighting;
mod memory_estimate;
mod meshes;
pub(crate) mod multiple;
mod narrow;
pub(crate) mod noise;
pub(crate) mod painted;
pub(crate) mod parts;
mod pieces;
mod preview;
mod profile;
mod proxies;
pub(crate) mod readback;
pub(crate) mod resources;
mod scattering;
pub(crate) mod screen;
mod shadow_map;
mod shadows;
pub(crate) mod stamp;
pub(crate) mod step;
pub(crate) mod strand_pass;
pub(crate) mod target;
pub(crate) mod visibility;
pub(crate) mod volume;

pub use memory_estimate::{DeviceBytes, DevicePart};
#[doc(hidden)]
pub use parts::PartLimits;

use crate::gpu::Context;
use strandlight_scattering::layout::Layout;
use strandlight_scene::RenderError;
use strandlight_scene::shadow_maps::ShadowPlan;
use strandlight_scene::strands::Strands;

/// The structs here that shaders mirror.
pub(crate) fn layouts() -> Vec<Layout> {
    [
        draw::LAYOUTS,
        pieces::LAYOUTS,
        preview::LAYOUTS,
        noise::LAYOUTS,
        lighting::LAYOUTS,
        scattering::LAYOUTS,
        screen::LAYOUTS,
        shadow_map::LAYOUTS,
        shadows::LAYOUTS,
        strand_pass::LAYOUTS,
        target::LAYOUTS,
        visibility::LAYOUTS,
    ]
    .concat()
}

/// The visibility from the shadow maps of `plan` for `strands` and an `eye` that looks along `forward`, as
/// [`strandlight_scene::shadow_maps::unblocked_share`] reads them.
///
/// # Errors
/// Whatever the device refuses.
pub fn shadow_maps(
    context: &Context,
    strands: &Strands,
    plan: &ShadowPlan,
    (eye, forward): ([f32; 3], [f32; 3]),
) -> Result<Vec<u32>, RenderError> {
    resources::guarded(context, || {
        let buffers = resources::StrandBuffers::new(context, strands);
        let mut maps = shadow_map::ShadowMaps::new(context, &buffers)?;
        maps.fit(context, &buffers, plan);
        for view in plan.views.iter().chain(&plan.through(forward)) {
            maps.draw(context, view, Default::default());
            context.wait("shadow map").map_err(resources::failed)?;
        }
        let all = (
            &resources::storage(context, "counters", lighting::COUNTER_BYTES),
            None,
        );
        maps.share(
            context,
            plan,
            (eye, forward),
            &buffers,
            all,
            Default::default(),
        );
        let mut visibility = resources::read_back(context, "unblocked", maps.visibility())?;
        // Buffers are never empty.
        visibility.truncate(plan.n_words(strands.points.len()));
        Ok(visibility)
    })
}
