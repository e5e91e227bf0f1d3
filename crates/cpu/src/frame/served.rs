//! Visible points that tables of multiple scattering serve: those with the scene's fibre, and painted ones that differ in
//! absorption. They are shaded eight lights at a time, and what arrives at them is kept for edits.

use strandlight_scattering::closed_form::WidthProfile;
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::scene::LightRecord;

use super::super::arriving::Arriving;
use super::super::draft_multiple::DraftMultiple;
use super::super::proxies::Proxies;
use super::super::radiance::{Radiance, RadianceBefore};
use super::super::scene_tables::SceneTables;
use super::super::shade::Counts;
use super::super::shade_wide::{Fibres, WideShader, Written};
use super::super::through_shares::Maps;
use super::super::visible::VisiblePoints;
use super::inputs::{Inputs, is_plain};
use super::kept::Kept;
use super::parts::{Bounced, FindingBounced, Quality, Shading, Shadowing};

/// What is kept of them.
#[derive(Default)]
pub(super) struct ServedPoints {
    /// What arrives of a group of lights.
    pub arriving: Option<Arriving>,
    /// That of the view before, and its visible points.
    pub arriving_before: Option<(Arriving, Vec<u32>)>,
    /// Of the points of a draft.
    pub draft_multiple: Option<DraftMultiple>,
    /// The picture by these, while it is being made.
    pub shadowing: Option<Shadowing>,
    /// Of the last complete picture.
    pub kept: Option<Kept>,
    /// Light of the proxies that the points scatter, and that of proxies in other light, which will take its place.
    pub bounced: Option<Bounced>,
    pub finding_bounced: Option<FindingBounced>,
    /// What it was before an edit that left shadows as they were, or in the view before, until it is found.
    pub bounced_before: Option<RadianceBefore>,
    /// That of the last view in which it was found, and the visible points there.
    bounced_of_view: Option<(Vec<u32>, Radiance)>,
}

impl ServedPoints {
    /// Radiance of some points without [bounce light](ServedPoints::bounced_at), or nothing yet: then something was found that
    /// it needs, or that light does.
    pub fn shade(
        &mut self,
        inputs: &Inputs,
        tables: &SceneTables,
        shading: &Shading,
        places: &[u32],
    ) -> Option<(Radiance, Counts)> {
        if !self.find_arriving(inputs, shading) {
            return None;
        }
        self.plan_kept(inputs, shading);
        let (scene, records) = (inputs.picturing.scene, &inputs.lights.records[..]);
        let is_draft = shading.quality == Quality::Draft
            && inputs.maps.is_none()
            && shading.groups.len() == 1
            && !inputs.needed.has_others;
        let arriving = self.arriving.as_ref()?;
        let maps = (inputs.maps.filter(|_| shading.has_narrow())).map(|maps| maps.of_lights);
        let seen = (&inputs.picturing.view, inputs.profile);
        let of_lights = (arriving, records);
        let shader = WideShader::new(
            scene,
            seen,
            tables,
            of_lights,
            (maps, inputs.axis_shares),
            shading.peaks,
        );
        let has_few = inputs.picturing.has_drafts
            && !shading.has_first()
            && match shading.quality {
                quality if quality.is_draft() => true,
                // The rest is found for the plain points that follow.
                _ => {
                    self.bounced_before.is_some()
                        && has_plain(inputs, &shading.order[shading.n_first..])
                }
            };
        let found = (&mut self.bounced, &mut self.finding_bounced);
        let is_wanted = tables.plain.is_some() && inputs.needed.plain;
        if is_wanted && !step_bounced(found, (inputs, has_few), &shader) {
            return None;
        }
        if self.finding_bounced.is_none() {
            self.bounced_before = None;
        }
        if is_draft && shading.n_done == 0 {
            let n = (shading.n_first, inputs.visible.points.len());
            self.draft_multiple = DraftMultiple::new(&arriving.lights, records, n);
        }
        let written = match (&self.draft_multiple, &self.kept) {
            (Some(draft), _) if is_draft => Written::Draft(&draft.columns),
            (_, Some(_)) => Written::Kept,
            _ => Written::Nothing,
        };
        let mut shaded = shader.shade(places, &inputs.visible.points, written);
        let bounced = (shading.group == 0)
            .then(|| bounced_at_painted(inputs, &shader, places))
            .flatten();
        if let Some(bounced) = &bounced {
            shaded.radiance.add_at_all(bounced);
        }
        let of_draft = (bounced.as_ref())
            .filter(|_| is_draft)
            .map(|bounced| self.with_plain(bounced, inputs, places));
        match (&mut self.draft_multiple, &mut self.kept) {
            (Some(draft), _) if is_draft => {
                for (sum, value) in (shaded.rest.iter_mut().flatten())
                    .zip(of_draft.unwrap_or_default().as_flattened())
                {
                    *sum += value;
                }
                draft.take(places, &shaded.numbers, &shaded.rest);
            }
            (_, Some(kept)) => {
                kept.take(records, places, &shaded.numbers);
                kept.take_bounced(places, bounced.as_deref(), sent_back(inputs.proxies));
            }
            _ => {}
        }
        Some((shaded.radiance, shaded.counts))
    }

