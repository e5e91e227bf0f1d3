//! What a picture is made of: the scene as stages read it, their results and work under way.

use std::ops::Range;
use std::sync::Arc;

use strandlight_scattering::closed_form::PackedRecord;
use strandlight_scattering::wide::Peaks;
use strandlight_scene::PreparedScene;
use strandlight_scene::beside::{Beside, HeightMaps, Places};
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::paint::PaintedPoint;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::ShadowPlan;

use super::super::proxies::Proxies;
use super::super::proxy_light::Surfaces;
use super::super::radiance::{Between, Radiance};
use super::super::shade::Counts;
use super::super::transmittance::LightSweep;

/// What all stages of a picture read.
pub(super) struct Picturing<'a> {
    pub scene: &'a PreparedScene,
    pub view: ViewUniform,
    pub beside: Beside,
    /// Shows what can be had soon first.
    pub has_drafts: bool,
}

/// How far radiance is that of the complete picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quality {
    /// It is that of the view before, where points are that this one shows too.
    Carried,
    /// Shadows are those of the volume, or the light through to the eye is by maps of a view far from this one.
    Draft,
    /// All light is in the shadows of maps; that through to the eye is by those of a view near this one. Some points are shaded, the
    /// others are interpolated.
    Turned,
    /// Single scattering is in the shadows of maps, all or some of each light, and leaves to chance what hardly counts; multiple scattering
    /// and lights without maps are those of the draft.
    Shadowed,
    /// Some points are shaded, the others are interpolated.
    Most,
    /// It is what was kept of lights of other colours.
    Recolored,
    Whole,
}

impl Quality {
    /// Are points shaded for it that are shaded again for a better one?
    pub const fn is_draft(self) -> bool {
        matches!(self, Quality::Draft | Quality::Turned)
    }
}

/// The lights of a scene, and which maps they get.
pub(super) struct Lights {
    pub plan: ShadowPlan,
    pub records: Vec<LightRecord>,
    pub sweeps: Vec<[f32; 4]>,
    pub is_lit: Vec<bool>,
    /// Those that are not black, narrow ones first.
    pub lit: Vec<u32>,
}

impl Lights {
    /// Is there one whose shadows are found along segments?
    pub fn has_narrow(&self) -> bool {
        self.records.iter().any(LightRecord::is_narrow)
    }
}

/// What the hair lets through, by the shadow volume.
#[derive(Default)]
pub(super) struct Records {
    /// `[light][voxel]`; none of lights that were black.
    pub packed: Vec<PackedRecord>,
    /// `[light][voxel]`: [from how many directions](super::super::transmittance::Swept::n_open) light comes,
    /// until light on the proxies is found by it for lights of any colour.
    pub n_open: Vec<u8>,
    /// By light, once it is done: was it not black?
    pub is_lit: Vec<Option<bool>>,
    /// Of the voxels.
    pub places: Places,
    /// `[light][direction]` of the lights that are done, until light on the proxies is found by them.
    pub maps: Vec<Vec<HeightMaps>>,
    /// Lights under way, as many as there are threads.
    pub under_way: Vec<LightSweep>,
}

/// What arrives of the lights at the proxies.
pub(super) struct ProxyLight {
    pub surfaces: Surfaces,
    /// Lights that are found.
    pub n_done: usize,
    /// `[light][surface]`: [`Surfaces::irradiance`], whatever the colours and the fibre; nothing of lights that were black.
    pub arriving: Vec<Vec<[f32; 3]>>,
    /// In place of it where it would be many bytes: the proxies in the light of the lights as they are.
    pub lit: Option<Proxies>,
}

impl ProxyLight {
    /// Is it that of lights of other colours too?
    pub fn is_of_any_color(&self) -> bool {
        self.lit.is_none()
    }
}

/// Light of the proxies that the visible points of plain hair scatter. It changes slowly along strands: it is found at some
/// of the points and interpolated.
pub(super) struct Bounced {
    /// At the visible points.
    pub light: Radiance,
    /// What the proxies sent back in all.
    pub sent_back: [f32; 3],
    /// Are the proxies still in that light?
    pub is_current: bool,
}

/// The same while it is being found.
pub(super) struct FindingBounced {
    /// At the visible points, black where it is not found.
    pub light: Radiance,
    /// Of `VisiblePoints::of_bounce`, as many as are found.
    pub n_done: usize,
}

/// Radiance that is being found.
pub(super) struct Shading {
    /// What it will be.
    pub quality: Quality,
    /// Lights, ranges of [`Lights::lit`], that are shaded one after the other.
    pub groups: Vec<Range<usize>>,
    pub group: usize,
    /// Places of the points to shade, as in `VisiblePoints::order`, and how many are the first.
    pub order: Vec<u32>,
    pub n_first: usize,
    /// Points done in the group.
    pub n_done: usize,
    pub radiance: Radiance,
    pub counts: Counts,
    /// Of drafts.
    pub peaks: Option<Peaks>,
}

/// A picture in shadows that is being made of a draft.
pub(super) struct Shadowing {
    /// Places of the points that get a radiance of their own, and how many have it.
    pub places: Vec<u32>,
    pub n_done: usize,
    /// By place: which points of the draft it lies between.
    pub between: Vec<Between>,
    pub radiance: Radiance,
    pub peaks: Peaks,
}

/// Radiance with some paint.
pub(super) struct Painted {
    pub radiance: Radiance,
    pub paint: Option<Arc<Vec<PaintedPoint>>>,
}

impl Shading {
    /// The places of the points to shade next, at most `most`.
    pub fn next_places(&self, most: usize) -> Vec<u32> {
        let places = &self.order[self.n_done..];
        let n = match self.n_first.saturating_sub(self.n_done) {
            0 => places.len(),
            n_left => n_left,
        };
        places[..n.min(most)].to_vec()
    }

    /// Are the points done that a first picture shows?
    pub fn has_first(&self) -> bool {
        // Where there are no others no picture comes before the last one.
        self.n_done >= self.n_first
            || self.n_first == self.order.len() && self.quality == Quality::Whole
    }

    /// Have narrow lights a radiance along segments?
    pub fn has_narrow(&self) -> bool {
        !self.radiance.along.is_empty()
    }

    /// Adds what some points have of the lights under way.
    pub fn add(&mut self, places: &[u32], radiance: &Radiance, counts: Counts) {
        self.radiance.add(places, radiance);
        self.counts = self.counts.and(counts);
    }

    /// Keeps the radiance of the points whose paint is what it was.
    pub fn only_repainted(
        &mut self,
        before: Painted,
        paint: Option<&[PaintedPoint]>,
        visible: &[u32],
    ) {
        let of = |paint: Option<&[PaintedPoint]>, point: usize| match paint {
            Some(paint) => paint[point],
            None => PaintedPoint::NONE,
        };
        let was = before.paint.as_ref().map(|paint| &paint[..]);
        let is_other = |place: u32| {
            let point = visible[place as usize] as usize;
            of(was, point) != of(paint, point)
        };
        self.radiance = before.radiance;
        self.order.retain(|place| is_other(*place));
        // They are few.
        self.n_first = self.order.len();
        for place in &self.order {
            self.radiance.clear(*place as usize);
        }
    }
}

/// Radiance that is shown.
pub(super) struct Shaded {
    /// The paint that it is of.
    pub paint: Option<Arc<Vec<PaintedPoint>>>,
    pub quality: Quality,
    pub radiance: Radiance,
}
