//! What one ray from the camera sees, by one method or another.

use glam::Vec3;
use strandlight_formats::Scattering;

use crate::rays::Start;
use strandlight_scattering::random::SplitMix64;

/// Ways of making a reference picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Unbiased path tracing.
    Path,
    /// Dual scattering with what lies between fibre and light taken from rays (Zinke 2008,
    /// section 4.1).
    RayShoot,
    /// Single scattering of many directional lights, shadows from rays (Xu 2011 section 5).
    Directional,
}

impl Method {
    /// The name used by the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Method::Path => "path",
            Method::RayShoot => "ray-shoot",
            Method::Directional => "directional",
        }
    }
}

/// A ray from the camera.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// The eye, with nothing nearer than the near plane.
    pub start: Start,
    /// Unit vector into the scene.
    pub direction: Vec3,
    /// A hash of seed and pixel: turns low-discrepancy sequences that every pixel runs through.
    pub pixel_key: u64,
    /// Number of the sample in its pixel.
    pub sample: u32,
}

/// What one camera ray sees: radiance of the hair, or of a proxy before it, linear Rec.709. Nothing
/// is seen where the ray meets none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layers {
    /// Does the ray meet hair?
    pub is_covered: bool,
    /// Light that met the seen fibre and no other.
    pub single: [f64; 3],
    /// Light that other fibres, at least one, sent forward only.
    pub global: [f64; 3],
    /// Light that a fibre sent back at least once before the seen one scattered it.
    pub local: [f64; 3],
    /// Does the ray meet a proxy?
    pub is_matte: bool,
    /// Radiance of the proxy.
    pub matte: [f64; 3],
}

impl Layers {
    /// The sum of the layers of the hair.
    pub fn total(&self) -> [f64; 3] {
        std::array::from_fn(|c| self.single[c] + self.global[c] + self.local[c])
    }

    /// The hair's radiance by `scattering`.
    pub fn of(&self, scattering: Scattering) -> [f64; 3] {
        match scattering {
            Scattering::Single => self.single,
            Scattering::Global => self.global,
            Scattering::Local => self.local,
            Scattering::Total => self.total(),
        }
    }
}

/// A method at work on one scene.
pub trait Integrator: Sync {
    /// An estimate of what `ray` sees, whose mean over `random` is the method's answer.
    fn sample(&self, ray: &CameraRay, random: &mut SplitMix64) -> Layers;
}
