//! The encoding of sRGB.

/// The sRGB transfer curve (IEC 61966-2-1), 0..=1 to 0..=1.
pub fn srgb_from_linear(x: f32) -> f32 {
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}
