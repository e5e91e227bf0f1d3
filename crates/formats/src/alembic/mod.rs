//! Alembic archives (`.abc`) in the Ogawa container: curves in, curves out.
//!
//! All numbers are little-endian. A file is 16 bytes and blocks that point to each other:
//!
//! | bytes | header |
//! |---|---|
//! | 0..5 | `Ogawa` |
//! | 5 | 255; 0 while the file is being written |
//! | 6..8 | 0, 1: version |
//! | 8..16 | position of the root group, u64 |
//!
//! | block | |
//! |---|---|
//! | group | number of children u64, and for each a u64: its position, with the highest bit set for data; 0 and the bit alone are empty |
//! | data | length u64, bytes |
//!
//! The root's children: a version (data, 0 i32), the library's version (data), the top object
//! (group), texts on the archive (data), time samplings (data), metadata (data: length u8, text). An
//! object is a group of its properties (group), its children (groups) and their headers (data, two
//! hashes of 16 bytes at its end); a compound property likewise one of properties and their headers. Other
//! properties are groups of samples: data of a hash of 16 bytes and the values, behind each sample
//! of an array its dimensions. Headers are described at [`archive::Archive`].
//!
//! **Reading.** Curves (`AbcGeom_Curve_v2`) become polylines in the world, by all transforms above
//! them: every operation, inheritance, at one point in time. Cubic curves, with knots or without,
//! are evaluated. What there is one value for is judged by the number of values and by the label
//! where that fits. Attributes are those of Unreal's schema, of Houdini and all others of numbers,
//! with indices or without; constant ones of Unreal's may stand on the objects around. Several
//! objects are one groom, its groups made of them if there are no others. A file can point to the
//! same data from many places, so what is read in all is bounded by a multiple of its length.
//!
//! **Writing.** One object of linear curves under an identity transform, Unreal's schema 1.5, any
//! other attribute under its name.

mod archive;
mod attributes;
mod cursor;
mod export;
mod import;
mod info;
mod knots;
mod merge;
mod murmur;
mod notes;
mod ogawa;
mod params;
mod pod;
mod sampler;
mod sampling;
mod shapes;
mod strands;
#[cfg(test)]
mod tests;
mod transform;
mod tree;
mod writer;

use crate::error::Result;
use crate::groom::Groom;
use crate::groom_format::{
    Export, ExportOptions, FormatInfo, GroomFormat, Import, ImportOptions, Sniff,
};
use info::INFO;

/// Alembic archives.
#[derive(Debug)]
pub(crate) struct AlembicFormat;

impl GroomFormat for AlembicFormat {
    fn info(&self) -> &'static FormatInfo {
        &INFO
    }

    fn sniff(&self, start: &[u8]) -> Sniff {
        match start.starts_with(ogawa::MAGIC) {
            true => Sniff::Sure,
            false => Sniff::No,
        }
    }

    fn read(&self, bytes: &[u8], options: &ImportOptions) -> Result<Import> {
        import::read(bytes, options)
    }

    fn write(&self, groom: &Groom, options: &ExportOptions) -> Result<Export> {
        export::write(std::slice::from_ref(groom), 24.0, options)
    }

    fn write_frames(
        &self,
        frames: &[Groom],
        frames_per_second: f64,
        options: &ExportOptions,
    ) -> Result<Export> {
        export::write(frames, frames_per_second, options)
    }

    fn frame_times(&self, bytes: &[u8]) -> Result<Vec<f64>> {
        import::frame_times(bytes)
    }
}
