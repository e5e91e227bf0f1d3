//! The renderer for windows and pages: the picture of the scene as it was last set, in the bytes
//! that a screen shows.

use std::mem;
use std::ops::Range;
use std::time::Duration;

use rayon::prelude::*;
use strandlight_formats::{Background, Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::budget::check_target;
use strandlight_scene::interactive::{PictureProgress, RenderReport};
use strandlight_scene::motion::Wind;
use strandlight_scene::paint::Paint;
use strandlight_scene::panorama::TurnedPanorama;
use strandlight_scene::progress::{Deadline, timed};
use strandlight_scene::proxy::Proxy;
#[cfg(not(target_arch = "wasm32"))]
use strandlight_scene::stats::Observer;
use strandlight_scene::tone;
use strandlight_scene::{
    Backend, Camera, DisplayTransform, Picture, PreparedScene, RenderError, Stats,
};

use super::CpuRenderer;
#[cfg(not(target_arch = "wasm32"))]
use super::edited_scene::BentStrands;
use super::edited_scene::{EditedScene, edit_setters};
use super::fade::Fade;
use super::frame::Edit;
use super::renderer::Advance;
use super::stats_name::stats_name;

/// Work after a view is shown [as seen from another](CpuRenderer::reprojected): less, and a drag would see no
/// picture of its own; more, and it would lag.
const WORK_ON_VIEWS: Duration = Duration::from_millis(30);

/// What a screen shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplayPixels<'a> {
    /// Tone-mapped sRGB times alpha, and alpha, row by row from the top.
    pub pixels: &'a [[u8; 4]],
    /// Width and height; zero before there is a picture.
    pub size: [u32; 2],
    /// Another number for every other picture of a renderer.
    pub version: u64,
}

/// A scene drawn on the CPU for a screen: setters, those of [`Backend`], say what is to be drawn (they make the tables of
/// the hair and the strands that it needs, no picture), [`InteractiveRenderer::advance`] works on it, and
/// [`InteractiveRenderer::display`] is the last picture meanwhile.
pub struct InteractiveRenderer {
    renderer: CpuRenderer,
    /// Of the pictures to come; a side of zero: none is drawn.
    size: [u32; 2],
    pixels: Vec<[u8; 4]>,
    /// What `pixels` becomes, where a refinement would be seen to jump.
    fade: Option<Fade>,
    /// Of what it ends with: is it lit as the scene was last set, and is nothing left to do?
    is_faded_to: (bool, bool),
    /// Of `pixels`.
    shown: [u32; 2],
    version: u64,
    /// Of the renderer's picture that is shown.
    frame_version: u64,
    /// Is there a picture of the view and size as last set?
    is_shown: bool,
    /// Is it that of another view, as seen from this one?
    is_reprojected: bool,
    /// Does [`WORK_ON_VIEWS`] follow that picture?
    owes_work: bool,
    /// What led to a picture that the next step shows: in this one there was no time left.
    to_be_shown: Option<Advance>,
    /// Is what is shown of the scene as it was last set, so that what follows refines it?
    is_current: bool,
    /// Is it lit as the scene was last set?
    is_shaded: bool,
    /// And nothing left to do?
    is_done: bool,
    report: RenderReport,
    shadings: u64,
}

impl InteractiveRenderer {
    /// A renderer of `scene`; its first picture, of the scene's size, is made by
    /// [`InteractiveRenderer::advance`].
    pub fn new(scene: PreparedScene) -> InteractiveRenderer {
        InteractiveRenderer::of(EditedScene::new(scene))
    }

    /// The same of a scene as it was edited.
    pub(super) fn of(edited: EditedScene) -> InteractiveRenderer {
        let report = RenderReport {
            stats: edited.scene.counts(stats_name()),
            ..RenderReport::default()
        };
        InteractiveRenderer {
            size: edited.scene.size,
            renderer: CpuRenderer::of(edited),
            pixels: Vec::new(),
            fade: None,
            is_faded_to: (false, false),
            shown: [0, 0],
            version: 0,
            frame_version: 0,
            is_shown: false,
            is_reprojected: false,
            owes_work: false,
            to_be_shown: None,
            is_current: false,
            is_shaded: false,
            is_done: false,
            report,
            shadings: 0,
        }
    }

