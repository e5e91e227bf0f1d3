//! How strands differ from each other: absorption and widths by strand and by lock, clumps and frizz.
//!
//! - [`FibreVariation`]: the fibre of each strand, and [`FibreVariation::under`], which lays paint over
//!   it. What comes of it is paint like any other, so it is shaded as painted hair is.
//! - [`ShapeVariation`]: bends the strands of a groom.
//!
//! Everything is a function of the groom and of the section of the scene, and nothing is stored.
//! Random numbers belong to the place of a strand's root, not to its number: they stay when strands are cut,
//! combed, sorted or thinned.

mod fibres;
mod locks;
mod random;
mod shape;
#[cfg(test)]
mod tests;

pub use fibres::{FibreVariation, varied_paint};
pub use shape::ShapeVariation;
