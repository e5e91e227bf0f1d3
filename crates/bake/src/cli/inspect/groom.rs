//! Hair.

use serde::Serialize;
use strandlight_formats::{Groom, Guesses, counted};

use super::parts::{Bounds, as_map, parameters};

#[derive(Serialize)]
struct AttributeInfo {
    name: String,
    domain: &'static str,
    components: u32,
}

#[derive(Serialize)]
struct DiameterInfo {
    min: f32,
    median: f32,
    max: f32,
    source: &'static str,
}

/// Names, and why; null where nothing tells.
#[derive(Serialize)]
struct GuessInfo {
    unit: Option<&'static str>,
    unit_because: Option<String>,
    up: Option<&'static str>,
    up_because: Option<String>,
}

#[derive(Serialize)]
pub(super) struct GroomInfo {
    kind: &'static str,
    format_version: String,
    strands: usize,
    points: usize,
    /// Fewest and most points of a strand.
    points_per_strand: [usize; 2],
    /// Shortest, mean and longest strand.
    strand_length: [f64; 3],
    bounds: Bounds,
    /// Extents of the bounds.
    size: [f32; 3],
    /// Of bounds, size and lengths.
    unit: &'static str,
    /// As drawn, unless the scene has a `diameter_cm`.
    diameter_cm: DiameterInfo,
    /// What unit and axes of the source file seem to be.
    guess: GuessInfo,
    /// What seems wrong with them, and with the thickness.
    pub notes: Vec<String>,
    /// Name of the format it was imported from; null where it was generated.
    source_format: Option<String>,
    source_cm_per_unit: f64,
    source_up: &'static str,
    source_hash: String,
    /// Strands of fewer than two points in the source file, kept for export only.
    single_point_strands: usize,
    attributes: Vec<AttributeInfo>,
    #[serde(serialize_with = "as_map")]
    parameters: Vec<(String, String)>,
    tool_version: String,
}

pub(super) fn describe_groom(
    groom: &Groom,
    kind: &'static str,
    format_version: String,
) -> GroomInfo {
    let (min, max) = groom.bounds();
    let mut points_per_strand = [usize::MAX, 0];
    let mut strand_length = [f64::INFINITY, 0.0, 0.0];
    for strand_ix in 0..groom.n_strands() {
        let points = &groom.points[groom.strand(strand_ix)];
        let n = points.len();
        points_per_strand = [points_per_strand[0].min(n), points_per_strand[1].max(n)];
        let length: f64 = points
            .windows(2)
            .map(|pair| distance(pair[0], pair[1]))
            .sum();
        strand_length[0] = strand_length[0].min(length);
        strand_length[1] += length / groom.n_strands() as f64;
        strand_length[2] = strand_length[2].max(length);
    }
    let source = &groom.source;
    let drawn = groom.diameter_range();
    let Guesses { unit, up } = groom.guess_source();
    GroomInfo {
        kind,
        format_version,
        strands: groom.n_strands(),
        points: groom.points.len(),
        points_per_strand,
        strand_length,
        bounds: Bounds { min, max },
        size: [0, 1, 2].map(|axis| max[axis] - min[axis]),
        unit: "cm",
        diameter_cm: DiameterInfo {
            min: drawn.min,
            median: drawn.median,
            max: drawn.max,
            source: drawn.source.name(),
        },
        guess: GuessInfo {
            unit: unit.as_ref().map(|guess| guess.value.name()),
            unit_because: unit.map(|guess| guess.because),
            up: up.as_ref().map(|guess| guess.value.name()),
            up_because: up.map(|guess| guess.because),
        },
        notes: super::super::groom::doubts(groom, drawn),
        source_format: source
            .original
            .as_ref()
            .map(|original| original.format.clone()),
        source_cm_per_unit: source.cm_per_unit,
        source_up: source.up.name(),
        source_hash: source.hash.clone(),
        single_point_strands: source.n_set_aside(),
        attributes: groom
            .attributes
            .iter()
            .map(|attribute| AttributeInfo {
                name: attribute.name.clone(),
                domain: attribute.domain.name(),
                components: attribute.components,
            })
            .collect(),
        parameters: source.parameters.clone(),
        tool_version: source.tool_version.clone(),
    }
}

fn distance(from: [f32; 3], to: [f32; 3]) -> f64 {
    (0..3)
        .map(|axis| f64::from(to[axis] - from[axis]).powi(2))
        .sum::<f64>()
        .sqrt()
}

/// The thickness of the strands, in micrometres.
fn text_of_diameter(info: &DiameterInfo) -> String {
    let [min, median, max] = [info.min, info.median, info.max].map(|cm| {
        let text = format!("{:.2}", f64::from(cm) * 1e4);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    });
    let source = info.source;
    if min == max {
        format!("diameter {max} \u{b5}m ({source})")
    } else {
        format!("diameter {min} to {max} \u{b5}m, median {median} ({source})")
    }
}

pub(super) fn text_of_groom(info: &GroomInfo) -> Vec<String> {
    let [fewest, most] = info.points_per_strand;
    let [shortest, mean, longest] = info.strand_length;
    let (Bounds { min, max }, size) = (&info.bounds, info.size);
    let mut lines = vec![
        format!("{} {}", info.kind, info.format_version)
            .trim_end()
            .to_owned(),
        format!(
            "{}, {}, {fewest} to {most} a strand",
            counted(info.strands, "strand", "strands"),
            counted(info.points, "point", "points")
        ),
        format!("lengths {shortest:.2} to {longest:.2} cm, mean {mean:.2}"),
        text_of_diameter(&info.diameter_cm),
        format!("bounds {min:.2?} to {max:.2?} cm"),
        format!("size {:.2} x {:.2} x {:.2} cm", size[0], size[1], size[2]),
        format!(
            "source: {}{} cm per unit, {} up, hash {}",
            match &info.source_format {
                Some(format) => format!("{format}, "),
                None => String::new(),
            },
            info.source_cm_per_unit,
            info.source_up,
            if info.source_hash.is_empty() {
                "none"
            } else {
                &info.source_hash
            }
        ),
    ];
    if info.single_point_strands > 0 {
        lines.push(format!(
            "{} of a single point, kept for export",
            counted(info.single_point_strands, "strand", "strands")
        ));
    }
    for attribute in &info.attributes {
        let AttributeInfo {
            name,
            domain,
            components,
        } = attribute;
        lines.push(format!("attribute {name}: {components} per {domain}"));
    }
    lines.extend(parameters(&info.parameters, &info.tool_version));
    lines
}
