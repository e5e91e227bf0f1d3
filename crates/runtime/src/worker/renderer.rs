//! The side of the page.

use std::mem;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use strandlight_cpu::{DisplayPixels, InteractiveRenderer};
use strandlight_formats::{Background, Scattering, Scene, SrbfLight};
use strandlight_render::gpu::Context;
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::assets::Assets;
use strandlight_scene::files::Files;
use strandlight_scene::interactive::{PictureProgress, RenderReport};
use strandlight_scene::motion::Wind;
use strandlight_scene::paint::Paint;
use strandlight_scene::panorama::TurnedPanorama;
use strandlight_scene::proxy::Proxy;
#[cfg(not(target_arch = "wasm32"))]
use strandlight_scene::stats::Observer;
#[cfg(target_arch = "wasm32")]
use strandlight_scene::tables::DEFAULT_FILE;
use strandlight_scene::{Backend, Camera, DisplayTransform, PreparedScene, RenderError};
#[cfg(not(target_arch = "wasm32"))]
use strandlight_scene::{Picture, Stats};

use super::WorkerError;
use super::message::{Answer, Batch, DocumentPaint, Edit, decode, encode, paint_blob};
use crate::interactive::{Display, InteractiveBackend};
use crate::session::Session;

/// The way to a worker and back.
pub trait Link {
    /// Sends bytes there. They arrive in the order in which they are sent.
    fn send(&mut self, message: Vec<u8>);

    /// The next answer that has come; or why there will be none.
    fn take(&mut self) -> Option<Result<Vec<u8>, String>>;
}

/// A [`Backend`] whose pictures a worker makes. Setters do as those of [`InteractiveRenderer`]; [`WorkerRenderer::advance`]
/// sends what was edited and takes up what has come. Where the worker fails, the page draws.
pub struct WorkerRenderer {
    /// The scene as it was last set. It draws where there is no worker.
    local: InteractiveRenderer,
    link: Option<Box<dyn Link>>,
    /// What the worker was not told. It is told all at once, so that it draws no scene between two edits that are made together.
    unsent: Vec<(Edit, Vec<Vec<u8>>)>,
    /// Is the worker's scene another one altogether?
    is_other_scene: bool,
    /// What was read of the files of the worker's scene.
    assets: Option<Assets>,
    /// Does the worker have the paint? Then it is told what changes of it.
    has_paint: bool,
    /// The wind, and whether the strands here are bent by it.
    wind: Option<(Wind, bool)>,
    size: [u32; 2],
    /// Batches that were sent, and the first of them that has the view as it is now.
    n_sent: u64,
    last_view: u64,
    /// The last one of the worker.
    answer: Answer,
    report: RenderReport,
    pixels: Vec<[u8; 4]>,
    shown: [u32; 2],
    /// Another number for every other picture, whoever made it.
    version: u64,
}

/// The files that a renderer of `scene` reads.
pub fn files_of(scene: &Scene) -> Vec<PathBuf> {
    let mut names = vec![scene.groom_path(), scene.lights_path()];
    let tables = scene.tables_path();
    // Elsewhere the program has them.
    #[cfg(target_arch = "wasm32")]
    let tables = tables.or_else(|| Some(DEFAULT_FILE.into()));
    names.extend(tables);
    names.extend(scene.lut_path());
    names.extend(scene.seen_panorama_path());
    names.extend(scene.mesh_paths().into_iter().map(|(_, path)| path));
    names.sort();
    names.dedup();
    names
}

/// Sends the scene at `path`, as its file is, to a worker: a [`WorkerRenderer`] of it follows. Both prepare it meanwhile.
///
/// # Errors
/// What cannot be read.
pub fn send_ahead(link: &mut dyn Link, path: &Path, files: &Files) -> Result<(), WorkerError> {
    let scene = files.scene(path)?;
    let (edit, blobs) = document(path, &scene, files, DocumentPaint::OfGroom)?;
    let batch = Batch {
        scene: Some(scene.to_toml_string()?),
        edits: vec![edit],
        is_ahead: true,
    };
    let blobs: Vec<&[u8]> = blobs.iter().map(Vec::as_slice).collect();
    link.send(encode(&batch, &blobs)?);
    Ok(())
}

