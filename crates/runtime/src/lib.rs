//! Renders baked hair scenes with wgpu.
