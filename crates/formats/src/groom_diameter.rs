//! How thick the fibres of a groom are drawn.

use crate::groom::{Attribute, Domain, Groom};
use crate::scene_hair::HairSection;

/// What says how thick fibres are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiameterSource {
    /// The scene's `hair.diameter_cm`, which overrides the groom.
    Scene,
    /// Attribute `diameter` of the groom, a value per point.
    PerPoint,
    /// Attribute `diameter` of the groom, a value per strand.
    PerStrand,
    /// Attribute `diameter` of the groom, one value for all.
    Constant,
    /// Nothing: [`HairSection::DEFAULT_DIAMETER_CM`].
    Default,
}

impl DiameterSource {
    /// Name in listings and JSON: `scene`, `per point`, `per strand`, `constant`, `default`.
    pub const fn name(self) -> &'static str {
        match self {
            DiameterSource::Scene => "scene",
            DiameterSource::PerPoint => "per point",
            DiameterSource::PerStrand => "per strand",
            DiameterSource::Constant => "constant",
            DiameterSource::Default => "default",
        }
    }
}

/// The diameters that a groom is drawn with, cm. With one value for all, `min`, `median` and `max`
/// are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiameterRange {
    /// Thinnest place.
    pub min: f32,
    /// Middle of the values sorted; of an even number of them the upper one of the two.
    pub median: f32,
    /// Thickest place.
    pub max: f32,
    /// What says so.
    pub source: DiameterSource,
}

impl DiameterRange {
    fn constant(value: f32, source: DiameterSource) -> Self {
        DiameterRange {
            min: value,
            median: value,
            max: value,
            source,
        }
    }
}

impl Groom {
    /// The diameters that this groom is drawn with, unless the scene has a `diameter_cm`: see
    /// [`HairSection::diameter_range`].
    pub fn diameter_range(&self) -> DiameterRange {
        let drawn = |attribute: &&Attribute| attribute.components == 1;
        let Some(attribute) = self.attribute("diameter").filter(drawn) else {
            return default_range();
        };
        let source = match attribute.domain {
            Domain::Point => DiameterSource::PerPoint,
            Domain::Strand => DiameterSource::PerStrand,
            Domain::Groom => DiameterSource::Constant,
        };
        match *attribute.data {
            [] => default_range(),
            [value] => DiameterRange::constant(value, source),
            ref values => {
                let mut values = values.to_vec();
                let middle = values.len() / 2;
                let (below, &mut median, above) =
                    values.select_nth_unstable_by(middle, f32::total_cmp);
                DiameterRange {
                    min: below.iter().copied().fold(median, f32::min),
                    median,
                    max: above.iter().copied().fold(median, f32::max),
                    source,
                }
            }
        }
    }
}

impl HairSection {
    /// The diameters that `groom` is drawn with in a scene of this hair: `diameter_cm`, or else
    /// the groom's own.
    pub fn diameter_range(&self, groom: &Groom) -> DiameterRange {
        match self.diameter_cm {
            Some(value) => DiameterRange::constant(value as f32, DiameterSource::Scene),
            None => groom.diameter_range(),
        }
    }
}

fn default_range() -> DiameterRange {
    let value = HairSection::DEFAULT_DIAMETER_CM as f32;
    DiameterRange::constant(value, DiameterSource::Default)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn groom(domain: Domain, components: u32, data: &[f32]) -> Groom {
        Groom {
            points: vec![[0.0; 3]; 6],
            strand_offsets: vec![0, 2, 6],
            attributes: vec![Attribute {
                name: "diameter".to_owned(),
                domain,
                components,
                data: data.to_vec(),
            }],
            ..Groom::default()
        }
    }

    #[test]
    fn the_range_and_its_source_are_those_that_are_drawn() {
        let range = |min, median, max, source| DiameterRange {
            min,
            median,
            max,
            source,
        };
        let own = [0.03, 0.01, 0.02, 0.05, 0.04, 0.06];
        for (groom, expected) in [
            (
                groom(Domain::Point, 1, &own),
                range(0.01, 0.04, 0.06, DiameterSource::PerPoint),
            ),
            (
                groom(Domain::Strand, 1, &[0.2, 0.1]),
                range(0.1, 0.2, 0.2, DiameterSource::PerStrand),
            ),
            (
                groom(Domain::Groom, 1, &[0.1]),
                range(0.1, 0.1, 0.1, DiameterSource::Constant),
            ),
            // The renderer takes a single component only.
            (
                groom(Domain::Groom, 2, &[0.1, 0.2]),
                range(0.008, 0.008, 0.008, DiameterSource::Default),
            ),
            (
                Groom::default(),
                range(0.008, 0.008, 0.008, DiameterSource::Default),
            ),
        ] {
            assert_eq!(groom.diameter_range(), expected);
            let mut hair = HairSection::default();
            assert_eq!(hair.diameter_range(&groom), expected);
            hair.diameter_cm = Some(0.5);
            let scene = range(0.5, 0.5, 0.5, DiameterSource::Scene);
            assert_eq!(hair.diameter_range(&groom), scene);
        }
    }
}
