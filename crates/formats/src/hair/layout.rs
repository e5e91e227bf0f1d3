//! What reader and writer of `.hair` files both know.

use crate::groom::UpAxis;
use crate::groom_format::{AttributeSupport, Capabilities, CurveBasis, FormatInfo};

/// The format's row.
pub static INFO: FormatInfo = FormatInfo {
    name: "hair",
    title: "a .hair file",
    extensions: &["hair"],
    cm_per_unit: 1.0,
    up: UpAxis::Z,
    can: Capabilities {
        reads: true,
        writes: true,
        attributes: AttributeSupport::Only(&["thickness", "diameter", "transparency", "color"]),
        bases: &[CurveBasis::Linear],
        frames: false,
        objects: false,
    },
};

/// Bits of the header's flags.
pub mod flag {
    /// There is a segments array.
    pub const SEGMENTS: u32 = 1;
    /// There is a points array.
    pub const POINTS: u32 = 2;
    /// There is a thickness array.
    pub const THICKNESS: u32 = 4;
    /// There is a transparency array.
    pub const TRANSPARENCY: u32 = 8;
    /// There is a colour array.
    pub const COLOR: u32 = 16;
    /// All that have a meaning; the others must be zero.
    pub const ALL: u32 = 31;
}

pub const HEADER_BYTES: usize = 128;
/// Where the default thickness stands.
pub const THICKNESS_AT: usize = 20;
/// Where the info string starts.
pub const INFO_START: usize = 40;

/// Names of the attributes, their flag, components, and place of their default in the header.
pub const ATTRIBUTES: [(&str, u32, usize, usize); 3] = [
    ("thickness", flag::THICKNESS, 1, THICKNESS_AT),
    ("transparency", flag::TRANSPARENCY, 1, 24),
    ("color", flag::COLOR, 3, 28),
];
