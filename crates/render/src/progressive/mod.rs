//! The renderer as a state machine, for windows and pages.
//!
//! [`ProgressiveRenderer`] owns a picture and a [`HairRenderer`], which has
//! the scene and draws the strands. Setters, those of [`Backend`](crate::Backend), say what is to
//! be drawn and return at once; [`ProgressiveRenderer::advance`] works on it for about the given
//! time, and [`ProgressiveRenderer::display`] is the last good picture meanwhile.
//!
//! Work goes in cycles. A cycle takes up all that was set, writes it to the device, and lights the
//! points in steps into the radiance buffer that is not shown; then the two change places and the
//! samples of the picture restart. What is set during a cycle waits for the next one, so that a
//! slider that is dragged is followed at the pace of whole cycles; a cycle less than half done is
//! given up for an edit once. The view is the exception: from a new view the strands are drawn at
//! once, lit as they were when last complete, as a draft. Before the first cycle is done, the draft
//! is lit by a guess: it is there before any shadow is looked for, and nothing of it remains.
//!
//! [`ProgressiveRenderer::draw_by_list`] has a visibility list take the place of samples: it is made once for a view,
//! only its points are lit, and every cycle draws it once. A draft of another view is drawn by a list of its own; points
//! of it that were not lit are left out. A list takes the device an answer, two where it has several bands; who does not
//! wait goes on with shadow maps meanwhile, and draws a view that has been left by then all the same, so that there is
//! something to see of a view that keeps turning.
//!
//! Which stages an edit makes stale stands in [`STAGES`](crate::invalidation::STAGES).
//!
//! Nothing is allocated on the device but where something grows, and pipelines are kept by what
//! they were compiled for.
//!
//! Which samples a strand thinner than a pixel covers depends on the strand, the pixel and the
//! number of the pass alone: translucent strands come out in any order right in the mean, with a
//! noise that [`PictureProgress::noise`] estimates, and that stays where it is while the view moves. A
//! step of 0.05 degrees of an orbit, strands far below a pixel wide, replaces 9 to 14 % of the
//! noise, one of
//! 0.5 degrees 24 to 41 % (`tests/tests/gpu/progressive.rs`).

mod backend;
mod pace;
mod shading;
mod size;
#[cfg(not(target_arch = "wasm32"))]
mod still;
mod work;

use crate::gpu::Context;
use crate::hair_renderer::HairRenderer;
use crate::passes::clock::Clock;
use crate::passes::film::Film;
use crate::passes::lighting::COUNTER_BYTES;
use crate::passes::noise::Noise;
use crate::passes::parts::{self, Tile};
use crate::passes::readback::Readback;
use crate::passes::resources::failed;
use crate::passes::screen::{DisplayPipeline, Screen};
use crate::passes::target::Target;
use crate::passes::{DeviceBytes, PartLimits};
use pace::Pacer;
use strandlight_scene::RenderError;
use strandlight_scene::budget::MAX_SAMPLES;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::sampling::PASS_SAMPLES;
use strandlight_scene::scene::PreparedScene;

pub use strandlight_scene::interactive::{PictureProgress, RenderReport, StageReport};

/// A scene on a device, drawn bit by bit.
pub struct ProgressiveRenderer {
    /// The scene, its edits, light and strands.
    hair: HairRenderer,
    film: Film,
    show: DisplayPipeline,
    size: [u32; 2],
    /// The part of the picture that is drawn, unless it is all of it.
    tile: Option<Tile>,
    parts: PartLimits,
    target: Option<Target>,
    screen: Screen,
    /// Of another size, not drawn yet.
    next_screen: Option<Screen>,
    noise: Noise,
    /// Counts of products that shading left, and of how many batches.
    counters: (Readback, u64),
    /// Whether the first picture is to be one without shadows.
    has_preview: bool,
    picture: Drawn,
    pacer: Pacer,
    /// What it was when the last still was finished.
    #[cfg(not(target_arch = "wasm32"))]
    still_report: RenderReport,
    /// Bytes that its drawing and its picture took.
    #[cfg(not(target_arch = "wasm32"))]
    still_bytes: [u64; 2],
    /// The picture is read back when it is finished: nothing is shown before.
    is_still: bool,
    /// Are pictures drawn by a visibility list, where that is possible?
    by_list: bool,
    /// Was the last still?
    #[cfg(not(target_arch = "wasm32"))]
    was_by_list: bool,
    /// The device has not answered yet in this turn how much there is to list.
    is_listing: bool,
}

