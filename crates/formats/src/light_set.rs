//! Environment lighting as spherical radial basis functions.

/// One light: `L(omega) = rgb * exp(2 (omega . direction - 1) / lambda^2)` (Xu 2011 Eq 1).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SrbfLight {
    /// Unit vector from the hair to the light, world space.
    pub direction: [f32; 3],
    /// Xu's bandwidth, 0.001..=10.
    pub lambda: f32,
    /// Amplitude, linear Rec.709, not negative.
    pub rgb: [f32; 3],
}

/// A fitted environment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightSet {
    /// Lights by falling energy.
    pub lights: Vec<SrbfLight>,
}