/// What sends a scene, with its files.
fn document(
    path: &Path,
    scene: &Scene,
    files: &Files,
    paint: DocumentPaint,
) -> Result<(Edit, Vec<Vec<u8>>), WorkerError> {
    let names = files_of(scene);
    let blobs = names.iter().map(|name| files.read(name, u64::MAX));
    let blobs = blobs.collect::<Result<_, _>>()?;
    let edit = Edit::Document {
        path: path.to_owned(),
        files: names,
        paint,
    };
    Ok((edit, blobs))
}

impl WorkerRenderer {
    /// A renderer of `scene`, which [`send_ahead`] has sent by `link`.
    pub fn new(scene: PreparedScene, link: Box<dyn Link>) -> WorkerRenderer {
        let size = scene.size;
        let local = InteractiveRenderer::new(scene);
        WorkerRenderer {
            report: local.report().clone(),
            local,
            link: Some(link),
            unsent: Vec::new(),
            is_other_scene: false,
            assets: None,
            has_paint: false,
            wind: None,
            size,
            n_sent: 1,
            last_view: 1,
            answer: Answer::default(),
            pixels: Vec::new(),
            shown: [0; 2],
            version: 0,
        }
    }

    /// Notes what the worker is to be told.
    fn note(&mut self, edit: Edit) {
        self.note_with(edit, Vec::new());
    }

    fn note_with(&mut self, edit: Edit, blobs: Vec<Vec<u8>>) {
        if self.link.is_none() {
            return;
        }
        if matches!(edit, Edit::Camera(..) | Edit::Size(_)) {
            self.last_view = self.n_sent + 1;
        }
        self.unsent.push((edit, blobs));
    }

    /// Sends what was edited, `session` being what is edited.
    fn send(&mut self, session: &Session) -> Result<(), WorkerError> {
        let assets = session.assets();
        let of_worker = self.assets.get_or_insert_with(|| assets.clone());
        let is_same = |a: &Assets| {
            let [lut, of_worker] = [assets, a].map(|of| of.lut.as_ref().map(Arc::as_ptr));
            let [map, of_worker_too] = [assets, a].map(|of| of.panorama.as_ref().map(Arc::as_ptr));
            Arc::ptr_eq(&assets.meshes, &a.meshes) && lut == of_worker && map == of_worker_too
        };
        let has_other_files = !is_same(of_worker);
        if self.is_other_scene || has_other_files {
            self.note_document(session, has_other_files && !self.is_other_scene)?;
        }
        let Some(link) = self.link.as_mut().filter(|_| !self.unsent.is_empty()) else {
            return Ok(());
        };
        let (edits, blobs): (Vec<Edit>, Vec<_>) = mem::take(&mut self.unsent).into_iter().unzip();
        let scene = match edits.iter().any(Edit::is_of_scene) {
            true => Some(session.scene().to_toml_string()?),
            false => None,
        };
        let batch = Batch {
            scene,
            edits,
            is_ahead: false,
        };
        let blobs: Vec<&[u8]> = blobs.iter().flatten().map(Vec::as_slice).collect();
        link.send(encode(&batch, &blobs)?);
        self.n_sent += 1;
        Ok(())
    }

    /// Notes all of the document, before what was edited since; where it `stays` as it is but for its files, with what else
    /// was set.
    fn note_document(&mut self, session: &Session, stays: bool) -> Result<(), WorkerError> {
        let own = session.own_paint();
        let paint = match (session.is_repainted(), own) {
            (false, _) => DocumentPaint::OfGroom,
            (true, Some(_)) => DocumentPaint::Own,
            (true, None) => DocumentPaint::None,
        };
        let (edit, mut blobs) = document(session.path(), session.scene(), session.files(), paint)?;
        blobs.extend(own.map(|paint| paint_blob(&paint.points)));
        let since = mem::replace(&mut self.unsent, vec![(edit, blobs)]);
        if stays {
            let scene = self.local.scene();
            let (colors, camera) = (
                scene.lights.iter().map(|light| light.rgb).collect(),
                scene.camera,
            );
            let points = session.scene().motion.as_ref();
            let points = points.map(|_| bytemuck::cast_slice(&scene.strands.points).to_vec());
            self.note(Edit::LightColors(colors));
            match (self.wind, points) {
                (Some((wind, _)), _) => {
                    self.note_with(Edit::Wind, vec![bytemuck::bytes_of(&wind).to_vec()]);
                }
                (None, Some(points)) => self.note_with(Edit::Points, vec![points]),
                (None, None) => {}
            }
            self.note(camera_edit(camera));
            self.note(Edit::Size(self.size));
        }
        self.unsent.extend(since);
        self.last_view = self.n_sent + 1;
        self.has_paint = false;
        self.is_other_scene = false;
        self.assets = Some(session.assets().clone());
        Ok(())
    }