    /// Light of the proxies at some places that have it at painted points already.
    fn with_plain(
        &self,
        at_painted: &[[f32; 4]],
        inputs: &Inputs,
        places: &[u32],
    ) -> Vec<[f32; 4]> {
        let mut all = at_painted.to_vec();
        let at_all = self.bounced_at(places, inputs.visible).unwrap_or_default();
        let paint = inputs.picturing.scene.paint();
        for ((value, found), &place) in all.iter_mut().zip(&at_all).zip(places) {
            if is_plain(paint, inputs.visible, place) {
                *value = *found;
            }
        }
        all
    }

    /// Radiance of some of the `visible` points in the shadows of maps, without [bounce light](ServedPoints::bounced_at), by what a draft
    /// wrote down.
    pub fn shadowed(
        &self,
        (scene, seen): (&PreparedScene, (&ViewUniform, Option<&WidthProfile>)),
        tables: &SceneTables,
        (records, maps): (&[LightRecord], Maps),
        points: (&[u32], &[u32]),
        Shadowing { between, peaks, .. }: &Shadowing,
    ) -> Option<Radiance> {
        let (arriving, draft) = (self.arriving.as_ref()?, self.draft_multiple.as_ref()?);
        let of_lights = (arriving, records);
        // Local scattering is in the draft.
        let of_narrow = (Some(maps.of_lights), None);
        let shader = WideShader::new(scene, seen, tables, of_lights, of_narrow, Some(*peaks));
        Some(shader.shade_shadowed(maps, draft, points, between))
    }

    /// Light of the proxies at some places, one after the other, interpolated from those at which it is found.
    pub fn bounced_at(&self, places: &[u32], visible: &VisiblePoints) -> Option<Vec<[f32; 4]>> {
        if let Some(bounced) = self.bounced.as_ref().filter(|bounced| bounced.is_current) {
            let of_place = |place: &u32| bounced.light.at[*place as usize];
            return Some(places.iter().map(of_place).collect());
        }
        let FindingBounced { light, n_done } = self.finding_bounced.as_ref()?;
        Some(visible.bounce_at(light, *n_done, (places, self.bounced_before.as_ref())))
    }

    /// The fibre or the terms are others, and shadows are what they were.
    pub fn outdate_bounced(&mut self) {
        if let Some(bounced) = self.bounced.take() {
            self.bounced_before = Some(RadianceBefore::new(bounced.light));
        }
        self.finding_bounced = None;
    }

    /// The view changes, which shows these `visible` points if it was drawn.
    pub fn keep_bounced(&mut self, visible: Option<&[u32]>) {
        let bounced = self.bounced.take_if(|bounced| bounced.is_current);
        if let Some((visible, bounced)) = visible.zip(bounced) {
            self.bounced_of_view = Some((visible.to_vec(), bounced.light));
        }
        (self.bounced, self.bounced_before, self.finding_bounced) = (None, None, None);
    }

    /// The `visible` points of the view are known.
    pub fn carry_bounced(&mut self, visible: &[u32]) {
        let before = self.bounced_of_view.as_ref();
        self.bounced_before =
            before.map(|(seen, light)| RadianceBefore::of_view(seen, light, visible));
    }

    /// What the points of a draft came to is that of another scene or view, or there is a better picture.
    pub fn forget_draft(&mut self) {
        (self.draft_multiple, self.shadowing) = (None, None);
    }

    /// There are other shadow maps.
    pub fn forget_shares(&mut self) {
        if let Some(arriving) = &mut self.arriving {
            arriving.forget_shares();
        }
    }

    /// Nothing is known of the light of the proxies.
    pub fn forget_bounced(&mut self) {
        (self.bounced, self.bounced_before, self.finding_bounced) = (None, None, None);
        self.bounced_of_view = None;
    }

