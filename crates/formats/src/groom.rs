//! Hair curves.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::provenance::tool_version;
use crate::validate::{finite, in_range, short_name};

/// Thinnest fibre, cm.
pub(crate) const MIN_DIAMETER_CM: f32 = 1e-6;
/// Thickest fibre that a groom can hold, cm.
pub const MAX_DIAMETER_CM: f32 = 10.0;

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

impl Domain {
    /// Name in listings: `groom`, `strand`, `point`.
    pub const fn name(self) -> &'static str {
        match self {
            Domain::Groom => "groom",
            Domain::Strand => "strand",
            Domain::Point => "point",
        }
    }
}

/// A named array over strands or points.
///
/// Names with a meaning: `diameter` (1 component, cm) is the fibre's thickness for rendering;
/// `color` (3 components, linear RGB), `transparency` (1) and `thickness` (1, in the *source
/// file's* unit, for export) come from files of other programs. Paint is [`dye`](crate::DYE) (4:
/// sigma_a per fibre radius, linear RGB, and its weight), [`width_scale`](crate::WIDTH_SCALE) (1)
/// and [`shift_scale`](crate::SHIFT_SCALE) (1), for whatever domain; a groom without them is not
/// painted. [`mask`](crate::MASK) (1) protects it from brushes.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// Lower-case ASCII name, letters, digits and `_`.
    pub name: String,
    /// What there is one value for.
    pub domain: Domain,
    /// Floats per value, 1..=4.
    pub components: u32,
    /// `components` floats per element of the domain, in order; all finite.
    pub data: Vec<f32>,
}

/// Which axis of the source file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum UpAxis {
    /// (x, y, z) becomes (-y, x, z).
    X,
    /// Already our convention.
    #[default]
    Y,
    /// (x, y, z) becomes (x, z, -y).
    Z,
}

impl UpAxis {
    /// `x`, `y` or `z`.
    pub const fn name(self) -> &'static str {
        match self {
            UpAxis::X => "x",
            UpAxis::Y => "y",
            UpAxis::Z => "z",
        }
    }

    /// Turns a source position so that +Y is up: a rotation made of swaps and signs, so exact.
    pub(crate) fn file_to_y_up(self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        match self {
            UpAxis::X => [-y, x, z],
            UpAxis::Y => [x, y, z],
            UpAxis::Z => [x, z, -y],
        }
    }

    /// Inverse of [`UpAxis::file_to_y_up`].
    pub(crate) fn y_up_to_file(self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        match self {
            UpAxis::X => [y, -x, z],
            UpAxis::Y => [x, y, z],
            UpAxis::Z => [x, -z, y],
        }
    }
}

/// Where a groom comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct GroomSource {
    /// Centimetres per unit of the source file, 1e-6..=1e6; 1 when generated.
    pub cm_per_unit: f64,
    /// Up axis of the source file.
    pub up: UpAxis,
    /// [`crate::content_hash`] of the source file's bytes; empty when generated.
    pub hash: String,
    /// Program that made the groom.
    pub tool_version: String,
    /// Its parameters, as name and value, in order.
    pub parameters: Vec<(String, String)>,
    /// What the source file's format keeps; `None` when generated.
    pub original: Option<Original>,
}

impl GroomSource {
    /// Does the groom come from a file of another program?
    pub fn is_imported(&self) -> bool {
        self.original.is_some()
    }

    /// What is kept for `format`, if the groom comes from a file of that format.
    pub(crate) fn original_of(&self, format: &str) -> Option<&[u8]> {
        let original = self.original.as_ref()?;
        (original.format == format).then_some(&original.data)
    }
}

impl Default for GroomSource {
    fn default() -> Self {
        GroomSource {
            cm_per_unit: 1.0,
            up: UpAxis::Y,
            hash: String::new(),
            tool_version: tool_version(),
            parameters: Vec::new(),
            original: None,
        }
    }
}

/// What the format that a groom was imported from keeps beyond points and attributes, so that the
/// file can be written again as it was.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Original {
    /// Name of the format: see [`FormatInfo::name`](crate::FormatInfo::name).
    pub format: String,
    /// Bytes that only the format understands; a `.groom` file keeps those of unknown formats too.
    pub data: Vec<u8>,
}

/// Strands as polylines, root to tip, in centimetres, right-handed, +Y up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Groom {
    /// Points of all strands one after another.
    pub points: Vec<[f32; 3]>,
    /// First point of each strand, and `points.len()` at the end; at least 2 points a strand.
    pub strand_offsets: Vec<u32>,
    /// Named arrays; names are unique.
    pub attributes: Vec<Attribute>,
    /// Where it comes from.
    pub source: GroomSource,
}

/// Largest coordinate: a kilometre. Keeps squares and sums of f32 far from overflow.
pub(crate) const MAX_COORDINATE_CM: f32 = 1e5;

