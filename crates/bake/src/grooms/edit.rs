//! What all edits of a groom share: their errors, subsets of strands, and the record of an edit.

use std::collections::HashMap;

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

/// The strands `kept`, in that order, with their attributes; the source stays.
///
/// `closest_guides` of a groom without `id` count its guides. They get the new numbers; where a strand
/// has a share of a guide that is not kept, they and `guide_weights` are left out.
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
    let mut taken = Groom {
        points: ranges()
            .flat_map(|range| groom.points[range].iter().copied())
            .collect(),
        strand_offsets,
        attributes: attributes.collect(),
        source: groom.source.clone(),
    };
    number_guides(&mut taken, groom, kept);
    taken
}

/// Has the numbers of closest guides in `taken`, the strands `kept` of `groom`, be those of its own
/// guides.
fn number_guides(taken: &mut Groom, groom: &Groom, kept: &[usize]) {
    let (Some(is_guide), None) = (guides(groom), strand_attribute(groom, "id", 1)) else {
        return;
    };
    let Some(closest) = strand_attribute(taken, "closest_guides", 3) else {
        return;
    };
    let weights = strand_attribute(taken, "guide_weights", 3);
    let strands: Vec<usize> = (0..groom.n_strands()).filter(|&ix| is_guide[ix]).collect();
    let numbers = kept.iter().filter(|&&ix| is_guide[ix]).zip(0_u32..);
    let numbers: HashMap<usize, u32> = numbers.map(|(&ix, number)| (ix, number)).collect();
    let renumbered: Option<Vec<f32>> = (0..closest.data.len())
        .map(|at| {
            let name = closest.data[at];
            let strand = (name >= 0.0).then(|| strands.get(name as usize)).flatten();
            let number = strand.and_then(|strand| numbers.get(strand));
            let has_share = weights.is_none_or(|weights| weights.data[at] > 0.0);
            match number {
                Some(&number) => Some(number as f32),
                // Guides are made of no others, and a weight of 0 is of none.
                None if is_guide[kept[at / 3]] || !has_share => Some(0.0),
                None => None,
            }
        })
        .collect();
    match renumbered {
        Some(data) => {
            let mut attributes = taken.attributes.iter_mut();
            if let Some(closest) = attributes.find(|it| it.name == "closest_guides") {
                closest.data = data;
            }
        }
        None => taken
            .attributes
            .retain(|it| !GIVEN_GUIDES.contains(&&*it.name)),
    }
}

/// Attributes that say which guides a strand is made of.
const GIVEN_GUIDES: [&str; 2] = ["closest_guides", "guide_weights"];

/// Attribute `name`, so many numbers a strand.
pub(super) fn strand_attribute<'a>(
    groom: &'a Groom,
    name: &str,
    components: u32,
) -> Option<&'a Attribute> {
    let attribute = groom.attribute(name)?;
    (attribute.components == components && attribute.domain == Domain::Strand).then_some(attribute)
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

#[cfg(test)]
mod tests {
    use strandlight_scene::progress::Progress;

    use super::super::edit_samples::{attribute, per_strand};
    use super::super::{InterpolateSpec, interpolate};
    use super::*;

    /// Guides 0 to 2, at an x of 0, 10 and 20, leaning by as much, each before a strand; a strand is of the
    /// guide before it, the last of guides 0 and 2.
    fn guided() -> Groom {
        let mut groom = Groom {
            strand_offsets: vec![0],
            ..Groom::default()
        };
        for (ix, x) in [0.0, 0.1, 10.0, 10.1, 20.0, 20.1].into_iter().enumerate() {
            let lean = if ix % 2 == 0 { x } else { 0.0 };
            groom.points.extend([[x, 0.0, 0.0], [x + lean, 1.0, 0.0]]);
            groom.strand_offsets.push(groom.points.len() as u32);
        }
        let closest = [0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 2, 0, 1];
        let weights = [
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.5, 0.5, 0.0],
        ];
        groom.attributes = vec![
            per_strand("guide", &groom, |ix| [1.0, 0.0][ix % 2]),
            attribute(
                "closest_guides",
                Domain::Strand,
                3,
                closest.map(|ix| ix as f32).to_vec(),
            ),
            attribute("guide_weights", Domain::Strand, 3, weights.concat()),
        ];
        groom
    }

    #[test]
    fn closest_guides_stay_those_that_they_are() {
        let groom = guided();
        let tips = |groom: &Groom, strands| {
            let spec = InterpolateSpec {
                strands,
                points_per_strand: None,
                seed: 0,
            };
            let made = interpolate(groom, &spec, &Progress::silent()).expect("made");
            assert!(made.by_attributes);
            let groom = made.groom;
            (0..groom.n_strands())
                .map(|ix| groom.points[groom.strand(ix).end - 1][0])
                .collect::<Vec<_>>()
        };
        assert_eq!(tips(&groom, 3), [0.1, 20.1, 30.1]);
        // Without the first guide, and in another order.
        for (kept, wanted) in [
            (&[2, 3, 4][..], vec![20.1]),
            (&[4, 2, 0, 3, 5], vec![20.1, 30.1]),
        ] {
            let taken = subset(&groom, kept);
            taken.validate().expect("a groom");
            assert_eq!(tips(&taken, wanted.len() as u32), wanted, "{kept:?}");
        }
    }

    #[test]
    fn guides_that_are_gone_are_not_named() {
        let groom = guided();
        let names = |groom: &Groom| {
            let names = groom.attributes.iter().map(|it| it.name.clone());
            names.collect::<Vec<_>>()
        };
        for kept in [&[0, 3][..], &[0, 2, 5], &[1, 3, 5]] {
            assert_eq!(names(&subset(&groom, kept)), ["guide"], "{kept:?}");
        }
        // Guides alone, and guides that nothing has a share of.
        for kept in [&[2, 4][..], &[0, 4, 5]] {
            assert_eq!(names(&subset(&groom, kept)), names(&groom), "{kept:?}");
        }
        // By name they are the same guides, there or not.
        let mut named = groom;
        let ids = per_strand("id", &named, |ix| (ix / 2) as f32);
        named.attributes.push(ids);
        let taken = subset(&named, &[0, 3]);
        let closest = taken.attribute("closest_guides").expect("kept");
        assert_eq!(closest.data, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    }
}
