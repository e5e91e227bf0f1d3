//! A document and its picture: what window, web page and script all drive.
//!
//! [`Viewer`] is a [`Session`] and a [`Backend`]: whatever changes the first tells the second what
//! of it to recompute, and no more. Windows and pages have an [`InteractiveBackend`], on the GPU or
//! the CPU; frames of a script can come from any.

mod current_picker;
mod masked;
mod painting;
#[cfg(not(target_arch = "wasm32"))]
mod shown;
mod varied;

use std::path::Path;
use std::time::Duration;

use glam::Vec3;
use serde_json::{Map, Value};
use strandlight_formats::Scene;

use crate::choice::CpuReason;
#[cfg(any(not(target_arch = "wasm32"), feature = "ui"))]
use crate::choice::{BackendChoice, Chosen};
use crate::error::SessionError;
use crate::interactive::{Display, InteractiveBackend};
use crate::mask_view::MaskView;
use crate::session::{Change, Edits, Saved, Session, section_of};
#[cfg(not(target_arch = "wasm32"))]
use crate::{ground_truth::GroundTruth, inspection::Inspector};
use current_picker::CurrentPicker;
#[cfg(not(target_arch = "wasm32"))]
use strandlight_cpu::BackgroundRenderer;
use strandlight_render::ProgressiveRenderer;
use strandlight_render::gpu::Context;
use strandlight_scene::Camera;
use strandlight_scene::assets::{Assets, camera, densities};
use strandlight_scene::interactive::{PictureProgress, RenderReport};
use strandlight_scene::motion::{Motion, Wind};
use strandlight_scene::paint::{ActiveStroke, Paint};
use strandlight_scene::scene::PreparedScene;
use strandlight_scene::{Backend, RenderError, SceneError};
use varied::VariedPaint;

/// A scene that is open, and drawn.
pub struct Viewer<B: Backend + ?Sized = dyn InteractiveBackend> {
    session: Session,
    renderer: Box<B>,
    /// Why the CPU draws, where that was decided.
    cpu_reason: Option<CpuReason>,
    /// Centre and radius of the hair at rest, for the camera of a scene that has none.
    framing: (Vec3, f32),
    /// Size of the window, in place of the scene's.
    window: Option<[u32; 2]>,
    /// Where the user looks from, in place of the scene's camera.
    view: Option<Camera>,
    /// Seconds since the start of the motion.
    time: f64,
    motion: Option<Motion>,
    /// What was recomputed since [`Viewer::take_changes`].
    changes: Change,
    picker: CurrentPicker,
    /// Of strands that vary, once that or the paint changes.
    varied: Option<VariedPaint>,
    /// The stroke that is being made.
    active_stroke: Option<ActiveStroke>,
    /// Where the picture goes on to ground truth.
    #[cfg(not(target_arch = "wasm32"))]
    ground_truth: Option<GroundTruth>,
    /// What is shown in place of the picture's colours.
    #[cfg(not(target_arch = "wasm32"))]
    inspector: Option<Inspector>,
    /// The mask over the picture.
    mask_view: MaskView,
    /// Another number for every other picture, whatever it is graded with.
    n_outdated: u64,
    /// Changes of what is seen in whatever look.
    n_beside_look: u64,
}

/// What is seen of a scene in whatever look.
const BESIDE_LOOK: Edits = Edits::GEOMETRY
    .union(Edits::TABLES)
    .union(Edits::PAINT)
    .union(Edits::PROXIES)
    .union(Edits::MOTION);

impl Viewer {
    /// Opens the scene file at `path` and puts it on the device.
    ///
    /// # Errors
    /// What cannot be read or drawn, by name; whatever the device refuses.
    pub fn open(context: &Context, path: &Path) -> Result<Viewer, SessionError> {
        Ok(Viewer::new(context, Session::open(path)?)?)
    }

    /// Shows a document, drawn on the device.
    ///
    /// # Errors
    /// What cannot be drawn, by name; whatever the device refuses.
    pub fn new(context: &Context, session: Session) -> Result<Viewer, RenderError> {
        Viewer::on(session, |scene| -> Result<Box<dyn InteractiveBackend>, _> {
            Ok(Box::new(on_device(context, scene)?))
        })
    }

