//! Strandlight's files: tables, light sets, grooms and scenes.
//!
//! - [`Groom`]: hair curves in centimetres with named attributes.
//! - [`LightSet`]: an environment as spherical Gaussian lights.
//! - [`TableFile`]: baked tables that describe their own axes.
//! - [`Scene`]: a TOML file that names the others.

mod groom;
mod light_set;
mod scene;
mod tables;
mod write;

pub use groom::{Attribute, Domain, Groom};
pub use light_set::{LightSet, SrbfLight};
pub use scene::Scene;
pub use tables::{Axis, Spacing, Table, TableFile};
pub use write::write_file;
