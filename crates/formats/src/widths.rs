//! The thickness of strands in files that must state one.

use std::borrow::Cow;

use crate::error::{Error, Result};
use crate::groom::{Attribute, Domain, Groom};
use crate::groom_format::{Note, NoteKind};
use crate::hair::thickness;
use crate::scene_hair::HairSection;

/// Diameters in a file's own unit.
#[derive(Debug)]
pub(crate) struct Widths<'a> {
    attribute: Option<Cow<'a, Attribute>>,
    default: f32,
}

impl<'a> Widths<'a> {
    /// Those of `groom` for a file of `cm_per_unit`: as they were imported, or else as they are
    /// drawn.
    ///
    /// # Errors
    /// `Value` where they have not one component.
    pub fn of(groom: &'a Groom, cm_per_unit: f64) -> Result<Self> {
        let attribute = thickness(groom, cm_per_unit);
        if let Some(attribute) = attribute.as_deref().filter(|a| a.components != 1) {
            let key = format!("components of attribute {}", attribute.name);
            return Err(Error::value(key, attribute.components, "1"));
        }
        Ok(Widths {
            attribute,
            default: (HairSection::DEFAULT_DIAMETER_CM / cm_per_unit) as f32,
        })
    }

    /// The diameter at `point`, an index into all points, of `strand`.
    pub fn at(&self, strand: usize, point: usize) -> f32 {
        let Some(attribute) = &self.attribute else {
            return self.default;
        };
        attribute.data[match attribute.domain {
            Domain::Groom => 0,
            Domain::Strand => strand,
            Domain::Point => point,
        }]
    }

    /// A line where the groom says nothing.
    pub fn note(&self) -> Option<Note> {
        let what = format!(
            "the groom has no thickness: {} cm is written",
            HairSection::DEFAULT_DIAMETER_CM
        );
        self.attribute
            .is_none()
            .then(|| Note::new(NoteKind::Assumed, what))
    }
}
