//! What all edits of a groom share: their errors, subsets of strands, and the record of an edit.

use strandlight_formats::{Attribute, Domain, Groom, GroomSource};

/// Why a groom cannot be edited as asked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EditError {
    /// A value outside its range.
    #[error("{what} is {value}, must be {range}")]
    OutOfRange {
        /// What was asked for, e.g. `strands`.
        what: &'static str,
        /// The value.
        value: String,
        /// What is accepted.
        range: String,
    },
    /// The groom lacks what the edit needs.
    #[error("{0}")]
    Missing(String),
    /// The result breaks a promise of grooms, such as the largest coordinate.
    #[error(transparent)]
    Groom(#[from] strandlight_formats::Error),
}

impl EditError {
    pub(super) fn range(
        what: &'static str,
        value: impl ToString,
        range: impl Into<String>,
    ) -> Self {
        EditError::OutOfRange {
            what,
            value: value.to_string(),
            range: range.into(),
        }
    }
}

/// The source of a groom that `edit` was made to, as `thin --strands 100`: unit, axis and hash stay,
/// what only fits the unedited strands goes.
pub(super) fn edited(source: &GroomSource, edit: String) -> GroomSource {
    let taken = |name: &str| source.parameters.iter().any(|(known, _)| known == name);
    let names = (2_u32..).map(|ix| format!("edit_{ix}"));
    let name = std::iter::once("edit".to_owned())
        .chain(names)
        .find(|name| !taken(name));
    let mut source = GroomSource {
        original: None,
        ..source.clone()
    };
    source.parameters.extend(name.map(|name| (name, edit)));
    source
}

/// The strands `kept`, in that order, with all their attributes; the source stays.
///
/// Panics where an index is none of a strand.
pub fn subset(groom: &Groom, kept: &[usize]) -> Groom {
    let ranges = || kept.iter().map(|&ix| groom.strand(ix));
    let mut strand_offsets = vec![0];
    let mut n_points = 0;
    for range in ranges() {
        n_points += range.len();
        // No more than the groom has, which fit.
        strand_offsets.push(n_points as u32);
    }
    let attributes = groom.attributes.iter().map(|attribute| {
        let n = attribute.components as usize;
        let values = |from: usize, to: usize| attribute.data[from * n..to * n].iter().copied();
        Attribute {
            data: match attribute.domain {
                Domain::Groom => attribute.data.clone(),
                Domain::Strand => kept.iter().flat_map(|&ix| values(ix, ix + 1)).collect(),
                Domain::Point => ranges()
                    .flat_map(|range| values(range.start, range.end))
                    .collect(),
            },
            ..attribute.clone()
        }
    });
    Groom {
        points: ranges()
            .flat_map(|range| groom.points[range].iter().copied())
            .collect(),
        strand_offsets,
        attributes: attributes.collect(),
        source: groom.source.clone(),
    }
}

/// Multiplies the widths of all strands, in the file's unit or in cm.
pub(super) fn scale_widths(groom: &mut Groom, factor: f64) {
    for attribute in &mut groom.attributes {
        if attribute.components == 1 && ["diameter", "thickness"].contains(&&*attribute.name) {
            for value in &mut attribute.data {
                *value = (f64::from(*value) * factor) as f32;
            }
        }
    }
}

/// Which strands are guides: attribute `guide` is not zero. `None` where no strand is said to be.
pub fn guides(groom: &Groom) -> Option<Vec<bool>> {
    let attribute = groom.attribute("guide").filter(|a| a.components == 1)?;
    let is_guide: Vec<bool> = match attribute.domain {
        Domain::Groom => vec![attribute.data[0] != 0.0; groom.n_strands()],
        Domain::Strand => attribute.data.iter().map(|&value| value != 0.0).collect(),
        Domain::Point => (0..groom.n_strands())
            .map(|ix| attribute.data[groom.strand(ix).start] != 0.0)
            .collect(),
    };
    is_guide.contains(&true).then_some(is_guide)
}