/// What there is of the picture.
#[derive(Clone, Debug, Default)]
struct Drawn {
    /// Rows where the bands of a pass end.
    band_ends: Vec<u32>,
    /// Bands of the pass under way that there are.
    bands: usize,
    passes: u32,
    /// Passes in the picture on the screen, if it is of this view, light and grade.
    shown: u32,
    /// The device has no room for a list of it.
    is_sampled: bool,
    /// What is on the screen is a view that was asked for before this one.
    is_of_before: bool,
}

impl ProgressiveRenderer {
    /// Puts `scene` on the device; the first picture is made by [`ProgressiveRenderer::advance`],
    /// in the scene's size until [`ProgressiveRenderer::set_size`] says another.
    ///
    /// # Errors
    /// What does not fit the device's limits, by name, before anything is made; whatever the
    /// device refuses.
    pub fn new(
        context: &Context,
        scene: PreparedScene,
    ) -> Result<ProgressiveRenderer, RenderError> {
        ProgressiveRenderer::with_budget(context, scene, u64::MAX)
    }

    /// [`ProgressiveRenderer::new`] with at most `bytes` on the device, about. Where the records of
    /// all lights take too much, every shading finds them again, batch by batch.
    ///
    /// # Errors
    /// As [`ProgressiveRenderer::new`]; a scene that needs more, before anything is made.
    pub fn with_budget(
        context: &Context,
        mut scene: PreparedScene,
        bytes: u64,
    ) -> Result<ProgressiveRenderer, RenderError> {
        let limits = context.device.limits();
        // The size of stills; none is on the device before it is asked for.
        scene.size = parts::fitting(scene.size, &limits);
        let size = scene.size;
        let scene = DeviceBytes::fit(scene, size, &limits, bytes)?;
        let before = context.counts();
        let mut hair = HairRenderer::on(context, scene, Clock::new(context), None)?;
        hair.report.stats = hair.scene.counts(context.name());
        let mut film = Film::new(context)?;
        film.set_proxies(context, &hair.ribbons, &hair.lighting);
        let mut renderer = ProgressiveRenderer {
            film,
            show: DisplayPipeline::new(context)?,
            size: [0, 0],
            tile: None,
            parts: PartLimits::default(),
            target: None,
            screen: Screen::new(context, [1, 1]),
            next_screen: None,
            noise: Noise::new(context)?,
            counters: (Readback::new(context, COUNTER_BYTES), 1),
            has_preview: true,
            picture: Drawn::default(),
            pacer: Pacer::new(!cfg!(target_arch = "wasm32")),
            #[cfg(not(target_arch = "wasm32"))]
            still_report: RenderReport::default(),
            #[cfg(not(target_arch = "wasm32"))]
            still_bytes: [0; 2],
            is_still: false,
            by_list: false,
            #[cfg(not(target_arch = "wasm32"))]
            was_by_list: false,
            is_listing: false,
            hair,
        };
        renderer.set_size(renderer.hair.scene.size)?;
        renderer.hair.counts_before = before;
        renderer.hair.report.device_bytes = renderer.device_bytes();
        context.check("upload").map_err(failed)?;
        Ok(renderer)
    }

    /// Puts `scene` on the device of `context` in place of what is on this one, drawn in the same way.
    ///
    /// # Errors
    /// As [`ProgressiveRenderer::new`] and [`ProgressiveRenderer::draw_by_list`]; nothing is changed then.
    pub fn move_to(&mut self, context: &Context, scene: PreparedScene) -> Result<(), RenderError> {
        let mut renderer = ProgressiveRenderer::new(context, scene)?;
        if self.by_list {
            renderer.draw_by_list()?;
        }
        *self = renderer;
        Ok(())
    }

    /// The device.
    pub fn context(&self) -> &Context {
        &self.hair.context
    }

    /// The scene as it was last set.
    pub fn scene(&self) -> &PreparedScene {
        &self.hair.scene
    }

    /// Whether [`ProgressiveRenderer::advance`] waits for what it has submitted, as it does
    /// natively by default, or leaves the device to itself and learns later how
    /// long it took, as it has to in a browser.
    pub fn set_waiting(&mut self, is_waiting: bool) {
        self.pacer = Pacer::new(is_waiting && !cfg!(target_arch = "wasm32"));
        self.hair.set_waiting(self.pacer.is_waiting());
    }

