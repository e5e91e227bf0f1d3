//! Hair curves.

/// What an attribute has one value for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Domain {
    /// One value for the whole groom.
    Groom,
    /// One value per strand.
    Strand,
    /// One value per point.
    Point,
}

/// A named array over strands or points, e.g. `diameter` (cm), `color` (linear RGB, 3 components).
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// Lower-case name.
    pub name: String,
    /// What there is one value for.
    pub domain: Domain,
    /// Floats per value, 1..=4.
    pub components: u32,
    /// `components` floats per element of the domain, in order.
    pub data: Vec<f32>,
}

/// Strands as polylines, root to tip, in centimetres, right-handed, +Y up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Groom {
    /// Points of all strands one after another.
    pub points: Vec<[f32; 3]>,
    /// First point of each strand, and `points.len()` at the end; at least 2 points a strand.
    pub strand_offsets: Vec<u32>,
    /// Named arrays.
    pub attributes: Vec<Attribute>,
}