    /// Works on the picture for about `budget`, one step at least.
    ///
    /// # Errors
    /// A picture that is too large.
    // Steps take some milliseconds, up to 30 on two cores (480,000 points).
    pub fn advance(&mut self, budget: Duration) -> Result<PictureProgress, RenderError> {
        if self.is_resting() {
            return Ok(self.progress());
        }
        // Its steps follow each other as fast as a screen takes them: work in between would hold up the picture.
        if self.step_fade() {
            return Ok(self.progress());
        }
        if !self.renderer.has_steps(self.size) {
            let (size, samples) = (self.size, self.scene().samples);
            let (picture, stats) = self.renderer.draw(size, samples, &|_| ())?;
            self.show(&picture, stats);
            (self.is_shaded, self.is_done) = (true, true);
            return Ok(self.progress());
        }
        let is_reprojected = self.reproject();
        let budget = match mem::take(&mut self.owes_work) || is_reprojected {
            true => WORK_ON_VIEWS,
            false => budget,
        };
        let to_be_shown = self.to_be_shown.take();
        self.renderer.hold(false);
        if let Some(advance) = to_be_shown.filter(|of| self.is_to_be_shown(of)) {
            self.take_up(&Advance {
                is_done: advance.is_done && !self.renderer.has_waiting(),
                is_complete: advance.is_complete && !self.renderer.has_waiting(),
                ..advance
            });
            return Ok(self.progress());
        }
        let deadline = Deadline::after(budget);
        let advance = self.renderer.advance(self.size, deadline);
        match self.is_to_be_shown(&advance) && !deadline.is_to_come() {
            // To bring a picture on the screen takes longer than most steps.
            true => {
                self.to_be_shown = Some(advance);
                self.renderer.hold(true);
            }
            false => self.take_up(&advance),
        }
        Ok(self.progress())
    }

    /// Goes on with the fade; answers whether there was one.
    fn step_fade(&mut self) -> bool {
        let Some(fade) = &mut self.fade else {
            return false;
        };
        self.version += 1;
        if fade.advance(&mut self.pixels) {
            self.fade = None;
            (self.is_shaded, self.is_done) = self.is_faded_to;
        }
        true
    }

    /// Is there a picture that is not on the screen?
    fn is_to_be_shown(&self, advance: &Advance) -> bool {
        // Or it is of a view that was left meanwhile.
        let is_left = self.is_reprojected && self.renderer.has_waiting_view();
        let is_new = advance.version != self.frame_version || !self.is_shown;
        !is_left && is_new && self.renderer.can_show(self.size)
    }

    /// Shows the picture that there is now, if it is another one.
    fn take_up(&mut self, advance: &Advance) {
        let (picture, seconds) = timed(|| match self.is_to_be_shown(advance) {
            true => self.renderer.shown(self.size),
            false => None,
        });
        if self.is_reprojected && self.renderer.has_waiting_view() {
            self.frame_version = advance.version;
        }
        if let Some(picture) = picture {
            self.frame_version = advance.version;
            let stats = self.renderer.take_stats();
            self.show(&picture, stats);
            self.report.ran("composite");
            self.report.took("composite", seconds);
        }
        if advance.is_done {
            // Of maps for other views to come.
            let stats = self.renderer.take_stats();
            self.note(&stats);
        }
        self.is_faded_to = (advance.is_complete, advance.is_done);
        (self.is_shaded, self.is_done) = match self.fade {
            Some(_) => (false, false),
            None => self.is_faded_to,
        };
    }

    /// How far the picture has come. It has no samples.
    pub fn progress(&self) -> PictureProgress {
        PictureProgress {
            is_shown: self.is_shown,
            is_shaded: self.is_shaded,
            is_done: self.is_resting(),
            ..PictureProgress::default()
        }
    }

