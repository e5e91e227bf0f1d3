//! Radiance of the visible points.

use strandlight_scattering::wide::Peaks;
use strandlight_scene::PreparedScene;
use strandlight_scene::progress::timed;

use super::super::arriving::Arriving;
use super::super::draft_multiple::DraftMultiple;
use super::super::proxies::Proxies;
use super::super::radiance::Radiance;
use super::super::scene_tables::SceneTables;
use super::super::shade::Counts;
use super::super::through_shares::Maps;
use super::inputs::{Inputs, NeededTables, is_plain, maps_of, tables_for};
use super::parts::{Picturing, Quality, Shaded, Shading, Shadowing};
use super::state::Frame;

/// Points that are found in shadows at a time, some milliseconds on two cores.
const SHADOWED_AT_ONCE: usize = 1 << 12;

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
        if self.to_be_shadowed(picturing) {
            self.shadow_some(picturing);
            return;
        }
        let scene = picturing.scene;
        if self.lights.is_none()
            || self.list.is_none()
            || self.volume.is_none()
            || self.records.is_none()
        {
            return;
        }
        let quality = match (&self.unblocked, &self.through) {
            (Some(_), Some(_)) => Quality::Whole,
            (Some(_), None) if self.has_through_near(picturing) => Quality::Turned,
            _ => Quality::Draft,
        };
        self.shading.take_if(|shading| shading.quality != quality);
        if self.tables_of(scene).is_none() || self.needed().has_others {
            self.served.kept = None;
        }
        if quality == Quality::Whole && self.show_recolored(picturing) {
            return;
        }
        if self.bounce.is_none() && scene.has_bounce() {
            // It was put off for what was kept, which does not serve.
            self.served.kept = None;
            return;
        }
        if self.shading.is_none() {
            self.find_axis_shares(scene);
            self.begin_shading(picturing, quality);
        }
        self.shade_slice(picturing);
    }

    /// Is there a draft that shadow maps can be cast on?
    pub(super) fn to_be_shadowed(&self, picturing: &Picturing) -> bool {
        let draft = self.served.draft_multiple.as_ref();
        picturing.has_drafts
            && self.quality() == Some(Quality::Draft)
            && draft.is_some_and(DraftMultiple::is_whole)
            && self.maps_for_first().is_some()
    }

    /// The shadow maps that do for a first picture, once there are these.
    fn maps_for_first(&self) -> Option<Maps<'_>> {
        let lights = self.lights.as_ref()?;
        let through = self.through.as_ref();
        if let Some(unblocked) = &self.unblocked {
            return maps_of(lights, Some(unblocked), through);
        }
        let (found, are_drawn) = self.casting.as_ref()?.maps_for_first()?;
        let maps = maps_of(lights, Some(found), through)?;
        Some(Maps {
            are_drawn: Some(are_drawn),
            ..maps
        })
    }

    /// Finds some more of the picture in their shadows.
    fn shadow_some(&mut self, picturing: &Picturing) {
        let under_way = self.served.shadowing.take();
        match self.shadow_next(picturing, under_way) {
            Some(shadowing) if shadowing.n_done < shadowing.places.len() => {
                self.served.shadowing = Some(shadowing);
            }
            Some(Shadowing {
                places,
                mut radiance,
                ..
            }) => {
                // Where there is paint the draft has it.
                if picturing.scene.paint().is_none() {
                    self.add_bounce(picturing.scene, &mut radiance, &places);
                }
                let radiance = self.filled(&radiance, places.len());
                self.served.forget_draft();
                self.show(picturing, Quality::Shadowed, radiance);
            }
            // The points are shaded as without a draft.
            None => self.served.forget_draft(),
        }
    }

    /// The picture under way with some more places, or one that is begun.
    fn shadow_next(
        &self,
        picturing: &Picturing,
        under_way: Option<Shadowing>,
    ) -> Option<Shadowing> {
        let scene = picturing.scene;
        let ((list, visible), lights) = (self.list.as_ref()?, self.lights.as_ref()?);
        let mut shadowing = under_way.unwrap_or_else(|| Shadowing {
            places: visible.order[..visible.n_first].to_vec(),
            n_done: 0,
            between: visible.between(&visible.order[..visible.n_thinned]),
            radiance: Radiance::black(visible.points.len(), lights.has_narrow()),
            peaks: peaks(scene),
        });
        let n = SHADOWED_AT_ONCE.min(shadowing.places.len() - shadowing.n_done);
        let places = &shadowing.places[shadowing.n_done..][..n];
        let profile = self.profile.as_ref().filter(|_| list.has_wide);
        let found = self.served.shadowed(
            (scene, (&picturing.view, profile)),
            self.tables_of(scene)?,
            (&lights.records, self.maps_for_first()?),
            (places, &visible.points),
            &shadowing,
        )?;
        shadowing.radiance.add(places, &found);
        shadowing.n_done += n;
        Some(shadowing)
    }

    /// Tables that points need, seen or not.
    fn needed(&self) -> NeededTables {
        self.needed_tables.unwrap_or_default()
    }

    /// The tables, if there are points that they serve.
    fn tables_of(&self, scene: &PreparedScene) -> Option<&SceneTables> {
        tables_for(scene, self.multiple.as_ref(), self.needed_tables)
    }

    /// Shows lights of other colours by what was kept; answers whether that was possible.
    fn show_recolored(&mut self, picturing: &Picturing) -> bool {
        if !self.is_recolored(picturing) {
            return false;
        }
        let (Some(kept), Some(lights), Some((_, visible)), Some(maps)) =
            (&self.served.kept, &self.lights, &self.list, &self.unblocked)
        else {
            return false;
        };
        let seen = (&*picturing.scene.strands, &visible.points[..]);
        let scale = picturing.view.radiance_scale;
        let mut radiance = kept.radiance(&lights.records, seen, maps, scale);
        let of_plain = (self.served.bounced.as_ref())
            .map(|bounced| (&bounced.light.at[..], bounced.sent_back));
        let of_painted = Some(kept.bounced()).filter(|(light, _)| !light.is_empty());
        if of_plain.is_some() || of_painted.is_some() {
            let lit = self.lit_proxies(picturing);
            let paint = picturing.scene.paint();
            for (bounced, of_paint) in [(of_plain, false), (of_painted, true)] {
                let found = bounced.map(|bounced| recolored(bounced, lit.as_ref()));
                for (place, found) in (0..).zip(found.iter().flatten()) {
                    if is_plain(paint, visible, place) != of_paint {
                        radiance.add_at(place, found);
                    }
                }
            }
            self.proxies = lit;
        }
        self.show(picturing, Quality::Recolored, radiance);
        true
    }

    /// About what shading a point costs, in products of a light and a point of plain round hair.
    fn products_of_point(&self, scene: &PreparedScene) -> usize {
        let n_lights = scene.lights.len();
        let needed = self.needed();
        if needed.has_others || self.tables_of(scene).is_none() {
            // The closed form of multiple scattering.
            10 * n_lights
        } else if scene.hair.optics().fibre.is_elliptic() {
            2 * n_lights
        } else if needed.painted {
            3 * n_lights / 2
        } else {
            n_lights
        }
    }

    /// Plans which points and lights are shaded, in which order.
    fn begin_shading(&mut self, picturing: &Picturing, quality: Quality) {
        let scene = picturing.scene;
        let products_of_point = self.products_of_point(scene);
        if let Some((_, visible)) = &mut self.list {
            visible.thin_for(products_of_point);
        }
        let (Some(lights), Some((list, visible))) = (&self.lights, &self.list) else {
            return;
        };
        if list.has_wide && self.profile.is_none() {
            self.profile = scene.width_profile(&picturing.view, None);
        }
        let n_places = visible.points.len();
        let through = self.through.as_ref().or(self.through_before.as_ref());
        let has_maps = maps_of(lights, self.unblocked.as_ref(), through).is_some();
        let has_narrow = has_maps && lights.has_narrow();
        let radiance = Radiance::black(n_places, has_narrow);
        let before = (self.before.as_ref()).filter(|before| before.is_like(&radiance));
        let mut shading = Shading {
            quality,
            groups: match self.tables_of(scene) {
                Some(_) => Arriving::groups(&lights.lit, n_places),
                // Nothing is kept.
                None => std::iter::once(0..lights.lit.len()).collect(),
            },
            group: 0,
            order: visible.order.clone(),
            // Shares of the volume change slowly along strands.
            n_first: match before {
                Some(before) if before.is_of_all() => visible.n_fewest,
                None if self.unblocked.is_some() => visible.n_first,
                _ => visible.n_thinned,
            },
            n_done: 0,
            radiance,
            counts: Counts::default(),
            peaks: quality.is_draft().then(|| peaks(scene)),
        };
        if let Some(before) = self.before_paint.take() {
            shading.only_repainted(before, scene.paint(), &visible.points);
        }
        self.shading = Some(shading);
    }

    /// Shades some more points, or finds something that they need.
    fn shade_slice(&mut self, picturing: &Picturing) {
        let has_better = matches!(
            self.quality(),
            Some(Quality::Turned | Quality::Most | Quality::Recolored | Quality::Whole)
        );
        let (Some(lights), Some((list, visible)), Some((grid, _)), Some(records)) =
            (&self.lights, &self.list, &self.volume, &self.records)
        else {
            return;
        };
        let through = self.through.as_ref().or(self.through_before.as_ref());
        let inputs = Inputs {
            picturing,
            lights,
            visible,
            grid,
            axis_shares: self.axis_shares.as_ref(),
            records: &records.packed,
            maps: maps_of(lights, self.unblocked.as_ref(), through),
            profile: self.profile.as_ref().filter(|_| list.has_wide),
            bounce: self.bounce.as_ref(),
            needed: self.needed(),
            proxies: self.proxies.as_ref(),
        };
        let tables = tables_for(picturing.scene, self.multiple.as_ref(), self.needed_tables);
        let Some(shading) = &mut self.shading else {
            return;
        };
        if shading.group == shading.groups.len() {
            // There is no light.
            self.finish_shading(picturing);
            return;
        }
        let places = shading.next_places(inputs.slice());
        let (served, others) = match tables {
            Some(_) => inputs.served_and_others(&places),
            None => (Vec::new(), places.clone()),
        };
        if let Some(tables) = tables.filter(|_| !served.is_empty()) {
            let Some((radiance, counts)) = self.served.shade(&inputs, tables, shading, &served)
            else {
                return;
            };
            shading.add(&served, &radiance, counts);
        }
        // These do all lights at once.
        if !others.is_empty() && shading.group == 0 {
            let (radiance, counts) = inputs.shade_alone(&others, shading.has_narrow());
            shading.add(&others, &radiance, counts);
        }
        shading.n_done += places.len();
        let is_last = shading.group + 1 == shading.groups.len();
        let is_first_done = shading.n_done >= shading.n_first;
        let is_draft = shading.quality.is_draft();
        if shading.n_done == shading.order.len() || is_draft && is_first_done {
            shading.group += 1;
            shading.n_done = 0;
            if is_last {
                self.finish_shading(picturing);
            }
        } else if is_last && is_first_done && picturing.has_drafts && !has_better {
            let done = shading.order[..shading.n_done].to_vec();
            let Radiance { at, along } = &mut shading.radiance;
            // That along segments is much, and stays as it is.
            let (at, along) = (at.clone(), std::mem::take(along));
            let mut found = Radiance { at, along };
            self.add_bounce(picturing.scene, &mut found, &done);
            let filled = self.filled(&found, done.len());
            if let Some(shading) = &mut self.shading {
                shading.radiance.along = found.along;
            }
            self.show(picturing, Quality::Most, filled);
        }
    }

    /// Adds the light of the proxies to that of the lights at the places that are `done`.
    fn add_bounce(&self, scene: &PreparedScene, radiance: &mut Radiance, done: &[u32]) {
        let Some((_, visible)) = &self.list else {
            return;
        };
        // Painted points have it.
        if self.bounce.is_some() && self.tables_of(scene).is_some() {
            let is_plain = |place: &u32| is_plain(scene.paint(), visible, *place);
            let plain: Vec<u32> = done.iter().copied().filter(is_plain).collect();
            let bounced = self.served.bounced_at(&plain, visible).unwrap_or_default();
            for (place, bounced) in plain.iter().zip(&bounced) {
                radiance.add_at(*place, bounced);
            }
        }
    }

    /// With what is interpolated from the first `n_done` places of the order to the others.
    fn filled(&self, radiance: &Radiance, n_done: usize) -> Radiance {
        let before = self.before.as_ref();
        let before = before.filter(|before| before.is_like(radiance));
        match &self.list {
            Some((_, visible)) => visible.filled(radiance, n_done, before),
            None => radiance.clone(),
        }
    }

    fn finish_shading(&mut self, picturing: &Picturing) {
        if let Some(shading) = self.shading.take() {
            let is_whole = shading.quality == Quality::Whole;
            let n_done = match is_whole {
                true => shading.order.len(),
                false => shading.n_first,
            };
            let done = &shading.order[..n_done];
            let mut radiance = shading.radiance;
            self.add_bounce(picturing.scene, &mut radiance, done);
            if !is_whole {
                radiance = self.filled(&radiance, n_done);
            }
            self.stats.set_terms(&shading.counts.terms);
            if is_whole {
                self.before = None;
                self.served.forget_draft();
            }
            if let (Some(kept), Some(lights), true) =
                (&mut self.served.kept, &self.lights, is_whole)
            {
                kept.is_taken(&lights.records);
            }
            self.show(picturing, shading.quality, radiance);
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
        if quality != Quality::Carried {
            self.carried_from = None;
        }
        self.shaded = Some(Shaded {
            paint: picturing.scene.shared_paint().cloned(),
            quality,
            radiance,
        });
        self.version += 1;
    }
}

/// Of the scene's fibre.
fn peaks(scene: &PreparedScene) -> Peaks {
    let optics = scene.hair.optics();
    Peaks::of(&optics.shading(scene.tables.view()))
}

/// Bounce light by place, of proxies that sent back so much `before`, as they are `lit` now: about, since they may be lit from
/// elsewhere.
fn recolored((bounced, before): (&[[f32; 4]], [f32; 3]), lit: Option<&Proxies>) -> Vec<[f32; 4]> {
    let now = lit.map_or(before, Proxies::total);
    let factor = |channel: usize| match before[channel] > 0.0 {
        true => now[channel] / before[channel],
        false => 0.0,
    };
    let [r, g, b] = [0, 1, 2].map(factor);
    bounced
        .iter()
        .map(|of| [r * of[0], g * of[1], b * of[2], 0.0])
        .collect()
}