    /// Shows a document, drawn by what [`BackendChoice::decide`] has `chosen`. Where `choice` is
    /// [`BackendChoice::Auto`], the CPU draws as well what the device refuses.
    ///
    /// # Errors
    /// What cannot be drawn, by name; whatever the device refuses.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn choose(
        choice: BackendChoice,
        chosen: Chosen,
        session: Session,
    ) -> Result<Viewer, SessionError> {
        let on_cpu =
            |scene| -> Box<dyn InteractiveBackend> { Box::new(BackgroundRenderer::new(scene)) };
        Viewer::choose_from(choice, chosen, session, on_cpu)
    }

    /// The same, `on_cpu` being what draws without a device.
    #[cfg(any(not(target_arch = "wasm32"), feature = "ui"))]
    pub(crate) fn choose_from(
        choice: BackendChoice,
        chosen: Chosen,
        session: Session,
        on_cpu: impl FnOnce(PreparedScene) -> Box<dyn InteractiveBackend>,
    ) -> Result<Viewer, SessionError> {
        let scene = unmuted_scene_of(&session).map_err(RenderError::from)?;
        let (renderer, reason): (Box<dyn InteractiveBackend>, _) = match chosen {
            Chosen::Cpu(reason) => (on_cpu(scene), Some(reason)),
            Chosen::Gpu(context) => match on_device(&context, scene) {
                Ok(renderer) => (Box::new(renderer), None),
                Err(error) if choice == BackendChoice::Auto => {
                    let scene = unmuted_scene_of(&session).map_err(RenderError::from)?;
                    let reason = CpuReason::Failed(error.to_string());
                    (on_cpu(scene), Some(reason))
                }
                Err(error) => return Err(error.into()),
            },
        };
        let mut viewer = Viewer::with(session, renderer)?;
        viewer.cpu_reason = reason;
        Ok(viewer)
    }

    /// Draws with samples from now on, where a device would draw by a visibility list.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn draw_with_samples(&mut self) {
        self.renderer.draw_with_samples();
    }

    /// Why the CPU draws; `None` where the GPU does.
    pub fn cpu_reason(&self) -> Option<&CpuReason> {
        self.cpu_reason.as_ref()
    }

    /// Draws the picture in the size of a window instead of the scene's; a side of zero: nothing
    /// is drawn.
    ///
    /// # Errors
    /// As [`Backend::set_size`].
    pub fn set_window(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        if self.window != Some(size) {
            self.outdate_picture();
        }
        self.window = Some(size);
        self.renderer.set_size(size)
    }

    /// Goes on with another device after the old one was lost: puts the document on it, unless the
    /// CPU draws.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn set_context(&mut self, context: &Context) -> Result<(), RenderError> {
        if self.renderer.device().is_none() {
            return Ok(());
        }
        self.outdate_picture();
        let scene = unmuted_scene_of(&self.session)?;
        self.renew_on(scene, |renderer, scene| renderer.set_device(context, scene))
    }

    /// See [`InteractiveBackend::advance`].
    ///
    /// # Errors
    /// As there.
    pub fn advance(&mut self, budget: Duration) -> Result<PictureProgress, RenderError> {
        self.renderer.follow(&self.session);
        let progress = self.renderer.advance(budget)?;
        #[cfg(not(target_arch = "wasm32"))]
        {
            self.go_to_ground_truth(&progress)?;
            self.inspect(&progress)?;
        }
        self.follow_mask(&progress)?;
        Ok(progress)
    }

    /// See [`InteractiveBackend::display`]; or the picture on its way to ground truth, or what is inspected
    /// of it.
    pub fn display(&self) -> Display<'_> {
        #[cfg(not(target_arch = "wasm32"))]
        if let Some(display) = self.override_display() {
            return display;
        }
        self.renderer.display()
    }

    /// See [`InteractiveBackend::report`].
    pub fn report(&self) -> &RenderReport {
        self.renderer.report()
    }
}

