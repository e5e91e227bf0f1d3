//! `strandlight groom stats`.

use std::path::PathBuf;
use strandlight_formats::counted;

use serde_json::{Value, json};
use strandlight_bake::grooms::{AttributeRange, GroomStats, Spread, stats};

use super::source::{SourceArgs, read_hair};
use crate::cli::{Failure, Outcome, print_line};

/// Measure hair: strands, points, lengths, widths, turning, extents, groups, attributes
#[derive(clap::Args)]
pub struct Args {
    /// .groom or hair file of another program, - for standard input
    file: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    source: SourceArgs,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let groom = read_hair(&args.file, &args.source, 0)?;
    let stats = stats(&groom);
    if args.json {
        let document = document(&stats);
        return print_line(serde_json::to_string_pretty(&document).map_err(Failure::input)?);
    }
    lines(&stats).into_iter().try_for_each(print_line)
}

fn spread(spread: Spread) -> Value {
    json!({ "min": spread.min, "median": spread.median, "max": spread.max })
}

fn document(stats: &GroomStats) -> Value {
    let groups = stats.groups.iter();
    let attributes = stats.attributes.iter();
    json!({
        "strands": stats.strands,
        "points": stats.points,
        "length_cm": spread(stats.length_cm),
        "points_per_strand": spread(stats.points_per_strand),
        "width_cm": spread(stats.width_cm),
        "turning_deg": spread(stats.turning_deg),
        "curvature_deg_per_cm": spread(stats.curvature_deg_per_cm),
        "bounds": { "min": stats.min, "max": stats.max },
        "coverage_cm2": stats.coverage_cm2,
        "groups": groups.map(|(id, n)| json!({ "id": id, "strands": n })).collect::<Vec<_>>(),
        "attributes": attributes.map(|attribute| json!({
            "name": attribute.name,
            "domain": attribute.domain.name(),
            "components": attribute.ranges.len(),
            "min": attribute.ranges.iter().map(|range| range[0]).collect::<Vec<_>>(),
            "max": attribute.ranges.iter().map(|range| range[1]).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
    })
}

fn lines(stats: &GroomStats) -> Vec<String> {
    let text = |name: &str, spread: Spread, unit: &str| {
        let [min, median, max] = [spread.min, spread.median, spread.max].map(short);
        format!("{name}: {min} to {max}{unit}, median {median}")
    };
    let (min, max) = (stats.min, stats.max);
    let size = [0, 1, 2].map(|axis: usize| format!("{:.2}", max[axis] - min[axis]));
    let mut lines = vec![
        format!(
            "{}, {}",
            counted(stats.strands, "strand", "strands"),
            counted(stats.points, "point", "points")
        ),
        text("length", stats.length_cm, " cm"),
        text("points per strand", stats.points_per_strand, ""),
        text("width", stats.width_cm, " cm"),
        text("turning", stats.turning_deg, " degrees"),
        text("curvature", stats.curvature_deg_per_cm, " degrees per cm"),
        format!(
            "extents: {} cm, from {min:.2?} to {max:.2?}",
            size.join(" x ")
        ),
        format!(
            "coverage: {} cm^2 of length times width",
            short(stats.coverage_cm2)
        ),
    ];
    for (id, n) in &stats.groups {
        lines.push(format!("group {id}: {}", counted(n, "strand", "strands")));
    }
    for AttributeRange {
        name,
        domain,
        ranges,
    } in &stats.attributes
    {
        let ranges = ranges
            .iter()
            .map(|[min, max]| format!("{} to {}", short((*min).into()), short((*max).into())));
        let ranges: Vec<String> = ranges.collect();
        let domain = domain.name();
        lines.push(format!(
            "attribute {name}, per {domain}: {}",
            ranges.join(", ")
        ));
    }
    lines
}

/// Four significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let decimals = (3 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
