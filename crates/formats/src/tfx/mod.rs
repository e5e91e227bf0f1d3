//! Hair of AMD TressFX, `.tfx`: text of version 2, binary files of versions 3 and 4.
//!
//! All strands of a file are guides by design: programs that draw them make follow hairs around
//! them. Version 4, little-endian, offsets in bytes from the start of the file, 0 where there is no
//! such array:
//!
//! | bytes | version 4 |
//! |---|---|
//! | 0..4 | 4.0, f32 |
//! | 4..8 | number of strands, u32 |
//! | 8..12 | number of points of each strand, u32: 4, 8, 16, 32 or 64 |
//! | 12..16 | offset of positions: 4 f32 a point, x, y, z and inverse mass (0: it does not move) |
//! | 16..20 | offset of texture coordinates of strands, 2 f32 |
//! | 20..24 | offset of texture coordinates of points, 2 f32 |
//! | 24..28 | offset of thickness factors of strands, f32 |
//! | 28..32 | offset of colours of points, 4 f32 |
//! | 32..160 | reserved, 0 |
//!
//! | bytes | version 3 |
//! |---|---|
//! | 0..4 | 3.0, f32 |
//! | 4..8, 8..12 | number of strands, of points of each, u32 |
//! | 12..16 | number of follow hairs of each, u32 |
//! | 16..20 | not 0: the last two points do not move either, u32 |
//! | 20..144 | reserved |
//! | 144..148 | offset of positions: 3 f32 a point |
//! | 148..152 | offset of thickness factors of strands, f32 |
//! | 152..156 | offset of texture coordinates of strands, 2 f32 |
//! | 156..160 | offset of colours of points, 4 f32 |
//! | 160..164 | offset of the list of guides; others than 0 are refused |
//! | 164..168 | offset of texture coordinates of points, 2 f32 |
//! | 168..296 | reserved |
//!
//! Version 2 is text: settings, a line each (`version 2.0`, `scale`, `rotation`, `translation`,
//! `bothEndsImmovable`, `maxNumVerticesInStrand`, `numFollowHairsPerGuideHair`,
//! `maxRadiusAroundGuideHair`, `numStrands`, `is sorted`); then each strand, `strand I numVerts N
//! texcoord U V` and N lines `x y z`.
//!
//! Attributes: `root_uv`, `inverse_mass` (of points), `tfx_uv` (of points), `tfx_thickness` (of
//! strands, a factor without unit), `tfx_color` (of points, rgba). Files of versions 2 and 3 are in
//! centimetres by convention, of version 4 in metres; y is up.
//!
//! **Version 4 is written.** A file of it whose arrays stand in the order of the table without gaps
//! comes back byte for byte with a unit of 1 cm. Strands of unequal lengths, or of another number
//! of points than the table has, are resampled by arc length, which a note says.
//! What is kept in the groom's [`crate::Original`]: of files of versions 2 and 3 the version, u32, since their
//! unit is not that of the file that is written; of version 4 nothing.

mod binary;
mod export;
mod layout;
mod text;

use layout::INFO;

use crate::bytes::{f32_at, u32_at};
use crate::error::Result;
use crate::groom::Groom;
use crate::groom_format::{
    Export, ExportOptions, FormatInfo, GroomFormat, Import, ImportOptions, Sniff,
};

/// Files of TressFX.
#[derive(Debug)]
pub(crate) struct TfxFormat;

impl GroomFormat for TfxFormat {
    fn info(&self) -> &'static FormatInfo {
        &INFO
    }

    fn sniff(&self, start: &[u8]) -> Sniff {
        match version(start) {
            Some(_) => Sniff::Sure,
            None => Sniff::No,
        }
    }

    fn read(&self, bytes: &[u8], options: &ImportOptions) -> Result<Import> {
        match bytes.starts_with(TEXT_START) {
            true => text::read(bytes, options),
            false => binary::read(bytes, options),
        }
    }

    fn write(&self, groom: &Groom, options: &ExportOptions) -> Result<Export> {
        export::write(groom, options)
    }
}

const TEXT_START: &[u8] = b"version ";

/// The version of the file that starts with `start`. TressFX's settings start as its text does.
fn version(start: &[u8]) -> Option<u32> {
    if start.starts_with(TEXT_START) {
        let strands = b"\nnumStrands ";
        let is_hair = start.windows(strands.len()).any(|bytes| bytes == strands);
        return is_hair.then_some(2);
    }
    let header_bytes = match start.get(..12).map(|start| f32_at(start, 0)) {
        Some(3.0) => binary::V3_HEADER_BYTES,
        Some(4.0) => binary::V4_HEADER_BYTES,
        _ => return None,
    };
    let (n_strands, n_points) = (u32_at(start, 4), u32_at(start, 8));
    let is_header = start.len() >= header_bytes
        && (1..=10_000_000).contains(&n_strands)
        && n_points.is_power_of_two()
        && (2..=1024).contains(&n_points);
    is_header.then_some(if header_bytes == binary::V4_HEADER_BYTES {
        4
    } else {
        3
    })
}