impl<B: Backend + ?Sized> Viewer<B> {
    /// Shows a document on the renderer that `open` answers for its scene.
    ///
    /// # Errors
    /// What cannot be drawn, by name; whatever `open` answers.
    pub fn on(
        session: Session,
        open: impl FnOnce(PreparedScene) -> Result<Box<B>, RenderError>,
    ) -> Result<Viewer<B>, RenderError> {
        let scene = unmuted_scene_of(&session)?;
        Viewer::with(session, open(scene)?)
    }

    /// Shows a document on a renderer that has its scene.
    fn with(session: Session, renderer: Box<B>) -> Result<Viewer<B>, RenderError> {
        let strands = &renderer.scene().strands;
        let mut viewer = Viewer {
            framing: (strands.centre, strands.radius),
            renderer,
            cpu_reason: None,
            motion: Motion::new(session.scene(), session.files()),
            session,
            window: None,
            view: None,
            time: 0.0,
            changes: Change::everything(),
            picker: CurrentPicker::default(),
            varied: None,
            active_stroke: None,
            #[cfg(not(target_arch = "wasm32"))]
            ground_truth: None,
            #[cfg(not(target_arch = "wasm32"))]
            inspector: None,
            mask_view: MaskView::default(),
            n_outdated: 0,
            n_beside_look: 0,
        };
        viewer.set_light_colors()?;
        viewer.move_hair()?;
        Ok(viewer)
    }

    /// The document.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The renderer.
    pub fn renderer(&self) -> &B {
        &self.renderer
    }

    /// The scene as it is drawn.
    pub fn prepared(&self) -> &PreparedScene {
        self.renderer.scene()
    }

    /// See [`Session::edit`]. A stroke that is being made ends before another groom comes.
    ///
    /// # Errors
    /// As there, or what cannot be drawn; nothing is changed then.
    pub fn edit(
        &mut self,
        label: &str,
        change: impl FnOnce(&mut Scene),
    ) -> Result<Change, SessionError> {
        let mut after = self.session.scene().clone();
        change(&mut after);
        if after.groom != self.session.scene().groom {
            self.release()?;
        }
        let change = self.session.edit(label, |scene| *scene = after)?;
        Ok(self.show_edit(change)?)
    }

    /// See [`Session::set`].
    ///
    /// # Errors
    /// As there, or what cannot be drawn; nothing is changed then.
    pub fn set(&mut self, values: &Map<String, Value>) -> Result<Change, SessionError> {
        self.release()?;
        let change = self.session.set(values)?;
        Ok(self.show_edit(change)?)
    }

    /// Looks from elsewhere. That is no edit: the scene keeps its camera until
    /// [`Viewer::save_view`], and looks from there again whenever that is changed.
    ///
    /// # Errors
    /// A camera that no scene could have; nothing is changed then.
    pub fn set_view(&mut self, view: Camera) -> Result<(), RenderError> {
        let mut scene = self.session.scene().clone();
        scene.camera = Some(section_of(&view));
        scene.validate().map_err(SceneError::from)?;
        self.view = Some(view);
        self.show_view(view);
        Ok(())
    }

    fn show_view(&mut self, view: Camera) {
        if self.renderer.scene().camera != view {
            self.outdate_picture();
            self.renderer.set_camera(view);
        }
    }

    /// What is shown is another picture from now on.
    fn outdate_picture(&mut self) {
        self.n_outdated += 1;
        #[cfg(not(target_arch = "wasm32"))]
        if let Some(truth) = &mut self.ground_truth {
            truth.set_outdated();
        }
    }

    /// Pages show the picture alone.
    #[cfg(all(feature = "ui", target_arch = "wasm32"))]
    pub(crate) fn awaited_layer(&self) -> Option<String> {
        None
    }

    /// Another number for every other groom, paint of it, place where it has moved to, and things beside it.
    #[cfg(feature = "ui")]
    pub(crate) fn n_beside_look(&self) -> u64 {
        self.n_beside_look
    }

