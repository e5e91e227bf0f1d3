//! Renders prepared hair scenes with wgpu.
//!
//! - [`HairRenderer`] draws hair in the render pass of another program, on its device and against
//!   its depth.
//! - [`ProgressiveRenderer`] draws pictures of its own, its hair with a [`HairRenderer`]: step by
//!   step for windows and pages, or whole with [`ProgressiveRenderer::render_to_image`]. Its
//!   setters are those of [`Backend`].
//! - [`gpu::Context`] opens a device for the latter.
//!
//! ```no_run
//! use strandlight_formats::Scene;
//! use strandlight_render::{ProgressiveRenderer, gpu::Context};
//! use strandlight_scene::PreparedScene;
//!
//! let scene = PreparedScene::load(&Scene::read("scene.toml")?)?;
//! let (camera, size) = (scene.camera, scene.size);
//! let mut renderer = ProgressiveRenderer::new(&Context::new()?, scene)?;
//! let (picture, _) = renderer.render_to_image(&camera, size, 64)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In a host's frame:
//!
//! ```no_run
//! use strandlight_render::{HairOptions, HairRenderer, HairView, PrepareBudget, wgpu};
//! # fn frame(device: &wgpu::Device, queue: &wgpu::Queue, scene: strandlight_scene::PreparedScene,
//! #     view: HairView, color: wgpu::RenderPassDescriptor) -> Result<(), Box<dyn std::error::Error>> {
//! let mut hair = HairRenderer::new(device, queue, scene, HairOptions::default())?;
//! let mut encoder = device.create_command_encoder(&Default::default());
//! hair.prepare(&mut encoder, &view, PrepareBudget::Complete)?;
//! let mut pass = encoder.begin_render_pass(&color);
//! hair.draw(&mut pass);
//! drop(pass);
//! queue.submit([encoder.finish()]);
//! # Ok(())
//! # }
//! ```

pub mod gpu;
#[doc(hidden)]
pub mod gpu_optics;
#[doc(hidden)]
pub mod gpu_tables;
mod hair_options;
mod hair_renderer;
#[doc(hidden)]
pub mod invalidation;
mod limits;
#[doc(hidden)]
pub mod passes;
pub mod progressive;
// A page opens no device of its own accord and waits for none.
#[cfg(not(target_arch = "wasm32"))]
#[doc(hidden)]
pub mod probe;

use strandlight_scattering::layout::Layout;

pub use hair_options::HairOptions;
pub use hair_renderer::{
    HairError, HairRenderer, HairView, PrepareBudget, ViewError, required_limits,
};
pub use progressive::ProgressiveRenderer;
pub use strandlight_scene::Backend;
// Its types stand in signatures.
pub use wgpu;

/// The layouts of the structs that shaders mirror, of this crate and of the prepared scene. A
/// struct that a shader binds and that is missing here fails a test.
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
