//! Renders baked hair scenes with wgpu.

pub mod gpu;
pub mod shaders;
