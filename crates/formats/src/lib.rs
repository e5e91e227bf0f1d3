//! Strandlight's files: hair, the light that falls on it, and scenes that name both.
//!
//! - [`Groom`]: hair curves in centimetres with named attributes, as a `.groom` file. Hair of other
//!   programs comes in by [`SourceFile`] and goes out by [`Groom::export`], in the formats of
//!   [`GROOM_FORMATS`].
//! - [`LightSet`]: an environment as spherical Gaussian lights, as a `.lights` file.
//! - [`Scene`]: a TOML file that names the others, with camera and parameters.
//! - [`Mesh`]: a head for the hair to stand on, as a `.mesh` file.
//! - [`Panorama`]: the environment map behind the hair, as a `.panorama` file.
//! - [`Cube`]: a LUT for the display, read from a `.cube` file.
//!
//! (And [`TableFile`]: baked tables that describe their own axes.)
//!
//! ```
//! use strandlight_formats::{
//!     BakedFile, ExportOptions, Groom, ImportOptions, LightSet, Scene, SourceFile, SrbfLight,
//!     groom_format,
//! };
//!
//! // One strand of two points as another program wrote it, in metres; `SourceFile::read(path)`
//! // takes it from a file.
//! let mut bytes = Vec::new();
//! bytes.extend(1i32.to_le_bytes());
//! bytes.extend(2i32.to_le_bytes());
//! for x in [0.0f32, 1.7, 0.1, 0.0, 1.6, 0.1] {
//!     bytes.extend(x.to_le_bytes());
//! }
//! let file = SourceFile::from_bytes(bytes)?;
//! assert_eq!(file.format().info().name, "usc");
//! let groom = file.import(&ImportOptions::default())?.groom;
//! assert_eq!(groom.points[1], [0.0, 160.0, 10.0]);
//!
//! // As a .groom file, and back; as a .hair file.
//! assert_eq!(Groom::from_bytes(&groom.to_bytes()?)?, groom);
//! let format = groom_format("hair").expect("it is in the table");
//! let export = groom.export(format, &ExportOptions::default())?;
//! assert!(export.bytes.starts_with(b"HAIR") && export.dropped.is_empty());
//!
//! // Light from above, and a scene with both.
//! let light = SrbfLight { direction: [0.0, 1.0, 0.0], lambda: 0.5, rgb: [1.0; 3] };
//! let set = LightSet { lights: vec![light], ..LightSet::default() };
//! assert_eq!(LightSet::from_bytes(&set.to_bytes()?)?, set);
//! let text = Scene::new("head.groom", "sky.lights").to_toml_string()?;
//! assert!(Scene::from_toml(&text)?.groom_path().ends_with("head.groom"));
//! # Ok::<(), strandlight_formats::Error>(())
//! ```
//!
//! Every reader answers damaged input with a typed [`Error`] that names the file, in memory
//! bounded by the length of the file; every writer is deterministic. The layout shared by the
//! binary kinds is described byte by byte in the book (`docs/book/src/reference/files.md`); how to add a format of hair, at [`GroomFormat`].

mod alembic;
mod attribute_names;
mod baked_file;
mod bytes;
#[doc(hidden)]
pub mod container;
mod counted;
mod ct2hair;
mod cube;
mod curves;
mod error;
mod groom;
mod groom_diameter;
mod groom_file;
mod groom_format;
mod groom_formats;
mod groom_scale;
pub mod hair;
mod input;
mod interchange;
mod light_set;
mod mesh;
mod mesh_file;
mod mitsuba;
mod npy;
mod npy_array;
mod paint;
mod panorama;
pub mod params;
mod pbrt;
mod plain_words;
mod ply;
mod point_list;
mod preset;
mod provenance;
mod resample;
mod scene;
mod scene_check;
mod scene_edit;
mod scene_file;
mod scene_hair;
mod scene_lights;
mod scene_motion;
mod scene_place;
mod scene_proxy;
mod scene_text;
mod scene_variation;
mod shared_exponent;
mod sniff;
mod strand_list;
mod suggest;
mod table_file;
mod tables;
mod taken_files;
mod text_lines;
mod text_patches;
mod tfx;
#[doc(hidden)]
pub mod usc;
mod usd;
mod validate;
mod widths;
mod write;

pub use baked_file::BakedFile;
#[doc(hidden)]
pub use container::Container;
pub use container::Kind;
pub use counted::counted;
pub use cube::{Cube, CubeTable, MAX_CURVE_SIZE, MAX_GRID_SIZE};
pub use error::{Error, FileName, Result};
pub use groom::{Attribute, Domain, Groom, GroomSource, MAX_DIAMETER_CM, Original, UpAxis};
pub use groom_diameter::{DiameterRange, DiameterSource};
pub use groom_file::GroomHeader;
pub use groom_format::{
    AttributeSupport, Capabilities, CurveBasis, Export, ExportOptions, FormatInfo, GroomFormat,
    Import, ImportOptions, Note, NoteKind, Sniff, StatedBy,
};
pub use groom_formats::{GROOM_FORMATS, groom_format, groom_format_for};
pub use groom_scale::{Guess, Guesses, LengthUnit};
pub use hair::ThicknessFaults;
#[doc(hidden)]
pub use input::{Input, file_hash, open_file, read_file, read_file_of_kind, read_start};
pub use interchange::SourceFile;
pub use light_set::{FitReport, LightKind, LightSet, LightSetInfo, MAX_LIGHTS, SrbfLight};
pub use mesh::{MAX_TRIANGLES, MAX_VERTICES, Mesh, MeshSource};
#[doc(hidden)]
pub use npy_array::NpyArray;
pub use paint::{
    DYE, MASK, MAX_SCALE, MAX_SIGMA_A, MIN_SCALE, PAINT_ATTRIBUTES, SHIFT_SCALE, WIDTH_SCALE,
};
pub use panorama::{MAX_PANORAMA_WIDTH, Panorama, PanoramaSource};
#[doc(hidden)]
pub use plain_words::{in_plain_words, system_in_plain_words};
#[doc(hidden)]
pub use preset::preset_names;
#[doc(hidden)]
pub use provenance::{content_hash, tool_version};
pub use scene::{
    Background, CameraSection, GroomSection, LutInput, MAX_SAMPLES, MAX_SHADOW_MAPS, MAX_SIDE,
    RenderSection, Scattering, Scene, TablesSection, ToneMap,
};
pub use scene_hair::{HairSection, Melanin};
pub use scene_lights::{AddedLight, LightAdjust, LightsSection, MAX_ADDED_LIGHTS};
pub use scene_motion::{MotionSection, WindSection};
pub use scene_proxy::{MAX_PROXIES, ProxySection};
#[doc(hidden)]
pub use scene_text::inline_value;
pub use scene_variation::VariationSection;
pub use sniff::FileKind;
#[doc(hidden)]
pub use sniff::SNIFF_BYTES;
#[doc(hidden)]
pub use suggest::{did_you_mean, nearest};
pub use table_file::TableReader;
pub use tables::{Axis, Table, TableFile, TableHeader, TableInfo};
// As output targets, for the programs alone.
#[doc(hidden)]
pub use taken_files::TakenFiles;
// They stand in the fields of sections and tables.
pub use strandlight_scattering::axis::Spacing;
pub use strandlight_scattering::{Lobe, PerLobe};
#[doc(hidden)]
pub use write::{
    OutputTarget, check_folder, check_writable, output_target, remove_stale_temporary_files,
    remove_temporary_files, write_file,
};
