//! The renderer as a state machine, for windows and pages.
//!
//! [`Live`] owns a scene and its picture. Setters say what is to be drawn and return at once;
//! [`Live::advance`] works on it for about as long as it is told, and [`Live::display`] is the last
//! good picture meanwhile.
//!
//! Work goes in cycles. A cycle takes up all that was set, writes it to the device, and lights the
//! points in steps into the radiance buffer that is not shown; then the two change places and the
//! samples of the picture start anew. What is set during a cycle waits for the next one, so that a
//! slider that is dragged is followed at the pace of whole cycles; a cycle less than half done is
//! given up for an edit once. The view is the exception: from a new view the strands are drawn at
//! once, lit as they were when last complete, as a draft. Before the first cycle is done, the draft
//! is lit by a guess: it is there before any shadow is looked for, and nothing of it remains.
//!
//! What depends on what:
//!
//! | set | made anew |
//! |---|---|
//! | grade | the last two passes |
//! | paint | shading |
//! | camera, size | projection; shadow maps towards the eye if it turned; shading |
//! | hair | what [`RULES`](strandlight_scene::edit::RULES) says; shading |
//! | amplitudes of lights | the list of lights that are not black; shading |
//! | lights, proxies | records, shadow maps; shading |
//! | points | the shadow volume; all of these |
//!
//! Nothing is allocated on the device but where something grows, and pipelines are kept by what
//! they were compiled for.
//!
//! Which samples a strand thinner than a pixel covers depends on the strand, the pixel and the
//! number of the pass alone: translucent strands come out in any order right in the mean, with a
//! noise that [`Progress::noise`] estimates, and that stays where it is while the view moves. A step
//! of 0.05 degrees of an orbit, strands far below a pixel wide, makes 9 to 14 % of the noise anew, one of
//! 0.5 degrees 24 to 41 % (`tests/tests/live.rs`).

mod cycle;
mod pace;
mod report;
mod set;
mod shading;
#[cfg(not(target_arch = "wasm32"))]
mod still;
mod work;

use crate::gpu::{Context, Counts};
use crate::passes::clock::Clock;
use crate::passes::deform::Deform;
use crate::passes::draw::{Draw, Ribbons};
use crate::passes::lighting::Lighting;
use crate::passes::mail::Mail;
use crate::passes::noise::Noise;
use crate::passes::parts::{self, Spread, Tile};
use crate::passes::resources::{StrandBuffers, failed};
use crate::passes::screen::{Screen, Show};
use crate::passes::target::Target;
use crate::passes::volume::Volume;
use crate::passes::{DeviceBytes, PartLimits};
use cycle::{Cycle, Dirt};
use pace::Pacer;
use strandlight_scene::RenderError;
use strandlight_scene::budget::MAX_SAMPLES;
use strandlight_scene::camera::{ViewUniform, view_uniform};
use strandlight_scene::motion::Wind;
use strandlight_scene::sampling::PASS_SAMPLES;
use strandlight_scene::scene::PreparedScene;

pub use report::{LiveReport, StageReport};

/// How far the picture has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Samples a pixel in the picture that is shown.
    pub samples: u32,
    /// Samples a pixel that it will have.
    pub of_samples: u32,
    /// The light of all points is that of the scene and view as they were last set; if not, the
    /// picture is a draft.
    pub is_shaded: bool,
    /// Nothing is left to do.
    pub is_done: bool,
    /// Estimate of the noise left in the picture: root mean square of the error over root mean
    /// square of the radiance. Unknown before there are two passes.
    pub noise: Option<f32>,
}

