//! Reference renderers: slow pictures of the exact model, that say how wrong the fast ones are.
//!
//! - [`Integrator`]: what one ray from the camera sees, in [`Layers`]; one for each [`Method`].
//! - [`Film`]: sums of camera samples, to which more can be added; [`ReferenceFile`] keeps them.
//! - [`Environment`]: the light, from a light set or the map itself.
//! - [`Fibres`]: what scatters it, all alike or painted; [`World`]: what rays meet.
//!
//! All of them draw the fibres as ribbons that face the ray ([`crate::rays`]), at their true
//! width, lit as seen from the axis. Geometry is f32, light f64. Every random number is a hash of
//! seed, pixel and sample, so neither threads nor runs matter.
//!
//! ```
//! use strandlight_reference::compare::{Layer, compare};
//!
//! let grey = |value: f32| Layer::new(2, 1, vec![[value; 3]; 2], vec![1.0; 2]);
//! let result = compare(&grey(1.1), &grey(1.0))?;
//! assert!((result.hair.relative_rmse - 0.1).abs() < 1e-6);
//! # Ok::<(), strandlight_reference::compare::CompareError>(())
//! ```

pub mod compare;
mod directional;
pub mod environment;
mod fibres;
mod file;
mod film;
mod frame;
mod path;
mod ray_shoot;
pub mod rays;
#[cfg(test)]
mod tests;
mod world;

pub use directional::Directional;
pub use environment::Environment;
pub use fibres::{Averages, AveragesAt, Fibres, Painted};
pub use file::{FileError, MAP, OPTIONS, ReferenceFile};
pub use film::{CameraRay, Film, MAX_SAMPLES};
pub use frame::Frame;
pub use path::{Estimator, MAX_EVENTS, PathTracer, ROULETTE_FROM, Traced};
pub use ray_shoot::{Densities, RayShoot};
pub use world::{Met, Surface, World};

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
}

/// A method at work on one scene.
pub trait Integrator: Sync {
    /// An estimate of what `ray` sees, whose mean over `random` is the method's answer.
    fn sample(&self, ray: &CameraRay, random: &mut SplitMix64) -> Layers;
}
