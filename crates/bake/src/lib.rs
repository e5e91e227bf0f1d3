//! The baking side of Strandlight: tables, light sets, grooms, and the CPU twin of the renderer.
//!
//! ```
//! use strandlight_bake::grooms::{GrowSpec, Style, generate};
//! use strandlight_scene::progress::Progress;
//!
//! let spec = GrowSpec { style: Style::Bob, strands: 10, points_per_strand: 8, seed: 1 };
//! let groom = generate(&spec, &Progress::silent())?;
//! assert_eq!(groom.n_strands(), 10);
//! # Ok::<(), strandlight_bake::grooms::GrowError>(())
//! ```

pub mod aov;
pub mod grooms;
pub mod lights;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod manifest;
pub mod maps;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod markup;
#[cfg(feature = "probe")]
#[doc(hidden)]
pub mod probe;
pub mod scenes;
pub mod tables;
