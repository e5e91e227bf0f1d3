//! Pictures by their visibility list, in stages that are kept from one picture to the next.
//!
//! A stage runs for a picture if an edit since the last one made it stale: see [`Stage::inputs`].
//! So after an edit of the hair nothing is drawn and no shadow is cast, and after one of the
//! background nothing is shaded.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;
use std::sync::Arc;
use strandlight_scattering::closed_form::{PackedRecord, TERM_GLOBAL, TERM_LOCAL};
use strandlight_scattering::multiple_tables::{Job, MultipleTables};
use strandlight_scattering::wide::Peaks;
use strandlight_scene::beside::{Beside, Places};
use strandlight_scene::camera::{Camera, ViewUniform, view_uniform};
use strandlight_scene::paint::PaintedPoint;
use strandlight_scene::progress::timed;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::{NO_SLOT, ShadowPlan, THROUGH_SLOT};
use strandlight_scene::stats::{self, LIGHTING_SHARE, Observer};
use strandlight_scene::volume::{Grid, SELF_LIFT};
use strandlight_scene::{Picture, PreparedScene, Stats};

use super::arriving::Arriving;
use super::composite::composite;
use super::list::{Listing, Tile, VisibilityList};
use super::proxies::Proxies;
use super::shade::{Counts, PointShader, record_at};
use super::shade_wide::WideShader;
use super::transmittance::{mix, transmittance_beside};
use super::unblocked::{Casting, Unblocked, VisiblePoint};
use super::visible::VisiblePoints;
use super::voxelise::{grid_position, voxelise};

/// Visible points that are shaded at a time: an eighth of them, within this.
const SLICE: Range<usize> = 64..4096;

/// Shares at all points are kept if they have at most this many bytes.
const MAX_SHARE_BYTES: usize = 256 << 20;

/// What can change between two pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edit {
    /// Parameters and modes of the fibre.
    Hair,
    /// The terms that are drawn.
    Terms,
    /// d_f and d_b.
    Densities,
    /// Colours along the strands.
    Paint,
    /// What can be painted: the tables of painted hair.
    PaintKinds,
    /// Where strands are, and how wide.
    Points,
    /// Directions and widths of the lights.
    Lights,
    /// Their amplitudes.
    Colors,
    /// What stands beside the hair.
    Proxies,
    /// Camera and size of the picture.
    View,
    /// What is behind the hair.
    Background,
}

/// A part of the work for a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// The shadow volume.
    Voxelise,
    /// Records of the lights in the volume.
    Transmittance,
    /// What each pixel shows.
    List,
    /// Unblocked shares of the lights. They are found at visible points; from the second view on, and
    /// where there are drafts, at all, and then serve any.
    ShadowMaps,
    /// The share of the light through to the eye.
    ThroughMaps,
    /// Tables of multiple scattering.
    MultipleTables,
    /// Radiance of the visible points.
    Shade,
}

impl Stage {
    /// All of them, in order.
    pub const ALL: [Stage; 7] = [
        Stage::Voxelise,
        Stage::Transmittance,
        Stage::List,
        Stage::ShadowMaps,
        Stage::ThroughMaps,
        Stage::MultipleTables,
        Stage::Shade,
    ];

    /// The edits that make the stage stale, by way of the stages before it too.
    pub const fn inputs(self) -> &'static [Edit] {
        use Edit::{
            Colors, Densities, Hair, Lights, Paint, PaintKinds, Points, Proxies, Terms, View,
        };
        match self {
            Stage::Voxelise => &[Points],
            Stage::Transmittance => &[Points, Lights, Proxies],
            Stage::List => &[Points, Proxies, View],
            Stage::ShadowMaps | Stage::ThroughMaps => &[Points, Lights, Proxies, View],
            Stage::MultipleTables => &[Hair, Terms],
            Stage::Shade => &[
                Hair, Terms, Densities, Paint, PaintKinds, Points, Lights, Colors, Proxies, View,
            ],
        }
    }
}

/// The stages' results, as far as they are up to date, and the stage under way.
#[derive(Default)]
pub(super) struct Frame {
    size: [u32; 2],
    /// Has there been a picture?
    is_drawn: bool,
    /// And one from elsewhere?
    was_turned: bool,
    /// Amplitudes that maps are shared out by, so that a light that is off and on again, or tinted,
    /// keeps its maps; those of the scene where there are none.
    pub planned: Vec<[f32; 3]>,
    lights: Option<Lights>,
    are_lights_current: bool,
    volume: Option<(Grid, Vec<[f32; 8]>)>,
    listing: Option<Listing>,
    list: Option<(VisibilityList, VisiblePoints)>,
    records: Option<Records>,
    casting: Option<Casting>,
    unblocked: Option<Unblocked>,
    through_casting: Option<Casting>,
    through: Option<Unblocked>,
    /// That of the view before, for drafts.
    through_before: Option<Unblocked>,
    /// Are there points that tables serve? Unknown after an edit of the paint.
    needs_tables: Option<bool>,
    multiple: Option<MultipleTables>,
    arriving: Option<Arriving>,
    /// That of the view before, and its visible points.
    arriving_before: Option<(Arriving, Vec<u32>)>,
    /// Has it the shares of the shadow maps?
    has_shares: bool,
    shading: Option<Shading>,
    shaded: Option<Shaded>,
    /// Radiance before an edit of the paint.
    before_paint: Option<Painted>,
    /// Of the work since they were last taken.
    stats: Stats,
    version: u64,
}

