//! NumPy arrays of strands, `.npy`, as neural models of hair save them.
//!
//! | bytes | what |
//! |---|---|
//! | 6 | `93 4e 55 4d 50 59` (`\x93NUMPY`) |
//! | 2 | version: 1 0, 2 0 or 3 0 |
//! | 2, from version 2 on 4 | length n of the header, little-endian |
//! | n | `{'descr': '<f4', 'fortran_order': False, 'shape': (strands, points, 3), }` and blanks |
//! | then | the array |
//!
//! Half, single and double precision are read, little-endian and in C order. Unit and axis are not
//! stated: metres with y up, as the heads of these models have them. Files are not written.

use crate::error::Result;
use crate::groom::{Groom, UpAxis};
use crate::groom_format::{
    AttributeSupport, Capabilities, CurveBasis, Export, ExportOptions, FormatInfo, GroomFormat,
    Import, ImportOptions, Sniff,
};
use crate::npy_array::{MAGIC, NpyArray};
use crate::strand_list::StrandList;

/// NumPy arrays.
#[derive(Debug)]
pub(crate) struct NpyFormat;

static INFO: FormatInfo = FormatInfo {
    name: "npy",
    title: "a NumPy array (.npy)",
    extensions: &["npy"],
    cm_per_unit: 100.0,
    up: UpAxis::Y,
    can: Capabilities {
        reads: true,
        writes: false,
        attributes: AttributeSupport::Only(&[]),
        bases: &[CurveBasis::Linear],
        frames: false,
        objects: false,
    },
};

impl GroomFormat for NpyFormat {
    fn info(&self) -> &'static FormatInfo {
        &INFO
    }

    fn sniff(&self, start: &[u8]) -> Sniff {
        match start.starts_with(MAGIC) {
            true => Sniff::Sure,
            false => Sniff::No,
        }
    }

    fn read(&self, bytes: &[u8], options: &ImportOptions) -> Result<Import> {
        read(bytes, options)
    }

    fn write(&self, _groom: &Groom, _options: &ExportOptions) -> Result<Export> {
        Err(INFO.is_not_written())
    }
}

fn read(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let is_wanted = |shape: &[u64]| matches!(shape, [_, _, 3]);
    let array = NpyArray::of(bytes, "(strands, points, 3)", is_wanted)?;
    let [n_strands, n_points] = [array.shape[0], array.shape[1]];
    let mut list = StrandList::new(options.placement(&INFO), options);
    // Of no points there is nothing in the file, however many strands.
    let n_strands = if n_points == 0 { 0 } else { n_strands };
    for strand in 0..n_strands as usize {
        // The file is as long as the shape says.
        let first = strand * n_points as usize;
        let points = (first..first + n_points as usize)
            .map(|point| [0, 1, 2].map(|axis| array.value(3 * point + axis) as f32));
        list.push(strand, points)?;
    }
    let mut notes = Vec::new();
    let groom = list.finish(INFO.name, &mut notes)?;
    Ok(Import::new(groom, notes))
}
