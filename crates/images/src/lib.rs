//! Images in and out: HDR environment maps are read, pictures are written as OpenEXR.
//!
//! - [`Map`]: a latitude-longitude map, from OpenEXR or Radiance `.hdr`.
//! - [`MapSelection`]: which part and layer of a file to read.
//! - [`exr_file`]: writes channels so that equal input gives equal bytes.
//!
//! ```
//! let pixels = (0..64 * 32).map(|ix| [1.0, 1.0, 1.0 + (ix / 64) as f32]).collect();
//! let map = strandlight_images::Map::new(64, 32, pixels)?;
//! assert_eq!(map.width(), 64);
//! # Ok::<(), strandlight_images::MapError>(())
//! ```

mod decoder_panic;
mod error;
pub mod exr_file;
mod exr_images;
pub mod exr_map;
mod faults;
mod map;
mod map_file;
pub mod picture;
mod primaries;
mod radiance_file;
mod radiance_map;
mod source;

pub use decoder_panic::catch_decoder_panic;
pub use error::{DecodeError, DecoderPanic, MapError};
pub use faults::PixelFaults;
pub use map::Map;
pub use source::{MapImage, MapSelection, MapSource, MapWindows, Window};
/// The pixel grid of [`Map`].
pub use strandlight_scene::LatLong;