    /// Takes up what has come from the worker.
    fn receive(&mut self) -> Result<(), WorkerError> {
        while let Some(answer) = self.link.as_mut().and_then(|link| link.take()) {
            let answer = answer.map_err(WorkerError::Failed)?;
            let (answer, mut blobs): (Answer, _) = decode(&answer)?;
            if let Some(reason) = answer.failure {
                return Err(WorkerError::Failed(reason));
            }
            if let Some(report) = &answer.report {
                self.report = report.into();
            }
            if let Some(size) = answer.size {
                (self.pixels, self.shown) = (blobs.values()?, size);
                self.version += 1;
                // The worker makes the next one.
                if let Some(link) = &mut self.link {
                    link.send(Vec::new());
                }
            }
            self.answer = answer;
        }
        Ok(())
    }

    /// The page goes on without a worker.
    fn leave(&mut self, error: &WorkerError) {
        warn(error);
        self.link = None;
        self.unsent.clear();
        self.version += 1;
    }

    /// Bends the strands here by the wind that the worker's have had all the time.
    fn bend(&mut self) -> Result<(), RenderError> {
        if let Some((wind, is_bent)) = &mut self.wind
            && !*is_bent
        {
            self.local.set_wind(Some(*wind))?;
            *is_bent = true;
        }
        Ok(())
    }

    /// Does the worker have all that was set?
    fn is_all_taken(&self) -> bool {
        self.unsent.is_empty() && self.answer.n_taken == self.n_sent
    }

    fn progress(&self) -> PictureProgress {
        let is_all_taken = self.is_all_taken();
        PictureProgress {
            is_shown: self.answer.is_shown && self.answer.n_taken >= self.last_view,
            is_shaded: self.answer.is_shaded && is_all_taken,
            is_done: self.answer.is_done && is_all_taken || self.size.contains(&0),
            ..PictureProgress::default()
        }
    }
}

/// Tells whoever made the page.
fn warn(error: &WorkerError) {
    let text = format!("strandview: the page draws without a worker: {error}");
    #[cfg(target_arch = "wasm32")]
    web_sys::console::warn_1(&text.into());
    #[cfg(not(target_arch = "wasm32"))]
    eprintln!("{text}");
}

fn camera_edit(camera: Camera) -> Edit {
    let places = [camera.eye, camera.target, camera.up].map(Into::into);
    Edit::Camera(places, camera.fov_y)
}

impl InteractiveBackend for WorkerRenderer {
    fn follow(&mut self, session: &Session) {
        if self.link.is_some()
            && let Err(error) = self.send(session)
        {
            self.leave(&error);
        }
    }

    fn advance(&mut self, budget: Duration) -> Result<PictureProgress, RenderError> {
        if let Err(error) = self.receive() {
            self.leave(&error);
        }
        if self.link.is_none() {
            self.bend()?;
            return self.local.advance(budget);
        }
        let progress = self.progress();
        if progress.is_done {
            self.bend()?;
        }
        Ok(progress)
    }

    fn works_alone(&self) -> bool {
        self.link.is_some()
    }

    fn report(&self) -> &RenderReport {
        match self.link {
            Some(_) => &self.report,
            None => self.local.report(),
        }
    }

    fn display(&self) -> Display<'_> {
        if self.link.is_some() {
            return Display::Pixels(DisplayPixels {
                pixels: &self.pixels,
                size: self.shown,
                version: self.version,
            });
        }
        let display = self.local.display();
        Display::Pixels(DisplayPixels {
            version: self.version + display.version,
            ..display
        })
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn over_nothing(&mut self, size: [u32; 2]) -> Result<Picture, RenderError> {
        self.local.over_nothing(size)
    }

    fn device(&self) -> Option<&Context> {
        None
    }

    fn set_device(&mut self, _: &Context, _: PreparedScene) -> Result<(), RenderError> {
        Ok(())
    }
}

