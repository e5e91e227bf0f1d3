//! A window in a page, as the page around it drives it: values, camera, picture, panel, end.
//!
//! [`Hosted`] is the page's hold of an [`App`] that winit's event loop owns as well. winit calls it,
//! and so does the page, in turn: on the one thread of a page neither can come while the other is
//! at work, unless a listener of the page calls back at once, which is refused.

use std::cell::RefCell;
use std::rc::Rc;

use serde_json::{Map, Value, json};
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::WindowId;

use super::app::{App, Sent};
use super::snapshot::{self, SnapshotError};
use super::workspace::Workspace;
use crate::error::SessionError;
use crate::session::section_of;
use strandlight_formats::CameraSection;
use strandlight_scene::assets::camera;
use strandlight_scene::interactive::PictureProgress;
use strandlight_scene::{Camera, RenderError};

/// Why a page cannot have what it asks for.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HostedError {
    /// The scene is still being opened, or was closed.
    #[error("no scene is shown")]
    NoScene,
    /// The page called from within a call that it got.
    #[error("the viewer is at work: call it when its own call has returned")]
    AtWork,
    /// A key or value that the scene does not have.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// A camera that no scene could have.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Something else than the value that is asked for.
    #[error("{what}: {source}")]
    Value {
        /// What it should be.
        what: &'static str,
        /// What is wrong with it.
        source: serde_json::Error,
    },
}

/// A window in a page, for the page.
#[derive(Clone)]
pub struct Hosted {
    app: Rc<RefCell<App>>,
    proxy: EventLoopProxy<Sent>,
}

/// The same for the event loop.
pub(super) struct Looped(Rc<RefCell<App>>);

impl Hosted {
    /// Shares `app` between page and event loop.
    pub(super) fn new(app: App, proxy: EventLoopProxy<Sent>) -> (Hosted, Looped) {
        let app = Rc::new(RefCell::new(app));
        let looped = Looped(app.clone());
        (Hosted { app, proxy }, looped)
    }

    fn with<T>(
        &self,
        act: impl FnOnce(&mut Workspace) -> Result<T, HostedError>,
    ) -> Result<T, HostedError> {
        let mut app = self.app.try_borrow_mut().map_err(|_| HostedError::AtWork)?;
        act(app.workspace().ok_or(HostedError::NoScene)?)
    }

    /// Sets values of the scene by their keys, as one step to undo.
    ///
    /// # Errors
    /// What [`Viewer::set`](crate::Viewer::set) refuses; nothing is changed then.
    pub fn set(&self, values: &Map<String, Value>) -> Result<(), HostedError> {
        self.with(|workspace| workspace.set(values))
    }

    /// The value of the scene's key, none where the scene leaves it to its default.
    ///
    /// # Errors
    /// No scene.
    pub fn get(&self, key: &str) -> Result<Option<Value>, HostedError> {
        self.with(|workspace| {
            let scene = workspace.viewer.session().scene();
            let root = serde_json::to_value(scene);
            let root = root.map_err(|source| HostedError::Value {
                what: "scene",
                source,
            })?;
            let value = key.split('.').try_fold(&root, |at, part| match at {
                Value::Array(list) => list.get(part.parse::<usize>().ok()?),
                _ => at.get(part),
            });
            Ok(value.cloned())
        })
    }

    /// Where the picture is seen from.
    ///
    /// # Errors
    /// No scene.
    pub fn camera(&self) -> Result<CameraSection, HostedError> {
        self.with(|workspace| Ok(section_of(&workspace.viewer.prepared().camera)))
    }

    /// Looks from elsewhere: keys of `camera` in a scene, of which those that are missing stay.
    ///
    /// # Errors
    /// A camera that no scene could have; nothing is changed then.
    pub fn set_camera(&self, keys: Map<String, Value>) -> Result<(), HostedError> {
        let refused = |source| HostedError::Value {
            what: "camera",
            source,
        };
        self.with(|workspace| {
            let now = section_of(&workspace.viewer.prepared().camera);
            let mut section = serde_json::to_value(now).map_err(refused)?;
            if let Value::Object(section) = &mut section {
                section.extend(keys);
            }
            let section: CameraSection = serde_json::from_value(section).map_err(refused)?;
            let strands = &workspace.viewer.prepared().strands;
            let view = camera(Some(&section), strands.centre, strands.radius);
            workspace.look_at_once(view)
        })
    }

