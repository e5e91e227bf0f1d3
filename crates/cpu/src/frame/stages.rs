//! The stages before shading, a step of each at a time.

use std::cmp::Reverse;
use std::sync::Arc;

use rayon::prelude::*;
use strandlight_scattering::multiple_tables::{Filling, MultipleTables};
use strandlight_scene::PreparedScene;
use strandlight_scene::beside::Beside;
use strandlight_scene::bounce::passed_weights;
use strandlight_scene::progress::timed;
use strandlight_scene::shadow_maps::{ShadowPlan, ShadowView};
use strandlight_scene::strands::Strands;
use strandlight_scene::volume::Grid;

use super::super::axis_shares::AxisShares;
use super::super::bounce::{BounceLight, BounceRays};
use super::super::list::Listing;
use super::super::proxies::Proxies;
use super::super::proxy_light::Surfaces;
use super::super::radiance::RadianceBefore;
use super::super::scene_tables::run;
use super::super::through_shares::Through;
use super::super::transmittance::LightSweep;
use super::super::unblocked::{Casting, StripOrder, Unblocked};
use super::super::visible::VisiblePoints;
use super::super::voxelise::Voxelising;
use super::parts::{Lights, Picturing, ProxyLight, Quality, Records};
use super::state::Frame;

/// Shares at all points are kept if they have at most this many bytes.
const MAX_SHARE_BYTES: usize = 256 << 20;

/// What arrives of each light at the proxies is kept if it has at most this many bytes.
const MAX_PROXY_BYTES: usize = 64 << 20;

/// Height maps of meshes are kept, for light on the proxies, if they are at most so many: some 64 MB.
const MAX_HEIGHT_MAPS: usize = 256;

/// Widths of the light that a thread fills tables of at a time: half a millisecond, of model `energy` some.
const WIDTHS_AT_ONCE: usize = 4;

/// Are answers of the maps of `plan` at all points few enough to be kept, so that they serve any view?
pub(super) fn can_be_everywhere(plan: &ShadowPlan, n_points: usize) -> bool {
    plan.n_slots > 0 && Unblocked::bytes_of(plan.n_maps(), n_points) <= MAX_SHARE_BYTES
}

impl Frame {
    pub(super) fn voxelise(&mut self, scene: &PreparedScene) {
        let strands = &scene.strands;
        let (found, seconds) = timed(|| {
            let (grid, voxelising) = self.voxelising.get_or_insert_with(|| {
                let grid = Grid::around(strands);
                (grid, Voxelising::new(strands, &grid))
            });
            voxelising.step(strands, grid).then_some(())?;
            let (grid, voxelising) = self.voxelising.take()?;
            Some((grid, voxelising.finish(&grid)))
        });
        let mut bytes = match &found {
            Some((_, volume)) => size_of_val(&volume[..]) as u64,
            None => 0,
        };
        let mut seconds = seconds;
        if found.is_some() {
            self.volume = found;
            let ((), more) = timed(|| self.find_axis_shares(scene));
            seconds += more;
            bytes += self.axis_shares.as_ref().map_or(0, AxisShares::bytes);
        }
        self.ran("voxelise", seconds, bytes);
    }

    /// If multiple scattering is drawn.
    pub(super) fn find_axis_shares(&mut self, scene: &PreparedScene) {
        if let (None, Some((grid, volume))) = (&self.axis_shares, &self.volume) {
            self.axis_shares = AxisShares::if_drawn(scene, grid, volume);
        }
    }

    pub(super) fn list(&mut self, picturing: &Picturing) {
        let Picturing {
            scene,
            view,
            beside,
            ..
        } = picturing;
        let strands = &scene.strands;
        let (found, seconds) = timed(|| match self.listing.take() {
            None => {
                self.listing = Some((Listing::new(view, strands), false));
                None
            }
            Some((mut listing, false)) => {
                let is_done = listing.step(view, strands, beside);
                self.listing = Some((listing, is_done));
                None
            }
            Some((mut listing, true)) => {
                let mut list = listing.finish();
                let visible = VisiblePoints::number(&mut list, strands);
                Some((list, visible))
            }
        });
        let mut bytes = 0;
        if let Some((list, visible)) = found {
            bytes = list.bytes() + size_of_val(&visible.points[..]) as u64;
            self.stats.pixels_visited = list.counts[0];
            let mut carried = None;
            if let Some((seen, radiance)) = self.before_view.take() {
                let before = RadianceBefore::of_view(&seen, &radiance, &visible.points);
                // What proxies show needs the light on them.
                if picturing.has_drafts && self.has_proxy_light() {
                    carried = visible.carried(&before);
                }
                self.before = Some(before);
                self.carried_from = carried.is_some().then_some((seen, radiance));
            }
            if picturing.has_drafts {
                self.served.carry_bounced(&visible.points);
            }
            self.list = Some((list, visible));
            if let Some(radiance) = carried {
                self.show(picturing, Quality::Carried, radiance);
            }
        }
        self.ran("list", seconds, bytes);
    }

