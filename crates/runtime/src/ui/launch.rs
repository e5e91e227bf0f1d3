//! What a window is opened with, and why it could not be.

use winit::error::{EventLoopError, OsError};

use super::log::EventLog;
use crate::choice::BackendChoice;
use crate::error::SessionError;
#[cfg(not(target_arch = "wasm32"))]
use crate::opening::CannotOpen;
use crate::session::Session;
#[cfg(not(target_arch = "wasm32"))]
use crate::work::Work;
#[cfg(target_arch = "wasm32")]
use crate::worker::{PageLink, send_ahead};
use strandlight_render::gpu::GpuError;

/// Opens the scene of a window, while that shows how far it is.
#[cfg(not(target_arch = "wasm32"))]
pub type Open = Box<dyn FnOnce(&Work) -> Result<Session, CannotOpen> + Send>;

/// Opens the scene of a page.
#[cfg(target_arch = "wasm32")]
pub type Open = Box<dyn FnOnce() -> Result<Session, SessionError>>;

/// What a window is opened with.
pub struct Launch {
    /// Opens the scene.
    pub open: Open,
    /// What is opened, for people: a name.
    pub name: String,
    /// Which renderer draws it.
    pub choice: BackendChoice,
    /// Width and height of the window in pixels; 1280 x 720 points by default.
    pub size: Option<[u32; 2]>,
    /// Seconds since the start of the scene's motion.
    pub seconds: f64,
    /// Where events are noted.
    pub log: EventLog,
    /// For tests: the device is lost after the first finished picture.
    pub loses_device: bool,
    /// What to draw in, all of it.
    #[cfg(target_arch = "wasm32")]
    pub canvas: web_sys::HtmlCanvasElement,
    /// Shows bar, panel and status line, or the picture alone.
    #[cfg(target_arch = "wasm32")]
    pub has_panel: bool,
    /// Starts what draws without a GPU.
    #[cfg(target_arch = "wasm32")]
    pub worker: WorkerStart,
}

/// How a page starts the worker that draws without a GPU, and what it draws.
#[cfg(target_arch = "wasm32")]
pub struct WorkerStart {
    start: js_sys::Function,
    path: std::path::PathBuf,
    files: strandlight_scene::files::Files,
}

#[cfg(target_arch = "wasm32")]
impl WorkerStart {
    /// `start` answers a worker, or throws; the scene is at `path` in `files`.
    pub fn new(
        start: js_sys::Function,
        path: std::path::PathBuf,
        files: strandlight_scene::files::Files,
    ) -> WorkerStart {
        WorkerStart { start, path, files }
    }

    /// A worker that prepares the scene, whose answers call `wake`; none where the browser refuses, which it is told.
    pub(super) fn start(self, wake: impl Fn() + Clone + 'static) -> Option<PageLink> {
        use wasm_bindgen::JsCast;

        let refused = |reason: &str| {
            let text = format!("strandview: the page draws without a worker: {reason}");
            web_sys::console::warn_1(&text.into());
        };
        let started = self.start.call0(&wasm_bindgen::JsValue::NULL);
        let started = started.and_then(|worker| worker.dyn_into::<web_sys::Worker>());
        let worker = started.map_err(|error| refused(&crate::page::words(&error)));
        let mut link = PageLink::new(worker.ok()?, wake);
        let sent = send_ahead(&mut link, &self.path, &self.files);
        sent.map_err(|error| refused(&error.to_string())).ok()?;
        Some(link)
    }
}

/// What is left of a launch while its scene is read.
pub(super) struct Rest {
    pub choice: BackendChoice,
    pub seconds: f64,
    pub log: EventLog,
    pub loses_device: bool,
    #[cfg_attr(
        target_arch = "wasm32",
        expect(dead_code, reason = "a page names itself")
    )]
    pub name: String,
    #[cfg(target_arch = "wasm32")]
    pub has_panel: bool,
    #[cfg(target_arch = "wasm32")]
    pub worker: Option<WorkerStart>,
}

impl Launch {
    /// What opens the scene, and the rest.
    pub(super) fn parts(self) -> (Open, Rest) {
        let rest = Rest {
            choice: self.choice,
            seconds: self.seconds,
            log: self.log,
            loses_device: self.loses_device,
            name: self.name,
            #[cfg(target_arch = "wasm32")]
            has_panel: self.has_panel,
            #[cfg(target_arch = "wasm32")]
            worker: Some(self.worker),
        };
        (self.open, rest)
    }
}

/// Why a window could not be opened, or had to close.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Failure {
    /// There is no display to open a window on.
    #[error(
        "cannot open a window: no display ({}); use --frame OUT.png to render without one",
        reason(.0)
    )]
    Display(#[source] EventLoopError),
    /// The display failed while the window was open.
    #[error("the window's event loop failed: {0}")]
    EventLoop(#[source] EventLoopError),
    /// The display has no window for us.
    #[error("the window could not be opened: {0}")]
    Window(#[from] OsError),
    /// No device that can draw.
    #[cfg_attr(
        not(target_arch = "wasm32"),
        error("{0}; --backend cpu draws without a GPU")
    )]
    #[cfg_attr(
        target_arch = "wasm32",
        error("{0}; the renderer \"cpu\" draws without a GPU")
    )]
    Gpu(#[from] GpuError),
    /// The file cannot be opened.
    #[cfg(not(target_arch = "wasm32"))]
    #[error(transparent)]
    Open(#[from] CannotOpen),
    /// The scene cannot be shown.
    #[error(transparent)]
    Session(#[from] SessionError),
}

/// What winit says of `error`, less where in its own source it gave up.
fn reason(error: &EventLoopError) -> String {
    let error = error.to_string();
    let reason = match error.strip_prefix("os error at ") {
        Some(rest) => rest.split_once(": ").map_or(rest, |(_, reason)| reason),
        None => &error,
    };
    reason.trim_end_matches('.').to_owned()
}
