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
//! | hair | what [`RULES`](crate::edit::RULES) says; shading |
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

use std::ops::Range;
use std::time::Duration;

use crate::camera::{Camera, ViewUniform, view_uniform};
use crate::edit::{EditError, EditReport};
use crate::error::RenderError;
use crate::gpu::{Context, Counts};
use crate::motion::Wind;
use crate::paint::Paint;
use crate::proxy::Proxy;
use crate::render::clock::Clock;
use crate::render::deform::Deform;
use crate::render::draw::{Draw, Ribbons, Target};
use crate::render::lighting::Lighting;
use crate::render::mail::Mail;
use crate::render::noise::Noise;
use crate::render::resources::{StrandBuffers, failed};
use crate::render::screen::{Screen, Show};
use crate::render::volume::Volume;
use crate::render::{check_frame, whole_passes};
use crate::scene::{PreparedScene, check_lights};
use crate::tone::ToneMap;
use cycle::{Cycle, Dirt};
use pace::Pacer;
use strandlight_formats::{Background, Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};

pub use report::{LiveReport, StageReport};

/// Passes of a draft: more are not drawn while points are being lit.
const DRAFT_PASSES: u32 = 4;

/// Share of a side of the picture around it where points are lit too: they are there when the view
/// turns.
const MARGIN: f32 = 0.15;

/// Points that the first cycle lights at a time.
const FIRST_CHUNK: f64 = 4096.0;

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
    /// What was made on the device before the last edit.
    counts: Counts,
}

/// What there is of the picture.
#[derive(Clone, Copy, Debug, Default)]
struct Drawn {
    /// The ribbons are those of the view.
    is_projected: bool,
    passes: u32,
    /// Passes in the picture on the screen, if it is of this view, light and grade.
    shown: u32,
}

/// The next piece of work.
enum Work {
    Project,
    Pass,
    Begin,
    FirstLook,
    Light,
    Show,
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
        if scene
            .device_bytes(scene.size)
            .check(&limits, bytes)
            .is_err()
        {
            scene.record_budget = 0;
            scene.device_bytes(scene.size).check(&limits, bytes)?;
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

    /// Looks from elsewhere.
    pub fn set_camera(&mut self, camera: Camera) {
        if self.scene.camera == camera {
            return;
        }
        self.scene.camera = camera;
        self.edited();
        self.wanted.view = true;
        self.picture = Drawn::default();
        self.noise.restart();
    }

    /// Width and height of the picture; a side of zero: nothing is drawn.
    ///
    /// # Errors
    /// As [`check_frame`], sides of zero excepted; what is too large for the device. Nothing is
    /// changed then.
    pub fn set_size(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        if size == self.size {
            return Ok(());
        }
        self.edited();
        if size.contains(&0) {
            self.target = None;
        } else {
            check_frame(size, 4)?;
            self.check_device(size)?;
            let (context, draw, ribbons) = (&self.context, &self.draw, &self.ribbons);
            // One at a time on the device.
            self.target = None;
            let (lights, _) = self.lighting.lit();
            self.target = Some(Target::new(context, draw, ribbons, size, lights));
            self.next_screen = Some(Screen::new(context, size));
            self.noise.forget_target();
            self.scene.size = size;
            self.wanted.view = true;
        }
        self.size = size;
        self.picture = Drawn::default();
        Ok(())
    }

    /// Refuses pictures that the device is too small for.
    fn check_device(&self, [width, height]: [u32; 2]) -> Result<(), RenderError> {
        let limits = self.context.device.limits();
        let most = limits.max_texture_dimension_2d;
        if width.max(height) > most {
            return Err(RenderError::Gpu(format!(
                "size {width}x{height}: the sides of pictures are at most {most} on this adapter"
            )));
        }
        let limit = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size);
        let bytes = 16 * u64::from(width) * u64::from(height);
        if bytes > limit {
            return Err(RenderError::TooLarge {
                what: format!("a picture of {width}x{height}"),
                bytes,
                limit,
            });
        }
        Ok(())
    }

    /// How radiance becomes a picture on the screen.
    pub fn set_grade(&mut self, exposure: f32, tone_map: ToneMap, background: Background) {
        let scene = &mut self.scene;
        let before = (scene.exposure, scene.tone_map, scene.background);
        if before == (exposure, tone_map, background) {
            return;
        }
        (scene.exposure, scene.tone_map, scene.background) = (exposure, tone_map, background);
        self.edited();
        self.picture.shown = 0;
    }

