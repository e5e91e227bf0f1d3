//! Small grooms for tests of edits.

use strandlight_formats::{Attribute, Domain, Groom};
use strandlight_scene::progress::Progress;

use super::{GrowSpec, Style, generate};

/// Straight hair on a head, 12 points a strand, without attributes.
pub fn head(strands: u32) -> Groom {
    let spec = GrowSpec {
        style: Style::Straight,
        strands,
        points_per_strand: 12,
        seed: 3,
    };
    let mut groom = generate(&spec, &Progress::silent()).expect("the counts are in range");
    groom.attributes.clear();
    groom
}

pub fn attribute(name: &str, domain: Domain, components: u32, data: Vec<f32>) -> Attribute {
    Attribute {
        name: name.to_owned(),
        domain,
        components,
        data,
    }
}

/// A number for each strand of `groom`.
pub fn per_strand(name: &str, groom: &Groom, value: impl Fn(usize) -> f32) -> Attribute {
    let data = (0..groom.n_strands()).map(value).collect();
    attribute(name, Domain::Strand, 1, data)
}