    /// Is the picture that of the scene as it is now, with all its samples?
    ///
    /// # Errors
    /// No scene.
    pub fn is_done(&self) -> Result<bool, HostedError> {
        self.with(|workspace| Ok(!workspace.is_unlogged))
    }

    /// Calls `done` with a PNG of the picture as it is.
    ///
    /// # Errors
    /// No scene.
    pub fn snapshot(
        &self,
        done: impl FnOnce(Result<Vec<u8>, SnapshotError>) + 'static,
    ) -> Result<(), HostedError> {
        self.with(|workspace| {
            snapshot::png_later(&workspace.viewer, done);
            Ok(())
        })
    }

    /// Shows bar, panel and status line, or the picture alone.
    ///
    /// # Errors
    /// No scene.
    pub fn show_panel(&self, is_shown: bool) -> Result<(), HostedError> {
        self.with(|workspace| {
            workspace.show_panel(is_shown);
            Ok(())
        })
    }

    /// Gives back memory and device at once, and ends the event loop when it comes to it.
    ///
    /// # Errors
    /// [`HostedError::AtWork`].
    pub fn close(&self) -> Result<(), HostedError> {
        let mut app = self.app.try_borrow_mut().map_err(|_| HostedError::AtWork)?;
        app.release();
        // A loop that is gone needs no end.
        let _ = self.proxy.send_event(Sent::Close);
        Ok(())
    }
}

impl ApplicationHandler<Sent> for Looped {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        self.0.borrow_mut().resumed(event_loop);
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, sent: Sent) {
        self.0.borrow_mut().user_event(event_loop, sent);
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        self.0.borrow_mut().window_event(event_loop, id, event);
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        self.0.borrow_mut().about_to_wait(event_loop);
    }
}

impl Workspace {
    fn set(&mut self, values: &Map<String, Value>) -> Result<(), HostedError> {
        self.end_stroke();
        let change = self.viewer.set(values)?;
        if !change.is_empty() {
            let keys: Vec<&String> = values.keys().collect();
            self.state.error = None;
            self.moved_on();
            self.changed("edit", json!({ "keys": keys }));
            self.window.request_redraw();
        }
        Ok(())
    }

    fn look_at_once(&mut self, view: Camera) -> Result<(), HostedError> {
        let from = self.viewer.prepared().camera;
        if view == from {
            return Ok(());
        }
        self.viewer.set_view(view)?;
        self.views.left(from, false, web_time::Instant::now());
        self.changed("view", json!({}));
        self.window.request_redraw();
        Ok(())
    }

    /// Shows bar, panel and status line, or the picture alone.
    pub(super) fn show_panel(&mut self, is_shown: bool) {
        // The picture gets another size, in the frames that follow.
        self.is_unlogged |= self.state.is_bare == is_shown;
        self.state.is_bare = !is_shown;
        self.window.request_redraw();
    }

    /// Tells the page how far the picture is, where that is news.
    pub(super) fn note_progress(&mut self) {
        if self.progress == self.told {
            return;
        }
        self.told = self.progress;
        let PictureProgress {
            samples,
            total_samples,
            is_shaded,
            is_done,
            ..
        } = self.progress;
        self.log.write(
            "progress",
            json!({
                "samples": samples,
                "totalSamples": total_samples,
                "isShaded": is_shaded,
                "isDone": is_done,
            }),
        );
    }

    /// Gives the device's memory back now: the browser would wait until it collects garbage.
    pub(super) fn release(self) {
        if let Some(context) = self.screen.context() {
            context.device.destroy();
        }
    }
}