    pub(super) fn cast(&mut self, picturing: &Picturing) {
        let (Some(lights), Some((_, visible))) = (&self.lights, &self.list) else {
            return;
        };
        let strands = &picturing.scene.strands;
        let plan = &lights.plan;
        let is_extended = self.unblocked.is_some();
        let mut casting = self.casting.take();
        let (is_done, seconds) = timed(|| {
            let of = (&**strands, &picturing.beside);
            step_maps(&mut casting, &mut self.strip_order, of, || {
                // Where there are drafts, other views are to come, but this one's picture first.
                let is_wanted = match picturing.has_drafts {
                    true => is_extended,
                    false => self.was_turned,
                };
                let is_everywhere = is_wanted && can_be_everywhere(plan, strands.points.len());
                let visible = (!is_everywhere).then_some(&visible.points[..]);
                ((plan.views.clone(), plan.maps_for_first()), visible)
            })
        });
        let mut bytes = 0;
        match casting {
            Some(casting) if is_done => {
                let unblocked = casting.finish();
                bytes = unblocked.bytes();
                self.stats.texels_visited += unblocked.n_texels;
                self.unblocked = Some(unblocked);
                // Those at more points are the same at these.
                if !is_extended {
                    self.served.forget_shares();
                }
                // Stills hardly need it again.
                if !picturing.has_drafts {
                    self.strip_order = None;
                }
            }
            unfinished => self.casting = unfinished,
        }
        self.ran("shadow maps", seconds, bytes);
    }

    pub(super) fn cast_through(&mut self, picturing: &Picturing) {
        let (Some(lights), Some((_, visible))) = (&self.lights, &self.list) else {
            return;
        };
        let is_extended = self.through.is_some();
        let mut casting = self.through_casting.take();
        let (is_done, seconds) = timed(|| {
            let of = (&*picturing.scene.strands, &picturing.beside);
            step_maps(&mut casting, &mut self.strip_order, of, || {
                let views = lights.plan.through(picturing.view.forward);
                let are_first = vec![true; views.len()];
                // At all points they serve the drafts of other views, after this one's picture.
                let visible = (!is_extended).then_some(&visible.points[..]);
                ((views, are_first), visible)
            })
        });
        let mut bytes = 0;
        match casting {
            Some(casting) if is_done => {
                let maps = casting.finish();
                bytes = maps.bytes();
                self.stats.texels_visited += maps.n_texels;
                let forward = picturing.view.forward;
                if !is_extended {
                    self.served.forget_shares();
                }
                if maps.is_everywhere() {
                    self.through_before = None;
                }
                self.through = Some(Through { maps, forward });
            }
            unfinished => self.through_casting = unfinished,
        }
        self.ran("through maps", seconds, bytes);
    }

    /// Are there records of all lights?
    pub(super) fn has_records(&self) -> bool {
        (self.records.as_ref()).is_some_and(|records| records.is_lit.iter().all(Option::is_some))
    }