/// A scene on a device, drawn bit by bit.
pub struct Live {
    context: Context,
    scene: PreparedScene,
    strands: StrandBuffers,
    volume: Volume,
    lighting: Lighting,
    draw: Draw,
    ribbons: Ribbons,
    show: Show,
    size: [u32; 2],
    /// The part of the picture that is drawn, unless it is all of it.
    tile: Option<Tile>,
    parts: PartLimits,
    spread: Spread,
    target: Option<Target>,
    screen: Screen,
    /// Of another size, not drawn yet.
    next_screen: Option<Screen>,
    noise: Noise,
    /// Counts of products that shading left, and of how many batches.
    counters: (Mail, u64),
    /// The wind that bends the strands of the scene, and what does.
    wind: Option<Wind>,
    deform: Option<Deform>,
    wanted: Dirt,
    cycle: Option<Cycle>,
    /// The buffer of radiance that is shown, and its scale; none before there is a first look.
    front: usize,
    front_scale: Option<f32>,
    /// Whether the first picture is to be one without shadows.
    has_first_look: bool,
    /// Whether the shadow volume is that of the points.
    has_volume: bool,
    picture: Drawn,
    clock: Clock,
    pacer: Pacer,
    report: LiveReport,
    /// What it was when the last still was finished.
    #[cfg(not(target_arch = "wasm32"))]
    still_report: LiveReport,
    /// What was made on the device before the last edit.
    counts: Counts,
}

/// What there is of the picture.
#[derive(Clone, Debug, Default)]
struct Drawn {
    /// The ribbons are those of the view.
    is_projected: bool,
    /// Rows where the bands of a pass end.
    band_ends: Vec<u32>,
    /// Bands of the pass under way that there are.
    bands: usize,
    passes: u32,
    /// Passes in the picture on the screen, if it is of this view, light and grade.
    shown: u32,
}

impl Live {
    /// Puts `scene` on the device; the first picture is made by [`Live::advance`], in the scene's
    /// size until [`Live::set_size`] says another.
    ///
    /// # Errors
    /// What does not fit the device's limits, by name, before anything is made; whatever the
    /// device refuses.
    pub fn new(context: &Context, scene: PreparedScene) -> Result<Live, RenderError> {
        Live::with_budget(context, scene, u64::MAX)
    }

    /// [`Live::new`] with at most `bytes` on the device, about. Where the records of all lights
    /// take too much, every shading finds them again, batch by batch.
    ///
    /// # Errors
    /// As [`Live::new`]; a scene that needs more, before anything is made.
    pub fn with_budget(
        context: &Context,
        mut scene: PreparedScene,
        bytes: u64,
    ) -> Result<Live, RenderError> {
        let limits = context.device.limits();
        // The size of stills; none is on the device before it is asked for.
        scene.size = parts::fitting(scene.size, &limits);
        if DeviceBytes::new(&scene, scene.size)
            .check(&limits, bytes)
            .is_err()
        {
            scene.record_budget = 0;
            DeviceBytes::new(&scene, scene.size).check(&limits, bytes)?;
        }
        let before = context.counts();
        let backend = format!("gpu: {} ({})", context.adapter_name, context.backend);
        let report = LiveReport {
            stats: scene.counts(backend),
            ..LiveReport::default()
        };
        let strands = StrandBuffers::new(context, &scene.strands);
        let volume = Volume::new(context, &scene.strands, &strands)?;
        let lighting = Lighting::new(context, &scene, &volume, &strands, 2)?;
        let draw = Draw::new(context)?;
        let radiance = [0, 1].map(|ix| lighting.radiance(ix));
        let mut ribbons = Ribbons::new(context, &draw, &strands, &radiance);
        ribbons.set_proxies(context, &lighting);
        let mut live = Live {
            context: context.clone(),
            strands,
            volume,
            ribbons,
            show: Show::new(context)?,
            size: [0, 0],
            tile: None,
            parts: PartLimits::default(),
            spread: Spread::of(&scene.strands),
            target: None,
            screen: Screen::new(context, [1, 1]),
            next_screen: None,
            noise: Noise::new(context)?,
            counters: (Mail::new(context, 80), 1),
            wind: None,
            deform: None,
            wanted: Dirt::all(),
            cycle: None,
            front: 0,
            front_scale: None,
            has_first_look: true,
            has_volume: false,
            picture: Drawn::default(),
            clock: Clock::new(context),
            pacer: Pacer::new(!cfg!(target_arch = "wasm32")),
            report,
            #[cfg(not(target_arch = "wasm32"))]
            still_report: LiveReport::default(),
            counts: before,
            lighting,
            draw,
            scene,
        };
        live.set_size(live.scene.size)?;
        live.counts = before;
        live.report.device_bytes = live.device_bytes();
        context.check("upload").map_err(failed)?;
        Ok(live)
    }