/// The lights of a scene, and which maps they get.
struct Lights {
    plan: ShadowPlan,
    records: Vec<LightRecord>,
    sweeps: Vec<[f32; 4]>,
    is_lit: Vec<bool>,
    /// Those that are not black, narrow ones first.
    lit: Vec<u32>,
}

#[derive(Default)]
struct Records {
    /// `[light][voxel]`; none of lights that were black.
    packed: Vec<PackedRecord>,
    /// By light as far as it is done: was it not black?
    is_lit: Vec<bool>,
    /// Of the voxels.
    places: Places,
}

/// How far radiance is that of the complete picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quality {
    /// Shadows are those of the volume, or the light through to the eye is that of the view before.
    Draft,
    /// Points that hardly count have the radiance of others.
    Most,
    Whole,
}

/// Radiance that is being found.
struct Shading {
    /// What it will be.
    quality: Quality,
    /// Lights, ranges of [`Lights::lit`], that are shaded one after the other.
    groups: Vec<Range<usize>>,
    group: usize,
    /// Places of the points to shade, as in [`VisiblePoints::order`], and how many are the first.
    order: Vec<u32>,
    n_first: usize,
    /// Points done in the group.
    n_done: usize,
    /// By visible point: rgb times the view's radiance scale, and zero.
    radiance: Vec<[f32; 4]>,
    counts: Counts,
    /// Of drafts.
    peaks: Option<Peaks>,
}

/// Radiance with some paint.
struct Painted {
    radiance: Vec<[f32; 4]>,
    paint: Option<Arc<Vec<PaintedPoint>>>,
}

impl Shading {
    /// Keeps the radiance of the points whose paint is what it was.
    fn only_repainted(&mut self, before: Painted, paint: Option<&[PaintedPoint]>, visible: &[u32]) {
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
            self.radiance[*place as usize] = [0.0; 4];
        }
    }
}

struct Shaded {
    /// The paint that it is of.
    paint: Option<Arc<Vec<PaintedPoint>>>,
    quality: Quality,
    /// As in [`Shading`].
    radiance: Vec<[f32; 4]>,
    proxies: Proxies,
}

/// What all stages of a picture read.
struct Picturing<'a> {
    scene: &'a PreparedScene,
    view: ViewUniform,
    beside: Beside,
    /// Shows what can be had soon first.
    has_drafts: bool,
}

impl Frame {
    /// Nothing yet of `scene`, whose amplitudes share out the maps.
    pub fn of(scene: &PreparedScene) -> Frame {
        Frame {
            planned: scene.lights.iter().map(|light| light.rgb).collect(),
            ..Frame::default()
        }
    }

    /// Forgets what `edit` makes stale.
    pub fn edited(&mut self, edit: Edit) {
        let are_kept = edit == Edit::View && self.has_maps_of_any_view();
        if edit == Edit::View {
            self.keep_for_next_view(are_kept);
        } else if Stage::ShadowMaps.inputs().contains(&edit) {
            (self.through_before, self.arriving_before) = (None, None);
        }
        if edit == Edit::Paint {
            let whole = self
                .shaded
                .take_if(|shaded| shaded.quality == Quality::Whole);
            if let Some(Shaded {
                radiance, paint, ..
            }) = whole
            {
                self.before_paint = Some(Painted { radiance, paint });
            }
        } else if Stage::Shade.inputs().contains(&edit) {
            self.before_paint = None;
        }
        for stage in Stage::ALL {
            let is_stale = stage.inputs().contains(&edit);
            if is_stale && !(are_kept && stage == Stage::ShadowMaps) {
                self.forget(stage);
            }
        }
        if matches!(
            edit,
            Edit::Points | Edit::Lights | Edit::Colors | Edit::Proxies
        ) {
            self.are_lights_current = false;
        }
        if edit == Edit::Background {
            self.version += 1;
        }
        if matches!(edit, Edit::Paint | Edit::PaintKinds) {
            self.needs_tables = None;
        }
        self.was_turned |= edit == Edit::View && self.is_drawn;
    }

