//! Curves of pbrt files as strands.

use super::layout::{INFO, thirds};
use super::tokens::{Token, Tokens};
use crate::curves::{self, Wrap};
use crate::error::{Error, Result};
use crate::groom::Domain;
use crate::groom_format::{CurveBasis, Import, ImportOptions, Note, NoteKind};
use crate::hair::diameter;
use crate::strand_list::{StrandList, attribute};
use crate::text_lines::number;

/// Parameters of a curve.
#[derive(Debug)]
struct Curve {
    points: Vec<[f32; 3]>,
    basis: CurveBasis,
    degree: f32,
    width: Option<f32>,
    width_0: Option<f32>,
    width_1: Option<f32>,
}

pub(super) fn read(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let placement = options.placement(&INFO);
    let mut list = StrandList::new(placement, options);
    let mut thickness = Vec::new();
    let mut tokens = Tokens::new(bytes);
    let (mut n_curves, mut n_shapes, mut n_transforms, mut n_included) = (0, 0, 0, 0);
    while let Some((offset, token)) = tokens.next()? {
        match token {
            Token::Word(b"Shape") => {
                if !matches!(tokens.next()?, Some((_, Token::Text(b"curve")))) {
                    n_shapes += 1;
                    continue;
                }
                let curve = Curve::read(&mut tokens, offset, options)?;
                let (points, widths) = curve.polyline(n_curves, options)?;
                if list.push(n_curves, points.into_iter())? {
                    thickness.extend(widths);
                }
                n_curves += 1;
            }
            Token::Word(
                b"Translate" | b"Rotate" | b"Scale" | b"Transform" | b"ConcatTransform"
                | b"CoordSysTransform" | b"ObjectInstance",
            ) => n_transforms += 1,
            Token::Word(b"Include" | b"Import") => n_included += 1,
            _ => {}
        }
    }
    let mut notes = Vec::new();
    for (n, what) in [
        (n_transforms, "transforms are not applied"),
        (n_shapes, "other shapes are left out"),
        (n_included, "included files are not read"),
    ] {
        if n > 0 {
            notes.push(Note::new(NoteKind::Dropped, format!("{n} {what}")));
        }
    }
    let mut groom = list.finish(INFO.name, &mut notes)?;
    groom.attributes = vec![attribute("thickness", Domain::Point, 1, thickness)];
    let diameter = diameter(&groom, placement.cm_per_unit);
    groom.attributes.extend(diameter);
    Ok(Import::new(groom, notes))
}

impl Curve {
    /// The parameters that follow; the statement starts at `offset`.
    fn read(tokens: &mut Tokens<'_>, offset: u64, options: &ImportOptions) -> Result<Curve> {
        let mut curve = Curve {
            points: Vec::new(),
            basis: CurveBasis::Bezier,
            degree: 3.0,
            width: None,
            width_0: None,
            width_1: None,
        };
        while let Some((at, Token::Text(declaration))) = tokens.peek()? {
            tokens.next()?;
            let mut words = declaration
                .split(u8::is_ascii_whitespace)
                .filter(|word| !word.is_empty());
            let name = words.nth(1).unwrap_or_default();
            let mut numbers = Vec::new();
            let mut text = None;
            let is_ours = matches!(name, b"P" | b"degree" | b"width" | b"width0" | b"width1");
            values(tokens, |at, token| {
                match token {
                    Token::Text(word) => text = Some(word),
                    Token::Word(word) if is_ours => {
                        let value = number(word);
                        let shown = String::from_utf8_lossy(&word[..word.len().min(40)]);
                        let what = || Error::invalid(format!("{shown:?} is no number"), at);
                        numbers.push(value.ok_or_else(what)?);
                        options.check_points(numbers.len() as u64 / 3)?;
                    }
                    _ => {}
                }
                Ok(())
            })?;
            let first = numbers.first().copied();
            match name {
                b"P" if numbers.len() % 3 == 0 => {
                    let points = numbers.chunks_exact(3);
                    curve.points = points.map(|point| [point[0], point[1], point[2]]).collect();
                }
                b"P" => {
                    let what = format!("P has {} numbers, not three a point", numbers.len());
                    return Err(Error::invalid(what, at));
                }
                b"degree" => curve.degree = first.unwrap_or(curve.degree),
                b"width" => curve.width = first,
                b"width0" => curve.width_0 = first,
                b"width1" => curve.width_1 = first,
                b"basis" => {
                    curve.basis = match text {
                        Some(b"bezier") => CurveBasis::Bezier,
                        Some(b"bspline") => CurveBasis::BSpline,
                        _ => {
                            let what = "basis is neither bezier nor bspline";
                            return Err(Error::invalid(what, at));
                        }
                    };
                }
                _ => {}
            }
        }
        match curve.points.is_empty() {
            true => Err(Error::invalid("a curve has no points P", offset)),
            false => Ok(curve),
        }
    }

