//! Pictures by their visibility list, in stages that are kept from one picture to the next.
//!
//! A stage runs for a picture if an edit since the last one made it stale: see [`Stage::inputs`].
//! So after an edit of the hair nothing is drawn and no shadow is cast, and after one of the
//! background nothing is shaded.

mod alone;
mod inputs;
pub(super) mod kept;
mod lights;
mod parts;
mod resolve;
mod served;
mod shading;
mod stage;
mod stages;
mod state;

use strandlight_scene::camera::{Camera, view_uniform};
use strandlight_scene::progress::timed;
use strandlight_scene::stats::{self, Observer};
use strandlight_scene::{Picture, PreparedScene, Stats};

use super::composite::before_composite;
use super::radiance::RadianceBefore;
use super::stats_name::stats_name;
use super::unblocked::Unblocked;

use inputs::NeededTables;
use parts::{Painted, Picturing, ProxyLight, Quality, Shaded};
pub(super) use stage::Edit;
use stage::Stage;
use stages::can_be_everywhere;
pub(super) use state::Frame;

impl Frame {
    /// Nothing yet of a scene, whose maps are shared out by these amplitudes of its lights.
    pub fn of(planned: &[[f32; 3]]) -> Frame {
        Frame {
            planned: planned.to_vec(),
            ..Frame::default()
        }
    }

    /// Forgets what `edit` makes stale.
    pub fn edited(&mut self, edit: Edit) {
        let is_shading_stale = Stage::Shade.inputs().contains(&edit);
        // Maps of this view, and those under way that will serve any.
        let are_kept =
            edit == Edit::View && (self.unblocked.as_ref()).is_some_and(Unblocked::is_everywhere);
        let is_cast_on = edit == Edit::View
            && (self.casting.as_ref()).is_some_and(|casting| casting.found().is_everywhere());
        match edit {
            Edit::View => self.keep_for_next_view(are_kept),
            _ => self.forget_views_before(edit),
        }
        if is_shading_stale {
            self.keep_shaded(edit);
            self.served.forget_draft();
        }
        if is_shading_stale && edit != Edit::Colors {
            // Its places may be others.
            match Stage::List.inputs().contains(&edit) {
                true => self.served.kept = None,
                false => self.outdate_kept(edit),
            }
            match edit {
                // Paint is no matter of plain points.
                Edit::Paint | Edit::View => {}
                _ if edit.keeps_shadows() => self.served.outdate_bounced(),
                _ => self.served.forget_bounced(),
            }
        }
        for stage in Stage::ALL {
            let is_stale = stage.inputs().contains(&edit);
            if !is_stale || are_kept && stage == Stage::ShadowMaps {
                continue;
            }
            let casting = self.casting.take_if(|_| is_cast_on);
            self.forget(stage);
            self.casting = casting.or(self.casting.take());
        }
        if matches!(
            edit,
            Edit::Points | Edit::Lights | Edit::Colors | Edit::Proxies
        ) {
            self.are_lights_current = false;
            // By now only colours can have changed where there is some.
            self.forget_lit_proxies_and_their_colors();
        }
        // What is scattered forward reaches them too.
        if matches!(edit, Edit::Hair | Edit::Terms | Edit::Densities) {
            self.forget_lit_proxies_and_their_colors();
        }
        if edit == Edit::Hair {
            self.profile = None;
        }
        if edit == Edit::Background {
            self.version += 1;
        }
        // Paint is mixed with the absorption of the hair.
        if matches!(
            edit,
            Edit::Paint | Edit::PaintKinds | Edit::Hair | Edit::Terms
        ) {
            self.needed_tables = None;
        }
        self.was_turned |= edit == Edit::View && self.is_drawn;
    }

    /// Keeps what the next view can use, shadow maps too if they `are_kept`.
    fn keep_for_next_view(&mut self, are_kept: bool) {
        let visible = (self.list.as_ref()).map(|(_, visible)| &visible.points[..]);
        self.served.keep_bounced(visible);
        // It starts with what this one shows, if it shows anything.
        if let Some((visible, shaded)) = visible.zip(self.shaded.take()) {
            self.before_view = match shaded.quality {
                Quality::Carried => self.carried_from.take(),
                _ => Some((visible.to_vec(), shaded.radiance)),
            };
        }
        self.carried_from = None;
        let through = self.through.take();
        if through
            .as_ref()
            .is_some_and(|through| through.maps.is_everywhere())
        {
            self.through_before = through;
        }
        let arriving = self.served.arriving.take();
        // Shares of other maps would stay beside those of the volume.
        let arriving = arriving.filter(|arriving| are_kept || !arriving.has_shares);
        let seen = arriving.is_some().then(|| self.list.take()).flatten();
        self.served.arriving_before = arriving
            .zip(seen)
            .map(|(arriving, (_, visible))| (arriving, visible.points));
    }

