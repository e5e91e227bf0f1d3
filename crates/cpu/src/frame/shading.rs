//! Radiance of the visible points.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::WidthProfile;
use strandlight_scattering::closed_form::{PackedRecord, TERM_GLOBAL, TERM_LOCAL};
use strandlight_scattering::multiple_tables::MultipleTables;
use strandlight_scattering::wide::{Level, Peaks, dispatch};
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::progress::timed;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::NO_SLOT;
use strandlight_scene::volume::{Grid, SELF_LIFT};

use super::super::arriving::Arriving;
use super::super::bounce::BounceLight;
use super::super::proxies::Proxies;
use super::super::radiance::Radiance;
use super::super::shade::{Counts, PointShader, record_at};
use super::super::shade_wide::WideShader;
use super::super::through_shares::{Maps, Scratch, ThroughShares};
use super::super::unblocked::VisiblePoint;
use super::super::voxelise::grid_position;
use super::kept::Kept;
use super::parts::{Bounced, Quality, Shaded, Shading};
use super::state::{Frame, Picturing};

/// Visible points that are shaded at a time: an eighth of them, within this.
const SLICE: Range<usize> = 64..4096;

/// Visible points that shares of shadow maps are taken at, at a time: some 10 ms on two cores.
const SHARES_AT_ONCE: usize = 1 << 13;

impl Frame {
    pub(super) fn shade(&mut self, picturing: &Picturing) {
        let ((), seconds) = timed(|| self.shade_some(picturing));
        let bytes = self
            .shaded
            .as_ref()
            .map_or(0, |shaded| shaded.radiance.bytes());
        self.ran("shade", seconds, bytes);
    }

