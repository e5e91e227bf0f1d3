//! Baked tables that describe their own axes.

/// How texel centres are placed along an axis; `u` runs 0..=1 from the first to the last centre.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Spacing {
    /// `x = min + (max - min) u`.
    Linear,
    /// `x = min (max / min)^u`.
    Log,
}

/// One axis of a table.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Axis {
    /// Name of the variable, e.g. `lambda_p`, `phi`, `eta`, `theta_d`.
    pub name: String,
    /// Value at the first texel centre.
    pub min: f64,
    /// Value at the last texel centre.
    pub max: f64,
    /// Number of texels.
    pub count: u32,
    /// Placement of the centres between.
    pub spacing: Spacing,
}

/// A 2D table of float32 texels with up to four channels a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Unique name, e.g. `C`, `H_TT`, `H_TRT`.
    pub name: String,
    /// Slowest-varying axis first: `[rows, columns]`.
    pub axes: Vec<Axis>,
    /// What each float of a texel is, fastest-varying of all.
    pub channels: Vec<String>,
    /// `[rows][columns][channels]`.
    pub data: Vec<f32>,
    /// Largest error between texel centres found when baking, in the unit of the texels.
    pub max_interpolation_error: f32,
}

/// A `.tables` file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableFile {
    /// Fresnel term of the H tables: `dielectric` or `schlick`.
    pub fresnel: String,
    /// All tables.
    pub tables: Vec<Table>,
}