    /// Other hair, other modes.
    ///
    /// # Errors
    /// The first parameter outside its range, or a mode whose lobes were not loaded; nothing is
    /// changed then.
    pub fn set_hair(&mut self, hair: &HairParams, modes: &[Lobe]) -> Result<EditReport, EditError> {
        let before = self.scene.hair.modes().to_vec();
        let report = self.scene.hair.edit(hair, modes)?;
        if report.rebuilt().next().is_some() {
            self.edited();
            self.wanted.add_hair(&report);
            self.wanted.kind |= before != self.scene.hair.modes();
        }
        self.report.edit = Some(report.clone());
        Ok(report)
    }

    /// The terms of scattering that are drawn.
    pub fn set_scattering(&mut self, scattering: Scattering) {
        if scattering == self.scene.scattering() {
            return;
        }
        self.edited();
        if let Some(report) = self.scene.set_scattering(scattering) {
            self.wanted.add_hair(&report);
        }
        self.wanted.kind = true;
    }

    /// d_f and d_b.
    pub fn set_densities(&mut self, densities: [f32; 2]) {
        if densities == self.scene.densities {
            return;
        }
        self.scene.densities = densities;
        self.edited();
        self.wanted.densities = true;
    }

    /// Other lights. Their amplitudes share out the shadow maps; where some are to be black for the
    /// time being, [`Live::set_light_colors`] says so afterwards.
    ///
    /// # Errors
    /// The first light with a value outside its range; nothing is changed then.
    pub fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<(), RenderError> {
        check_lights(&lights)?;
        if lights == self.scene.lights {
            return Ok(());
        }
        self.lighting.plan_for(&lights);
        self.scene.lights = lights;
        self.edited();
        self.wanted.lights = true;
        Ok(())
    }

    /// Other amplitudes of the lights there are, in their order; a black light is not shaded, and
    /// keeps its shadows.
    ///
    /// # Errors
    /// Not one for each light, or one outside its range; nothing is changed then.
    pub fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<(), RenderError> {
        if rgb.len() != self.scene.lights.len() {
            return Err(RenderError::Colors {
                colors: rgb.len(),
                lights: self.scene.lights.len(),
            });
        }
        let mut lights = self.scene.lights.clone();
        for (light, &rgb) in lights.iter_mut().zip(rgb) {
            light.rgb = rgb;
        }
        check_lights(&lights)?;
        if lights != self.scene.lights {
            self.scene.lights = lights;
            self.edited();
            self.wanted.colors = true;
        }
        Ok(())
    }

    /// Moves the hair: x, y, z and fibre radius in cm, one for each point of the scene's strands.
    ///
    /// # Errors
    /// As [`Strands::moved`](crate::strands::Strands::moved); nothing is changed then.
    pub fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError> {
        self.scene.strands = self.scene.strands.moved(points)?;
        (self.wind, self.deform) = (None, None);
        self.edited();
        self.wanted.points = true;
        Ok(())
    }

    /// Takes the paint of the groom's points in `changed`; of the others `paint` must be as it was.
    /// What is uploaded are the rows of the texture of paint that are other than before; the first
    /// paint of all, and the first of widths or shifts, also takes tables and a pipeline.
    ///
    /// # Errors
    /// As [`PreparedScene::repaint`]; nothing is changed then.
    pub fn set_paint(&mut self, paint: &Paint, changed: Range<usize>) -> Result<(), RenderError> {
        let (range, report) = self.scene.repaint(paint, changed)?;
        if range.is_empty() && report.is_none() {
            return Ok(());
        }
        self.edited();
        self.wanted.add_paint(range);
        if let Some(report) = report {
            self.wanted.add_hair(&report);
            self.wanted.kind = true;
        }
        Ok(())
    }

    /// Bends the strands of the scene in the wind, on the device alone: [`Live::scene`] has them at
    /// rest, with room to move. Without wind they are at rest.
    pub fn set_wind(&mut self, wind: Option<Wind>) {
        if wind != self.wind {
            self.wind = wind;
            self.edited();
            self.wanted.points = true;
        }
    }

    /// Other things in the light and in the view.
    pub fn set_proxies(&mut self, proxies: Vec<Proxy>) {
        if proxies != self.scene.proxies {
            self.scene.proxies = proxies;
            self.edited();
            self.wanted.proxies = true;
        }
    }

    /// Samples a pixel that the picture gets at rest, rounded up to whole passes of four.
    pub fn set_samples(&mut self, samples: u32) {
        if samples != self.scene.samples {
            self.scene.samples = samples;
            if self.picture.passes > whole_passes(samples) / 4 {
                self.restart_samples();
            }
        }
    }