    /// Are the maps, or those under way, looked up at all points?
    fn has_maps_of_any_view(&self) -> bool {
        let maps = match (&self.unblocked, &self.casting) {
            (Some(unblocked), _) => Some(unblocked),
            (None, Some(casting)) => Some(casting.found()),
            (None, None) => None,
        };
        maps.is_some_and(Unblocked::is_everywhere)
    }

    /// Keeps what the next view can use, shadow maps too if they `are_kept`.
    fn keep_for_next_view(&mut self, are_kept: bool) {
        if self.through.as_ref().is_some_and(Unblocked::is_everywhere) {
            self.through_before = self.through.take();
        }
        // Shares of other maps would stay beside those of the volume.
        if are_kept || !self.has_shares {
            if let (Some(arriving), Some((_, visible))) = (self.arriving.take(), self.list.take()) {
                let is_filled = arriving.is_filled();
                self.arriving_before = is_filled.then_some((arriving, visible.points));
            }
        } else {
            self.arriving_before = None;
        }
    }

    fn forget(&mut self, stage: Stage) {
        match stage {
            Stage::Voxelise => self.volume = None,
            Stage::Transmittance => {
                (self.records, self.arriving, self.arriving_before) = (None, None, None);
            }
            Stage::List => (self.listing, self.list, self.arriving) = (None, None, None),
            Stage::ShadowMaps => {
                (self.casting, self.unblocked, self.arriving) = (None, None, None);
            }
            Stage::ThroughMaps => (self.through_casting, self.through) = (None, None),
            Stage::MultipleTables => self.multiple = None,
            Stage::Shade => (self.shading, self.shaded) = (None, None),
        }
    }

    /// Draws `scene` as `camera` sees it, which is the camera of the last picture unless
    /// [`Edit::View`] said otherwise.
    pub fn draw(
        &mut self,
        scene: &PreparedScene,
        camera: &Camera,
        size: [u32; 2],
        observer: Observer,
    ) -> (Picture, Stats) {
        let picturing = self.picturing(scene, camera, size, false);
        while self.step(&picturing) {
            observer(self.share_done());
        }
        observer(LIGHTING_SHARE);
        let (rgba, seconds) = timed(|| self.composite(&picturing));
        let bytes = size_of_val(&rgba[..]) as u64;
        self.ran("composite", seconds, bytes);
        let [width, height] = size;
        let picture = Picture {
            width,
            height,
            rgba,
        };
        (picture, self.take_stats())
    }

    /// Works on the same picture while there `is_time`, a step at least, and answers whether it is
    /// complete. [`Frame::version`] tells when there is another to show: at first a draft of every light
    /// and term, at most of the points; without shadow maps where those are not there yet.
    pub fn advance(
        &mut self,
        scene: &PreparedScene,
        camera: &Camera,
        size: [u32; 2],
        mut is_time: impl FnMut() -> bool,
    ) -> bool {
        let picturing = self.picturing(scene, camera, size, true);
        let version = self.version;
        while self.step(&picturing) {
            // What is new is shown before there is more.
            if !is_time() || self.version != version {
                return false;
            }
        }
        true
    }

    /// Another number, another picture.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Is there a picture of the scene as it was last set, if a draft?
    pub fn has_picture(&self) -> bool {
        self.shaded.is_some()
    }

    /// Has it all light?
    pub fn has_all_light(&self) -> bool {
        self.quality()
            .is_some_and(|quality| quality != Quality::Draft)
    }

    /// What the work took since it was last asked.
    pub fn take_stats(&mut self) -> Stats {
        std::mem::take(&mut self.stats)
    }

    /// The last picture of the scene as it was last drawn, linear radiance and coverage, row by row, if there
    /// is one.
    pub fn shown(
        &self,
        scene: &PreparedScene,
        camera: &Camera,
        size: [u32; 2],
    ) -> Option<Vec<[f32; 4]>> {
        let is_there = self.shaded.is_some() && self.list.is_some() && self.size == size;
        is_there.then(|| {
            self.composite(&Picturing {
                scene,
                view: view_uniform(camera, &scene.strands, size, scene.radiance_scale()),
                beside: scene.beside(),
                has_drafts: true,
            })
        })
    }

