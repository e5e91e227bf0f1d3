//! The row of PLY files.

use crate::groom::UpAxis;
use crate::groom_format::{AttributeSupport, Capabilities, CurveBasis, FormatInfo};

pub static INFO: FormatInfo = FormatInfo {
    name: "ply",
    title: "a PLY file of strands",
    extensions: &["ply"],
    cm_per_unit: 100.0,
    up: UpAxis::Y,
    can: Capabilities {
        reads: true,
        writes: false,
        attributes: AttributeSupport::Only(&["thickness", "diameter", "color"]),
        bases: &[CurveBasis::Linear],
        frames: false,
        objects: false,
    },
};
