//! Strands in PLY files, as reconstruction of hair from pictures writes them.
//!
//! The header is text, a line each: `ply`; `format ascii 1.0`, `binary_little_endian` or
//! `binary_big_endian`; `element NAME COUNT`, and below each its `property TYPE NAME` or `property
//! list TYPE TYPE NAME`; `end_header`. Then the elements one after another, of binary files their
//! properties without gaps, of text files a line each.
//!
//! Element `vertex` has `x`, `y`, `z`, strand by strand, root first. Where strands end is said by
//! the first of these that a file has:
//!
//! 1. a property `strand_id`, `strand`, `strand_index`, `curve_id`, `curve` or `hair_id` of the
//!    vertices, the same along a strand;
//! 2. element `strand` with `nsegs`, the number of segments of each (hairutil);
//! 3. element `edge` with `vertex1` and `vertex2`, each from one vertex to the next;
//! 4. nothing: 100 vertices a strand, as GaussianHaircut and HAAR write them, where they are a
//!    multiple of 100 and look like strands.
//!
//! `thickness` (a diameter), `width` (likewise) or `radius` become attribute `thickness`; `red`,
//! `green` and `blue` attribute `color`, bytes divided by 255. Meshes and Gaussian splats are
//! refused. Neither unit nor axis is stated: metres with y up, as the heads of these models have
//! them. Files are not written.

mod header;
mod layout;
mod strands;

use layout::INFO;

use crate::error::Result;
use crate::groom::Groom;
use crate::groom_format::{
    Export, ExportOptions, FormatInfo, GroomFormat, Import, ImportOptions, Sniff,
};

/// Strands in PLY files.
#[derive(Debug)]
pub(crate) struct PlyFormat;

impl GroomFormat for PlyFormat {
    fn info(&self) -> &'static FormatInfo {
        &INFO
    }

    /// A file whose header names no faces, as far as it is seen.
    fn sniff(&self, start: &[u8]) -> Sniff {
        match header::is_ply(start) && !header::is_mesh(start) {
            true => Sniff::Sure,
            false => Sniff::No,
        }
    }

    fn read(&self, bytes: &[u8], options: &ImportOptions) -> Result<Import> {
        strands::read(bytes, options)
    }

    fn write(&self, _groom: &Groom, _options: &ExportOptions) -> Result<Export> {
        Err(INFO.is_not_written())
    }
}
