//! What readers and writers of `.tfx` files both know.

use crate::groom::{Attribute, Domain, Groom, UpAxis};
use crate::groom_format::{
    AttributeSupport, Capabilities, CurveBasis, ExportOptions, FormatInfo, ImportOptions, Note,
    NoteKind, Placement,
};
use crate::strand_list::attribute;

/// The format's row.
pub static INFO: FormatInfo = FormatInfo {
    name: "tfx",
    title: "a TressFX .tfx file",
    extensions: &["tfx"],
    cm_per_unit: 100.0,
    up: UpAxis::Y,
    can: Capabilities {
        reads: true,
        writes: true,
        attributes: AttributeSupport::Only(&["root_uv", INVERSE_MASS, POINT_UV, THICKNESS, COLOR]),
        bases: &[CurveBasis::Linear],
        frames: false,
        objects: false,
    },
};

pub const INVERSE_MASS: &str = "inverse_mass";
pub const POINT_UV: &str = "tfx_uv";
pub const THICKNESS: &str = "tfx_thickness";
pub const COLOR: &str = "tfx_color";
/// Centimetres per unit of versions 2 and 3.
pub const OLD_CM_PER_UNIT: f64 = 1.0;

/// Where the points of a file of `version` go.
pub fn placement(version: u32, options: &ImportOptions) -> Placement {
    let usual = match version {
        4 => INFO.cm_per_unit,
        _ => OLD_CM_PER_UNIT,
    };
    Placement {
        cm_per_unit: options.cm_per_unit.unwrap_or(usual),
        ..options.placement(&INFO)
    }
}

/// Marks in the [`crate::Original`] of `groom` that it comes from a file of another version than the one that is
/// written.
pub fn set_version(groom: &mut Groom, version: u32) {
    if let (Some(original), false) = (&mut groom.source.original, version == 4) {
        original.data = version.to_le_bytes().to_vec();
    }
}

/// Where the points of `groom` go in a file of version 4: its unit is that of the file that the groom comes
/// from only if that was of version 4 as well.
pub fn placement_for_export(groom: &Groom, options: &ExportOptions) -> Placement {
    let placement = options.placement(groom, &INFO);
    let is_other_version =
        (groom.source.original_of(INFO.name)).is_some_and(|data| !data.is_empty());
    Placement {
        cm_per_unit: match options.cm_per_unit {
            None if is_other_version => INFO.cm_per_unit,
            _ => placement.cm_per_unit,
        },
        ..placement
    }
}

/// What is to be known of every file: the unit where nothing states it, and that there are guides
/// only.
pub fn usual_notes(
    version: u32,
    n_strands: usize,
    n_follow: u32,
    options: &ImportOptions,
) -> Vec<Note> {
    let mut notes = Vec::new();
    if options.cm_per_unit.is_none() {
        let unit = if version == 4 {
            "metres"
        } else {
            "centimetres"
        };
        let what = format!("a file of version {version} of TressFX: taken as in {unit}");
        notes.push(Note::new(NoteKind::Assumed, what));
    }
    let what = match n_follow {
        0 => format!("all {n_strands} strands are guides; TressFX makes hair around them"),
        _ => format!(
            "all {n_strands} strands are guides; TressFX makes {n_follow} follow hairs around each"
        ),
    };
    notes.push(Note::new(NoteKind::Assumed, what));
    notes
}

/// The inverse mass of strands whose first two points do not move, nor the last two.
pub fn held_at_both_ends(groom: &Groom) -> Attribute {
    let mut data = Vec::with_capacity(groom.points.len());
    for strand in 0..groom.n_strands() {
        let n = groom.strand(strand).len();
        data.extend((0..n).map(|ix| match ix < 2 || ix + 2 >= n {
            true => 0.0,
            false => 1.0,
        }));
    }
    attribute(INVERSE_MASS, Domain::Point, 1, data)
}
