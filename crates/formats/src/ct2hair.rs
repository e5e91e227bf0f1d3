//! Strands of CT2Hair (Shen et al. 2023), `.bin`.
//!
//! All numbers are little-endian:
//!
//! | bytes | what |
//! |---|---|
//! | 4 | number of strands, i32 |
//! | for each strand: 4 | number of points n, i32 |
//! | 28 n | for each point: position, 3 f32; direction or colour, 3 f32; label, f32, as a rule 0 |
//!
//! There is no signature; [`crate::point_list`] tells such files from USC-HairSalon's. Positions are
//! in millimetres; the axis is not stated, y by convention. Strands with points that are no
//! numbers, which such files hold, are left out, as CT2Hair does itself. Files are not written.

use crate::bytes::{f32_at, point_at, u32_at};
use crate::counted::counted;
use crate::error::{Error, Result};
use crate::groom::{Groom, UpAxis};
use crate::groom_format::{
    AttributeSupport, Capabilities, CurveBasis, Export, ExportOptions, FormatInfo, GroomFormat,
    Import, ImportOptions, Note, NoteKind, SNIFF_BYTES, Sniff,
};
use crate::point_list::{self, PointKind};
use crate::strand_list::StrandList;

/// Files of CT2Hair.
#[derive(Debug)]
pub(crate) struct Ct2hairFormat;

static INFO: FormatInfo = FormatInfo {
    name: "ct2hair",
    title: "a CT2Hair .bin file",
    extensions: &["bin"],
    cm_per_unit: 0.1,
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

/// Bytes of a point.
const POINT_BYTES: usize = 28;

impl GroomFormat for Ct2hairFormat {
    fn info(&self) -> &'static FormatInfo {
        &INFO
    }

    fn sniff(&self, start: &[u8]) -> Sniff {
        match point_list::kind(start, SNIFF_BYTES) {
            Some(PointKind::Labelled) => Sniff::Likely,
            _ => Sniff::No,
        }
    }

    fn read(&self, bytes: &[u8], options: &ImportOptions) -> Result<Import> {
        read(bytes, options)
    }

    fn write(&self, _groom: &Groom, _options: &ExportOptions) -> Result<Export> {
        Err(INFO.is_not_written())
    }
}

/// The count at `at`, which must not be negative.
fn count(bytes: &[u8], at: usize, what: impl Fn() -> String) -> Result<u32> {
    let Some(word) = bytes.get(at..at.saturating_add(4)) else {
        let what = format!("file ends before the {}", what());
        return Err(Error::invalid(what, bytes.len() as u64));
    };
    let count = u32_at(word, 0);
    let range = format!("in 0..={}", i32::MAX);
    match i32::try_from(count) {
        Ok(_) => Ok(count),
        Err(_) => Err(Error::value(what(), count as i32, range)),
    }
}

fn read(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let n_strands = count(bytes, 0, || "number of strands".to_owned())?;
    let mut list = StrandList::new(options.placement(&INFO), options);
    let (mut at, mut n_broken) = (4usize, 0usize);
    for strand in 0..n_strands as usize {
        let n_points = count(bytes, at, || format!("number of points of strand {strand}"))?;
        at += 4;
        let rest = &bytes[at..];
        let wanted = n_points as u64 * POINT_BYTES as u64;
        if wanted > rest.len() as u64 {
            let left = rest.len();
            let what = format!(
                "{n_points} points of strand {strand} take {wanted} bytes, the file has {left} left"
            );
            return Err(Error::invalid(what, at as u64));
        }
        let points = &rest[..wanted as usize];
        at += points.len();
        let points = points.chunks_exact(POINT_BYTES);
        let is_number = |point: &[u8]| (0..3).all(|axis| !f32_at(point, 4 * axis).is_nan());
        match points.clone().all(is_number) {
            true => drop(list.push(strand, points.map(|point| point_at(point, 0)))?),
            false => n_broken += 1,
        }
    }
    if at != bytes.len() {
        let what = counted(bytes.len() - at, "byte", "bytes") + " after the last strand";
        return Err(Error::invalid(what, at as u64));
    }
    let mut notes = Vec::new();
    if n_broken > 0 {
        let what = counted(
            n_broken,
            "strand with points that are no numbers is",
            "strands with points that are no numbers are",
        ) + " left out";
        notes.push(Note::new(NoteKind::Dropped, what));
    }
    let what = "directions, colours and labels of points are left out";
    notes.push(Note::new(NoteKind::Dropped, what));
    let groom = list.finish(INFO.name, &mut notes)?;
    Ok(Import::new(groom, notes))
}