    /// The last picture, of the size that was set last from the first picture of that size on.
    pub fn display(&self) -> DisplayPixels<'_> {
        DisplayPixels {
            pixels: &self.pixels,
            size: self.shown,
            version: self.version,
        }
    }

    /// The finished picture, linear, without anything behind it; drawn anew where it is not finished or of
    /// another size. Nothing that is shown changes.
    ///
    /// # Errors
    /// As [`Backend::render`].
    #[cfg(not(target_arch = "wasm32"))]
    pub fn over_nothing(&mut self, size: [u32; 2]) -> Result<Picture, RenderError> {
        if let (true, Some(picture)) = (self.is_done, self.renderer.shown_over_nothing(size)) {
            return Ok(picture);
        }
        let mut edited = self.renderer.edited.clone();
        edited.scene.background = Background::None;
        let samples = edited.scene.samples;
        Ok(CpuRenderer::of(edited).render(size, samples, &|_| ())?.0)
    }

    /// What was recomputed since the last edit, and what that took.
    pub fn report(&self) -> &RenderReport {
        &self.report
    }

    /// Nothing is drawn, or all of it is.
    fn is_resting(&self) -> bool {
        self.is_done || self.size.contains(&0)
    }

    /// The scene was edited elsewhere, and is this one now, its strands bent by its wind.
    ///
    /// # Errors
    /// As [`EditedScene::bend`]; the strands are those before the wind then.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn set_edited(
        &mut self,
        mut edited: EditedScene,
        edits: Vec<Edit>,
    ) -> Result<(), RenderError> {
        if let Some(bent) = self.renderer.edited.bent() {
            edited.take_bent(&bent);
        }
        let bent = edited.bend();
        self.renderer.edited = edited;
        self.take(edits);
        bent
    }

    /// The strands of the scene, where wind bends them.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn bent(&self) -> Option<BentStrands> {
        self.renderer.edited.bent()
    }

    /// Another scene takes the place of this one.
    pub(super) fn replace(&mut self, edited: EditedScene) {
        self.report.stats = edited.scene.counts(stats_name());
        self.size = edited.scene.size;
        self.renderer.replace(edited);
        self.turned();
    }

    /// The scene was edited.
    fn take(&mut self, edits: impl IntoIterator<Item = Edit>) {
        let edits: Vec<Edit> = edits.into_iter().collect();
        if edits.is_empty() {
            return;
        }
        let is_view = edits.contains(&Edit::View);
        self.renderer.take(edits);
        match is_view {
            true => self.turned(),
            false => self.edited(),
        }
    }

    /// The picture is no longer that of the scene.
    fn edited(&mut self) {
        if self.is_done {
            self.report.stages.clear();
        }
        (self.fade, self.is_current) = (None, false);
        (self.is_shaded, self.is_done) = (false, false);
    }

    /// Nor that of the view.
    fn turned(&mut self) {
        self.edited();
        self.is_shown = false;
    }

    /// Notes what stages took.
    fn note(&mut self, stats: &Stats) {
        for stage in &stats.stages {
            self.report.ran(stage.name);
            self.report.took(stage.name, 1e-3 * stage.milliseconds);
        }
    }

    /// Shows the last picture as the view sees it that was set, if there is a new one, so that it can be on the screen while
    /// [`InteractiveRenderer::advance`] works on the view's own picture; answers whether it did.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn show_reprojected(&mut self) -> bool {
        if self.is_resting() || !self.renderer.has_steps(self.size) {
            return false;
        }
        let is_reprojected = self.reproject();
        self.owes_work |= is_reprojected;
        is_reprojected
    }

    /// Shows the last picture as the view sees it that was set, until that has a picture; answers whether it did.
    fn reproject(&mut self) -> bool {
        if self.is_shown {
            return false;
        }
        let (picture, seconds) = timed(|| self.renderer.reprojected(self.size));
        if let Some(picture) = picture {
            let stats = Stats {
                stages: Vec::new(),
                ..self.report.stats.clone()
            };
            self.show(&picture, stats);
            self.report.ran("reproject");
            self.report.took("reproject", seconds);
            (self.is_shown, self.is_reprojected) = (true, true);
        }
        self.is_reprojected
    }

    /// Takes up a picture, and what it took.
    fn show(&mut self, picture: &Picture, stats: Stats) {
        let scene = self.renderer.scene();
        let grade = (scene.exposure.exp2(), &scene.display);
        let size = [picture.width, picture.height];
        let is_refined = self.is_current && self.shown == size;
        let (pixels, seconds) = timed(|| {
            let mut pixels = Vec::new();
            levels(picture, grade, &mut pixels);
            pixels
        });
        self.fade = None;
        let fade = match is_refined {
            true => Fade::new(&self.pixels, pixels),
            false => Err(pixels),
        };
        match fade {
            Ok(fade) => self.fade = Some(fade),
            Err(pixels) => self.pixels = pixels,
        }
        self.shown = size;
        self.version += 1;
        self.is_shown = !self.renderer.has_waiting_view();
        self.is_reprojected = false;
        self.is_current = !self.renderer.has_waiting();
        self.note(&stats);
        let report = &mut self.report;
        report.ran("display");
        report.took("display", seconds);
        let is_lit = stats.stages.iter().any(|stage| stage.name == "shade");
        self.shadings += u64::from(is_lit);
        report.shadings = self.shadings;
        report.stats = stats;
    }
}

