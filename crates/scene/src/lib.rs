//! Hair scenes prepared for rendering: what the GPU and the CPU renderer both draw from. No GPU.
//!
//! - [`PreparedScene`]: a scene file with everything it names, read and put into world space.
//! - [`Camera`]: the view.
//! - [`Backend`]: what draws a scene, on the GPU or the CPU.
//! - [`Picture`]: linear radiance, and its PNG.
//!
//! ```
//! use strandlight_scene::{Camera, glam::Vec3};
//!
//! // Frames a sphere of 15 cm about a head, with a field of view of 0.6 rad.
//! let head = Vec3::new(0.0, 160.0, 0.0);
//! let camera = Camera::framing(head, 15.0, 0.6);
//! let (right, up, forward) = camera.axes();
//! assert!((head - camera.eye).normalize().dot(forward) > 0.999);
//! assert!(right.dot(up).abs() < 1e-5);
//! ```

pub mod assets;
pub mod backend;
#[doc(hidden)]
pub mod background;
#[doc(hidden)]
pub mod beside;
#[doc(hidden)]
pub mod bounce;
pub mod budget;
pub mod camera;
pub mod display;
mod error;
pub mod files;
#[doc(hidden)]
pub mod hierarchy;
pub mod interactive;
#[doc(hidden)]
pub mod interreflection;
#[cfg(feature = "keys")]
#[doc(hidden)]
pub mod keys;
mod lat_long;
pub mod layers;
mod limits;
pub mod lut;
pub mod material;
#[doc(hidden)]
pub mod memory;
pub mod mesh;
pub mod motion;
#[doc(hidden)]
pub mod optics;
pub mod paint;
pub mod panorama;
pub mod picture;
#[doc(hidden)]
pub mod png_file;
#[doc(hidden)]
pub mod probe;
#[doc(hidden)]
pub mod progress;
pub mod provenance;
pub mod proxy;
#[doc(hidden)]
pub mod sampling;
pub mod scene;
#[doc(hidden)]
pub mod shadow_maps;
pub mod stats;
pub mod strands;
#[doc(hidden)]
pub mod tables;
pub mod tone;
pub mod variation;
#[doc(hidden)]
pub mod volume;

use strandlight_scattering::layout::Layout;

pub use backend::Backend;
pub use camera::Camera;
pub use display::DisplayTransform;
pub use error::{GroupFault, RenderError, SceneError};
/// The version whose types appear in signatures.
pub use glam;
pub use lat_long::LatLong;
pub use picture::Picture;
pub use scene::PreparedScene;
pub use stats::Stats;

/// The layouts of this crate's structs that shaders mirror.
#[doc(hidden)]
pub fn layouts() -> Vec<Layout> {
    let layouts = [
        bounce::LAYOUTS,
        camera::LAYOUTS,
        interreflection::LAYOUTS,
        motion::wind::LAYOUTS,
        optics::LAYOUTS,
        probe::LAYOUTS,
        proxy::LAYOUTS,
        scene::LAYOUTS,
        shadow_maps::LAYOUTS,
        volume::LAYOUTS,
    ];
    layouts.concat()
}