    /// Looks from the scene's camera again.
    pub fn reset_view(&mut self) {
        self.view = None;
        let camera = self.scene_camera();
        self.show_view(camera);
    }

    /// Is the picture seen from elsewhere than the scene has it?
    pub fn is_view_moved(&self) -> bool {
        self.view.is_some() && self.renderer.scene().camera != self.scene_camera()
    }

    /// Makes the view the scene's camera: an edit.
    ///
    /// # Errors
    /// As [`Viewer::edit`].
    pub fn save_view(&mut self) -> Result<Change, SessionError> {
        let section = section_of(&self.renderer.scene().camera);
        self.commit();
        let change = self.edit("Save view", |scene| scene.camera = Some(section))?;
        self.commit();
        self.view = None;
        Ok(change)
    }

    fn scene_camera(&self) -> Camera {
        let section = self.session.scene().camera.as_ref();
        let (centre, radius) = self.framing;
        camera(section, centre, radius)
    }

    /// See [`Session::commit`].
    pub fn commit(&mut self) {
        self.session.commit();
    }

    /// Takes the last step back; `None` if there is none.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn undo(&mut self) -> Result<Option<Change>, RenderError> {
        self.release()?;
        let n_done = self.session.n_done();
        let change = self.session.undo();
        self.show_step(change, n_done)
    }

    /// Does again what was undone last; `None` if there is none.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn redo(&mut self) -> Result<Option<Change>, RenderError> {
        self.release()?;
        let n_done = self.session.n_done();
        let change = self.session.redo();
        self.show_step(change, n_done)
    }

    /// See [`Session::go_to`].
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn go_to(&mut self, n_done: usize) -> Result<Option<Change>, RenderError> {
        self.release()?;
        let before = self.session.n_done();
        let change = self.session.go_to(n_done);
        self.show_step(change, before)
    }

    /// Where the hair is that is seen at `cursor`, px from the upper left corner of the picture.
    pub fn pick(&mut self, cursor: [f32; 2]) -> Option<glam::Vec3> {
        let size = self.size();
        let scene = self.renderer.scene();
        let picker = self.picker.of(&scene.strands);
        picker.pick(&scene.camera, size, cursor)
    }

    /// Width and height of the picture: the window's, or the scene's.
    pub fn size(&self) -> [u32; 2] {
        self.window.unwrap_or(self.session.scene().render.size)
    }

    /// See [`Session::keep_mine`].
    pub fn keep_mine(&mut self) {
        self.session.keep_mine();
    }

    /// See [`Session::overrule_conflicts`].
    pub fn overrule_conflicts(&mut self) {
        self.session.overrule_conflicts();
    }

    /// See [`Session::save`]. A stroke that is being made ends first.
    ///
    /// # Errors
    /// As there; whatever the device refuses.
    pub fn save(&mut self) -> Result<Saved, SessionError> {
        self.release()?;
        self.session.save()
    }

    /// See [`Session::save_as`]. A stroke that is being made ends first.
    ///
    /// # Errors
    /// As there; whatever the device refuses.
    pub fn save_as(&mut self, path: &Path) -> Result<Saved, SessionError> {
        self.release()?;
        self.session.save_as(path)
    }

    /// Reads all files again: see [`Session::reload`]. A stroke that is being made ends first, and
    /// can be brought back by undoing. The view stays unless the scene has another camera now.
    ///
    /// # Errors
    /// As there, or what cannot be drawn; the document stays as it was then.
    pub fn reload(&mut self) -> Result<Change, SessionError> {
        self.release()?;
        let (before, view) = (self.session.clone(), self.view);
        let mut change = self.session.reload()?;
        let has_other_camera = before.scene().camera != self.session.scene().camera;
        change.edits.set(Edits::CAMERA, has_other_camera);
        if let Err(error) = self.show(&change) {
            // With all that it knows of the files.
            (self.session, self.view) = (before, view);
            change.edits.remove(Edits::CAMERA);
            // It was drawn before.
            let _ = self.show(&change);
            return Err(error.into());
        }
        Ok(change)
    }

    /// Seconds since the start of the motion.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Shows the scene at `seconds` since the start of the motion.
    ///
    /// # Errors
    /// What cannot be drawn, by name; whatever the device refuses. The hair stays where it was then.
    pub fn set_time(&mut self, seconds: f64) -> Result<(), RenderError> {
        self.time = seconds;
        self.n_beside_look += u64::from(self.motion.is_some());
        self.move_hair()
    }

    /// Moves the hair to where it is at the time.
    fn move_hair(&mut self) -> Result<(), RenderError> {
        if self.motion.is_some() {
            self.outdate_picture();
            self.mask_view.forget();
        }
        let renderer = &mut self.renderer;
        match &mut self.motion {
            Some(Motion::Wind(section)) => {
                let wind = Wind::at(section, &renderer.scene().strands, self.time);
                renderer.set_wind(Some(wind))?;
            }
            Some(Motion::Sequence(sequence)) => {
                let points = sequence.points_at(&renderer.scene().strands, self.time)?;
                renderer.set_points(&points)?;
            }
            None => {}
        }
        Ok(())
    }

    /// One whole picture, linear, of `size` and `samples` a pixel, whatever the window has, and
    /// what it took.
    ///
    /// # Errors
    /// As [`Backend::render`].
    #[cfg(not(target_arch = "wasm32"))]
    pub fn frame(
        &mut self,
        size: [u32; 2],
        samples: u32,
    ) -> Result<(strandlight_scene::Picture, strandlight_scene::Stats), RenderError> {
        self.renderer.render(size, samples, &|_| ())
    }

    /// What has changed since this was last asked.
    pub fn take_changes(&mut self) -> Change {
        std::mem::take(&mut self.changes)
    }

    /// Shows what an edit of the document changed; takes the edit back if that cannot be.
    fn show_edit(&mut self, change: Change) -> Result<Change, RenderError> {
        match self.show(&change) {
            Ok(()) => {
                self.session.keep_edit();
                Ok(change)
            }
            Err(error) => {
                if let Some(back) = self.session.abandon() {
                    // It was drawn before.
                    let _ = self.show(&back);
                }
                Err(error)
            }
        }
    }

    /// Shows what steps of the history changed; goes back to the first `n_done` if that cannot be.
    fn show_step(
        &mut self,
        change: Option<Change>,
        n_done: usize,
    ) -> Result<Option<Change>, RenderError> {
        let shown = change.as_ref().map_or(Ok(()), |change| self.show(change));
        if shown.is_err()
            && let Some(back) = self.session.go_to(n_done)
        {
            // It was drawn before.
            let _ = self.show(&back);
        }
        shown.map(|()| change)
    }

    /// Tells the renderer what has changed.
    fn show(&mut self, change: &Change) -> Result<(), RenderError> {
        self.changes = std::mem::take(&mut self.changes).and(change.clone());
        if change.has(BESIDE_LOOK) {
            self.n_beside_look += 1;
        }
        if change.has(Edits::CAMERA) {
            self.view = None;
        }
        if change.has(Edits::MASK) {
            self.mask_view.set_outdated();
        }
        // Another groom has a mask of its own, and what moves is seen elsewhere.
        if change.has(Edits::GEOMETRY | Edits::SHAPE | Edits::MOTION) {
            self.mask_view.forget();
        }
        // How it is graded can change while it goes on.
        let mut of_picture =
            Edits::all() - (Edits::GRADE | Edits::SAMPLES | Edits::LABEL | Edits::MASK);
        // The window's picture has its own.
        of_picture.set(Edits::SIZE, self.window.is_none());
        let background = self.session.scene().render.background;
        let panorama = self.session.panorama();
        let shown = self.renderer.scene();
        let is_behind = background == shown.background && panorama == shown.panorama;
        if change.has(of_picture) || !is_behind {
            self.outdate_picture();
        }
        let has_motion = self.motion.is_some();
        if change.inputs().is_all() || change.has(Edits::DIAMETER) && has_motion {
            return self.renew();
        }
        if change.has(Edits::VARIATION) && self.needs_less_paint()
            || change.has(Edits::HAIR) && self.is_unpaintable()
        {
            return self.renew();
        }
        let scene = self.session.scene();
        let (assets, renderer) = (self.session.assets(), &mut self.renderer);
        if change.has(Edits::HAIR | Edits::MODES) {
            renderer.set_hair(&scene.hair.params(), &scene.hair.modes)?;
        }
        if change.has(Edits::SCATTERING) {
            renderer.set_scattering(scene.render.scattering);
        }
        if change.has(Edits::DENSITIES) {
            renderer.set_densities(densities(&scene.hair));
        }
        if change.has(Edits::DIAMETER) {
            let strands = assets.strands(scene)?;
            let radii: Vec<f32> = strands.points.iter().map(|point| point[3]).collect();
            renderer.set_radii(&radii)?;
        }
        if change.has(Edits::LIGHTS) {
            renderer.set_lights(assets.planned_lights(&scene.lights))?;
        }
        if change.has(Edits::LIGHTS | Edits::LIGHT_COLORS) {
            renderer.set_light_colors(&assets.light_colors(&scene.lights))?;
        }
        if change.has(Edits::PROXIES) {
            renderer.set_proxies(assets.proxies(scene));
        }
        if change.has(Edits::CAMERA) {
            let (centre, radius) = self.framing;
            renderer.set_camera(camera(scene.camera.as_ref(), centre, radius));
        }
        if change.has(Edits::SIZE) && self.window.is_none() {
            renderer.set_size(scene.render.size)?;
        }
        if change.has(Edits::SAMPLES) {
            renderer.set_samples(scene.render.samples);
        }
        if change.has(Edits::GRADE) {
            let render = &scene.render;
            let display = assets.display(render);
            renderer.set_panorama(panorama);
            renderer.set_grade(render.exposure as f32, display, render.background);
        }
        self.show_paint(change)
    }

    /// Puts the document on the renderer again.
    fn renew(&mut self) -> Result<(), RenderError> {
        let scene = unmuted_scene_of(&self.session)?;
        self.renew_on(scene, B::set_scene)
    }

    fn renew_on(
        &mut self,
        scene: PreparedScene,
        put: impl FnOnce(&mut B, PreparedScene) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        self.varied = None;
        self.framing = (scene.strands.centre, scene.strands.radius);
        put(&mut self.renderer, scene)?;
        self.set_light_colors()?;
        self.motion = Motion::new(self.session.scene(), self.session.files());
        if let Some(view) = self.view {
            self.renderer.set_camera(view);
        }
        self.move_hair()?;
        if let Some(size) = self.window {
            self.renderer.set_size(size)?;
        }
        Ok(())
    }

    fn set_light_colors(&mut self) -> Result<(), RenderError> {
        let lights = &self.session.scene().lights;
        let colors = self.session.assets().light_colors(lights);
        self.renderer.set_light_colors(&colors)
    }
}

/// `scene` of these files and this paint. Shadow maps are planned for the lights as the set has them, so that
/// switching one off and on again, here or in the file, gives the same picture.
pub(crate) fn unmuted_scene(
    scene: &Scene,
    assets: &Assets,
    paint: Option<&Paint>,
) -> Result<PreparedScene, SceneError> {
    let mut prepared = PreparedScene::with_paint(scene, assets, paint)?;
    prepared.lights = assets.planned_lights(&scene.lights);
    Ok(prepared)
}

fn unmuted_scene_of(session: &Session) -> Result<PreparedScene, SceneError> {
    unmuted_scene(session.scene(), session.assets(), session.paint())
}

/// What draws `scene` on the device: by a visibility list, without samples.
fn on_device(context: &Context, scene: PreparedScene) -> Result<ProgressiveRenderer, RenderError> {
    let mut renderer = ProgressiveRenderer::new(context, scene)?;
    renderer.draw_by_list()?;
    Ok(renderer)
}
