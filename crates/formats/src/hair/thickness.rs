//! Between a file's thickness, in its own unit, and the diameter that is drawn.

use std::borrow::Cow;
use std::fmt;

use crate::groom::{Attribute, Domain, Groom, MAX_DIAMETER_CM, MIN_DIAMETER_CM};
use crate::groom_scale::short;
use crate::scene_hair::HairSection;

/// Thickness in a unit of `cm_per_unit` as centimetres.
fn to_cm(thickness: f32, cm_per_unit: f64) -> f32 {
    (f64::from(thickness) * cm_per_unit) as f32
}

/// A head of hair has at least so many strands; fewer may be thick on purpose.
const HEAD_STRANDS: usize = 30;
/// Thicker than this share of its size, the hair of a head is not meant so: programs that know of
/// no thickness write 1, whatever their unit.
const ABSURD_SHARE: f32 = 0.01;
/// No hair is too thick below this, cm: down and lashes are small and of ordinary hair.
const ABSURD_CM: f32 = 0.05;

/// The thickest strand of `groom` that is drawn, cm.
fn thickest(groom: &Groom) -> f32 {
    match groom.n_strands() >= HEAD_STRANDS {
        true => (ABSURD_SHARE * groom.size()).clamp(ABSURD_CM, MAX_DIAMETER_CM),
        false => MAX_DIAMETER_CM,
    }
}

/// Attribute `diameter`, attribute `thickness` in centimetres; `None` where that is a
/// thickness that nothing can be drawn with. Tips that taper to nothing keep the least diameter.
/// [`Groom::thickness_faults`] counts both.
pub(crate) fn diameter(groom: &Groom, cm_per_unit: f64) -> Option<Attribute> {
    let thickness = groom.attribute("thickness").filter(|a| a.components == 1)?;
    let thickest = thickest(groom);
    let scaled = |&value: &f32| to_cm(value, cm_per_unit);
    let mut data: Vec<f32> = thickness.data.iter().map(scaled).collect();
    let drawable = data.iter().all(|value| (0.0..=thickest).contains(value))
        && data.iter().any(|&value| value >= MIN_DIAMETER_CM);
    data.iter_mut()
        .for_each(|value| *value = value.max(MIN_DIAMETER_CM));
    drawable.then(|| Attribute {
        name: "diameter".to_owned(),
        domain: thickness.domain,
        components: 1,
        data,
    })
}

/// The diameters that are drawn.
fn drawn(groom: &Groom) -> Option<&Attribute> {
    groom.attribute("diameter").filter(|a| a.components == 1)
}

/// The thickness to write into a file of `cm_per_unit`: attribute `thickness` as it was imported,
/// unless the groom is drawn with another `diameter` than the import gave it.
pub(crate) fn thickness(groom: &Groom, cm_per_unit: f64) -> Option<Cow<'_, Attribute>> {
    let source_unit = groom.source.cm_per_unit;
    let drawn = drawn(groom);
    let imported = groom.attribute("thickness");
    let is_imported = imported.is_some() && diameter(groom, source_unit).as_ref() == drawn;
    if is_imported || drawn.is_none() {
        let imported = imported?;
        if source_unit == cm_per_unit {
            return Some(Cow::Borrowed(imported));
        }
        let mut scaled = imported.clone();
        for value in &mut scaled.data {
            *value = (f64::from(*value) * source_unit / cm_per_unit) as f32;
        }
        return Some(Cow::Owned(scaled));
    }
    let drawn = drawn?;
    let to_unit = |&value: &f32| match cm_per_unit {
        1.0 => value,
        _ => (f64::from(value) / cm_per_unit) as f32,
    };
    Some(Cow::Owned(Attribute {
        name: "thickness".to_owned(),
        domain: drawn.domain,
        components: 1,
        data: drawn.data.iter().map(to_unit).collect(),
    }))
}

