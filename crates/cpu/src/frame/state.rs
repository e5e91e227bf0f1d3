//! What the stages of a picture keep.

use std::sync::Arc;

use strandlight_scattering::closed_form::WidthProfile;
use strandlight_scattering::multiple_tables::Filling;
use strandlight_scene::Stats;
use strandlight_scene::volume::Grid;

use super::super::axis_shares::AxisShares;
use super::super::bounce::{BounceLight, BounceRays};
use super::super::list::{Listing, VisibilityList};
use super::super::proxies::Proxies;
use super::super::radiance::{Radiance, RadianceBefore};
use super::super::scene_tables::SceneTables;
use super::super::through_shares::Through;
use super::super::unblocked::{Casting, StripOrder, Unblocked};
use super::super::visible::VisiblePoints;
use super::super::voxelise::Voxelising;
use super::inputs::NeededTables;
use super::parts::{Lights, Painted, ProxyLight, Records, Shaded, Shading};
use super::served::ServedPoints;

/// The stages' results, as far as they are up to date, and the stage under way.
#[derive(Default)]
pub(in super::super) struct Frame {
    pub(super) size: [u32; 2],
    /// Has there been a picture?
    pub(super) is_drawn: bool,
    /// And one from elsewhere?
    pub(super) was_turned: bool,
    /// Amplitudes that maps are shared out by, so that a light that is off and on again, or tinted,
    /// keeps its maps; those of the scene where there are none.
    pub planned: Vec<[f32; 3]>,
    pub(super) lights: Option<Lights>,
    pub(super) are_lights_current: bool,
    pub(super) voxelising: Option<(Grid, Voxelising)>,
    pub(super) volume: Option<(Grid, Vec<[f32; 8]>)>,
    /// Of that volume, where multiple scattering is or was drawn.
    pub(super) axis_shares: Option<AxisShares>,
    /// Are all of its tiles made?
    pub(super) listing: Option<(Listing, bool)>,
    pub(super) list: Option<(VisibilityList, VisiblePoints)>,
    pub(super) records: Option<Records>,
    pub(super) proxy_light: Option<ProxyLight>,
    /// In the light of the lights as they are.
    pub(super) proxies: Option<Proxies>,
    pub(super) bounce_rays: Option<BounceRays>,
    /// What the proxies send back to the hair, in the same light; where it is nothing, none.
    pub(super) bounce: Option<BounceLight>,
    pub(super) strip_order: Option<Arc<StripOrder>>,
    pub(super) casting: Option<Casting>,
    pub(super) unblocked: Option<Unblocked>,
    pub(super) through_casting: Option<Casting>,
    pub(super) through: Option<Through>,
    /// That of the view before, for drafts.
    pub(super) through_before: Option<Through>,
    /// Unknown after an edit of the paint, the hair or the terms.
    pub(super) needed_tables: Option<NeededTables>,
    pub(super) filling: Option<Filling>,
    pub(super) multiple: Option<SceneTables>,
    pub(super) served: ServedPoints,
    /// Of the fibre over its width, where a view shows strands that are wide.
    pub(super) profile: Option<WidthProfile>,
    pub(super) shading: Option<Shading>,
    pub(super) shaded: Option<Shaded>,
    /// Radiance before edits that left points and shadows as they are, or of the view before.
    pub(super) before: Option<RadianceBefore>,
    /// The visible points and radiance of the view before, until it is known what the next one shows.
    pub(super) before_view: Option<(Vec<u32>, Radiance)>,
    /// The same while the picture is [carried](super::parts::Quality::Carried) over from it.
    pub(super) carried_from: Option<(Vec<u32>, Radiance)>,
    /// Radiance before an edit of the paint.
    pub(super) before_paint: Option<Painted>,
    /// Of the work since they were last taken.
    pub(super) stats: Stats,
    pub(super) version: u64,
}