    /// Forgets what was kept of views before, as far as `edit`, which is none of the view, makes it stale.
    fn forget_views_before(&mut self, edit: Edit) {
        if Stage::ShadowMaps.inputs().contains(&edit) {
            self.served.arriving_before = None;
        }
        if Stage::ThroughMaps.inputs().contains(&edit) {
            self.through_before = None;
        }
    }

    /// Keeps the radiance that pictures after `edit` start with, and forgets what they cannot.
    fn keep_shaded(&mut self, edit: Edit) {
        let is_whole = |shaded: &mut Shaded| shaded.quality == Quality::Whole;
        self.before_paint.take_if(|_| edit != Edit::Paint);
        if edit == Edit::Paint
            && let Some(Shaded {
                radiance, paint, ..
            }) = self.shaded.take_if(is_whole)
        {
            self.before_paint = Some(Painted { radiance, paint });
        }
        if !edit.keeps_shadows() {
            self.before = None;
            self.before_view.take_if(|_| edit != Edit::View);
            self.carried_from = None;
        } else if let Some(shaded) = self.shaded.take_if(is_whole) {
            self.before = Some(RadianceBefore::new(shaded.radiance));
        }
    }

    /// The proxies are in other light.
    fn forget_lit_proxies(&mut self) {
        (self.proxies, self.bounce) = (None, None);
        self.served.finding_bounced = None;
        if let Some(bounced) = &mut self.served.bounced {
            bounced.is_current = false;
        }
    }

    /// The same, and what arrives at them if it was kept for lights of these colours alone.
    fn forget_lit_proxies_and_their_colors(&mut self) {
        self.forget_lit_proxies();
        let is_of_these_colors = |found: &ProxyLight| !found.is_of_any_color();
        if self.proxy_light.as_ref().is_some_and(is_of_these_colors) {
            self.forget(Stage::ProxyLight);
        }
    }

    fn outdate_kept(&mut self, edit: Edit) {
        match &mut self.served.kept {
            Some(kept) if edit == Edit::Paint => kept.repaint(),
            Some(kept) => kept.outdate(),
            None => {}
        }
    }

