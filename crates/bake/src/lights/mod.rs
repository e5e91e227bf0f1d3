//! Environment maps and their fit by spherical Gaussian lights.

mod cells;
mod exr_map;
mod fit;
mod harmonics;
mod linear;
mod map;
mod preview;
mod primaries;
mod projection;
mod quiet;
mod radiance_map;
mod report;
mod response;
mod search;
mod spectrum;
mod sphere;
mod sun;

pub use fit::{Fit, FitOptions, MAX_LIGHTS, STEPS, fit};
pub use map::{LatLong, Map, MapError, MapSource, PixelFaults};
pub use preview::preview_png;
pub use report::evaluate;
