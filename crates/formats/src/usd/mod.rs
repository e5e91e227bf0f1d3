//! Universal Scene Description: text layers (`.usda`), binary ones (`.usdc`) and packages (`.usdz`)
//! are read, `.usda` is written. `.usd` may be any of them.
//!
//! | module | what |
//! |---|---|
//! | [`text`], [`binary`], [`package`] | the encodings |
//! | [`model`], [`layer`] | prims with attributes, whichever encoding they come from |
//! | [`stage`], [`time`], [`transform`] | which prims are there, when, and where |
//! | [`pieces`], [`primvars`], [`merge`], [`import`] | `BasisCurves` as a groom |
//! | [`export`] | a groom as `BasisCurves` |
//!
//! **One layer is read.** Chosen variants are applied. What references, payloads, inherits,
//! specializes and sub-layers bring in is not; it is named, so that nothing is lost in silence.

mod binary;
mod export;
mod import;
mod info;
mod layer;
mod merge;
mod model;
mod package;
mod pieces;
mod primvars;
mod stage;
mod text;
mod time;
mod transform;

use info::INFO;

use crate::error::Result;
use crate::groom::Groom;
use crate::groom_format::{
    Export, ExportOptions, FormatInfo, GroomFormat, Import, ImportOptions, Sniff,
};

/// Universal Scene Description.
#[derive(Debug)]
pub(crate) struct UsdFormat;

impl GroomFormat for UsdFormat {
    fn info(&self) -> &'static FormatInfo {
        &INFO
    }

    fn sniff(&self, start: &[u8]) -> Sniff {
        let is_text = text::SIGNATURES.iter().any(|sign| start.starts_with(sign));
        match is_text || start.starts_with(binary::SIGNATURE) || package::is_package(start) {
            true => Sniff::Sure,
            false => Sniff::No,
        }
    }

    fn read(&self, bytes: &[u8], options: &ImportOptions) -> Result<Import> {
        import::read(bytes, options)
    }

    fn write(&self, groom: &Groom, options: &ExportOptions) -> Result<Export> {
        export::write(std::slice::from_ref(groom), None, options)
    }

    fn frame_times(&self, bytes: &[u8]) -> Result<Vec<f64>> {
        import::frame_times(bytes)
    }

    fn write_frames(
        &self,
        frames: &[Groom],
        frames_per_second: f64,
        options: &ExportOptions,
    ) -> Result<Export> {
        export::write(frames, Some(frames_per_second), options)
    }
}
