//! The renderer as a [`Backend`].

use std::ops::Range;

use strandlight_formats::{Background, Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::budget::check_frame;
use strandlight_scene::camera::view_uniform;
use strandlight_scene::motion::Wind;
use strandlight_scene::paint::Paint;
use strandlight_scene::panorama::TurnedPanorama;
use strandlight_scene::proxy::Proxy;
use strandlight_scene::stats::Observer;
use strandlight_scene::{
    Backend, Camera, DisplayTransform, Picture, PreparedScene, RenderError, Stats,
};

use super::composite::composite;
use super::edited_scene::{EditedScene, edit_setters};
use super::frame::{Edit, Frame};
use super::last_view::LastView;
use super::sampled::{PointShadows, ShadowSource, render_observed};
use strandlight_scene::progress::Deadline;

/// Most pixels of a picture that is drawn by a visibility list, some 100 bytes each; larger ones are
/// drawn by samples.
const MAX_LIST_PIXELS: u64 = 1 << 25;

/// A scene that is drawn on the CPU: by a visibility list, without noise. An edit recomputes what
/// depends on it.
pub struct CpuRenderer {
    pub(super) edited: EditedScene,
    frame: Frame,
    /// The scene that is being drawn by [`CpuRenderer::advance`], and edits since then.
    drawn: Option<PreparedScene>,
    waiting: Vec<Edit>,
    /// See [`CpuRenderer::hold`].
    is_held: bool,
    /// The picture of another view, until the view as last set has one.
    last_view: Option<LastView>,
    /// Draws samples in place of a visibility list.
    is_sampled: bool,
    /// In place of sweeps and shadow maps.
    shadows: Option<Box<PointShadows<'static>>>,
}

/// What [`CpuRenderer::advance`] came to.
#[derive(Clone, Copy)]
pub(super) struct Advance {
    /// Nothing is left to do.
    pub is_done: bool,
    /// The picture that is shown has all light of the scene as last set, in the shadows of maps, if not of all of them yet.
    pub is_complete: bool,
    /// Another number, another picture.
    pub version: u64,
}

impl CpuRenderer {
    /// A renderer of `scene`.
    pub fn new(scene: PreparedScene) -> CpuRenderer {
        CpuRenderer::of(EditedScene::new(scene))
    }

    /// A renderer of a scene as it was edited.
    pub(super) fn of(edited: EditedScene) -> CpuRenderer {
        CpuRenderer {
            frame: Frame::of(&edited.planned),
            edited,
            drawn: None,
            waiting: Vec::new(),
            is_held: false,
            last_view: None,
            is_sampled: false,
            shadows: None,
        }
    }

    /// [`CpuRenderer::new`] that draws samples, as a GPU does, and everything again for every picture.
    pub fn by_samples(scene: PreparedScene) -> CpuRenderer {
        CpuRenderer {
            is_sampled: true,
            ..CpuRenderer::new(scene)
        }
    }

    /// [`CpuRenderer::by_samples`] with transmittance found by `shadows` at every point: see
    /// [`ShadowSource::Points`].
    pub fn with_shadows(scene: PreparedScene, shadows: Box<PointShadows<'static>>) -> CpuRenderer {
        CpuRenderer {
            shadows: Some(shadows),
            ..CpuRenderer::by_samples(scene)
        }
    }

    /// The scene was edited. An edit waits for the first picture after the one before it, so that there
    /// are pictures while a slider is dragged. Another view need not wait for a picture to be shown: it shows that one as
    /// seen from there.
    pub(super) fn take(&mut self, edits: impl IntoIterator<Item = Edit>) {
        for edit in edits {
            let is_to_come = self.is_held && edit != Edit::View;
            self.waiting.push(edit);
            if self.drawn.is_none() || !is_to_come && !self.has_to_wait() {
                self.take_edits();
            }
        }
    }

    /// Another scene takes the place of this one.
    pub(super) fn replace(&mut self, edited: EditedScene) {
        self.frame = Frame::of(&edited.planned);
        self.edited = edited;
        (self.drawn, self.last_view) = (None, None);
        self.waiting.clear();
        self.is_held = false;
    }

    /// Says whether there is a picture that is still to be shown: edits wait for that, too.
    pub(super) fn hold(&mut self, is_held: bool) {
        self.is_held = is_held;
    }

    /// Does another view wait for the picture of this one?
    pub(super) fn has_waiting_view(&self) -> bool {
        self.waiting.contains(&Edit::View)
    }

    /// Does any edit wait for the picture before it?
    pub(super) fn has_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Must edits that wait go on waiting? Paint also waits for all points: then it shades those alone that it touches, as
    /// long as the stroke goes on.
    fn has_to_wait(&self) -> bool {
        let is_paint = self.waiting.contains(&Edit::Paint);
        !self.frame.has_picture() || is_paint && self.frame.has_most_points()
    }

    /// Takes up the edits that waited.
    fn take_edits(&mut self) {
        if !self.waiting.is_empty() {
            if self.has_waiting_view() {
                self.keep_view();
            }
            self.drawn = None;
            self.frame.planned.clone_from(&self.edited.planned);
            for edit in self.waiting.drain(..) {
                self.frame.edited(edit);
            }
        }
    }

    /// Keeps the picture that is shown, if there is one, for views to come.
    fn keep_view(&mut self) {
        let shown = self
            .drawn
            .as_ref()
            .and_then(|drawn| self.frame.last_view(drawn));
        if shown.is_some() {
            self.last_view = shown;
        }
    }

    /// The picture of another view as the view that was set last sees it, while that has no picture of its own.
    pub(super) fn reprojected(&self, size: [u32; 2]) -> Option<Picture> {
        let last = self
            .last_view
            .as_ref()
            .filter(|last| last.view.size == size)?;
        let scene = &self.edited.scene;
        let view = view_uniform(&scene.camera, &scene.strands, size, scene.radiance_scale());
        let mut rgba = last.seen_from(&view);
        composite(scene, &view, 1, &mut rgba, &|_| ());
        let [width, height] = size;
        Some(Picture {
            width,
            height,
            rgba,
        })
    }

    /// Are pictures of this size drawn in steps?
    pub(super) fn has_steps(&self, size: [u32; 2]) -> bool {
        let n_pixels = u64::from(size[0]) * u64::from(size[1]);
        !self.is_sampled && n_pixels <= MAX_LIST_PIXELS
    }

    /// Works on the picture of this size until `deadline`, a step at least, or until there is another to
    /// show: see [`Frame::advance`].
    pub(super) fn advance(&mut self, size: [u32; 2], deadline: Deadline) -> Advance {
        if !self.has_to_wait() {
            self.take_edits();
        }
        let scene = self.drawn.get_or_insert_with(|| self.edited.scene.clone());
        let camera = scene.camera;
        let is_time = || deadline.is_to_come();
        let is_done = self.frame.advance(scene, &camera, size, is_time);
        if self.frame.has_picture() && self.waiting.is_empty() {
            self.last_view = None;
        }
        Advance {
            is_done: is_done && self.waiting.is_empty(),
            is_complete: self.frame.has_all_light() && self.waiting.is_empty(),
            version: self.frame.version(),
        }
    }

    /// Is there a picture of this size that [`CpuRenderer::advance`] came to?
    pub(super) fn can_show(&self, size: [u32; 2]) -> bool {
        self.drawn.is_some() && self.frame.can_show(size)
    }

    /// The last picture that [`CpuRenderer::advance`] came to, if there is one of this size.
    pub(super) fn shown(&self, size: [u32; 2]) -> Option<Picture> {
        let scene = self.drawn.as_ref()?;
        let rgba = self.frame.shown(scene, &scene.camera, size)?;
        let [width, height] = size;
        Some(Picture {
            width,
            height,
            rgba,
        })
    }

    /// [`CpuRenderer::shown`] without what is behind it.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn shown_over_nothing(&self, size: [u32; 2]) -> Option<Picture> {
        let mut scene = self.drawn.clone()?;
        scene.background = Background::None;
        let rgba = self.frame.shown(&scene, &scene.camera, size)?;
        let [width, height] = size;
        Some(Picture {
            width,
            height,
            rgba,
        })
    }

    /// What the work since the last picture took.
    pub(super) fn take_stats(&mut self) -> Stats {
        self.frame.take_stats()
    }

    /// [`Backend::render`], in pages too.
    pub(super) fn draw(
        &mut self,
        size: [u32; 2],
        samples: u32,
        observer: Observer,
    ) -> Result<(Picture, Stats), RenderError> {
        check_frame(size, samples)?;
        let camera = self.edited.scene.camera;
        if self.has_steps(size) {
            self.take_edits();
            return Ok(self.frame.draw(&self.edited.scene, &camera, size, observer));
        }
        let shadows = match &self.shadows {
            None => ShadowSource::Sweep,
            Some(find) => ShadowSource::Points(find),
        };
        render_observed(
            &self.edited.scene,
            &camera,
            size,
            samples,
            shadows,
            observer,
        )
    }
}

impl Backend for CpuRenderer {
    fn name(&self) -> String {
        "cpu".to_owned()
    }

    fn scene(&self) -> &PreparedScene {
        &self.edited.scene
    }

    fn set_scene(&mut self, scene: PreparedScene) -> Result<(), RenderError> {
        self.replace(EditedScene::new(scene));
        Ok(())
    }

    edit_setters!(edited);

    fn set_wind(&mut self, wind: Option<Wind>) -> Result<(), RenderError> {
        let edit = self.edited.set_wind(wind)?;
        self.take(edit);
        Ok(())
    }

    fn set_size(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        self.edited.scene.size = size;
        Ok(())
    }

    fn set_samples(&mut self, samples: u32) {
        self.edited.scene.samples = samples;
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
        self.draw(size, samples, observer)
    }
}
