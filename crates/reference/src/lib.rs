//! Reference renderers: slow pictures of the exact model, that say how wrong the fast ones are.
//!
//! The inside of `strandlight reference`: all but [`compare`] is public for that program, hidden here, and
//! without a promise of stability.
//!
//! - [`Integrator`]: what one ray from the camera sees, in [`Layers`]; one for each [`Method`].
//! - [`Film`]: sums of camera samples, to which more can be added; [`ReferenceFile`] keeps them, a
//!   [`ReferencePart`] those that one of several machines draws.
//! - [`Environment`]: the light, from a light set or the map itself.
//! - [`Fibres`]: what scatters it, all alike or painted; [`World`]: what rays meet.
//!
//! All of them draw the fibres as ribbons that face the ray ([`crate::rays`]), at their true
//! width, lit as seen from the axis. Geometry is f32, light f64. Every random number is a hash of
//! seed, pixel and sample, so neither threads nor runs matter.
//!
//! Without the feature `files` there are no files, no comparison, and no maps but pixels in memory: what a viewer needs to
//! go to ground truth.
//!
//! ```
//! use strandlight_reference::compare::{Layer, compare};
//!
//! let grey = |value: f32| Layer::new(2, 1, vec![[value; 3]; 2], vec![1.0; 2]);
//! let result = compare(&grey(1.1), &grey(1.0))?;
//! assert!((result.hair.relative_rmse - 0.1).abs() < 1e-6);
//! # Ok::<(), strandlight_reference::compare::CompareError>(())
//! ```

mod backdrop;
mod camera;
#[cfg(feature = "files")]
pub mod compare;
#[doc(hidden)]
pub mod converge;
#[cfg(feature = "files")]
mod decode;
mod directional;
#[doc(hidden)]
pub mod environment;
#[cfg(feature = "files")]
mod exact;
mod fibre_tables;
mod fibres;
#[cfg(feature = "files")]
mod file;
#[cfg(feature = "files")]
mod file_error;
#[cfg(feature = "files")]
mod film;
mod frame;
mod integrator;
mod mesh_rays;
#[cfg(feature = "files")]
mod part;
mod path;
mod ray_shoot;
#[doc(hidden)]
pub mod rays;
#[cfg(feature = "files")]
mod spans;
#[cfg(feature = "files")]
mod stored;
mod surface;
#[cfg(all(test, feature = "files"))]
mod tests;
mod traced_scene;
mod world;

#[doc(hidden)]
pub use backdrop::Backdrop;
#[doc(hidden)]
pub use camera::MAX_TRUTH_SAMPLES;
#[doc(hidden)]
pub use directional::Directional;
#[doc(hidden)]
pub use environment::Environment;
#[doc(hidden)]
pub use fibre_tables::FibreTables;
#[doc(hidden)]
pub use fibres::{Averages, AveragesAt, Fibres, Painted};
#[cfg(feature = "files")]
#[doc(hidden)]
pub use file::{MAP, OPTIONS, ReferenceFile};
#[cfg(feature = "files")]
#[doc(hidden)]
pub use file_error::FileError;
#[cfg(feature = "files")]
#[doc(hidden)]
pub use film::Film;
#[doc(hidden)]
pub use frame::Frame;
#[doc(hidden)]
pub use integrator::{CameraRay, Integrator, Layers, Method};
#[doc(hidden)]
pub use mesh_rays::MeshRays;
#[cfg(feature = "files")]
#[doc(hidden)]
pub use part::{PartInfo, PartsError, ReferencePart, order_of_parts};
#[doc(hidden)]
pub use path::{Estimator, MAX_EVENTS, PathTracer, ROULETTE_FROM, Traced};
#[doc(hidden)]
pub use ray_shoot::{Densities, RayShoot};
#[cfg(feature = "files")]
#[doc(hidden)]
pub use spans::{samples_of_part, whole_samples};
#[doc(hidden)]
pub use surface::Surface;
#[doc(hidden)]
pub use traced_scene::TracedScene;
#[doc(hidden)]
pub use world::{Met, World};