/// What a screen shows of `picture`, in place of what `pixels` had: radiance times `scale`, through `display`,
/// in sRGB times alpha. The twin of `show` in `shaders/pass/display.wgsl`.
pub fn levels(
    picture: &Picture,
    (scale, display): (f32, &DisplayTransform),
    pixels: &mut Vec<[u8; 4]>,
) {
    pixels.resize(picture.rgba.len(), [0; 4]);
    let width = picture.width.max(1) as usize;
    let rows = pixels
        .par_chunks_mut(width)
        .zip(picture.rgba.par_chunks(width));
    rows.enumerate().for_each(|(y, (pixels, row))| {
        // Much of a picture is one colour: what is behind the hair.
        let mut last = ([0.0; 4], display.graded([0.0; 4], scale));
        for (x, (pixel, &rgba)) in pixels.iter_mut().zip(row).enumerate() {
            if rgba != last.0 {
                last = (rgba, display.graded(rgba, scale));
            }
            let [r, g, b, a] = last.1;
            let dither = tone::dither([x as u32, y as u32]);
            *pixel = [r * a, g * a, b * a, a].map(|value| tone::level(value, dither));
        }
    });
}

impl Backend for InteractiveRenderer {
    fn name(&self) -> String {
        self.renderer.name()
    }

    fn scene(&self) -> &PreparedScene {
        self.renderer.scene()
    }

    fn set_scene(&mut self, scene: PreparedScene) -> Result<(), RenderError> {
        self.replace(EditedScene::new(scene));
        Ok(())
    }

    edit_setters!(renderer.edited);

    fn set_wind(&mut self, wind: Option<Wind>) -> Result<(), RenderError> {
        let edit = self.renderer.edited.set_wind(wind)?;
        self.take(edit);
        Ok(())
    }

    fn set_size(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        if self.size == size {
            return Ok(());
        }
        if !size.contains(&0) {
            check_target(size)?;
            self.renderer.set_size(size)?;
        }
        self.size = size;
        self.turned();
        Ok(())
    }

    /// Of pictures by samples alone, which a screen is not shown.
    fn set_samples(&mut self, samples: u32) {
        self.renderer.set_samples(samples);
    }

    fn shade_view_only(&mut self) {
        self.renderer.shade_view_only();
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn render(
        &mut self,
        size: [u32; 2],
        samples: u32,
        observer: Observer,
    ) -> Result<(Picture, Stats), RenderError> {
        self.renderer.render(size, samples, observer)
    }
}
