//! The steps of shading.

use std::ops::Range;

use strandlight_scene::shadow_maps::ShadowView;

/// Pieces of work that depend on those before them; what each wrote stays.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Step {
    /// Draws a shadow map.
    Map(ShadowView),
    /// Finds TT's unblocked shares for an eye.
    Through { eye: [f32; 3], forward: [f32; 3] },
    /// Sweeps a batch of lights along a direction of each.
    Sweep { batch: usize, k: u32 },
    /// Fills the tables of multiple scattering.
    Tables,
    /// Shades points with a batch of lights.
    Shade { batch: usize, points: Range<u32> },
    /// Shades the segments about points with narrow lights.
    Narrow { points: Range<u32> },
    /// Adds what the proxies send back of a batch of lights.
    Proxies { batch: usize },
    /// Adds what they send to each other.
    Interreflection,
    /// Finds what of that comes to the hair.
    Bounce,
    /// Shades points with it.
    ShadeBounce { points: Range<u32> },
}

impl Step {
    /// The points that it shades, in the list of these if there is one.
    pub fn points(&self) -> Option<&Range<u32>> {
        match self {
            Step::Shade { points, .. } | Step::Narrow { points } | Step::ShadeBounce { points } => {
                Some(points)
            }
            _ => None,
        }
    }

    /// Leaves out what lies beyond the first `n` points. Answers whether anything is left to do.
    pub fn keep_first(&mut self, n: u32) -> bool {
        match self {
            Step::Shade { points, .. } | Step::Narrow { points } | Step::ShadeBounce { points } => {
                points.end = points.end.min(n);
                points.start < points.end
            }
            _ => true,
        }
    }

    /// The stage it counts for.
    pub fn stage(&self) -> &'static str {
        match self {
            Step::Map(_) | Step::Through { .. } => "shadow maps",
            Step::Sweep { .. } => "transmittance",
            Step::Tables => "tables",
            Step::Shade { .. } | Step::Narrow { .. } | Step::ShadeBounce { .. } => "shade",
            Step::Proxies { .. } | Step::Interreflection | Step::Bounce => "proxies",
        }
    }
}
