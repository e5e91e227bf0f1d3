//! The side of the worker.

use std::time::Duration;

use strandlight_cpu::InteractiveRenderer;
use strandlight_formats::Scene;
use strandlight_scene::Backend;
use strandlight_scene::assets::{Assets, ModesToRead};
use strandlight_scene::files::Files;
use strandlight_scene::glam::Vec3;
use strandlight_scene::paint::Paint;
use strandlight_scene::{Camera, SceneError};

use super::WorkerError;
use super::message::{Answer, Batch, Blobs, DocumentPaint, Edit, Report, decode, encode};
use crate::viewer::unmuted_scene;

/// Work before messages are looked at again; one step at least.
const BUDGET: Duration = Duration::from_millis(4);

/// Draws what a [`WorkerRenderer`](super::WorkerRenderer) tells it.
#[derive(Default)]
pub struct Worker {
    drawn: Option<Drawn>,
    /// Batches so far.
    n_taken: u64,
    /// Does anybody look?
    is_watched: bool,
    /// Was the last picture seen? Without edits none is made before, so that none is left out and nothing jumps.
    is_unseen: bool,
    version: u64,
    /// What was told last.
    told: Answer,
    failure: Option<String>,
}

/// A document, and its renderer.
struct Drawn {
    renderer: InteractiveRenderer,
    assets: Assets,
    scene: Scene,
    /// What the page has painted.
    paint: Paint,
}

impl Worker {
    /// Takes a message of the page. What is wrong with it is the next answer.
    pub fn take(&mut self, message: &[u8]) {
        if message.is_empty() {
            self.is_unseen = false;
            return;
        }
        self.n_taken += 1;
        if let Err(error) = self.try_to_take(message) {
            self.failure = Some(error.to_string());
        }
    }

    fn try_to_take(&mut self, message: &[u8]) -> Result<(), WorkerError> {
        let (batch, mut blobs): (Batch, _) = decode(message)?;
        self.is_watched |= !batch.is_ahead;
        for edit in batch.edits {
            let scene = batch.scene.as_deref();
            if let Edit::Document { path, files, paint } = edit {
                let text = scene.unwrap_or_default();
                let scene = Scene::from_bytes(text.as_bytes(), &path)?;
                let files = files
                    .into_iter()
                    .map(|name| Ok((name, blobs.next()?.to_vec())));
                let files = files.collect::<Result<Vec<_>, WorkerError>>()?;
                self.open(scene, &Files::in_memory(files), paint, &mut blobs)?;
            } else if let Some(drawn) = &mut self.drawn {
                drawn.edit(edit, scene, &mut blobs)?;
            }
        }
        Ok(())
    }

    fn open(
        &mut self,
        scene: Scene,
        files: &Files,
        paint: DocumentPaint,
        blobs: &mut Blobs,
    ) -> Result<(), WorkerError> {
        let assets = Assets::read(&scene, files, ModesToRead::All)?;
        let paint = match paint {
            DocumentPaint::OfGroom => Paint::from_groom(&assets.groom)?,
            DocumentPaint::Own => Some(blobs.paint()?),
            DocumentPaint::None => None,
        };
        let prepared = unmuted_scene(&scene, &assets, paint.as_ref())?;
        let renderer = match self.drawn.take() {
            Some(Drawn { mut renderer, .. }) => {
                renderer.set_scene(prepared)?;
                renderer
            }
            None => InteractiveRenderer::new(prepared),
        };
        self.drawn = Some(Drawn {
            renderer,
            assets,
            scene,
            paint: Paint::default(),
        });
        Ok(())
    }

    /// Is there something to do, or to tell?
    pub fn is_working(&self) -> bool {
        let is_picture_due = self.is_watched && !self.is_unseen;
        let drawn = self.drawn.as_ref();
        let is_unfinished = drawn.is_some_and(|drawn| !drawn.renderer.progress().is_done);
        let is_untold = self.told.n_taken != self.n_taken;
        self.told.failure.is_none() && (is_untold || is_picture_due && is_unfinished)
    }