    /// The points of the curve's polyline, and the width at each; the curve is the `ix`-th.
    fn polyline(self, ix: usize, options: &ImportOptions) -> Result<(Vec<[f32; 3]>, Vec<f32>)> {
        let refused =
            |found: String, range: &str| Err(Error::value(format!("curve {ix}"), found, range));
        let n = self.points.len();
        let (basis, points) = match (self.degree, self.basis) {
            (3.0, basis) => (basis, self.points),
            (2.0, CurveBasis::Bezier) if n >= 3 && n % 2 == 1 => {
                let quadratics = self.points.windows(3).step_by(2);
                (
                    CurveBasis::Bezier,
                    raised(quadratics.map(|p| [p[0], p[1], p[2]])),
                )
            }
            (2.0, CurveBasis::BSpline) if n >= 3 => {
                // Pieces of a quadratic B-spline end midway between its control points.
                let pieces = self.points.windows(3);
                let pieces = pieces.map(|p| [middle(p[0], p[1]), p[1], middle(p[1], p[2])]);
                (CurveBasis::Bezier, raised(pieces))
            }
            (2.0, _) => {
                let range = "1 + 2 n points of a Bezier curve, 3 or more of a B-spline";
                return refused(format!("{n} points of degree 2"), range);
            }
            (degree, _) => return refused(format!("degree {degree}"), "degree 2 or 3"),
        };
        let per_segment = options.samples_per_segment;
        let samples = curves::samples(basis, Wrap::Open, points.len(), per_segment);
        let samples = match samples {
            Ok(samples) => samples,
            Err(range) => return refused(format!("{} points", points.len()), range),
        };
        let is_straight = |segment: usize| {
            basis == CurveBasis::Bezier && {
                let p = &points[3 * segment..3 * segment + 4];
                thirds(p[0], p[3]) == [p[1], p[2]]
            }
        };
        let width = self.width.unwrap_or(1.0);
        let (width_0, width_1) = (self.width_0.unwrap_or(width), self.width_1.unwrap_or(width));
        let n_segments = (samples.len() - 1) / per_segment.max(1) as usize;
        let mut polyline = (Vec::new(), Vec::new());
        for sample in &samples {
            let segment = sample.ends[0] as usize;
            let is_end = sample.t == 0.0 || sample.t == 1.0;
            if is_end || !is_straight(segment) {
                let along = (segment as f32 + sample.t) / n_segments as f32;
                polyline.0.push(sample.point(&points));
                polyline.1.push(width_0 * (1.0 - along) + width_1 * along);
            }
        }
        Ok(polyline)
    }
}

/// The values of a parameter: one, or several between brackets.
fn values<'a>(
    tokens: &mut Tokens<'a>,
    mut act: impl FnMut(u64, Token<'a>) -> Result<()>,
) -> Result<()> {
    let end = tokens.offset();
    let ends = || Error::invalid("file ends within a parameter", end);
    let (at, first) = tokens.next()?.ok_or_else(ends)?;
    if first != Token::Open {
        return act(at, first);
    }
    loop {
        match tokens.next()?.ok_or_else(ends)? {
            (_, Token::Close) => return Ok(()),
            (at, token) => act(at, token)?,
        }
    }
}

fn middle(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|axis: usize| ((f64::from(a[axis]) + f64::from(b[axis])) / 2.0) as f32)
}

/// A chain of quadratic Bezier curves as one of cubic ones, the same curve.
fn raised(quadratics: impl Iterator<Item = [[f32; 3]; 3]>) -> Vec<[f32; 3]> {
    let mut points = Vec::new();
    for [start, inner, end] in quadratics {
        // Two thirds of the way from each end to the inner point.
        let towards = |from: [f32; 3]| {
            [0, 1, 2].map(|axis: usize| {
                ((f64::from(from[axis]) + 2.0 * f64::from(inner[axis])) / 3.0) as f32
            })
        };
        if points.is_empty() {
            points.push(start);
        }
        points.extend([towards(start), towards(end), end]);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polyline(curve: Curve) -> (Vec<[f32; 3]>, Vec<f32>) {
        let options = ImportOptions::default().with_samples_per_segment(2);
        curve.polyline(0, &options).unwrap()
    }

    fn curve(points: &[[f32; 3]], basis: CurveBasis, degree: f32) -> Curve {
        Curve {
            points: points.to_vec(),
            basis,
            degree,
            width: None,
            width_0: Some(0.4),
            width_1: Some(0.2),
        }
    }

    const POINTS: [[f32; 3]; 5] = [
        [0.0; 3],
        [2.0, 4.0, 0.0],
        [4.0, 0.0, 0.0],
        [6.0, -4.0, 0.0],
        [8.0, 0.0, 0.0],
    ];

    #[test]
    fn curves_of_degree_two_pass_where_they_should() {
        let (points, widths) = polyline(curve(&POINTS, CurveBasis::Bezier, 2.0));
        let expected = [
            [0.0, 0.0, 0.0],
            [2.0, 2.0, 0.0],
            [4.0, 0.0, 0.0],
            [6.0, -2.0, 0.0],
            [8.0, 0.0, 0.0],
        ];
        for (found, expected) in points.iter().zip(expected) {
            let far = (0..3).map(|axis| (found[axis] - expected[axis]).abs());
            assert!(far.fold(0.0, f32::max) < 1e-6, "{points:?}");
        }
        assert_eq!((widths[0], widths[4]), (0.4, 0.2));
        assert!((widths[2] - 0.3).abs() < 1e-7);

        // (p0 + 6 p1 + p2) / 8 in the middle of a B-spline's first piece.
        let (points, _) = polyline(curve(&POINTS, CurveBasis::BSpline, 2.0));
        // Its second piece is straight.
        assert_eq!(points.len(), 6);
        assert_eq!(points[0], [1.0, 2.0, 0.0]);
        let far = [points[1][0] - 2.0, points[1][1] - 3.0];
        assert!(far.iter().all(|x| x.abs() < 1e-6), "{points:?}");
        assert_eq!(points[5], [7.0, -2.0, 0.0]);
    }

    #[test]
    fn straight_segments_are_one_piece() {
        let [a, b] = [[0.1, 0.2, 0.3], [0.7, -0.3, 0.9]];
        let [inner_0, inner_1] = thirds(a, b);
        let bent = [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 1.0, 0.0]];
        let points = [&[a, inner_0, inner_1, b], &bent[..]].concat();
        let (points, _) = polyline(curve(&points, CurveBasis::Bezier, 3.0));
        assert_eq!(points.len(), 4);
        assert_eq!((points[0], points[1], points[3]), (a, b, bent[2]));
    }
}
