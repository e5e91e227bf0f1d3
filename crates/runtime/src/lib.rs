//! Renders baked hair scenes with wgpu.
//!
//! - [`PreparedScene`]: a scene file with all it names, read and put into world space.
//! - [`Renderer`]: holds a prepared scene on a device ([`gpu::Context`]) and draws it.
//! - [`Live`]: the same bit by bit, for windows and pages.
//! - [`Session`]: a document, its edits, undo and saving; [`Viewer`]: that and a [`Live`].
//! - [`Picture`]: the linear result, and its PNG.

pub mod assets;
pub mod camera;
pub mod edit;
mod error;
pub mod files;
pub mod gpu;
mod limits;
pub mod live;
pub mod memory;
pub mod motion;
pub mod optics;
pub mod paint;
pub mod picture;
// A page opens no device of its own accord and waits for none.
#[cfg(not(target_arch = "wasm32"))]
pub mod probe;
pub mod provenance;
pub mod proxy;
pub mod render;
pub mod sampling;
pub mod scene;
pub mod script;
pub mod session;
pub mod shaders;
pub mod shadow_maps;
pub mod stats;
pub mod strands;
pub mod tables;
pub mod timings;
pub mod tone;
#[cfg(feature = "ui")]
pub mod ui;
pub mod viewer;
pub mod volume;
#[cfg(all(target_arch = "wasm32", feature = "ui"))]
pub mod web;

pub use camera::Camera;
pub use error::{RenderError, SceneError};
pub use live::Live;
pub use picture::Picture;
pub use render::Renderer;
pub use scene::PreparedScene;
pub use session::Session;
pub use stats::Stats;
pub use viewer::Viewer;