    fn picturing<'a>(
        &mut self,
        scene: &'a PreparedScene,
        camera: &Camera,
        size: [u32; 2],
        has_drafts: bool,
    ) -> Picturing<'a> {
        if self.size != size {
            self.size = size;
            self.edited(Edit::View);
        }
        Picturing {
            scene,
            view: view_uniform(camera, &scene.strands, size, scene.radiance_scale()),
            beside: scene.beside(),
            has_drafts,
        }
    }

    /// The stage that is to be run next.
    fn next(&self, picturing: &Picturing) -> Option<Stage> {
        let has_maps = self.unblocked.is_some() && self.through.is_some();
        let has_none = self
            .lights
            .as_ref()
            .is_some_and(|lights| lights.plan.views.is_empty());
        let has_draft = self.shaded.is_some() || !picturing.has_drafts || has_none;
        let maps = match &self.unblocked {
            None => Stage::ShadowMaps,
            Some(_) => Stage::ThroughMaps,
        };
        if self.volume.is_none() {
            Some(Stage::Voxelise)
        } else if self.list.is_none() {
            Some(Stage::List)
        } else if !has_maps && has_draft {
            Some(maps)
        } else if !self.has_records() {
            Some(Stage::Transmittance)
        } else if self.multiple.is_none() && self.needs_tables == Some(true) {
            Some(Stage::MultipleTables)
        } else if self.quality() != Some(Quality::Whole) {
            Some(Stage::Shade)
        } else {
            None
        }
    }

    fn quality(&self) -> Option<Quality> {
        self.shaded.as_ref().map(|shaded| shaded.quality)
    }

    /// Works a little on what is to be done next; answers whether there was anything.
    fn step(&mut self, picturing: &Picturing) -> bool {
        let scene = picturing.scene;
        if self.stats.device.is_none() && self.stats.stages.is_empty() {
            let threads = rayon::current_num_threads();
            self.stats = scene.counts(format!("cpu: {threads} threads"));
        }
        self.prepare_lights(scene);
        self.needs_tables.get_or_insert_with(|| needs_tables(scene));
        let Some(stage) = self.next(picturing) else {
            self.is_drawn = true;
            return false;
        };
        match stage {
            Stage::Voxelise => self.voxelise(scene),
            Stage::List => self.list(picturing),
            Stage::ShadowMaps => self.cast(picturing),
            Stage::ThroughMaps => self.cast_through(picturing),
            Stage::Transmittance => self.transmit(picturing),
            Stage::MultipleTables => self.fill_tables(scene),
            Stage::Shade => self.shade(picturing),
        }
        true
    }
}

/// The stages.
impl Frame {
    /// Finds the lights and their maps after an edit of them.
    fn prepare_lights(&mut self, scene: &PreparedScene) {
        if self.are_lights_current {
            return;
        }
        self.are_lights_current = true;
        let now = scene.shadow_plan();
        let mut lights = scene.lights.clone();
        for (light, rgb) in lights.iter_mut().zip(&self.planned) {
            light.rgb = *rgb;
        }
        let mut plan = ShadowPlan::new(&lights, &scene.strands, scene.shadow_maps);
        if scene.reference_amplitudes.is_some() || !serves(&plan, &now) {
            plan = now;
        }
        let before = self.lights.take();
        if before.is_none_or(|before| before.plan != plan) {
            self.forget(Stage::ShadowMaps);
            self.forget(Stage::ThroughMaps);
            (self.through_before, self.arriving_before) = (None, None);
        }
        let (records, sweeps) = scene.records_with(&plan);
        let is_lit: Vec<bool> = records.iter().map(|light| light.power > 0.0).collect();
        // Narrow lights first, so that the lanes of a vector ask for as many nodes.
        let mut lit: Vec<u32> = (0..)
            .zip(&is_lit)
            .filter_map(|(ix, is)| is.then_some(ix))
            .collect();
        lit.sort_by(|&a, &b| {
            let lambda = |ix: u32| records[ix as usize].lambda;
            lambda(a).total_cmp(&lambda(b))
        });
        if let Some(before) = &self.records {
            let mut pairs = before.is_lit.iter().zip(&is_lit);
            if !pairs.all(|(before, now)| *before || !now) {
                self.forget(Stage::Transmittance);
            }
        }
        self.lights = Some(Lights {
            plan,
            records,
            sweeps,
            is_lit,
            lit,
        });
    }

    fn voxelise(&mut self, scene: &PreparedScene) {
        let grid = Grid::around(&scene.strands);
        let (volume, seconds) = timed(|| voxelise(&scene.strands, &grid));
        self.ran("voxelise", seconds, size_of_val(&volume[..]) as u64);
        self.volume = Some((grid, volume));
    }

    fn list(&mut self, picturing: &Picturing) {
        let Picturing {
            scene,
            view,
            beside,
            ..
        } = picturing;
        let strands = &scene.strands;
        let mut listing = self.listing.take();
        let (found, seconds) = timed(|| {
            let Some(listing) = &mut listing else {
                listing = Some(Listing::new(view, strands));
                return None;
            };
            listing.step(view, beside).then(|| {
                let mut list = listing.finish();
                let visible = VisiblePoints::number(&mut list, strands);
                (list, visible)
            })
        });
        let mut bytes = 0;
        match found {
            None => self.listing = listing,
            Some((list, visible)) => {
                bytes = list.bytes() + size_of_val(&visible.points[..]) as u64;
                self.stats.pixels_visited = list.counts[0];
                self.list = Some((list, visible));
            }
        }
        self.ran("list", seconds, bytes);
    }