/// Values of an imported file's thickness that cannot be drawn as they are, counted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ThicknessFaults {
    /// Number of values in all: one for each point, or the default alone.
    pub n_values: usize,
    /// Values below zero.
    pub negative: usize,
    /// Values above `thickest_cm`.
    pub too_thick: usize,
    /// The thickest strand that is drawn, cm: 10, or of a head of hair (30 strands or more) a
    /// hundredth of its size, but 0.05 at least.
    pub thickest_cm: f32,
    /// Values of zero, and others below `MIN_DIAMETER_CM` centimetres.
    pub too_thin: usize,
    /// The first of the negative and thick ones, or else of the thin ones: where, and its value
    /// in the file's unit.
    pub first: Option<(String, f32)>,
    /// The whole thickness is left out and strands have the default diameter: some value is
    /// negative or too thick, or all are too thin. Otherwise thin places are drawn
    /// `MIN_DIAMETER_CM` thick.
    pub is_left_out: bool,
}

impl Groom {
    /// What cannot be drawn of the thickness that this groom was imported with; `None` when all
    /// can, the groom does not come from a file with a thickness, or it is drawn with a `diameter`
    /// that is not made of this one.
    pub fn thickness_faults(&self) -> Option<ThicknessFaults> {
        let thickness = self.attribute("thickness").filter(|a| a.components == 1)?;
        self.source.original.as_ref()?;
        // Formats with widths of their own carry a `thickness` in the unit of an earlier file.
        if drawn(self) != diameter(self, self.source.cm_per_unit).as_ref() {
            return None;
        }
        let mut faults = ThicknessFaults {
            n_values: thickness.data.len(),
            thickest_cm: thickest(self),
            ..ThicknessFaults::default()
        };
        let (mut first_thin, mut first_other) = (None, None);
        for (ix, &value) in thickness.data.iter().enumerate() {
            let drawn = to_cm(value, self.source.cm_per_unit);
            let (count, first) = if drawn < 0.0 {
                (&mut faults.negative, &mut first_other)
            } else if drawn > faults.thickest_cm {
                (&mut faults.too_thick, &mut first_other)
            } else if drawn < MIN_DIAMETER_CM {
                (&mut faults.too_thin, &mut first_thin)
            } else {
                continue;
            };
            *count += 1;
            first.get_or_insert((ix, value));
        }
        let (ix, value) = first_other.or(first_thin)?;
        faults.is_left_out = first_other.is_some() || faults.too_thin == faults.n_values;
        let place = match thickness.domain {
            Domain::Point => {
                let strand = self
                    .strand_offsets
                    .partition_point(|&end| end as usize <= ix)
                    - 1;
                let point = ix - self.strand_offsets[strand] as usize;
                format!("point {point} of strand {strand}")
            }
            Domain::Strand => format!("strand {ix}"),
            Domain::Groom => "the default".to_owned(),
        };
        faults.first = Some((place, value));
        Some(faults)
    }
}

/// One line: what was found, and what is drawn instead.
impl fmt::Display for ThicknessFaults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bad = self.negative + self.too_thick + self.too_thin;
        write!(
            f,
            "thickness: {bad} of {} values cannot be drawn (",
            self.n_values
        )?;
        let mut comma = "";
        for (count, what) in [
            (self.negative, "negative".to_owned()),
            (
                self.too_thick,
                format!("above {} cm", short(self.thickest_cm)),
            ),
            (
                self.too_thin,
                format!("zero or below {MIN_DIAMETER_CM:e} cm"),
            ),
        ] {
            if count > 0 {
                write!(f, "{comma}{count} {what}")?;
                comma = ", ";
            }
        }
        if let Some((place, value)) = &self.first {
            write!(f, "; first {value} at {place}")?;
        }
        if self.is_left_out {
            let default = HairSection::DEFAULT_DIAMETER_CM;
            write!(f, "): all strands are drawn {default} cm thick")
        } else {
            write!(f, "): drawn {MIN_DIAMETER_CM:e} cm thick there")
        }
    }
}