    /// The scene as it was last set.
    pub fn scene(&self) -> &PreparedScene {
        &self.scene
    }

    /// Whether [`Live::advance`] waits for what it has submitted, as it does natively unless it is
    /// told otherwise, or leaves the device to itself and learns later how long it took, as it has
    /// to in a browser.
    pub fn set_waiting(&mut self, is_waiting: bool) {
        self.pacer = Pacer::new(is_waiting && !cfg!(target_arch = "wasm32"));
    }

    /// How far the picture has come.
    pub fn progress(&self) -> Progress {
        let is_shaded =
            self.front_scale.is_some() && self.cycle.is_none() && self.wanted.is_clean();
        let of_samples = self.of_samples();
        let samples = self.samples_of(self.picture.shown);
        Progress {
            samples,
            of_samples,
            is_shaded,
            is_done: self.target.is_none() || is_shaded && samples == of_samples,
            noise: self.noise.of(self.picture.shown),
        }
    }

    /// The picture on the screen: tone-mapped, encoded in sRGB, multiplied by alpha, `rgba8unorm`.
    /// Of the size that was set last (and not zero) from the first picture of that size on.
    pub fn display(&self) -> &wgpu::TextureView {
        self.screen.view()
    }

    /// What [`Live::display`] shows, row by row.
    ///
    /// # Errors
    /// The device failed.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn read_display(&self) -> Result<Vec<[u8; 4]>, RenderError> {
        self.screen.read(&self.context)
    }

    /// What the device did since the last edit.
    pub fn report(&self) -> &LiveReport {
        &self.report
    }

    /// The view that is drawn, with the radiance that is shown.
    fn drawn_view(&self) -> ViewUniform {
        let scale = self.front_scale.unwrap_or(1.0);
        let scene = &self.scene;
        let view = view_uniform(&scene.camera, &scene.strands, scene.size, scale);
        match &self.tile {
            Some(tile) => tile.of(&view),
            None => view,
        }
    }

    fn restart_samples(&mut self) {
        self.noise.restart();
        self.picture.bands = 0;
        self.picture.passes = 0;
        self.picture.shown = 0;
    }

    /// Samples a pixel that the picture gets at rest.
    fn of_samples(&self) -> u32 {
        self.scene.samples.clamp(1, MAX_SAMPLES)
    }

    /// Samples a pixel of so many passes of the picture.
    fn samples_of(&self, passes: u32) -> u32 {
        (PASS_SAMPLES * passes).min(self.of_samples())
    }

    fn submitted(&mut self, stage: &'static str, units: f64) -> Result<(), RenderError> {
        let report = &mut self.report;
        report.ran(stage);
        self.pacer
            .submitted(&self.context, stage, units, |(name, _, _, seconds)| {
                report.took(name, seconds);
            })
    }

    fn device_bytes(&self) -> u64 {
        let target = self.target.as_ref().map_or(0, Target::bytes);
        let lighting = self.lighting.bytes().map(|(_, bytes)| bytes);
        let [width, height] = self.size.map(u64::from);
        let fixed = self.strands.bytes() + self.volume.bytes() + self.ribbons.bytes();
        fixed + lighting.iter().sum::<u64>() + target + 4 * width * height
    }
}