    fn cast(&mut self, picturing: &Picturing) {
        let (Some(lights), Some((_, visible))) = (&self.lights, &self.list) else {
            return;
        };
        let strands = &picturing.scene.strands;
        let plan = &lights.plan;
        let mut casting = self.casting.take();
        let (is_done, seconds) = timed(|| {
            let casting = casting.get_or_insert_with(|| {
                let bytes = Unblocked::bytes_of(plan.n_slots, strands.points.len());
                // Where there are drafts, other views are to come.
                let is_turned = self.was_turned || picturing.has_drafts;
                let is_everywhere = is_turned && bytes <= MAX_SHARE_BYTES;
                let visible = (!is_everywhere).then_some(&visible.points[..]);
                Casting::new(plan.n_slots, plan.views.clone(), strands, visible)
            });
            casting.step(&picturing.beside)
        });
        let mut bytes = 0;
        match casting {
            Some(casting) if is_done => {
                let unblocked = casting.finish();
                bytes = unblocked.bytes();
                self.stats.texels_visited += unblocked.n_texels;
                self.unblocked = Some(unblocked);
                self.has_shares = false;
            }
            unfinished => self.casting = unfinished,
        }
        self.ran("shadow maps", seconds, bytes);
    }

    fn cast_through(&mut self, picturing: &Picturing) {
        let (Some(lights), Some((_, visible))) = (&self.lights, &self.list) else {
            return;
        };
        let is_everywhere = self
            .unblocked
            .as_ref()
            .is_some_and(Unblocked::is_everywhere);
        let mut casting = self.through_casting.take();
        let (is_done, seconds) = timed(|| {
            let casting = casting.get_or_insert_with(|| {
                let views = lights.plan.through(picturing.view.forward);
                let n_slots = u32::from(!views.is_empty());
                // At all points they serve the drafts of other views.
                let visible = (!is_everywhere).then_some(&visible.points[..]);
                Casting::new(n_slots, views, &picturing.scene.strands, visible)
            });
            casting.step(&picturing.beside)
        });
        let mut bytes = 0;
        match casting {
            Some(casting) if is_done => {
                let through = casting.finish();
                bytes = through.bytes();
                self.stats.texels_visited += through.n_texels;
                self.through = Some(through);
                self.through_before = None;
            }
            unfinished => self.through_casting = unfinished,
        }
        self.ran("through maps", seconds, bytes);
    }

    /// Are there records of all lights?
    fn has_records(&self) -> bool {
        let n = self.lights.as_ref().map(|lights| lights.records.len());
        self.records.as_ref().map(|records| records.is_lit.len()) == n
    }

    fn transmit(&mut self, picturing: &Picturing) {
        let (Some(lights), Some((grid, volume))) = (&self.lights, &self.volume) else {
            return;
        };
        let records = self.records.get_or_insert_with(|| Records {
            packed: Vec::with_capacity(grid.n_voxels() * lights.records.len()),
            is_lit: Vec::new(),
            places: picturing.beside.places_of_voxels(grid),
        });
        let first = records.is_lit.len();
        // The black ones are no work.
        let mut n = 0;
        let is_last = |is_lit: &bool| {
            n += usize::from(*is_lit);
            n == 2 * rayon::current_num_threads()
        };
        let range = match lights.is_lit[first..].iter().position(is_last) {
            Some(last) => first..first + last + 1,
            None => first..lights.is_lit.len(),
        };
        let ((), seconds) = timed(|| {
            let of_range = &lights.records[range.clone()];
            let beside = (&picturing.beside, &records.places);
            let found = transmittance_beside(grid, volume, of_range, &lights.sweeps, beside);
            records.packed.extend(found);
            records.is_lit.extend(&lights.is_lit[range.clone()]);
        });
        let is_last = range.end == lights.is_lit.len();
        let bytes = if is_last {
            size_of_val(&records.packed[..]) as u64
        } else {
            0
        };
        self.ran("transmittance", seconds, bytes);
    }

    fn fill_tables(&mut self, scene: &PreparedScene) {
        let (tables, seconds) = timed(|| multiple_tables(scene));
        self.ran("tables", seconds, tables.bytes() as u64);
        self.multiple = Some(tables);
    }

