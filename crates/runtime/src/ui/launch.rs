//! What a window is opened with, and why it could not be.

use winit::error::{EventLoopError, OsError};

use super::log::EventLog;
use crate::choice::BackendChoice;
use crate::error::SessionError;
use crate::session::Session;
use strandlight_render::gpu::GpuError;

/// Opens the scene of a window.
pub type Open = Box<dyn FnOnce() -> Result<Session, SessionError>>;

/// What a window is opened with.
pub struct Launch {
    /// Opens the scene.
    pub open: Open,
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
    #[error("cannot open a window: no display ({0}); use --frame OUT.png to render without one")]
    EventLoop(#[source] EventLoopError),
    /// The display has no window for us.
    #[error("the window could not be opened: {0}")]
    Window(#[from] OsError),
    /// No device that can draw.
    #[error("{0}; --backend cpu draws without a GPU")]
    Gpu(#[from] GpuError),
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
