//! Every parameter of a scene, once: key, label, symbol, unit, range, default, help, and how it is
//! read and set.
//!
//! - [`HAIR`], [`VARIATION`], [`LIGHTS`], [`ADJUST`], [`ADDED`], [`CAMERA`], [`RENDER`], [`MOTION`],
//!   [`WIND`], [`ELLIPSOID`], [`GROUND`], [`MESH`]: a [`Section`] of a scene with its [`Param`]s.
//! - [`ParamSpec`]: what is said of a parameter; [`SECTIONS`] lists them without the types of the
//!   sections.
//! - [`reference_markdown`]: the tables of the scene reference.
//!
//! Scenes are checked against these rows, the viewer's panel is laid out from them, and the tests
//! of invalid values walk through them. The ranges of the model itself, in radians, are those of
//! [`Parameter::range`](strandlight_scattering::Parameter::range).
//!
//! ```
//! use strandlight_formats::{HairSection, params::{HAIR, Value}};
//!
//! let mut hair = HairSection::default();
//! let eta = HAIR.param("eta").expect("a row");
//! assert_eq!(eta.get(&hair), Some(Value::Number(1.55)));
//! assert!(eta.set(&mut hair, Some(Value::Number(9.0))).is_err());
//! ```

mod field;
mod hair;
mod lights;
mod motion;
mod picture;
mod reference;
mod section;
mod spec;
#[cfg(test)]
mod tests;
mod variation;

pub use field::{Field, Value};
pub use hair::HAIR;
pub use lights::{ADDED, ADJUST, LIGHTS};
pub use motion::{ELLIPSOID, GROUND, MESH, MOTION, WIND};
pub use picture::{CAMERA, GROOM, RENDER, TABLES};
pub use reference::reference_markdown;
pub use section::{Param, Section, SectionSpec};
pub use spec::{Absent, Group, Kind, Numbers, ParamSpec, Shape, Word};
pub use variation::VARIATION;

/// Every section of a scene, in the order of the reference.
pub const SECTIONS: [&dyn SectionSpec; 14] = [
    &GROOM, &LIGHTS, &ADJUST, &ADDED, &TABLES, &HAIR, &VARIATION, &CAMERA, &RENDER, &MOTION, &WIND,
    &ELLIPSOID, &GROUND, &MESH,
];

/// The keys of all parameters, such as `hair.eta`.
pub fn keys() -> impl Iterator<Item = String> {
    SECTIONS.into_iter().flat_map(|section| {
        let specs = section.specs().into_iter();
        specs.map(|(spec, _)| format!("{}.{}", section.name(), spec.key))
    })
}