impl Backend for WorkerRenderer {
    fn name(&self) -> String {
        self.local.name()
    }

    fn scene(&self) -> &PreparedScene {
        self.local.scene()
    }

    fn set_scene(&mut self, scene: PreparedScene) -> Result<(), RenderError> {
        self.size = scene.size;
        self.local.set_scene(scene)?;
        self.wind = None;
        self.unsent.clear();
        self.is_other_scene = self.link.is_some();
        self.last_view = self.n_sent + 1;
        Ok(())
    }

    fn set_hair(&mut self, hair: &HairParams, modes: &[Lobe]) -> Result<(), RenderError> {
        self.local.set_hair(hair, modes)?;
        self.note(Edit::Hair(*hair, modes.to_vec()));
        Ok(())
    }

    fn set_scattering(&mut self, scattering: Scattering) {
        self.local.set_scattering(scattering);
        self.note(Edit::Scattering(scattering));
    }

    fn set_densities(&mut self, densities: [f32; 2]) {
        self.local.set_densities(densities);
        self.note(Edit::Densities(densities));
    }

    fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<(), RenderError> {
        self.local.set_lights(lights.clone())?;
        self.note(Edit::Lights(lights));
        Ok(())
    }

    fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<(), RenderError> {
        self.local.set_light_colors(rgb)?;
        self.note(Edit::LightColors(rgb.to_vec()));
        Ok(())
    }

    fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError> {
        self.local.set_points(points)?;
        self.wind = None;
        self.note_with(Edit::Points, vec![bytemuck::cast_slice(points).to_vec()]);
        Ok(())
    }

    fn set_radii(&mut self, radii: &[f32]) -> Result<(), RenderError> {
        self.local.set_radii(radii)?;
        self.note_with(Edit::Radii, vec![bytemuck::cast_slice(radii).to_vec()]);
        Ok(())
    }

    /// The worker bends the strands; those of the scene here follow when the picture is complete.
    fn set_wind(&mut self, wind: Option<Wind>) -> Result<(), RenderError> {
        self.wind = wind.map(|wind| (wind, false));
        if wind.is_none() {
            self.local.set_wind(None)?;
        }
        let blob = wind.map_or_else(Vec::new, |wind| bytemuck::bytes_of(&wind).to_vec());
        self.note_with(Edit::Wind, vec![blob]);
        Ok(())
    }

    fn set_paint(&mut self, paint: &Paint, changed: Range<usize>) -> Result<(), RenderError> {
        self.local.set_paint(paint, changed.clone())?;
        if self.link.is_none() {
            return Ok(());
        }
        let n_points = paint.points.len();
        let changed = match mem::replace(&mut self.has_paint, true) {
            true => changed,
            false => 0..n_points,
        };
        let start = changed.start;
        let blob = paint_blob(paint.points.get(changed).unwrap_or_default());
        self.note_with(Edit::Paint { start, n_points }, vec![blob]);
        Ok(())
    }

    fn set_proxies(&mut self, proxies: Vec<Proxy>) {
        self.local.set_proxies(proxies);
        self.note(Edit::Proxies);
    }

    fn set_camera(&mut self, camera: Camera) {
        if self.local.scene().camera != camera {
            self.local.set_camera(camera);
            self.note(camera_edit(camera));
        }
    }

    fn set_grade(&mut self, exposure: f32, display: DisplayTransform, background: Background) {
        self.local.set_grade(exposure, display, background);
        self.note(Edit::Grade {
            exposure,
            background,
        });
    }

    fn set_panorama(&mut self, panorama: Option<TurnedPanorama>) {
        self.local.set_panorama(panorama);
        self.note(Edit::Panorama);
    }

    fn set_size(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        if self.size != size {
            self.local.set_size(size)?;
            self.size = size;
            self.note(Edit::Size(size));
        }
        Ok(())
    }

    fn set_samples(&mut self, samples: u32) {
        self.local.set_samples(samples);
        self.note(Edit::Samples(samples));
    }

    /// Nothing else is ever shaded.
    fn shade_view_only(&mut self) {}

    #[cfg(not(target_arch = "wasm32"))]
    fn render(
        &mut self,
        size: [u32; 2],
        samples: u32,
        observer: Observer,
    ) -> Result<(Picture, Stats), RenderError> {
        self.local.render(size, samples, observer)
    }
}