    /// Goes on with the picture; answers what the page is to be told, if there is something new.
    pub fn work(&mut self) -> Option<Vec<u8>> {
        let is_untold = self.told.n_taken != self.n_taken;
        let mut failure = self.failure.take();
        let mut picture = None;
        let mut answer = Answer {
            n_taken: self.n_taken,
            ..Answer::default()
        };
        if let Some(Drawn { renderer, .. }) = &mut self.drawn {
            // An edit is answered by its picture, whether the one before was seen or not.
            if self.is_watched
                && (is_untold || !self.is_unseen)
                && let Err(error) = renderer.advance(BUDGET)
            {
                failure = failure.or(Some(error.to_string()));
            }
            let progress = renderer.progress();
            (answer.is_shown, answer.is_shaded) = (progress.is_shown, progress.is_shaded);
            answer.is_done = progress.is_done;
            let display = renderer.display();
            if display.version != self.version {
                self.version = display.version;
                self.is_unseen = true;
                answer.size = Some(display.size);
                picture = Some(display.pixels);
                answer.report = Some(Report::from(renderer.report()));
            } else if answer.is_done && !self.told.is_done {
                answer.report = Some(Report::from(renderer.report()));
            }
        }
        answer.failure = failure;
        let is_news = is_untold
            || picture.is_some()
            || answer.failure.is_some()
            || answer.progress() != self.told.progress();
        if !is_news {
            return None;
        }
        let message = encode(&answer, picture.map(bytemuck::cast_slice).as_slice());
        self.told = answer;
        message.ok()
    }
}

impl Drawn {
    /// Calls the setter.
    fn edit(
        &mut self,
        edit: Edit,
        scene: Option<&str>,
        blobs: &mut Blobs,
    ) -> Result<(), WorkerError> {
        if edit.is_of_scene()
            && let Some(text) = scene
        {
            let folder = std::mem::take(&mut self.scene.folder);
            self.scene = Scene::from_toml(text)?;
            self.scene.folder = folder;
        }
        let renderer = &mut self.renderer;
        match edit {
            // Opened before.
            Edit::Document { .. } => {}
            Edit::Hair(hair, modes) => renderer.set_hair(&hair, &modes)?,
            Edit::Scattering(scattering) => renderer.set_scattering(scattering),
            Edit::Densities(densities) => renderer.set_densities(densities),
            Edit::Lights(lights) => renderer.set_lights(lights)?,
            Edit::LightColors(rgb) => renderer.set_light_colors(&rgb)?,
            Edit::Points => renderer.set_points(&blobs.values::<[f32; 4]>()?)?,
            Edit::Radii => renderer.set_radii(&blobs.values::<f32>()?)?,
            Edit::Wind => renderer.set_wind(blobs.values()?.first().copied())?,
            Edit::Paint { start, n_points } => {
                let points = blobs.paint()?.points;
                self.paint.points.resize(n_points, Default::default());
                let changed = start..start + points.len();
                let old = self.paint.points.get_mut(changed.clone());
                old.ok_or(SceneError::Offsets)?.copy_from_slice(&points);
                renderer.set_paint(&self.paint, changed)?;
            }
            Edit::Proxies => renderer.set_proxies(self.assets.proxies(&self.scene)),
            Edit::Camera([eye, target, up], fov_y) => renderer.set_camera(Camera {
                eye: Vec3::from(eye),
                target: Vec3::from(target),
                up: Vec3::from(up),
                fov_y,
            }),
            Edit::Panorama => {
                renderer.set_panorama(self.assets.turned_panorama(&self.scene.lights));
            }
            Edit::Grade {
                exposure,
                background,
            } => {
                let display = self.assets.display(&self.scene.render);
                renderer.set_grade(exposure, display, background);
            }
            Edit::Size(size) => renderer.set_size(size)?,
            Edit::Samples(samples) => renderer.set_samples(samples),
        }
        Ok(())
    }
}