    fn shade(&mut self, picturing: &Picturing) {
        let ((), seconds) = timed(|| self.shade_some(picturing));
        let bytes = self
            .shaded
            .as_ref()
            .map_or(0, |shaded| size_of_val(&shaded.radiance[..]) as u64);
        self.ran("shade", seconds, bytes);
    }

    fn shade_some(&mut self, picturing: &Picturing) {
        let scene = picturing.scene;
        let (Some(lights), Some((_, visible)), Some((grid, _)), Some(records)) =
            (&self.lights, &self.list, &self.volume, &self.records)
        else {
            return;
        };
        let quality = match self.unblocked.is_some() && self.through.is_some() {
            true => Quality::Whole,
            false => Quality::Draft,
        };
        if self
            .shading
            .as_ref()
            .is_some_and(|shading| shading.quality != quality)
        {
            self.shading = None;
        }
        let tables = self
            .multiple
            .as_ref()
            .filter(|tables| self.needs_tables == Some(true) && serve(tables, scene));
        let n_places = visible.points.len();
        let shading = self.shading.get_or_insert_with(|| {
            let mut shading = Shading {
                quality,
                groups: match tables {
                    Some(_) => Arriving::groups(&lights.lit, n_places),
                    // Nothing is kept.
                    None => std::iter::once(0..lights.lit.len()).collect(),
                },
                group: 0,
                order: visible.order.clone(),
                n_first: visible.n_first,
                n_done: 0,
                radiance: vec![[0.0; 4]; n_places],
                counts: Counts::default(),
                peaks: (quality == Quality::Draft).then(|| {
                    let optics = scene.hair.optics();
                    Peaks::of(&optics.shading(scene.tables.view()))
                }),
            };
            if let Some(before) = self.before_paint.take() {
                shading.only_repainted(before, scene.paint(), &visible.points);
            }
            shading
        });
        let Some(group) = shading.groups.get(shading.group).cloned() else {
            // There is no light.
            self.finish_shading(picturing);
            return;
        };
        let of_group = &lights.lit[group];
        let through = self.through.as_ref().or(self.through_before.as_ref());
        let through = through.filter(|through| !through.is_empty());
        let is_first_picture = self.shaded.is_none();
        let places = &shading.order[shading.n_done..];
        let slice = n_places.div_ceil(8).clamp(SLICE.start, SLICE.end);
        let places = &places[..places.len().min(slice)];
        let paint = scene.paint();
        let is_plain = |place: &u32| {
            let point = visible.points[*place as usize] as usize;
            paint.is_none_or(|paint| !paint[point].is_painted())
        };
        let (plain, painted): (Vec<u32>, Vec<u32>) = match tables {
            Some(_) => places.iter().partition(|place| is_plain(place)),
            None => (Vec::new(), places.to_vec()),
        };
        let mut found = Vec::with_capacity(2);
        if let Some(tables) = tables.filter(|_| !plain.is_empty()) {
            let n_groups = shading.groups.len();
            let serves = |arriving: &Arriving| match n_groups {
                1 => of_group.iter().all(|ix| arriving.lights.contains(ix)),
                _ => arriving.lights == of_group,
            };
            if !self.arriving.as_ref().is_some_and(serves) {
                let before = self
                    .arriving_before
                    .take()
                    .filter(|(before, _)| serves(before));
                self.arriving = Some(match before {
                    Some((before, points)) => before.of_view(&points, &visible.points),
                    None => Arriving::new(of_group, n_places),
                });
            }
            let Some(arriving) = &mut self.arriving else {
                return;
            };
            if !arriving.is_filled() {
                let from = (&lights.records[..], &records.packed[..]);
                arriving.fill(scene, grid, from, &visible.points);
                self.has_shares = false;
                return;
            }
            if let Some(unblocked) = self.unblocked.as_ref().filter(|_| !self.has_shares) {
                arriving.take_shares(&lights.records, unblocked, &visible.points);
                self.has_shares = true;
            }
            let arriving = (&*arriving, &lights.records[..]);
            let view = &picturing.view;
            let shader = WideShader::new(scene, view, tables, arriving, through, shading.peaks);
            found.push((shader.shade(&plain, &visible.points), plain));
        }
        // These do all lights at once.
        if !painted.is_empty() && shading.group == 0 {
            let lit = Lit {
                scene,
                view: &picturing.view,
                grid,
                lights: &lights.records,
                records: &records.packed,
                unblocked: self.unblocked.as_ref(),
                through,
            };
            found.push((lit.shade(&painted, &visible.points), painted));
        }
        shading.n_done += places.len();
        for ((radiance, counts), places) in found {
            for (&place, radiance) in places.iter().zip(radiance) {
                let sum = &mut shading.radiance[place as usize];
                for (sum, value) in sum.iter_mut().zip(radiance) {
                    *sum += value;
                }
            }
            shading.counts = shading.counts.and(counts);
        }
        let is_last = shading.group + 1 == shading.groups.len();
        let is_first_done = shading.n_done >= shading.n_first;
        if shading.n_done == shading.order.len() || quality == Quality::Draft && is_first_done {
            shading.group += 1;
            shading.n_done = 0;
            if is_last {
                self.finish_shading(picturing);
            }
        } else if is_last && is_first_done && picturing.has_drafts && is_first_picture {
            let radiance = shading.radiance.clone();
            self.show(picturing, Quality::Most, radiance);
        }
    }