    /// Draws all pictures but those of [`ProgressiveRenderer::finish`] by a visibility list from now on, without samples,
    /// as the CPU renderer does. Those that the device has no room for are drawn with samples all the same.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn draw_by_list(&mut self) -> Result<(), RenderError> {
        self.hair.use_list(self.pacer.is_waiting())?;
        self.by_list = true;
        self.restart_picture();
        self.hair.context.check("visibility list").map_err(failed)
    }

    /// Draws all pictures with samples from now on, as before [`ProgressiveRenderer::draw_by_list`].
    #[cfg(not(target_arch = "wasm32"))]
    pub fn draw_with_samples(&mut self) {
        self.by_list = false;
        self.restart_picture();
    }

    /// How far the picture has come.
    pub fn progress(&self) -> PictureProgress {
        let is_shaded = self.hair.is_complete();
        let (samples, total_samples) = match self.is_by_list() {
            true => (0, 0),
            false => (self.samples_of(self.picture.shown), self.total_samples()),
        };
        let is_whole = self.picture.shown >= self.n_passes();
        PictureProgress {
            samples,
            total_samples,
            is_shown: self.picture.shown > 0 || self.picture.is_of_before,
            is_shaded,
            is_done: self.target.is_none() || is_shaded && is_whole,
            noise: self.noise.of(self.picture.shown),
        }
    }

    /// The picture on the screen: tone-mapped, encoded in sRGB, multiplied by alpha, `rgba8unorm`.
    /// Of the size that was set last (and not zero) from the first picture of that size on.
    pub fn display(&self) -> &wgpu::TextureView {
        self.screen.view()
    }

    /// What [`ProgressiveRenderer::display`] shows, row by row.
    ///
    /// # Errors
    /// The device failed.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn read_display(&self) -> Result<Vec<[u8; 4]>, RenderError> {
        self.screen.read(&self.hair.context)
    }

    /// What the device did since the last edit.
    pub fn report(&self) -> &RenderReport {
        &self.hair.report
    }

    /// The view that is drawn, with the radiance that is shown.
    fn drawn_view(&self) -> ViewUniform {
        let view = self.hair.view();
        match &self.tile {
            Some(tile) => tile.of(&view),
            None => view,
        }
    }

    /// The view or the part of it that is drawn is another.
    fn restart_picture(&mut self) {
        self.picture = Drawn {
            is_of_before: self.picture.is_of_before,
            ..Drawn::default()
        };
        self.hair.is_projected = false;
        self.noise.restart();
    }

    fn restart_samples(&mut self) {
        self.noise.restart();
        self.picture.bands = 0;
        self.picture.passes = 0;
        self.picture.shown = 0;
    }

    /// Is the picture drawn by a visibility list, in one pass?
    fn is_by_list(&self) -> bool {
        self.by_list && !self.picture.is_sampled
    }

    /// Passes that the picture gets at rest.
    fn n_passes(&self) -> u32 {
        match self.is_by_list() {
            true => 1,
            false => self.total_samples().div_ceil(PASS_SAMPLES),
        }
    }

    /// Samples a pixel that the picture gets at rest.
    fn total_samples(&self) -> u32 {
        self.hair.scene.samples.clamp(1, MAX_SAMPLES)
    }

    /// Samples a pixel of so many passes of the picture.
    fn samples_of(&self, passes: u32) -> u32 {
        (PASS_SAMPLES * passes).min(self.total_samples())
    }

    fn submitted(&mut self, stage: &'static str, units: f64) -> Result<(), RenderError> {
        self.submitted_units(stage, units, true)
    }

    /// [`ProgressiveRenderer::submitted`] of a step that may have been less than `units`: the time of a unit is not learnt
    /// from it.
    fn submitted_uncounted(&mut self, stage: &'static str, units: f64) -> Result<(), RenderError> {
        self.submitted_units(stage, units, false)
    }

    fn submitted_units(
        &mut self,
        stage: &'static str,
        units: f64,
        are_counted: bool,
    ) -> Result<(), RenderError> {
        let report = &mut self.hair.report;
        report.ran(stage);
        let units = (units, are_counted);
        self.pacer
            .submitted(&self.hair.context, stage, units, |(name, _, _, seconds)| {
                report.took(name, seconds);
            })
    }

    fn device_bytes(&self) -> u64 {
        let target = self.target.as_ref().map_or(0, Target::bytes);
        let [width, height] = self.size.map(u64::from);
        self.hair.bytes() + target + self.film.behind_bytes() + 4 * width * height
    }
}