    /// Works a little on what arrives of the lights under way; answers whether all is known.
    fn find_arriving(&mut self, inputs: &Inputs, shading: &Shading) -> bool {
        let (lights, visible) = (inputs.lights, &inputs.visible.points[..]);
        let of_group = &lights.lit[shading.groups[shading.group].clone()];
        let serves = |arriving: &Arriving| match shading.groups.len() {
            1 => of_group.iter().all(|ix| arriving.lights.contains(ix)),
            _ => arriving.lights == of_group,
        };
        if !self.arriving.as_ref().is_some_and(serves) {
            let before = self.arriving_before.take();
            self.arriving = Some(match before.filter(|(before, _)| serves(before)) {
                Some((before, points)) => before.of_view(&points, visible),
                None => Arriving::new(of_group, visible.len()),
            });
        }
        let Some(arriving) = &mut self.arriving else {
            return false;
        };
        let scene = inputs.picturing.scene;
        let of_lights = (&lights.records[..], inputs.records);
        // Drafts and first pictures show no others.
        let has_few =
            shading.quality.is_draft() || inputs.picturing.has_drafts && !shading.has_first();
        let some = has_few.then(|| &shading.order[..shading.n_first]);
        if !arriving.find(scene, inputs.grid, of_lights, (visible, some)) {
            return false;
        }
        let eye = inputs.picturing.view.eye;
        inputs.maps.is_none_or(|maps| {
            arriving.take_shares(scene, eye, (&lights.records, maps), (visible, some))
        })
    }

    /// Keeps what each light comes to where a complete picture is shaded whose lights may be edited next.
    fn plan_kept(&mut self, inputs: &Inputs, shading: &Shading) {
        let n_places = inputs.visible.points.len();
        let is_kept = inputs.picturing.has_drafts
            && shading.quality == Quality::Whole
            && shading.groups.len() == 1
            && !inputs.needed.has_others;
        let Some(arriving) = self.arriving.as_ref().filter(|_| is_kept) else {
            self.kept = None;
            return;
        };
        let (lights, all) = (&arriving.lights[..], &inputs.lights.records[..]);
        let kept = self.kept.take();
        let kept = kept.filter(|kept| kept.is_of(lights, all, n_places));
        self.kept = match shading.order.len() == n_places {
            true => kept.or_else(|| Kept::new(lights, all, n_places)),
            // Where some places are repainted, all were kept before or none is.
            false => kept.filter(Kept::is_whole),
        };
    }
}

/// Light of the proxies at some places, nothing at plain points; none where no point is painted or no proxy sends any.
fn bounced_at_painted(
    inputs: &Inputs,
    shader: &WideShader,
    places: &[u32],
) -> Option<Vec<[f32; 4]>> {
    let bounce = inputs.bounce?;
    let paint = Some(inputs.picturing.scene.paint()?);
    let (ixs, painted): (Vec<usize>, Vec<u32>) = places
        .iter()
        .enumerate()
        .filter(|(_, place)| !is_plain(paint, inputs.visible, **place))
        .unzip();
    let points = (&painted[..], &inputs.visible.points[..]);
    let found = shader.shade_bounce(bounce, points, Fibres::OfPoints);
    let mut all = vec![[0.0; 4]; places.len()];
    for (ix, found) in ixs.into_iter().zip(found) {
        all[ix] = found;
    }
    Some(all)
}

/// What the proxies send back in all.
fn sent_back(proxies: Option<&Proxies>) -> [f32; 3] {
    proxies.map_or([0.0; 3], Proxies::total)
}

/// Is one of these points plain?
fn has_plain(inputs: &Inputs, places: &[u32]) -> bool {
    let paint = inputs.picturing.scene.paint();
    places
        .iter()
        .any(|place| is_plain(paint, inputs.visible, *place))
}

/// Finds some more of the light of the proxies, while what was found before stays; answers whether enough is known: at `has_few`,
/// for a first picture, that at some of the places.
fn step_bounced(
    (bounced, finding): (&mut Option<Bounced>, &mut Option<FindingBounced>),
    (inputs, has_few): (&Inputs, bool),
    shader: &WideShader,
) -> bool {
    let is_known = bounced.as_ref().is_some_and(|bounced| bounced.is_current);
    let Some(bounce) = inputs.bounce.filter(|_| !is_known) else {
        return true;
    };
    let visible = inputs.visible;
    let under_way = finding.get_or_insert_with(|| FindingBounced {
        light: Radiance::black(visible.points.len(), false),
        n_done: 0,
    });
    let n_wanted = match has_few {
        true => visible.n_first_of_bounce,
        false => visible.of_bounce.len(),
    };
    if has_few && under_way.n_done >= n_wanted {
        return true;
    }
    let missing = &visible.of_bounce[under_way.n_done..n_wanted];
    let missing = &missing[..missing.len().min(inputs.slice())];
    let of_places = (missing, &visible.points[..]);
    let found = shader.shade_bounce(bounce, of_places, Fibres::OfScene);
    for (&place, found) in missing.iter().zip(found) {
        under_way.light.at[place as usize] = found;
    }
    under_way.n_done += missing.len();
    if under_way.n_done == visible.of_bounce.len()
        && let Some(FindingBounced { mut light, n_done }) = finding.take()
    {
        let all: Vec<u32> = (0..visible.points.len() as u32).collect();
        light.at = visible.bounce_at(&light, n_done, (&all, None));
        *bounced = Some(Bounced {
            light,
            sent_back: sent_back(inputs.proxies),
            is_current: true,
        });
    }
    false
}