    fn finish_shading(&mut self, picturing: &Picturing) {
        if let Some(shading) = self.shading.take() {
            self.stats.set_terms(&shading.counts.terms);
            self.show(picturing, shading.quality, shading.radiance);
        }
    }

    fn show(&mut self, picturing: &Picturing, quality: Quality, mut radiance: Vec<[f32; 4]>) {
        let (Some(lights), Some((list, visible)), Some((grid, _)), Some(records)) =
            (&self.lights, &self.list, &self.volume, &self.records)
        else {
            return;
        };
        if quality != Quality::Whole {
            visible.fill(&mut radiance);
        }
        let n_points = picturing.scene.strands.points.len();
        self.stats.list_entries = list.n_entries() as u64;
        self.stats.visible_points = visible.points.len() as u64;
        self.stats.points_skipped = (n_points - visible.points.len()) as u64;
        // What proxies send back is the same for all qualities.
        let before = self.shaded.take();
        let proxies = before.map_or_else(
            || {
                let mut proxies = Proxies::new(picturing.scene);
                if !proxies.is_empty() {
                    let Picturing { view, .. } = picturing;
                    proxies.light(
                        view,
                        grid,
                        &lights.records,
                        &lights.sweeps,
                        &records.packed,
                        &records.places,
                    );
                }
                proxies
            },
            |shaded| shaded.proxies,
        );
        self.shaded = Some(Shaded {
            paint: picturing.scene.shared_paint().cloned(),
            quality,
            radiance,
            proxies,
        });
        self.version += 1;
    }

    fn composite(&self, picturing: &Picturing) -> Vec<[f32; 4]> {
        let [width, height] = self.size;
        let mut rgba = vec![[0.0; 4]; (width * height) as usize];
        if let (Some((list, _)), Some(shaded)) = (&self.list, &self.shaded) {
            resolve(list, shaded, self.size, &mut rgba);
        }
        composite(picturing.scene, &picturing.view, 1, &mut rgba);
        rgba
    }

    /// Notes what a part of a stage took.
    fn ran(&mut self, name: &'static str, seconds: f64, bytes: u64) {
        let stages = &mut self.stats.stages;
        match stages.iter_mut().find(|stage| stage.name == name) {
            Some(stage) => {
                stage.milliseconds += 1e3 * seconds;
                stage.bytes = stage.bytes.max(bytes);
            }
            None => stages.push(stats::Stage {
                name,
                milliseconds: 1e3 * seconds,
                bytes,
                runs: 1,
                gpu_milliseconds: None,
            }),
        }
    }

    /// About how much of the work is done, 0..1 of the light.
    fn share_done(&self) -> f64 {
        let list = f64::from(u8::from(self.list.is_some()));
        let maps = match &self.casting {
            Some(casting) => casting.share_done(),
            None => f64::from(u8::from(self.unblocked.is_some())),
        };
        let shade = self.shading.as_ref().map_or(0.0, |shading| {
            let n = shading.radiance.len() * shading.groups.len().max(1);
            let n_done = shading.radiance.len() * shading.group + shading.n_done;
            n_done as f64 / n.max(1) as f64
        });
        LIGHTING_SHARE * (0.1 * list + 0.6 * maps + 0.3 * shade)
    }
}

/// Has `plan` maps of all lights that have some by the plan `now`? Amplitudes share out the maps, but
/// those of other amplitudes are as right.
fn serves(plan: &ShadowPlan, now: &ShadowPlan) -> bool {
    let mut pairs = plan.slots.iter().zip(&now.slots);
    plan.slots.len() == now.slots.len()
        && pairs.all(|(slot, now)| *slot != NO_SLOT || *now == NO_SLOT)
}

/// Are there points of the fibre that tables are of? Painted points have fibres of their own. Nor are
/// there tables where pictures of single modes must add up to that of all, which those of their tables do
/// to 0.1 %.
fn needs_tables(scene: &PreparedScene) -> bool {
    let has_plain = match scene.paint() {
        Some(paint) => paint.iter().any(|point| !point.is_painted()),
        None => true,
    };
    has_plain && scene.reference_amplitudes.is_none()
}

