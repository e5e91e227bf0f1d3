//! Strandlight's files: tables, light sets, grooms and scenes.
//!
//! - [`Groom`]: hair curves in centimetres with named attributes.
//! - [`LightSet`]: an environment as spherical Gaussian lights.
//! - [`TableFile`]: baked tables that describe their own axes.
//! - [`Scene`]: a TOML file that names the others.

//!
//! Every reader answers damaged input with a typed [`Error`] that names the file, in memory
//! bounded by the length of the file; every writer is deterministic. The layout shared by the
//! binary kinds is described in [`container`].

pub mod container;
mod error;
mod groom;
mod groom_diameter;
mod groom_file;
mod groom_scale;
pub mod hair;
mod input;
mod light_set;
mod paint;
pub mod params;
mod preset;
mod scene;
mod scene_file;
mod scene_hair;
mod scene_lights;
mod scene_motion;
mod scene_place;
mod scene_proxy;
mod scene_text;
mod sniff;
mod suggest;
mod table_file;
mod tables;
mod validate;
mod write;

pub use container::{Container, Kind};
pub use error::{Error, FileName, Result};
pub use groom::{
    Attribute, Domain, Groom, GroomSource, HairOriginal, MAX_COORDINATE_CM, SinglePoint, UpAxis,
};
pub use groom_diameter::{DiameterRange, DiameterSource};
pub use groom_file::GroomHeader;
pub use groom_scale::{Guess, Guesses, LengthUnit};
pub use hair::{HairFile, HairImport, ThicknessFaults};
pub use input::{
    Input, content_hash, file_hash, open_file, read_file, read_file_of_kind, read_start,
    tool_version,
};
pub use light_set::{FitReport, LightSet, LightSetInfo, MAX_LIGHTS, SrbfLight};
pub use paint::{
    DYE, MAX_SCALE, MAX_SIGMA_A, MIN_SCALE, PAINT_ATTRIBUTES, SHIFT_SCALE, WIDTH_SCALE,
};
pub use preset::preset_names;
pub use scene::{
    Background, CameraSection, GroomSection, RenderSection, Scattering, Scene, TablesSection,
    ToneMap,
};
pub use scene_hair::{HairSection, Melanin};
pub use scene_lights::{LightAdjust, LightsSection};
pub use scene_motion::{MotionSection, WindSection};
pub use scene_proxy::{MAX_PROXIES, ProxySection};
pub use sniff::{FileKind, SNIFF_BYTES};
pub use suggest::{did_you_mean, nearest};
pub use table_file::TableReader;
pub use tables::{Axis, Table, TableFile, TableHeader, TableInfo};
// They stand in the fields of sections and tables.
pub use strandlight_scattering::axis::Spacing;
pub use strandlight_scattering::{Lobe, PerLobe};
pub use write::{
    OutputTarget, check_folder, check_writable, output_target, remove_temporary_files, write_file,
};