    fn shade_some(&mut self, picturing: &Picturing) {
        let scene = picturing.scene;
        let is_shaded = self.has_shaded();
        let (Some(lights), Some((list, visible)), Some((grid, _)), Some(records)) =
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
        if tables.is_none() || scene.paint().is_some() {
            self.kept = None;
        }
        if quality == Quality::Whole && picturing.has_drafts && !self.has_shaded() {
            let kept = self.kept.as_ref();
            let kept = kept.filter(|kept| kept.serves(&lights.records));
            if let (Some(kept), Some(maps)) = (kept, &self.unblocked) {
                let scale = picturing.view.radiance_scale;
                let seen = (&*scene.strands, &visible.points[..]);
                let mut radiance = kept.radiance(&lights.records, seen, maps, scale);
                if let Some(bounced) = &self.bounced {
                    let lit = self.lit_proxies(picturing);
                    radiance.add_at(&recolored(bounced, lit.as_ref()));
                    self.proxies = lit;
                }
                self.show(picturing, Quality::Recolored, radiance);
                return;
            }
        }
        if self.bounce.is_none() && scene.has_bounce() {
            // It was put off for what was kept, which does not serve.
            self.kept = None;
            return;
        }
        if list.has_wide && self.profile.is_none() {
            self.profile = scene.width_profile(&picturing.view, None);
        }
        let profile = self.profile.as_ref().filter(|_| list.has_wide);
        let through = self.through.as_ref().or(self.through_before.as_ref());
        let maps = match (&self.unblocked, through) {
            (Some(of_lights), Some(through)) if lights.plan.n_slots > 0 => Some(Maps {
                plan: &lights.plan,
                of_lights,
                through,
            }),
            _ => None,
        };
        let has_narrow = maps.is_some() && lights.records.iter().any(LightRecord::is_narrow);
        let shading = self.shading.get_or_insert_with(|| {
            let radiance = Radiance::black(n_places, has_narrow);
            let has_before = (self.before.as_ref()).is_some_and(|before| before.is_like(&radiance));
            let mut shading = Shading {
                quality,
                groups: match tables {
                    Some(_) => Arriving::groups(&lights.lit, n_places),
                    // Nothing is kept.
                    None => std::iter::once(0..lights.lit.len()).collect(),
                },
                group: 0,
                order: visible.order.clone(),
                // Shares of the volume change slowly along strands.
                n_first: match has_before || self.unblocked.is_none() {
                    true => visible.n_thinned,
                    false => visible.n_first,
                },
                n_done: 0,
                radiance,
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
        let has_narrow = !shading.radiance.along.is_empty();
        let is_first_picture = !is_shaded;
        let places = &shading.order[shading.n_done..];
        let slice = n_places.div_ceil(8).clamp(SLICE.start, SLICE.end);
        let n_left = match shading.n_first - shading.n_done.min(shading.n_first) {
            0 => places.len(),
            n_left => n_left,
        };
        let places = &places[..n_left.min(slice)];
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
                self.n_shares = 0;
                return;
            }
            if let Some(maps) = maps.filter(|_| self.n_shares < n_places) {
                let end = (self.n_shares + SHARES_AT_ONCE).min(n_places);
                let maps = (&lights.records[..], maps);
                let places = self.n_shares..end;
                arriving.take_shares(scene, picturing.view.eye, maps, &visible.points, places);
                self.n_shares = end;
                if end < n_places {
                    return;
                }
            }
            let is_kept = picturing.has_drafts
                && quality == Quality::Whole
                && n_groups == 1
                && paint.is_none()
                && shading.order.len() == n_places;
            if !is_kept {
                self.kept = None;
            } else if !self
                .kept
                .as_ref()
                .is_some_and(|kept| kept.is_of(&arriving.lights, &lights.records, n_places))
            {
                self.kept = Kept::new(&arriving.lights, &lights.records, n_places);
            }
            let of_lights = (&*arriving, &lights.records[..]);
            let view = &picturing.view;
            let maps = maps.filter(|_| has_narrow).map(|maps| maps.of_lights);
            let seen = (view, profile);
            let shader = WideShader::new(scene, seen, tables, of_lights, maps, shading.peaks);
            let bounce = self.bounce.as_ref().filter(|_| shading.group == 0);
            if let Some(bounce) = bounce {
                let bounced = self.bounced.take_if(|bounced| bounced.is_current);
                let bounced = self.bounced.insert(bounced.unwrap_or_else(|| Bounced {
                    at: vec![[0.0; 4]; n_places],
                    n_done: 0,
                    sent_back: self.proxies.as_ref().map_or([0.0; 3], Proxies::total),
                    is_current: true,
                }));
                let missing = &visible.of_bounce[bounced.n_done..];
                let missing = &missing[..missing.len().min(slice)];
                if !missing.is_empty() {
                    let found = shader.shade_bounce(bounce, missing, &visible.points);
                    for (&place, found) in missing.iter().zip(found) {
                        bounced.at[place as usize] = found;
                    }
                    bounced.n_done += missing.len();
                    if bounced.n_done == visible.of_bounce.len() {
                        visible.spread_bounce(&mut bounced.at);
                    }
                    return;
                }
            }
            let mut shaded = shader.shade(&plain, &visible.points, self.kept.is_some());
            if let (Some(_), Some(bounced)) = (bounce, &self.bounced) {
                let of_plain = plain.iter().map(|place| bounced.at[*place as usize]);
                shaded.radiance.add_at(&of_plain.collect::<Vec<_>>());
            }
            if let Some(kept) = &mut self.kept {
                kept.take(&lights.records, &plain, &shaded.kept);
            }
            found.push((shaded.radiance, shaded.counts, plain));
        }
        // These do all lights at once.
        if !painted.is_empty() && shading.group == 0 {
            let lit = Lit {
                scene,
                view: &picturing.view,
                grid,
                lights: &lights.records,
                records: &records.packed,
                maps,
                profile,
            };
            let (mut radiance, counts) = lit.shade(&painted, &visible.points, has_narrow);
            if let Some(bounce) = &self.bounce {
                radiance.add_at(&lit.shade_bounce(bounce, &painted, &visible.points));
            }
            found.push((radiance, counts, painted));
        }
        shading.n_done += places.len();
        for (radiance, counts, places) in found {
            shading.radiance.add(&places, &radiance);
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
            let mut radiance = shading.radiance.clone();
            let before = self.before.as_ref();
            let before = before.filter(|before| before.is_like(&radiance));
            visible.fill(&mut radiance, shading.n_done, before);
            self.show(picturing, Quality::Most, radiance);
        }
    }

    fn finish_shading(&mut self, picturing: &Picturing) {
        if let Some(mut shading) = self.shading.take() {
            if let (Quality::Draft, Some((_, visible))) = (shading.quality, &self.list) {
                let before = self.before.as_ref();
                let before = before.filter(|before| before.is_like(&shading.radiance));
                visible.fill(&mut shading.radiance, shading.n_first, before);
            }
            self.stats.set_terms(&shading.counts.terms);
            let is_whole = shading.quality == Quality::Whole;
            if is_whole {
                self.before = None;
            }
            if let (Some(kept), Some(lights), true) = (&mut self.kept, &self.lights, is_whole) {
                kept.is_taken(&lights.records);
            }
            self.show(picturing, shading.quality, shading.radiance);
        }
    }

    pub(super) fn show(&mut self, picturing: &Picturing, quality: Quality, radiance: Radiance) {
        let Some((list, visible)) = &self.list else {
            return;
        };
        let n_points = picturing.scene.strands.points.len();
        self.stats.list_entries = list.n_entries() as u64;
        self.stats.visible_points = visible.points.len() as u64;
        self.stats.points_skipped = (n_points - visible.points.len()) as u64;
        if self.proxies.is_none() {
            self.proxies = self.lit_proxies(picturing);
        }
        self.shaded = Some(Shaded {
            paint: picturing.scene.shared_paint().cloned(),
            quality,
            radiance,
        });
        self.version += 1;
    }
}

/// Bounce light of the proxies as they are `lit` now: about, since they may be lit from elsewhere.
fn recolored(bounced: &Bounced, lit: Option<&Proxies>) -> Vec<[f32; 4]> {
    let before = bounced.sent_back;
    let now = lit.map_or(before, Proxies::total);
    let factor = |channel: usize| match before[channel] > 0.0 {
        true => now[channel] / before[channel],
        false => 0.0,
    };
    let [r, g, b] = [0, 1, 2].map(factor);
    let bounced = bounced.at.iter();
    bounced
        .map(|of| [r * of[0], g * of[1], b * of[2], 0.0])
        .collect()
}

/// Are there points of the fibre that tables are of? Painted points have fibres of their own. Nor are
/// there tables where pictures of single modes must add up to that of all, which those of their tables do
/// to 0.1 %.
pub(super) fn needs_tables(scene: &PreparedScene) -> bool {
    let has_plain = match scene.paint() {
        Some(paint) => paint.iter().any(|point| !point.is_painted()),
        None => true,
    };
    has_plain && scene.reference_amplitudes.is_none()
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
    maps: Option<Maps<'a>>,
    profile: Option<&'a WidthProfile>,
}

impl Lit<'_> {
    /// Radiance of some visible points, along segments where there are narrow lights.
    fn shade(&self, places: &[u32], visible: &[u32], has_narrow: bool) -> (Radiance, Counts) {
        let shader = PointShader::new(self.scene, self.view, self.profile);
        let n_voxels = self.grid.n_voxels();
        let lift = SELF_LIFT * self.grid.h;
        let through = self
            .maps
            .map(|maps| ThroughShares::new(&self.scene.strands, self.view.eye, maps));
        let answers = self.maps.map(|maps| maps.of_lights);
        let mut found = Radiance::black(places.len(), has_narrow);
        let mut along: Vec<_> = found.along.iter_mut().map(Some).collect();
        along.resize_with(places.len(), || None);
        let counts = found
            .at
            .par_iter_mut()
            .zip(along)
            .zip(places)
            .with_min_len(16)
            .map_init(Scratch::default, |scratch, ((radiance, along), &place)| {
                let at = VisiblePoint {
                    place: place as usize,
                    point: visible[place as usize] as usize,
                };
                if let Some(through) = &through {
                    dispatch!(Level::new(), simd => through.find(simd, at, scratch));
                }
                let position = Vec3::from_slice(&self.scene.strands.points[at.point]);
                let arriving = |ix: usize, light: &LightRecord| {
                    let lifted = position + Vec3::from(light.direction) * lift;
                    let g = grid_position(self.grid, lifted);
                    let record = record_at(self.grid, &self.records[ix * n_voxels..], g);
                    let (mut unblocked, mut unblocked_tt) = (record.shares[0], record.shares[0]);
                    let slot = light.shadow_index;
                    if let Some(maps) = self.maps.filter(|_| slot != NO_SLOT) {
                        unblocked = maps.of_lights.share(slot, at);
                        unblocked_tt = scratch.shares[slot as usize];
                    }
                    (record, unblocked, unblocked_tt)
                };
                shader.shade(at, self.lights, arriving, radiance, answers.zip(along))
            })
            .reduce(Counts::default, Counts::and);
        (found, counts)
    }

    /// Bounce light at some visible points: rgb times the view's radiance scale, and zero.
    fn shade_bounce(&self, bounce: &BounceLight, places: &[u32], visible: &[u32]) -> Vec<[f32; 4]> {
        let shader = PointShader::new(self.scene, self.view, None);
        let of_place = |&place: &u32| shader.shade_bounce(bounce, visible[place as usize] as usize);
        places.par_iter().with_min_len(16).map(of_place).collect()
    }
}
