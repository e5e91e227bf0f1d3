//! What shading reads of the stages before it.

use std::ops::Range;

use rayon::prelude::*;
use strandlight_scattering::closed_form::{
    PackedRecord, TERM_GLOBAL, TERM_LOCAL, WidthProfile, painted_fibre, unpack_paint,
};
use strandlight_scattering::multiple_tables::{MultipleTables, Packs, packs_of};
use strandlight_scene::PreparedScene;
use strandlight_scene::paint::PaintedPoint;
use strandlight_scene::volume::Grid;

use super::super::axis_shares::AxisShares;
use super::super::bounce::BounceLight;
use super::super::proxies::Proxies;
use super::super::scene_tables::SceneTables;
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
    /// Where multiple scattering is drawn.
    pub axis_shares: Option<&'a AxisShares>,
    /// `[light][voxel]`
    pub records: &'a [PackedRecord],
    /// None where they are not there yet, and where no light has one.
    pub maps: Option<Maps<'a>>,
    /// Where strands are seen that are wide.
    pub profile: Option<&'a WidthProfile>,
    pub bounce: Option<&'a BounceLight>,
    /// Tables that points need, seen or not.
    pub needed: NeededTables,
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

    /// Splits places into those of points that tables serve and those of others.
    pub fn served_and_others(&self, places: &[u32]) -> (Vec<u32>, Vec<u32>) {
        let paint = self.picturing.scene.paint();
        let is_served = |place: &u32| is_served_at(paint, self.visible, *place);
        places.iter().partition(|place| is_served(place))
    }
}

/// Do tables serve a point with this paint? Those of painted points are of the scene's widths and shifts.
pub(super) fn is_served(paint: &PaintedPoint) -> bool {
    paint.width_scale == 1.0 && paint.shift_scale == 1.0
}

/// Do tables serve the visible point at a place?
pub(super) fn is_served_at(
    paint: Option<&[PaintedPoint]>,
    visible: &VisiblePoints,
    place: u32,
) -> bool {
    let point = visible.points[place as usize] as usize;
    paint.is_none_or(|paint| is_served(&paint[point]))
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

/// Tables of multiple scattering that the points of a scene need.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct NeededTables {
    /// Those of the scene's fibre.
    pub plain: bool,
    /// Are there painted points that tables serve?
    pub painted: bool,
    /// Those of such points.
    pub packs: Packs,
    /// Are there painted points that none serve?
    pub has_others: bool,
}

/// Points whose paint is looked at by one thread at a time.
const PAINT_CHUNK: usize = 1 << 13;

impl NeededTables {
    /// Of `scene`; none where [modes add up](PreparedScene::modes_add_up).
    pub fn of(scene: &PreparedScene) -> NeededTables {
        if scene.modes_add_up {
            return NeededTables::default();
        }
        let Some(paint) = scene.paint() else {
            return NeededTables {
                plain: true,
                ..NeededTables::default()
            };
        };
        let fibre = &scene.hair.optics().fibre;
        let has_packs = scene.terms() & (TERM_GLOBAL | TERM_LOCAL) != 0;
        let of_chunk = |points: &[PaintedPoint]| {
            let mut needed = NeededTables::default();
            let mut before = None;
            for point in points {
                // Most are as their neighbours.
                if before.replace(point) == Some(point) {
                    continue;
                }
                if !is_served(point) {
                    needed.has_others = true;
                    continue;
                }
                needed.plain |= !point.is_painted();
                needed.painted |= point.is_painted();
                if point.is_painted() && has_packs {
                    let paint = unpack_paint(&point.texel());
                    let fibre = painted_fibre(fibre, &paint);
                    needed.packs |= packs_of(&fibre, &paint);
                }
            }
            needed
        };
        let chunks = paint.par_chunks(PAINT_CHUNK);
        chunks
            .map(of_chunk)
            .reduce(NeededTables::default, |a, b| NeededTables {
                plain: a.plain || b.plain,
                painted: a.painted || b.painted,
                packs: a.packs | b.packs,
                has_others: a.has_others || b.has_others,
            })
    }

    /// Is there a point that needs some?
    pub fn is_any(self) -> bool {
        self.plain || self.painted
    }

    /// Are all of them among `tables`?
    pub fn are_in(self, tables: &SceneTables) -> bool {
        (!self.plain || tables.plain.is_some()) && tables.painted.missing(self.packs) == 0
    }
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
    tables: Option<&'a SceneTables>,
    needed: Option<NeededTables>,
) -> Option<&'a SceneTables> {
    let drawn = scene.terms() & (TERM_GLOBAL | TERM_LOCAL);
    let needed = needed.filter(|needed| needed.is_any())?;
    tables.filter(|tables| {
        let of_plain = tables.plain.as_ref().map_or(drawn, MultipleTables::terms);
        needed.are_in(tables) && drawn & !(of_plain & tables.painted.terms()) == 0
    })
}