    fn forget(&mut self, stage: Stage) {
        match stage {
            Stage::Voxelise => {
                (
                    self.voxelising,
                    self.volume,
                    self.axis_shares,
                    self.strip_order,
                ) = (None, None, None, None);
            }
            Stage::Transmittance => {
                (
                    self.records,
                    self.served.arriving,
                    self.served.arriving_before,
                ) = (None, None, None);
            }
            Stage::List => (self.listing, self.list, self.served.arriving) = (None, None, None),
            Stage::ShadowMaps => {
                (self.casting, self.unblocked, self.served.arriving) = (None, None, None);
            }
            Stage::ThroughMaps => (self.through_casting, self.through) = (None, None),
            Stage::ProxyLight => {
                self.proxy_light = None;
                self.forget_lit_proxies();
            }
            Stage::Bounce => (self.bounce_rays, self.bounce) = (None, None),
            Stage::MultipleTables => {
                self.filling = None;
                if let Some(tables) = &mut self.multiple {
                    tables.plain = None;
                }
            }
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
        let of_steps = before_composite(observer);
        while self.step(&picturing) {
            of_steps(self.share_done());
        }
        let (rgba, seconds) = timed(|| self.composite(&picturing, observer));
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

    /// Has it the light of most points, and the others interpolated?
    pub fn has_most_points(&self) -> bool {
        matches!(self.quality(), Some(Quality::Turned | Quality::Most))
    }

    /// Has it all light?
    pub fn has_all_light(&self) -> bool {
        self.quality()
            .is_some_and(|quality| !matches!(quality, Quality::Carried | Quality::Draft))
    }

    /// Is there a picture that was shaded for this view?
    fn has_shaded(&self) -> bool {
        self.quality()
            .is_some_and(|quality| quality != Quality::Carried)
    }

    /// What the work took since it was last asked.
    pub fn take_stats(&mut self) -> Stats {
        std::mem::take(&mut self.stats)
    }

    /// Is there a picture of this size?
    pub fn can_show(&self, size: [u32; 2]) -> bool {
        self.shaded.is_some() && self.list.is_some() && self.size == size
    }

    /// The last picture of the scene as it was last drawn, linear radiance and coverage, row by row, if there
    /// is one.
    pub fn shown(
        &self,
        scene: &PreparedScene,
        camera: &Camera,
        size: [u32; 2],
    ) -> Option<Vec<[f32; 4]>> {
        self.can_show(size).then(|| {
            let picturing = Picturing {
                scene,
                view: view_uniform(camera, &scene.strands, size, scene.radiance_scale()),
                beside: scene.beside(),
                has_drafts: true,
            };
            self.composite(&picturing, &|_| ())
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
        // What is carried over from the view before is one, if only maps of the line of sight are to come and those of that
        // view do not serve.
        let is_carried = self.quality() == Some(Quality::Carried)
            && self.unblocked.is_some()
            && !self.has_through_near(picturing);
        let has_draft = self.has_shaded() || is_carried || !picturing.has_drafts || has_none;
        // The first maps of the lights show something if these are there.
        let maps = match &self.through {
            None => Stage::ThroughMaps,
            Some(_) => Stage::ShadowMaps,
        };
        if self.volume.is_none() {
            Some(Stage::Voxelise)
        } else if self.list.is_none() {
            Some(Stage::List)
        } else if self.to_be_shadowed(picturing) {
            Some(Stage::Shade)
        } else if !has_maps && has_draft {
            Some(maps)
        } else if !self.has_records() {
            Some(Stage::Transmittance)
        } else if !self.has_proxy_light() {
            Some(Stage::ProxyLight)
        } else if self.bounce.is_none()
            && picturing.scene.has_bounce()
            && !self.is_recolored(picturing)
        {
            Some(Stage::Bounce)
        } else if self.lacks_tables() {
            Some(Stage::MultipleTables)
        } else if self.quality() != Some(Quality::Whole) {
            Some(Stage::Shade)
        } else {
            self.to_be_extended(picturing)
        }
    }

    /// The maps that are there at the points that this view shows, and are not yet at all points for other views
    /// to come.
    fn to_be_extended(&self, picturing: &Picturing) -> Option<Stage> {
        let (lights, of_lights, through) = (
            self.lights.as_ref()?,
            self.unblocked.as_ref()?,
            self.through.as_ref()?,
        );
        let n_points = picturing.scene.strands.points.len();
        if !picturing.has_drafts || !can_be_everywhere(&lights.plan, n_points) {
            None
        } else if !of_lights.is_everywhere() {
            Some(Stage::ShadowMaps)
        } else if !through.maps.is_everywhere() {
            Some(Stage::ThroughMaps)
        } else {
            None
        }
    }

    /// Can lights of other colours be shown at once, by what was kept?
    fn is_recolored(&self, picturing: &Picturing) -> bool {
        let kept = self.served.kept.as_ref().zip(self.lights.as_ref());
        picturing.has_drafts
            && !self.has_shaded()
            && (self.unblocked.is_some() && self.through.is_some())
            && kept.is_some_and(|(kept, lights)| kept.serves(&lights.records))
    }

    /// Are tables to be filled?
    fn lacks_tables(&self) -> bool {
        let is_lacking = |needed: NeededTables| {
            let tables = self.multiple.as_ref();
            needed.is_any() && tables.is_none_or(|tables| !needed.are_in(tables))
        };
        self.needed_tables.is_some_and(is_lacking)
    }

    /// Are there maps of the line of sight of a view before, near this one?
    fn has_through_near(&self, picturing: &Picturing) -> bool {
        self.through_before
            .as_ref()
            .is_some_and(|before| before.is_near(picturing.view.forward))
    }

    fn quality(&self) -> Option<Quality> {
        self.shaded.as_ref().map(|shaded| shaded.quality)
    }

    /// Works a little on what is to be done next; answers whether there was anything.
    fn step(&mut self, picturing: &Picturing) -> bool {
        let scene = picturing.scene;
        if self.stats.device.is_none() && self.stats.stages.is_empty() {
            self.stats = scene.counts(stats_name());
        }
        self.prepare_lights(scene);
        if let Some(lights) = &self.lights {
            // By the plan that is kept while colours change.
            self.stats.shadow_maps = lights.plan.views.len();
        }
        if self.needed_tables.is_none() {
            self.needed_tables = Some(NeededTables::of(scene));
            if let Some(tables) = &mut self.multiple {
                tables.keep_packs_of(scene);
            }
        }
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
            Stage::ProxyLight => self.light_proxies(picturing),
            Stage::Bounce => self.find_bounce(picturing),
            Stage::MultipleTables => self.fill_tables(scene),
            Stage::Shade => self.shade(picturing),
        }
        true
    }
}

impl Frame {
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

    /// About how much of the work is done, 0..=1.
    fn share_done(&self) -> f64 {
        let list = f64::from(u8::from(self.list.is_some()));
        let maps = match &self.casting {
            Some(casting) => casting.share_done(),
            None => f64::from(u8::from(self.unblocked.is_some())),
        };
        let shade = match &self.shading {
            Some(shading) if shading.quality == Quality::Whole => {
                let n = shading.radiance.at.len() * shading.groups.len().max(1);
                let n_done = shading.radiance.at.len() * shading.group + shading.n_done;
                n_done as f64 / n.max(1) as f64
            }
            _ => f64::from(u8::from(self.quality() == Some(Quality::Whole))),
        };
        0.1 * list + 0.6 * maps + 0.3 * shade
    }
}
