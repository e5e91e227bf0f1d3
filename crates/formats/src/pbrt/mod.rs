//! Curves in scene files of pbrt-v4.
//!
//! A statement `Shape "curve"` for each curve, with parameters `"point3 P" [...]`, its control
//! points; `"string basis"` `bezier` (the default) or `bspline`; `"integer degree"` 2 or 3 (the
//! default); `"float width"`, or `width0` and `width1` at root and tip, the diameters, 1 by default
//! and linear between them.
//!
//! **Read** are these statements of a scene, whatever stands around them; transforms are not
//! applied, which a note says. Segments of cubic Bezier curves whose inner control points are at the
//! thirds of a straight line become one piece of the polyline, others as many as
//! [`ImportOptions::samples_per_segment`] has.
//!
//! **Written** is a statement for each strand, a cubic Bezier curve of straight segments: the same
//! line as the polyline. What Strandlight has written comes back byte for byte with a unit of 1 cm.
//! The width can only go linearly from root to tip. Neither unit nor axis is stated; centimetres
//! and y up are the convention here.

mod layout;
mod read;
mod tokens;

use std::fmt::Write as _;

use layout::{INFO, thirds};

use crate::counted::counted;
use crate::error::Result;
use crate::groom::Groom;
use crate::groom_format::{
    Export, ExportOptions, FormatInfo, GroomFormat, Import, ImportOptions, Note, NoteKind, Sniff,
};
use crate::widths::Widths;

/// Scene files of pbrt-v4.
#[derive(Debug)]
pub(crate) struct PbrtFormat;

/// Widths may be so far from linear, as a share, before it is said.
const LINEAR: f32 = 1e-3;

impl GroomFormat for PbrtFormat {
    fn info(&self) -> &'static FormatInfo {
        &INFO
    }

    /// Text in whose start there is a curve.
    fn sniff(&self, start: &[u8]) -> Sniff {
        match !start.contains(&0) && tokens::has_curve(start) {
            true => Sniff::Likely,
            false => Sniff::No,
        }
    }

    fn read(&self, bytes: &[u8], options: &ImportOptions) -> Result<Import> {
        read::read(bytes, options)
    }

    fn write(&self, groom: &Groom, options: &ExportOptions) -> Result<Export> {
        write(groom, options)
    }
}

fn write(groom: &Groom, options: &ExportOptions) -> Result<Export> {
    let placement = options.placement(groom, &INFO);
    let widths = Widths::of(groom, placement.cm_per_unit)?;
    let mut text = String::with_capacity(120 * groom.points.len());
    let mut n_bent = 0;
    for strand in 0..groom.n_strands() {
        let range = groom.strand(strand);
        let [width_0, width_1] = [range.start, range.end - 1].map(|point| widths.at(strand, point));
        let last = (range.len() - 1) as f32;
        n_bent += usize::from(range.clone().enumerate().any(|(ix, point)| {
            let linear = width_0 + (width_1 - width_0) * ix as f32 / last;
            (widths.at(strand, point) - linear).abs() > LINEAR * width_0.max(width_1)
        }));
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "Shape \"curve\" \"string type\" \"cylinder\" \"string basis\" \"bezier\" \
             \"integer degree\" 3 \"float width0\" {width_0} \"float width1\" {width_1} \
             \"point3 P\" ["
        );
        let mut put = |[x, y, z]: [f32; 3]| writeln!(text, "{x} {y} {z}");
        let mut last = None;
        for &point in &groom.points[range] {
            let point = placement.to_file(point);
            if let Some(from) = last.replace(point) {
                for inner in thirds(from, point) {
                    let _ = put(inner);
                }
            }
            let _ = put(point);
        }
        text.push_str("]\n");
    }
    let mut export = Export::new(text.into_bytes());
    export.notes.extend(widths.note());
    if n_bent > 0 {
        let what = format!(
            "the widths of {} are written as linear from root to tip, which they are not",
            counted(n_bent, "strand", "strands")
        );
        export.notes.push(Note::new(NoteKind::Dropped, what));
    }
    Ok(export)
}
