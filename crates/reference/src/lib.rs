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
mod integrator;
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
pub use film::{Film, MAX_SAMPLES};
pub use frame::Frame;
pub use integrator::{CameraRay, Integrator, Layers, Method};
pub use path::{Estimator, MAX_EVENTS, PathTracer, ROULETTE_FROM, Traced};
pub use ray_shoot::{Densities, RayShoot};
pub use world::{Met, Surface, World};