/// Tables of multiple scattering of the fibre, for the terms that are drawn.
fn multiple_tables(scene: &PreparedScene) -> MultipleTables {
    let shading = scene.hair.optics().shading(scene.tables.view());
    MultipleTables::new(&shading, scene.hair.averages(), scene.terms(), |jobs| {
        jobs.into_par_iter().for_each(Job::run);
    })
}

/// Do the tables have all terms of multiple scattering that are drawn?
fn serve(tables: &MultipleTables, scene: &PreparedScene) -> bool {
    scene.terms() & (TERM_GLOBAL | TERM_LOCAL) & !tables.terms() == 0
}

/// What shades visible points that have fibres of their own, and elliptic ones.
struct Lit<'a> {
    scene: &'a PreparedScene,
    view: &'a ViewUniform,
    grid: &'a Grid,
    lights: &'a [LightRecord],
    records: &'a [PackedRecord],
    unblocked: Option<&'a Unblocked>,
    through: Option<&'a Unblocked>,
}

impl Lit<'_> {
    /// Radiance of some visible points.
    fn shade(&self, places: &[u32], visible: &[u32]) -> (Vec<[f32; 4]>, Counts) {
        let shader = PointShader::new(self.scene, self.view);
        let n_voxels = self.grid.n_voxels();
        let lift = SELF_LIFT * self.grid.h;
        let mut radiance = vec![[0.0; 4]; places.len()];
        let counts = radiance
            .par_iter_mut()
            .zip(places)
            .with_min_len(16)
            .map(|(radiance, &place)| {
                let at = VisiblePoint {
                    place: place as usize,
                    point: visible[place as usize] as usize,
                };
                let position = Vec3::from_slice(&self.scene.strands.points[at.point]);
                let arriving = |ix: usize, light: &LightRecord| {
                    let lifted = position + Vec3::from(light.direction) * lift;
                    let g = grid_position(self.grid, lifted);
                    let record = record_at(self.grid, &self.records[ix * n_voxels..], g);
                    let (mut unblocked, mut unblocked_tt) = (record.shares[0], record.shares[0]);
                    let slot = light.shadow_index;
                    if let Some(maps) = self.unblocked.filter(|_| slot != NO_SLOT) {
                        unblocked = maps.share(slot, at);
                        unblocked_tt = unblocked;
                        if let Some(through) = self.through {
                            let through = through.share(THROUGH_SLOT, at);
                            unblocked_tt = mix(unblocked, through, light.forward_weight);
                        }
                    }
                    (record, unblocked, unblocked_tt)
                };
                shader.shade(at.point, self.lights, arriving, radiance)
            })
            .reduce(Counts::default, Counts::and);
        (radiance, counts)
    }
}

/// Adds up what each pixel shows: rgb times the view's radiance scale, and coverage.
fn resolve(list: &VisibilityList, shaded: &Shaded, size: [u32; 2], rgba: &mut [[f32; 4]]) {
    // A row of tiles is a band of the picture.
    let across = list
        .tiles
        .iter()
        .take_while(|tile| tile.origin[1] == 0)
        .count();
    let rows = list.tiles.chunks(across.max(1));
    let mut bands = Vec::new();
    let mut rest = rgba;
    for tiles in rows {
        let height = tiles[0].size[1];
        let (band, after) = rest.split_at_mut((size[0] * height) as usize);
        bands.push((tiles, band));
        rest = after;
    }
    bands.into_par_iter().for_each(|(tiles, band)| {
        for tile in tiles {
            resolve_tile(tile, shaded, size[0], band);
        }
    });
}

fn resolve_tile(tile: &Tile, shaded: &Shaded, width: u32, band: &mut [[f32; 4]]) {
    let place = |pixel: usize| {
        let [x, y] = [pixel as u32 % tile.size[0], pixel as u32 / tile.size[0]];
        (tile.origin[0] + x + width * y) as usize
    };
    for (pixel, range) in tile.starts.windows(2).enumerate() {
        let mut sum = [0.0; 4];
        for entry in &tile.entries[range[0] as usize..range[1] as usize] {
            let first = entry.first as usize;
            let (a, b) = (&shaded.radiance[first], &shaded.radiance[first + 1]);
            let t = entry.t();
            for (channel, sum) in sum.iter_mut().enumerate().take(3) {
                *sum += entry.weight * mix(a[channel], b[channel], t);
            }
            sum[3] += entry.weight;
        }
        band[place(pixel)] = sum;
    }
    for entry in &tile.proxies {
        let sent_back = shaded
            .proxies
            .sent_back(entry.surface, Vec3::from(entry.position));
        let sum = &mut band[place(entry.pixel as usize)];
        for (channel, value) in sent_back.into_iter().enumerate() {
            sum[channel] += entry.weight * value;
        }
        sum[3] += entry.weight;
    }
}
