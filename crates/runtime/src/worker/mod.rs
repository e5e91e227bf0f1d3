//! The CPU renderer in a worker of a web page, so that the page answers input whatever is being computed.
//!
//! The viewer has a [`WorkerRenderer`]; in the worker another instance of the program has a [`Worker`]. They share
//! no memory: files and edits go there as messages, pictures come back. What the setters of a
//! [`Backend`](strandlight_scene::Backend) are told is sent as it is; what is made of files (proxies, the display
//! transform, the map behind the hair) the worker makes itself, of the same files.

#[cfg_attr(
    not(any(test, feature = "ui")),
    expect(dead_code, reason = "a program without a page has one side alone")
)]
mod message;
#[cfg(all(target_arch = "wasm32", feature = "ui"))]
mod page_link;
#[cfg(any(test, feature = "ui"))]
mod renderer;
#[cfg(test)]
mod tests;
mod work;

use strandlight_scene::{RenderError, SceneError};

use message::MessageError;
#[cfg(all(target_arch = "wasm32", feature = "ui"))]
pub use page_link::PageLink;
#[cfg(all(target_arch = "wasm32", feature = "ui"))]
pub use renderer::files_of;
#[cfg(any(test, feature = "ui"))]
pub use renderer::{Link, WorkerRenderer, send_ahead};
pub use work::Worker;

/// Why a page has to draw without a worker.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// A message that cannot be made or read.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// A file that cannot be read.
    #[error(transparent)]
    File(#[from] strandlight_formats::Error),
    /// A scene that cannot be drawn.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An edit that cannot be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The worker ended, or never began.
    #[cfg(any(test, feature = "ui"))]
    #[error("{0}")]
    Failed(String),
}
