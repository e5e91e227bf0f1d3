//! Renders prepared hair scenes with wgpu.
//!
//! - [`gpu::Context`]: a device.
//! - [`Renderer`]: holds a prepared scene on a device and draws it.
//! - [`ProgressiveRenderer`]: the same bit by bit, for windows and pages.

mod device_scene;
pub mod gpu;
pub mod gpu_optics;
pub mod gpu_tables;
mod limits;
pub mod passes;
pub mod progressive;
// A page opens no device of its own accord and waits for none.
#[cfg(not(target_arch = "wasm32"))]
pub mod probe;

use strandlight_scattering::layout::Layout;

pub use progressive::ProgressiveRenderer;

/// The layouts of the structs that shaders mirror, of this crate and of the prepared scene. A struct
/// that a shader binds and that is missing here fails a test.
#[doc(hidden)]
pub fn layouts() -> Vec<Layout> {
    let layouts = [
        strandlight_scene::layouts(),
        passes::layouts(),
        #[cfg(not(target_arch = "wasm32"))]
        probe::layouts(),
    ];
    layouts.concat()
}
