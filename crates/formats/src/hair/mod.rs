//! Cem Yuksel's `.hair` files.
//!
//! All numbers are little-endian. A header of 128 bytes, then the arrays whose flag is set:
//!
//! | bytes | header |
//! |---|---|
//! | 0..4 | `HAIR`; capitals or not when read, capitals when written |
//! | 4..8 | number of strands, u32 |
//! | 8..12 | number of points of all strands, u32 |
//! | 12..16 | flags, u32, see below |
//! | 16..20 | default number of segments a strand, u32 |
//! | 20..24, 24..28, 28..40 | default thickness, transparency, colour, f32 |
//! | 40..128 | info string |
//!
//! | array | flag | items |
//! |---|---|---|
//! | segments | 0 | u16 a strand |
//! | points | 1 | 3 f32 a point; must be there |
//! | thickness | 2 | f32 a point |
//! | transparency | 3 | f32 a point |
//! | colour | 4 | 3 f32 a point |
//!
//! **Import and export are inverse.** A groom imported with a unit of 1 cm, whatever its up
//! axis, is exported as the same bytes: header, defaults and info string are kept in the
//! groom's [`crate::Original`], arrays as attributes, and turning the axes only swaps and
//! negates. In another unit each coordinate is multiplied in and divided out, rounded to f32
//! both times, so it may come back changed by one or two units in the last place; all else is
//! the same. Strands of a single point (no segments) have no direction and cannot be drawn: they
//! are set aside in the `Original` and put back on export.
//!
//! What is kept in the `Original`: the 128 bytes of the header, its magic in capitals, then 36
//! bytes for each strand of a single point: its index u32, position, thickness, transparency and
//! colour f32, in the file's own unit and axes; zero where the file has no such array.
//!
//! Thickness is kept in the file's own unit as attribute `thickness`, and in centimetres as
//! attribute `diameter`, which is what is drawn; what cannot be drawn is counted by
//! [`crate::Groom::thickness_faults`]. Export writes `thickness`, or `diameter` where that says
//! something else: values of points and strands as the array, a single one as the default.
//! Models of few strands hold thick ones on purpose (0.1 for 10,000 strands on a head 60 wide); a
//! scene's `diameter_cm` overrides them. A head of hair (30 strands or more) is not drawn thicker
//! than a hundredth of its size: 1 on a head 0.27 wide says that a program knew of no thickness.

mod export;
mod import;
mod layout;
mod original;
mod thickness;

pub use thickness::ThicknessFaults;
pub(crate) use thickness::{diameter, thickness};

use layout::INFO;

use crate::error::Result;
use crate::groom::Groom;
use crate::groom_format::{
    Export, ExportOptions, FormatInfo, GroomFormat, Import, ImportOptions, Sniff,
};

/// Cem Yuksel's `.hair` files.
#[derive(Debug)]
pub(crate) struct HairFormat;

impl GroomFormat for HairFormat {
    fn info(&self) -> &'static FormatInfo {
        &INFO
    }

    /// `hair` may also be the first word of a text: what follows the magic are three small numbers.
    fn sniff(&self, start: &[u8]) -> Sniff {
        match start.split_at_checked(4) {
            Some((b"HAIR", _)) => Sniff::Sure,
            Some((magic, rest))
                if magic.eq_ignore_ascii_case(b"HAIR")
                    && rest.iter().take(12).any(|&byte| byte == 0) =>
            {
                Sniff::Sure
            }
            _ => Sniff::No,
        }
    }

    fn read(&self, bytes: &[u8], options: &ImportOptions) -> Result<Import> {
        import::read(bytes, options)
    }

    fn write(&self, groom: &Groom, options: &ExportOptions) -> Result<Export> {
        export::write(groom, options).map(Export::new)
    }

    fn n_set_aside(&self, original: &[u8]) -> usize {
        original::n_single_points(original)
    }
}