impl Groom {
    /// Number of strands.
    pub fn n_strands(&self) -> usize {
        self.strand_offsets.len().saturating_sub(1)
    }

    /// Indices of the points of strand `ix`, root first. Panics when `ix >= n_strands()`.
    pub fn strand(&self, ix: usize) -> Range<usize> {
        self.strand_offsets[ix] as usize..self.strand_offsets[ix + 1] as usize
    }

    /// The attribute called `name`.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes
            .iter()
            .find(|attribute| attribute.name == name)
    }

    /// Smallest and largest coordinates; zero for an empty groom.
    pub fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let Some(&first) = self.points.first() else {
            return ([0.0; 3], [0.0; 3]);
        };
        self.points
            .iter()
            .fold((first, first), |(mut min, mut max), point| {
                for axis in 0..3 {
                    min[axis] = min[axis].min(point[axis]);
                    max[axis] = max[axis].max(point[axis]);
                }
                (min, max)
            })
    }

    /// Number of elements of `domain`.
    pub(crate) fn domain_len(&self, domain: Domain) -> usize {
        match domain {
            Domain::Groom => 1,
            Domain::Strand => self.n_strands(),
            Domain::Point => self.points.len(),
        }
    }

    /// Checks everything the fields promise. The reader and the writer call it.
    ///
    /// # Errors
    /// `Value` naming the first entry that breaks a promise.
    pub fn validate(&self) -> Result<()> {
        self.validate_offsets()?;
        for strand_ix in 0..self.n_strands() {
            for (point_ix, point) in self.points[self.strand(strand_ix)].iter().enumerate() {
                // `contains` is false for NaN.
                let range = -MAX_COORDINATE_CM..=MAX_COORDINATE_CM;
                if !point.iter().all(|x| range.contains(x)) {
                    return Err(Error::value(
                        format!("point {point_ix} of strand {strand_ix}"),
                        format!("{point:?}"),
                        format!("finite and within +-{MAX_COORDINATE_CM} cm"),
                    ));
                }
            }
        }
        for (ix, attribute) in self.attributes.iter().enumerate() {
            self.validate_attribute(attribute)?;
            if self.attributes[..ix]
                .iter()
                .any(|other| other.name == attribute.name)
            {
                return Err(Error::value("attribute name", &attribute.name, "unique"));
            }
        }
        if let Some(original) = &self.source.original {
            short_name("format of the source", &original.format)?;
        }
        in_range("cm_per_unit", self.source.cm_per_unit, 1e-6, 1e6)
    }

    fn validate_offsets(&self) -> Result<()> {
        let offsets = &self.strand_offsets;
        if offsets.len() < 2 {
            return Err(Error::value(
                "number of strands",
                self.n_strands(),
                "at least 1",
            ));
        }
        if offsets[0] != 0 {
            return Err(Error::value("strand_offsets[0]", offsets[0], "0"));
        }
        for (strand_ix, pair) in offsets.windows(2).enumerate() {
            if u64::from(pair[1]) < u64::from(pair[0]) + 2 {
                return Err(Error::value(
                    format!("number of points of strand {strand_ix}"),
                    i64::from(pair[1]) - i64::from(pair[0]),
                    "at least 2",
                ));
            }
        }
        let last = offsets[offsets.len() - 1] as usize;
        if last != self.points.len() {
            return Err(Error::value(
                "last strand offset",
                last,
                format!("the number of points, {}", self.points.len()),
            ));
        }
        Ok(())
    }

    fn validate_attribute(&self, attribute: &Attribute) -> Result<()> {
        let name = &attribute.name;
        let lower = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        if name.is_empty() || name.len() > 64 || !name.chars().all(lower) {
            return Err(Error::value(
                "attribute name",
                format!("{name:?}"),
                "1 to 64 of a-z, 0-9 and _",
            ));
        }
        if !(1..=4).contains(&attribute.components) {
            return Err(Error::value(
                format!("components of attribute {name}"),
                attribute.components,
                "1..=4",
            ));
        }
        let expected = self.domain_len(attribute.domain) * attribute.components as usize;
        if attribute.data.len() != expected {
            return Err(Error::value(
                format!("number of floats of attribute {name}"),
                attribute.data.len(),
                expected.to_string(),
            ));
        }
        for (ix, &value) in attribute.data.iter().enumerate() {
            finite(|| format!("attribute {name}[{ix}]"), value)?;
            if name == "diameter" {
                // In single precision, as it is: 1e-6 is written as such.
                if !(MIN_DIAMETER_CM..=MAX_DIAMETER_CM).contains(&value) {
                    let range = format!("in {MIN_DIAMETER_CM}..={MAX_DIAMETER_CM}");
                    return Err(Error::value("attribute diameter (cm)", value, range));
                }
            }
        }
        crate::paint::check(name, attribute.components, &attribute.data)
    }
}