    /// Works some milliseconds on the records of as many lights as there are threads.
    pub(super) fn transmit(&mut self, picturing: &Picturing) {
        let (Some(lights), Some((grid, volume))) = (&self.lights, &self.volume) else {
            return;
        };
        let n_lights = lights.records.len();
        let ((), seconds) = timed(|| {
            let records = self.records.get_or_insert_with(|| Records {
                packed: vec![[0; 2]; grid.n_voxels() * n_lights],
                n_open: match picturing.beside.is_empty() {
                    true => Vec::new(),
                    false => vec![0; grid.n_voxels() * n_lights],
                },
                is_lit: vec![None; n_lights],
                places: picturing.beside.places_of_voxels(grid),
                maps: vec![Vec::new(); n_lights],
                under_way: Vec::new(),
            });
            if records.under_way.is_empty() {
                records.begin(lights);
            }
            let of_lights = (&lights.records[..], &lights.sweeps[..]);
            let beside = (&picturing.beside, &records.places);
            let under_way = records.under_way.par_iter_mut();
            // They have about as many directions and keep in step.
            let are_done: Vec<bool> = under_way
                .map(|light| light.sweep_next((grid, volume), of_lights, beside))
                .collect();
            if are_done.contains(&false) {
                return;
            }
            let n_maps = lights.sweeps.len() * picturing.beside.meshes().len();
            for light in std::mem::take(&mut records.under_way) {
                let of_light =
                    grid.n_voxels() * light.light_ix..grid.n_voxels() * (light.light_ix + 1);
                let n_open = records.n_open.get_mut(of_light.clone());
                light.pack(&mut records.packed[of_light], n_open.unwrap_or_default());
                records.is_lit[light.light_ix] = Some(true);
                if n_maps <= MAX_HEIGHT_MAPS {
                    records.maps[light.light_ix] = light.maps;
                }
            }
        });
        let bytes = match (&self.records, self.has_records()) {
            (Some(records), true) => size_of_val(&records.packed[..]) as u64,
            _ => 0,
        };
        self.ran("transmittance", seconds, bytes);
    }

    /// Is the light at the proxies found, of all lights?
    pub(super) fn has_proxy_light(&self) -> bool {
        let n = self.lights.as_ref().map(|lights| lights.records.len());
        self.proxy_light.as_ref().map(|found| found.n_done) == n
    }

    /// Finds what arrives of the next lights, as many as there are threads.
    pub(super) fn light_proxies(&mut self, picturing: &Picturing) {
        let Picturing { scene, beside, .. } = picturing;
        let (Some(lights), Some((grid, volume)), Some(records)) =
            (&self.lights, &self.volume, &self.records)
        else {
            return;
        };
        let of_all = &lights.records;
        let passed = passed_weights(scene);
        let ((), seconds) = timed(|| {
            let found = self.proxy_light.get_or_insert_with(|| {
                let surfaces = Surfaces::new(beside, grid, volume);
                let bytes = size_of::<[f32; 3]>() * surfaces.list().len() * of_all.len();
                ProxyLight {
                    surfaces,
                    n_done: 0,
                    arriving: Vec::new(),
                    lit: (bytes > MAX_PROXY_BYTES).then(|| Proxies::new(scene)),
                }
            });
            // Those that were black when their records were made are no work.
            let is_work = |ix: &usize| records.is_lit[*ix] == Some(true) && !beside.is_empty();
            let next = (found.n_done..of_all.len()).filter(is_work);
            let next: Vec<usize> = next.take(rayon::current_num_threads()).collect();
            let n = grid.n_voxels();
            let irradiance = |&ix: &usize| {
                let of_light = (&of_all[ix], &lights.sweeps[..]);
                let of_voxels = (
                    &records.packed[n * ix..][..n],
                    &records.n_open[n * ix..][..n],
                );
                let maps = records.maps.get(ix).map_or(&[][..], |maps| maps);
                let surfaces = &found.surfaces;
                surfaces.irradiance((beside, maps), grid, of_light, of_voxels)
            };
            let arriving: Vec<Vec<[f32; 3]>> = next.par_iter().map(irradiance).collect();
            for (&ix, arriving) in next.iter().zip(arriving) {
                match &mut found.lit {
                    Some(lit) => lit.add(
                        &found.surfaces,
                        (&picturing.view, &passed),
                        of_all[ix].rgb,
                        &arriving,
                    ),
                    None => {
                        found.arriving.resize(ix, Vec::new());
                        found.arriving.push(arriving);
                    }
                }
            }
            found.n_done = next.last().map_or(of_all.len(), |last| last + 1);
        });
        if let (true, Some(found), Some(records)) =
            (self.has_proxy_light(), &self.proxy_light, &mut self.records)
        {
            // They are many bytes.
            records.maps = Vec::new();
            if found.is_of_any_color() {
                records.n_open = Vec::new();
            }
        }
        if !beside.is_empty() {
            self.ran("light on proxies", seconds, 0);
        }
    }

