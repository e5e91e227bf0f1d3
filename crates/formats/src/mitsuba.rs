//! Curves of Mitsuba 3, the text files of its shapes `linearcurve` and `bsplinecurve`.
//!
//! A line for each control point, `x y z radius`; empty lines between curves. Mitsuba reads four
//! numbers from each line and ignores what follows, so files that Strandlight writes say after the
//! first control point which shape they are for: `# linearcurve`.
//!
//! Files that do not say so are read as B-splines, which are drawn with more points than the file
//! has and start and end short of the outer ones, unless a curve has less than the four points that
//! a B-spline needs: then all are polylines. Attribute `thickness` is twice the radius. Neither
//! unit nor axis is stated; centimetres and y up are the convention here.
//!
//! What is written are polylines, each number with as many digits as tell it from all others, so
//! that a file that was written comes back with the same numbers.

use std::fmt::Write as _;

use crate::curves::{self, Wrap};
use crate::error::{Error, Result};
use crate::groom::{Domain, Groom, UpAxis};
use crate::groom_format::{
    AttributeSupport, Capabilities, CurveBasis, Export, ExportOptions, FormatInfo, GroomFormat,
    Import, ImportOptions, Note, NoteKind, SNIFF_BYTES, Sniff,
};
use crate::hair::diameter;
use crate::strand_list::{StrandList, attribute};
use crate::text_lines::{lines, numbers};
use crate::widths::Widths;

/// Files of curves of Mitsuba 3.
#[derive(Debug)]
pub(crate) struct MitsubaFormat;

static INFO: FormatInfo = FormatInfo {
    name: "mitsuba",
    title: "a Mitsuba curve file",
    extensions: &["txt"],
    cm_per_unit: 1.0,
    up: UpAxis::Y,
    can: Capabilities {
        reads: true,
        writes: true,
        attributes: AttributeSupport::Only(&["thickness", "diameter"]),
        bases: &[CurveBasis::Linear, CurveBasis::BSpline],
        frames: false,
        objects: false,
    },
};

/// Comment of files of polylines.
const LINEAR: &str = "linearcurve";
/// Comment of files of B-splines.
const SPLINE: &str = "bsplinecurve";

impl GroomFormat for MitsubaFormat {
    fn info(&self) -> &'static FormatInfo {
        &INFO
    }

    /// Four numbers on each line, the last one not negative; on most after a comment that states the shape or where a float
    /// is infinite or not a number, for what is damaged there the reader tells.
    fn sniff(&self, start: &[u8]) -> Sniff {
        let is_whole = start.len() < SNIFF_BYTES;
        // The last line may be cut.
        let end = match start.iter().rposition(|&byte| byte == b'\n') {
            Some(end) if !is_whole => end,
            _ => start.len(),
        };
        let (mut n_points, mut n_others) = (0, 0);
        let mut is_stated = false;
        for line in lines(&start[..end]) {
            let (point, comment) = split_comment(line.bytes);
            is_stated |= basis_of(comment).is_some();
            match numbers::<4>(words(point)) {
                Some([.., radius]) if radius >= 0.0 => n_points += 1,
                None if words(point).next().is_none() => {}
                // Those that are no numbers to render are the reader's to tell.
                _ if is_stated || has_no_number(point) => n_others += 1,
                _ => return Sniff::No,
            }
        }
        // Of two lines one may be wrong if they say what they are.
        let is_one = match is_stated {
            true => n_points + n_others > 1 && n_points >= n_others,
            false => n_points > 1 && n_points > n_others,
        };
        match is_one {
            true => Sniff::Likely,
            false => Sniff::No,
        }
    }

    fn read(&self, bytes: &[u8], options: &ImportOptions) -> Result<Import> {
        read(bytes, options)
    }

    fn write(&self, groom: &Groom, options: &ExportOptions) -> Result<Export> {
        write(groom, options)
    }
}

/// A line before and after its `#`.
fn split_comment(line: &[u8]) -> (&[u8], &[u8]) {
    match line.iter().position(|&byte| byte == b'#') {
        Some(at) => (&line[..at], &line[at + 1..]),
        None => (line, &[]),
    }
}

/// The shape that a comment states.
fn basis_of(comment: &[u8]) -> Option<CurveBasis> {
    let of_word = |word| match std::str::from_utf8(word) {
        Ok(LINEAR) => Some(CurveBasis::Linear),
        Ok(SPLINE) => Some(CurveBasis::BSpline),
        _ => None,
    };
    words(comment).filter_map(of_word).last()
}

fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// Is it a control point one of whose four floats is infinite or not a number?
fn has_no_number(line: &[u8]) -> bool {
    let float = |word| std::str::from_utf8(word).ok()?.parse::<f64>().ok();
    let floats: Option<Vec<f64>> = words(line).map(float).collect();
    floats.is_some_and(|floats| floats.len() == 4 && floats.iter().any(|x| !x.is_finite()))
}

/// Control points of all curves, and the first of each.
#[derive(Debug, Default)]
struct ControlPoints {
    points: Vec<[f32; 3]>,
    radii: Vec<f32>,
    starts: Vec<usize>,
    /// What the file says that it is.
    basis: Option<CurveBasis>,
}

fn control_points(bytes: &[u8], options: &ImportOptions) -> Result<ControlPoints> {
    let mut found = ControlPoints::default();
    let mut in_curve = false;
    for line in lines(bytes) {
        let (point, comment) = split_comment(line.bytes);
        found.basis = basis_of(comment).or(found.basis);
        if words(point).next().is_none() {
            in_curve = false;
            continue;
        }
        let Some([x, y, z, radius]) = numbers(words(point)) else {
            return Err(line.is_not("a control point, `x y z radius`"));
        };
        if !in_curve {
            found.starts.push(found.points.len());
        }
        in_curve = true;
        found.points.push([x, y, z]);
        found.radii.push(radius);
        options.check_points(found.points.len() as u64)?;
    }
    found.starts.push(found.points.len());
    Ok(found)
}

fn read(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let placement = options.placement(&INFO);
    let found = control_points(bytes, options)?;
    let curves = || found.starts.windows(2).map(|pair| pair[0]..pair[1]);
    let least = curves().map(|curve| curve.len()).min().unwrap_or(0);
    let mut notes = Vec::new();
    let basis = found.basis.unwrap_or_else(|| {
        let (basis, what) = match least < 4 {
            true => (
                CurveBasis::Linear,
                "read as polylines (linearcurve), for a curve has fewer than four points",
            ),
            false => (
                CurveBasis::BSpline,
                "the file does not say which shape it is for: read as B-splines (bsplinecurve); \
                 `# linearcurve` on its first line makes them polylines",
            ),
        };
        notes.push(Note::new(NoteKind::Assumed, what));
        basis
    });
    let mut list = StrandList::new(placement, options);
    let mut thickness = Vec::new();
    for (ix, curve) in curves().enumerate() {
        let (points, radii) = (&found.points[curve.clone()], &found.radii[curve]);
        if basis == CurveBasis::Linear {
            if list.push(ix, points.iter().copied())? {
                thickness.extend(radii.iter().map(|radius| 2.0 * radius));
            }
            continue;
        }
        let samples = curves::samples(basis, Wrap::Open, points.len(), options.samples_per_segment);
        let samples = samples.map_err(|range| {
            let key = format!("number of control points of B-spline {ix}");
            Error::value(key, points.len(), range)
        })?;
        if list.push(ix, samples.iter().map(|sample| sample.point(points)))? {
            thickness.extend(
                samples
                    .iter()
                    .map(|sample| 2.0 * sample.vertex(radii, 1, 0)),
            );
        }
    }
    let mut groom = list.finish(INFO.name, &mut notes)?;
    groom.attributes = vec![attribute("thickness", Domain::Point, 1, thickness)];
    let diameter = diameter(&groom, placement.cm_per_unit);
    groom.attributes.extend(diameter);
    Ok(Import::new(groom, notes))
}

fn write(groom: &Groom, options: &ExportOptions) -> Result<Export> {
    let placement = options.placement(groom, &INFO);
    let widths = Widths::of(groom, placement.cm_per_unit)?;
    let mut text = String::with_capacity(48 * groom.points.len());
    for strand in 0..groom.n_strands() {
        if strand > 0 {
            text.push('\n');
        }
        for point in groom.strand(strand) {
            let [x, y, z] = placement.to_file(groom.points[point]);
            let radius = 0.5 * widths.at(strand, point);
            // Writing to a string does not fail.
            let _ = write!(text, "{x} {y} {z} {radius}");
            text.push_str(match point {
                0 => " # linearcurve\n",
                _ => "\n",
            });
        }
    }
    let mut export = Export::new(text.into_bytes());
    export.notes.extend(widths.note());
    Ok(export)
}
