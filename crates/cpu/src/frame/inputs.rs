//! What shading reads of the stages before it.

use std::ops::Range;

use strandlight_scattering::closed_form::{PackedRecord, TERM_GLOBAL, TERM_LOCAL, WidthProfile};
use strandlight_scattering::multiple_tables::MultipleTables;
use strandlight_scene::PreparedScene;
use strandlight_scene::paint::PaintedPoint;
use strandlight_scene::volume::Grid;

use super::super::bounce::BounceLight;
use super::super::proxies::Proxies;
use super::super::through_shares::{Maps, Through};
use super::super::unblocked::Unblocked;
use super::super::visible::VisiblePoints;
use super::parts::Lights;
use super::parts::Picturing;

/// Of one picture.
pub(super) struct Inputs<'a> {
    pub picturing: &'a Picturing<'a>,
    pub lights: &'a Lights,
    pub visible: &'a VisiblePoints,
    /// That of the shadow volume.
    pub grid: &'a Grid,
    /// `[light][voxel]`
    pub records: &'a [PackedRecord],
    /// None where they are not there yet, and where no light has one.
    pub maps: Option<Maps<'a>>,
    /// Where strands are seen that are wide.
    pub profile: Option<&'a WidthProfile>,
    pub bounce: Option<&'a BounceLight>,
    pub proxies: Option<&'a Proxies>,
}

/// Visible points that are shaded at a time: an eighth of them, within this.
const SLICE: Range<usize> = 64..2048;

impl Inputs<'_> {
    /// Visible points that are shaded at a time.
    pub fn slice(&self) -> usize {
        let eighth = self.visible.points.len().div_ceil(8);
        eighth.clamp(SLICE.start, SLICE.end)
    }

    /// Splits places into those of points with the scene's fibre and those of painted points.
    pub fn plain_and_painted(&self, places: &[u32]) -> (Vec<u32>, Vec<u32>) {
        let paint = self.picturing.scene.paint();
        let is_plain = |place: &u32| is_plain(paint, self.visible, *place);
        places.iter().partition(|place| is_plain(place))
    }
}

/// Has the visible point at a place the scene's fibre?
pub(super) fn is_plain(
    paint: Option<&[PaintedPoint]>,
    visible: &VisiblePoints,
    place: u32,
) -> bool {
    let point = visible.points[place as usize] as usize;
    paint.is_none_or(|paint| !paint[point].is_painted())
}

/// The shadow maps of the lights and those through the hair to the eye, once there are both.
pub(super) fn maps_of<'a>(
    lights: &'a Lights,
    unblocked: Option<&'a Unblocked>,
    through: Option<&'a Through>,
) -> Option<Maps<'a>> {
    let (of_lights, through) = unblocked.zip(through)?;
    (lights.plan.n_slots > 0).then_some(Maps {
        plan: &lights.plan,
        of_lights,
        through,
        are_drawn: None,
    })
}

/// The tables, where there are points that they serve and they have all terms of multiple scattering that are drawn.
pub(super) fn tables_for<'a>(
    scene: &PreparedScene,
    tables: Option<&'a MultipleTables>,
    needs_tables: Option<bool>,
) -> Option<&'a MultipleTables> {
    let drawn = scene.terms() & (TERM_GLOBAL | TERM_LOCAL);
    tables.filter(|tables| needs_tables == Some(true) && drawn & !tables.terms() == 0)
}