    /// Finds what rays to the proxies meet, then the light that comes along them.
    pub(super) fn find_bounce(&mut self, picturing: &Picturing) {
        let ((), seconds) = timed(|| match (&mut self.bounce_rays, &self.volume) {
            (None, _) => self.bounce_rays = BounceRays::new(picturing.scene),
            (Some(rays), Some((grid, volume))) if !rays.is_found() => rays.step(grid, volume),
            (Some(_), _) => self.light_bounce(picturing),
        });
        let bytes = self.bounce.as_ref().map_or(0, BounceLight::bytes);
        self.ran("bounce", seconds, bytes);
    }

    /// Finds the light that comes along the rays that were found.
    fn light_bounce(&mut self, picturing: &Picturing) {
        let rays = self.bounce_rays.as_ref();
        if let Some((rays, lit)) = rays.zip(self.lit_proxies(picturing)) {
            self.bounce = Some(rays.light(lit.at_surfaces()));
            self.proxies = Some(lit);
        }
    }

    /// The proxies in the light of the lights as they are, and of each other, once that is found.
    pub(super) fn lit_proxies(&self, picturing: &Picturing) -> Option<Proxies> {
        let found = (self.proxy_light.as_ref()).filter(|_| self.has_proxy_light())?;
        let lights = self.lights.as_ref()?;
        let passed = passed_weights(picturing.scene);
        let mut proxies = match &found.lit {
            Some(lit) => lit.clone(),
            None => Proxies::new(picturing.scene),
        };
        for (light, arriving) in lights.records.iter().zip(&found.arriving) {
            if light.power > 0.0 {
                let of_view = (&picturing.view, &passed);
                proxies.add(&found.surfaces, of_view, light.rgb, arriving);
            }
        }
        if let Some(rays) = &self.bounce_rays {
            rays.reflect(&passed, &mut proxies);
        }
        Some(proxies)
    }

    /// Fills some more of the tables that are needed.
    pub(super) fn fill_tables(&mut self, scene: &PreparedScene) {
        let Some(needed) = self.needed_tables else {
            return;
        };
        let tables = self.multiple.get_or_insert_default();
        let filling = &mut self.filling;
        let ((), seconds) = timed(|| {
            if needed.plain && tables.plain.is_none() {
                let shading = scene.hair.optics().shading(scene.tables.view());
                let averages = scene.hair.averages();
                let filled = filling
                    .get_or_insert_with(|| Filling::new(&shading, averages, scene.terms(), run));
                let most = WIDTHS_AT_ONCE * rayon::current_num_threads();
                if filled.fill(shading.fibre, averages, most, run) {
                    tables.plain = filling.take().map(Filling::finish);
                }
                return;
            }
            tables.fill_pack(scene, needed.packs);
        });
        let of_plain = tables.plain.as_ref().map_or(0, MultipleTables::bytes);
        let bytes = (of_plain + tables.painted.bytes()) as u64;
        self.ran("tables", seconds, bytes);
    }
}

/// Works a little on shadow maps: puts the strands in order for them, begins those of the views and at the visible points that
/// `wanted` says, or goes on; answers whether all are done.
fn step_maps<'a>(
    casting: &mut Option<Casting>,
    order: &mut Option<Arc<StripOrder>>,
    (strands, beside): (&Strands, &Beside),
    wanted: impl FnOnce() -> ((Vec<ShadowView>, Vec<bool>), Option<&'a [u32]>),
) -> bool {
    if let Some(casting) = casting {
        return casting.step(beside);
    }
    let (views, visible) = wanted();
    if order.is_none() && !views.0.is_empty() {
        *order = Some(Arc::new(StripOrder::new(strands)));
        return false;
    }
    let order = order.clone().unwrap_or_default();
    *casting = Some(Casting::new(views, (strands, &order), visible));
    false
}

impl Records {
    /// Takes up the next lights.
    fn begin(&mut self, lights: &Lights) {
        let mut missing = Vec::new();
        for (ix, done) in self.is_lit.iter_mut().enumerate() {
            match lights.is_lit[ix] {
                true if done.is_none() => missing.push(ix),
                true => {}
                // The black ones are no work.
                false => *done = done.or(Some(false)),
            }
        }
        // Those of as many directions together, so that no thread waits for another.
        missing.sort_by_key(|&ix| Reverse(lights.records[ix].n_sweeps));
        missing.truncate(rayon::current_num_threads());
        self.under_way = missing.into_iter().map(LightSweep::new).collect();
    }
}
