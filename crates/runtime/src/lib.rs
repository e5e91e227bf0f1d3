//! Renders baked hair scenes with wgpu.

pub mod gpu;
pub mod probe;
pub mod shaders;
pub mod tables;
