//! Mathematical constants that `core::f32::consts` lacks. Twin: `shaders/lib/constants.wgsl`.

/// sqrt(pi).
pub(crate) const SQRT_PI: f32 = 1.772_453_9;
