//! `strandlight groom formats`.

use strandlight_formats::{AttributeSupport, CurveBasis, FormatInfo, GROOM_FORMATS};

use crate::cli::{Outcome, print_line};

/// Runs the command.
pub fn run() -> Outcome {
    GROOM_FORMATS
        .into_iter()
        .try_for_each(|format| print_line(line(format.info())))
}

fn line(info: &FormatInfo) -> String {
    let endings: Vec<String> = info
        .extensions
        .iter()
        .map(|end| format!(".{end}"))
        .collect();
    let way = match (info.can.reads, info.can.writes) {
        (true, true) => "in and out",
        (true, false) => "in",
        _ => "out",
    };
    let bases: Vec<&str> = info
        .can
        .bases
        .iter()
        .map(|basis| CurveBasis::name(*basis))
        .collect();
    let attributes = match info.can.attributes {
        AttributeSupport::Only([]) => "no attributes".to_owned(),
        AttributeSupport::Only(names) => names.join(", "),
        _ => "any attributes".to_owned(),
    };
    let frames = if info.can.frames { ", animation" } else { "" };
    format!(
        "{}: {}, {way}; {} cm a unit and {} up unless the file says otherwise; {} curves, \
         {attributes}{frames}",
        info.name,
        endings.join(", "),
        info.cm_per_unit,
        info.up.name(),
        bases.join(", "),
    )
}
