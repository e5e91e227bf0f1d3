//! How far one picture is from another.
//!
//! - [`Layer::read`]: one layer of an OpenEXR file, or a PNG, as linear pixels.
//! - [`compare()`]: a [`Comparison`]: relative RMSE, bias, ratio of colours, the worst pixel, and
//!   what of it is noise of the reference.
//! - [`flip()`]: FLIP (Andersson et al. 2020), what a person would see when the two pictures
//!   alternate.
//! - [`signed_png`]: the signed difference to look at.
//!
//! ```
//! use strandlight_reference::compare::{Layer, compare};
//!
//! let grey = |value: f32| Layer::new(2, 1, vec![[value; 3]; 2], vec![1.0; 2]);
//! let result = compare(&grey(1.1), &grey(1.0))?;
//! assert!((result.hair.relative_rmse - 0.1).abs() < 1e-6);
//! # Ok::<(), strandlight_reference::compare::CompareError>(())
//! ```

mod error;
mod flip;
mod heat;
mod layer;
mod statistics;

pub use error::{CompareError, LayerError};
pub use flip::{FlipMap, PIXELS_PER_DEGREE, flip};
pub use heat::{flip_png, heat_scale, signed_png};
pub use layer::{Layer, MAX_PIXELS, MAX_SIDE};
pub use statistics::{Comparison, Region, Worst, compare};
