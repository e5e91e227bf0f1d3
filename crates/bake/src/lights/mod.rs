//! Environment maps and their fit by spherical Gaussian lights.
//!
//! - [`Map`](strandlight_images::Map): a latitude-longitude map, read from OpenEXR or Radiance .hdr.
//! - [`fit()`]: a map becomes a [`Fit`]: compact sources (the sun) become narrow lights (`sun`);
//!   the rest is filtered by the mean response of fibres (`response`, `spectrum`, `harmonics`),
//!   lobes are placed where most is left to explain (`search`) and refined by variable projection
//!   (`projection`), and each channel's energy is made the map's.
//! - [`fit_to_budget`]: the smallest set within an error; [`fit_with_curve`]: the error of other
//!   counts beside it.
//! - [`separate`]: compact sources as lights, the rest as a map.
//! - [`evaluate`]: how far a light set is from its map; [`preview_png`]: the same to look at;
//!   [`light_set()`]: the file; [`panorama()`]: the map for the background of pictures.
//! - [`texel_means`]: a light set as a map.
//! - [`sort_lights`]: lights from elsewhere in the order of a set.
//! - [`exchange`]: light sets for other programs; [`rig`]: as lights of USD.
//!
//! ```
//! use strandlight_bake::lights::{FitOptions, evaluate, fit};
//! use strandlight_images::{Map, MapError};
//! use strandlight_scene::progress::Progress;
//!
//! let pixels = (0..64 * 32).map(|ix| [1.0, 1.0, 1.0 + (ix / 64) as f32]).collect();
//! let map = Map::new(64, 32, pixels)?;
//! let options = FitOptions { count: 8, seed: 0 };
//! let fitted = fit(&map, options, &Progress::silent())?;
//! assert!(evaluate(&fitted.lights, &map).fibre_error < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod budget;
mod cells;
mod columns;
pub mod exchange;
mod fit;
mod harmonics;
mod light_set;
mod linear;
mod order;
mod panorama;
mod preview;
mod projection;
mod report;
mod residual;
mod response;
pub mod rig;
mod search;
mod spectrum;
mod sphere;
mod sun;
mod texels;

pub use budget::{
    Budget, ChosenFit, CountError, Metric, curve_steps, fibre_error_of, fit_to_budget,
    fit_with_curve,
};
pub use cells::radiance;
pub use fit::{Fit, FitError, FitOptions, MAX_FITTED_LIGHTS, STEPS, fit};
pub use light_set::light_set;
pub use order::{light_energy, misplaced_light, sort_lights};
pub use panorama::panorama;
pub use preview::{Pictures, light_set_png, pictures, preview_png};
pub use report::{EVALUATION_STEPS, evaluate, evaluate_with_progress};
pub use residual::{MAX_SUNS, Separated, evaluate_with_residual, rest_parameter, separate};
pub use texels::texel_means;