    /// Works at most about `budget` on the device, one step at least.
    ///
    /// # Errors
    /// [`RenderError::DeviceLost`], after which a new context and a new `Live` are needed, or
    /// whatever else the device refuses.
    pub fn advance(&mut self, budget: Duration) -> Result<Progress, RenderError> {
        // Lets callbacks run; a browser runs them anyway.
        let _ = self.context.device.poll(wgpu::PollType::Poll);
        self.context.check("advance").map_err(failed)?;
        if let Some(counts) = self.counters.0.take::<u64>() {
            self.report.stats.set_counters(&counts, self.counters.1);
        }
        self.noise.take();
        let report = &mut self.report;
        self.clock.take(|name, ms| report.measured(name, ms));
        self.pacer.begin(budget, |(name, _, _, seconds)| {
            report.took(name, seconds);
        });
        if self.target.is_some() {
            let drafts = self.picture.passes;
            let mut is_first = true;
            while let Some(work) = self.next(drafts) {
                if !self.has_time(&work, is_first) {
                    break;
                }
                // Not worth a turn of their own.
                let is_small = matches!(work, Work::Project | Work::Begin | Work::FirstLook);
                is_first = is_small && is_first;
                self.work(&work)?;
            }
            if self.picture.shown < self.picture.passes {
                self.work(&Work::Show)?;
            }
            let report = &mut self.report;
            let took = |(name, _, _, seconds): pace::Finished| report.took(name, seconds);
            self.pacer.flush(&self.context, took)?;
            self.clock.start_reading(&self.context);
        }
        self.report.counts = self.context.counts().since(self.counts);
        Ok(self.progress())
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
        let of_samples = whole_passes(self.scene.samples);
        let samples = 4 * self.picture.shown;
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

    /// Draws `samples` a pixel to the end and reads the picture back: linear, as
    /// [`Renderer::render`](crate::Renderer::render) answers it.
    ///
    /// # Errors
    /// As [`check_frame`], and as [`Live::advance`].
    #[cfg(not(target_arch = "wasm32"))]
    pub fn finish(&mut self, samples: u32) -> Result<crate::Picture, RenderError> {
        check_frame(self.size, samples)?;
        let before = self.scene.samples;
        self.set_samples(samples);
        // Nobody sees it.
        self.has_first_look = false;
        while !self.advance(Duration::from_secs(1))?.is_done {}
        let Some(target) = &self.target else {
            return Err(RenderError::Size {
                width: self.size[0],
                height: self.size[1],
            });
        };
        let rgba = crate::render::resources::read_back(&self.context, "picture", target.picture())?;
        self.set_samples(before);
        let [width, height] = self.size;
        Ok(crate::Picture {
            width,
            height,
            rgba,
        })
    }

    /// Starts the report of an edit.
    fn edited(&mut self) {
        self.report.stages.clear();
        self.report.edit = None;
        self.counts = self.context.counts();
    }

    /// What is to be done next, `drafts` passes having been there when this turn began.
    fn next(&self, drafts: u32) -> Option<Work> {
        let passes = self.picture.passes;
        let is_resting = self.cycle.is_none() && self.wanted.is_clean();
        if self.front_scale.is_some() {
            if !self.picture.is_projected {
                return Some(Work::Project);
            }
            let cycle = self.cycle.as_ref().map(|cycle| &cycle.dirt);
            let moves = |dirt: &Dirt| dirt.view || dirt.points;
            let is_draft = moves(&self.wanted) || cycle.is_some_and(moves);
            // A first look is not worth more.
            let most = if self.report.shadings == 0 {
                1
            } else {
                DRAFT_PASSES
            };
            // While points are being lit, a draft: one pass in a turn.
            let may_draw = match is_resting {
                true => passes < whole_passes(self.scene.samples) / 4,
                false => passes == 0 || is_draft && passes == drafts && passes < most,
            };
            if may_draw {
                return Some(Work::Pass);
            }
        }
        match &self.cycle {
            Some(_) if self.front_scale.is_none() && self.has_first_look => Some(Work::FirstLook),
            Some(_) => Some(Work::Light),
            None if !is_resting => Some(Work::Begin),
            None => None,
        }
    }

    fn has_time(&self, work: &Work, is_first: bool) -> bool {
        let (stage, units) = match work {
            Work::Begin | Work::FirstLook => return true,
            Work::Project => ("project", 1.0),
            Work::Pass => ("draw", 1.0),
            Work::Show => ("display", 1.0),
            Work::Light => {
                let next = self.cycle.as_ref().and_then(|cycle| cycle.steps.front());
                let Some(step) = next else {
                    return true;
                };
                (step.stage(), self.lighting.units(step))
            }
        };
        self.pacer.has_time(stage, units, is_first)
    }

    fn work(&mut self, work: &Work) -> Result<(), RenderError> {
        match work {
            Work::Begin => self.begin(Dirt::default(), false),
            Work::Light => self.light(),
            Work::FirstLook => self.take_first_look(),
            Work::Project => {
                let view = self.drawn_view();
                self.ribbons.set_view(&self.context, &view);
                let stamp = self.clock.stamp("project");
                self.ribbons.project(&self.context, &self.draw, stamp);
                self.picture.is_projected = true;
                self.restart_samples();
                self.submitted("project", 1.0)
            }
            Work::Pass => {
                let Some(target) = &self.target else {
                    return Ok(());
                };
                let stamp = self.clock.stamp("draw");
                let (context, draw, ribbons) = (&self.context, &self.draw, &self.ribbons);
                if self.picture.passes == 0 {
                    target.clear(context);
                }
                let pass_ix = self.picture.passes;
                target.pass(context, draw, ribbons, self.front, pass_ix, stamp);
                self.picture.passes += 1;
                self.submitted("draw", 1.0)?;
                let passes = self.picture.passes;
                if let Some(target) = self.target.as_ref().filter(|_| Noise::is_due(passes)) {
                    let stamp = self.clock.stamp("noise");
                    self.noise.look(&self.context, target, passes, stamp);
                    self.submitted("noise", 1.0)?;
                }
                Ok(())
            }
            Work::Show => {
                let Some(target) = &mut self.target else {
                    return Ok(());
                };
                let (context, draw, ribbons) = (&self.context, &self.draw, &self.ribbons);
                let background = (&self.scene.background, 4 * self.picture.passes);
                let lit = self.lighting.lit();
                let stamp = self.clock.stamp("composite");
                target.composite(context, draw, ribbons, background, lit, stamp);
                self.submitted("composite", 1.0)?;
                let Some(target) = &self.target else {
                    return Ok(());
                };
                let (context, ribbons) = (&self.context, &self.ribbons);
                let stamp = self.clock.stamp("display");
                let (exposure, tone_map) = (self.scene.exposure, self.scene.tone_map);
                if let Some(next) = self.next_screen.take() {
                    self.screen = next;
                }
                let from = (ribbons, target);
                self.screen
                    .show(context, &self.show, from, exposure, tone_map, stamp);
                self.picture.shown = self.picture.passes;
                self.submitted("display", 1.0)
            }
        }
    }

    /// Takes up what was set since the last cycle began, and what one that is given up had taken.
    fn begin(&mut self, given_up: Dirt, is_second_try: bool) -> Result<(), RenderError> {
        let mut dirt = std::mem::take(&mut self.wanted);
        dirt.add(&given_up);
        let (context, scene) = (&self.context, &self.scene);
        let mut steps = Vec::new();
        if dirt.points {
            match &self.wind {
                Some(wind) => {
                    let deform = match self.deform.take() {
                        Some(deform) => deform,
                        None => Deform::new(context, &scene.strands, &self.strands)?,
                    };
                    deform.run(context, wind, self.clock.stamp("deform"));
                    self.deform = Some(deform);
                    self.report.ran("deform");
                }
                None => self.strands.update(context, &scene.strands),
            }
            let is_other = self.volume.fit(context, &scene.strands, &self.strands);
            let stamp = self.clock.stamp("voxelise");
            self.volume.fill(context, stamp);
            self.has_volume = true;
            self.report.ran("voxelise");
            let lighting = &mut self.lighting;
            lighting.set_points(context, scene, &self.volume, &self.strands, is_other);
            self.picture.is_projected = false;
        }
        if dirt.lights {
            let lighting = &mut self.lighting;
            lighting.set_lights(context, scene, &self.volume, &self.strands);
        } else if dirt.colors && self.lighting.set_colors(context, scene, &self.strands) {
            steps.extend(self.lighting.map_steps());
        }
        if dirt.proxies {
            let (volume, strands) = (&self.volume, &self.strands);
            self.lighting.set_proxies(context, scene, volume, strands)?;
        }
        if dirt.points || dirt.lights || dirt.shadows || dirt.proxies {
            steps = self.lighting.shadow_steps();
        }
        if let Some(range) = &dirt.paint {
            let lighting = &mut self.lighting;
            lighting.set_paint(context, scene, &scene.hair, range.clone());
        }
        if let Some(report) = &dirt.hair {
            let hair = &scene.hair;
            self.lighting.set_hair(context, scene, hair, report);
        }
        if dirt.densities {
            self.lighting.set_densities(scene);
        }
        if dirt.kind {
            self.lighting.set_kind(context, scene)?;
        }
        let mut view = view_uniform(
            &scene.camera,
            &scene.strands,
            scene.size,
            scene.radiance_scale(),
        );
        view.margin_px += MARGIN * scene.size[0].max(scene.size[1]) as f32;
        self.lighting.begin(context, &view);
        steps.extend(self.lighting.through_steps(view.forward));
        steps.extend(self.lighting.shade_steps(self.chunk()));
        self.cycle = Some(Cycle {
            dirt,
            view,
            n_steps: steps.len(),
            steps: steps.into(),
            is_second_try,
        });
        Ok(())
    }

    /// Lights all points by a guess, so that there is something to see.
    fn take_first_look(&mut self) -> Result<(), RenderError> {
        let Some(cycle) = &self.cycle else {
            return Ok(());
        };
        self.has_first_look = false;
        self.front_scale = Some(cycle.view.radiance_scale);
        let stamp = self.clock.stamp("first look");
        let (context, scene, strands) = (&self.context, &self.scene, &self.strands);
        self.lighting
            .take_first_look(context, scene, strands, self.front, stamp)?;
        self.submitted("first look", 1.0)
    }

    /// Points to light at a time: what takes some milliseconds.
    fn chunk(&self) -> u32 {
        let (_, n_lights) = self.lighting.lit();
        let a_point = self
            .pacer
            .rate("shade")
            .map(|rate| rate * f64::from(n_lights.max(1)));
        let n = a_point.map_or(FIRST_CHUNK, |a_point| 4e-3 / a_point);
        n.clamp(1024.0, f64::from(1_u32 << 20)) as u32
    }

    /// Takes the next step of the cycle, or ends it.
    fn light(&mut self) -> Result<(), RenderError> {
        let Some(cycle) = &mut self.cycle else {
            return Ok(());
        };
        if self.wanted.is_edited() && cycle.may_restart() {
            let dirt = std::mem::take(&mut cycle.dirt);
            self.lighting.forget_through();
            return self.begin(dirt, true);
        }
        if !self.has_volume {
            // After the first look, which needs none.
            self.has_volume = true;
            self.volume
                .fill(&self.context, self.clock.stamp("voxelise"));
            self.report.ran("voxelise");
        }
        let Some(step) = cycle.steps.pop_front() else {
            let view = cycle.view;
            if cycle.dirt.proxies {
                self.ribbons.set_proxies(&self.context, &self.lighting);
            }
            self.cycle = None;
            let counters = self.lighting.counters();
            if self.counters.0.send(&self.context, counters, 80, |_| ()) {
                self.counters.1 = self.lighting.n_batches();
            }
            self.swap(&view);
            return Ok(());
        };
        let stage = step.stage();
        let units = self.lighting.units(&step);
        let stamp = self.clock.stamp(stage);
        let (strands, volume) = (&self.strands, &self.volume);
        let back = 1 - self.front;
        self.lighting
            .submit(&self.context, strands, volume, &step, back, stamp);
        self.submitted(stage, units)
    }

    /// Shows the radiance that was found for `view`.
    fn swap(&mut self, view: &ViewUniform) {
        self.front = 1 - self.front;
        self.front_scale = Some(view.radiance_scale);
        if self.picture.is_projected {
            let view = self.drawn_view();
            self.ribbons.set_view(&self.context, &view);
        }
        self.restart_samples();
        self.report.device_bytes = self.device_bytes();
        self.report.stats.scattering = self.scene.scattering().name();
        self.report.stats.skipped = self.scene.skipped();
        self.report.shadings += 1;
    }

    /// The view that is drawn, with the radiance that is shown.
    fn drawn_view(&self) -> ViewUniform {
        let scale = self.front_scale.unwrap_or(1.0);
        view_uniform(
            &self.scene.camera,
            &self.scene.strands,
            self.scene.size,
            scale,
        )
    }

    fn restart_samples(&mut self) {
        self.noise.restart();
        self.picture.passes = 0;
        self.picture.shown = 0;
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
