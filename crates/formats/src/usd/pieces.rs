//! The curves of one prim as polylines.

use std::collections::HashMap;

use super::stage::Stage;
use super::time::Moment;
use super::transform::{self, IDENTITY};
use crate::curves::{Counts, Interpolation, Sample, Wrap, n_segments, n_varying, samples};
use crate::error::{Error, Result};
use crate::groom::{Domain, MAX_COORDINATE_CM};
use crate::groom_format::{CurveBasis, ImportOptions, Placement};

/// A curve that is kept: where its values start, and how many there are.
#[derive(Clone, Copy, Debug)]
struct Curve {
    /// Index among all curves of the prim.
    ix: usize,
    first_cv: usize,
    n_cvs: usize,
    first_varying: usize,
    n_varying: usize,
}

/// How the points of a prim make polylines.
#[derive(Debug)]
pub(super) struct Shape {
    /// Kind of curves.
    pub basis: CurveBasis,
    /// What happens at their ends.
    pub wrap: Wrap,
    curves: Vec<Curve>,
    counts: Counts,
    /// Of each number of control points that occurs; empty of linear curves, whose points are these.
    samples: HashMap<usize, Vec<Sample>>,
    /// Points of the polylines.
    pub n_points: u64,
    /// Curves that have too few points or a number that their basis does not allow.
    pub n_left_out: usize,
}

/// The polylines of a prim.
#[derive(Debug)]
pub(super) struct Piece {
    /// Path of the prim.
    pub path: String,
    /// Points in the groom's unit and axes.
    pub points: Vec<[f32; 3]>,
    /// Points of each strand.
    pub lengths: Vec<u32>,
    /// How much longer the prim's transforms make lengths, and centimetres per unit: what widths
    /// are multiplied with.
    pub scale: f64,
    /// Named values.
    pub values: Vec<Values>,
}

/// Values of a piece; becomes an attribute.
#[derive(Clone, Debug)]
pub(super) struct Values {
    pub name: String,
    pub domain: Domain,
    pub components: usize,
    pub data: Vec<f32>,
}

/// Why a prim is skipped, in words that can follow `is skipped: `.
pub(super) type Skipped = String;

/// The token called `name` of the prim `ix`, one of `words`, or the first of them.
fn token<T: Copy>(stage: &Stage, ix: usize, name: &str, words: &[(&str, T)]) -> Result<T> {
    let property = stage.prim(ix).properties.get(name);
    let value = property.and_then(|property| property.default.as_ref());
    let value = value.filter(|value| !stage.layer.is_blocked(value));
    let word = match value {
        Some(value) => stage.layer.strings(value)?.into_iter().next(),
        None => None,
    };
    let Some(word) = word else {
        return Ok(words[0].1);
    };
    match words.iter().find(|(known, _)| *known == word) {
        Some(&(_, value)) => Ok(value),
        None => {
            let known: Vec<&str> = words.iter().map(|(known, _)| *known).collect();
            let key = format!("{name} of {}", stage.path(ix));
            Err(Error::value(
                key,
                word,
                format!("one of {}", known.join(", ")),
            ))
        }
    }
}

/// Numbers of control points, which must not change over time; `None` where there are none.
fn vertex_counts(stage: &Stage, ix: usize, moment: Moment) -> Result<Option<Vec<f64>>> {
    let Some(property) = stage.prim(ix).properties.get("curveVertexCounts") else {
        return Ok(None);
    };
    let Some(counts) = moment.held(stage.layer, property)? else {
        return Ok(None);
    };
    for (_, value) in &property.samples {
        let other = stage.layer.numbers::<f64>(value)?;
        if property.samples.len() > 1 && other.is_some_and(|other| other.data != counts.data) {
            let key = format!("curveVertexCounts of {}", stage.path(ix));
            let range = "the same at all times: hair whose strands change cannot be imported";
            return Err(Error::value(key, "changing over time", range));
        }
    }
    Ok((!counts.data.is_empty()).then_some(counts.data))
}

impl Shape {
    /// That of the prim `ix`, and its points.
    pub fn of(
        stage: &Stage,
        ix: usize,
        moment: Moment,
        options: &ImportOptions,
    ) -> Result<std::result::Result<(Shape, Vec<f32>), Skipped>> {
        let is_cubic = token(stage, ix, "type", &[("cubic", true), ("linear", false)])?;
        let basis = [
            ("bezier", CurveBasis::Bezier),
            ("bspline", CurveBasis::BSpline),
            ("catmullRom", CurveBasis::CatmullRom),
        ];
        let basis = match is_cubic {
            true => token(stage, ix, "basis", &basis)?,
            false => CurveBasis::Linear,
        };
        let wraps = [
            ("nonperiodic", Wrap::Open),
            ("pinned", Wrap::Pinned),
            ("periodic", Wrap::Periodic),
        ];
        let wrap = token(stage, ix, "wrap", &wraps)?;
        let Some(counts) = vertex_counts(stage, ix, moment)? else {
            return Ok(Err("it has no curveVertexCounts".to_owned()));
        };
        let points = match stage.prim(ix).properties.get("points") {
            Some(property) => moment.numbers::<f32>(stage.layer, property)?,
            None => None,
        };
        let Some(points) = points.filter(|points| !points.data.is_empty()) else {
            return Ok(Err("it has no points".to_owned()));
        };
        let n_points = points.data.len() / points.width;
        let sum: f64 = counts.iter().sum();
        let are_counts = counts.iter().all(|n| *n >= 0.0 && n.fract() == 0.0);
        if points.width != 3 || !are_counts || sum != n_points as f64 {
            return Err(Error::value(
                format!("points of {}", stage.path(ix)),
                format!("{n_points} of {} numbers", points.width),
                format!("{sum} of 3, as curveVertexCounts says"),
            ));
        }
        let mut shape = Shape {
            basis,
            wrap,
            curves: Vec::with_capacity(counts.len()),
            counts: Counts {
                uniform: counts.len(),
                varying: 0,
                vertex: n_points,
            },
            samples: HashMap::new(),
            n_points: 0,
            n_left_out: 0,
        };
        let mut first_cv = 0;
        for (ix, &n_cvs) in counts.iter().enumerate() {
            let n_cvs = n_cvs as usize;
            shape.add_curve(ix, first_cv, n_cvs, options);
            first_cv += n_cvs;
        }
        Ok(Ok((shape, points.data)))
    }

    /// Are the points of the polylines the control points?
    fn is_plain(&self) -> bool {
        self.basis == CurveBasis::Linear && self.wrap != Wrap::Periodic
    }

    fn add_curve(&mut self, ix: usize, first_cv: usize, n_cvs: usize, options: &ImportOptions) {
        let (Ok(n), Ok(n_ends)) = (
            n_segments(self.basis, self.wrap, n_cvs),
            n_varying(self.basis, self.wrap, n_cvs),
        ) else {
            self.n_left_out += 1;
            return;
        };
        self.curves.push(Curve {
            ix,
            first_cv,
            n_cvs,
            first_varying: self.counts.varying,
            n_varying: n_ends,
        });
        self.counts.varying += n_ends;
        let pieces = match self.basis {
            CurveBasis::Linear => 1,
            _ => options.samples_per_segment.max(1),
        };
        self.n_points += n as u64 * u64::from(pieces) + 1;
    }

    /// Works out how curves are sampled, once their number is known not to be too large.
    pub fn prepare(&mut self, options: &ImportOptions) {
        if self.is_plain() {
            return;
        }
        for curve in &self.curves {
            let n = curve.n_cvs;
            if let std::collections::hash_map::Entry::Vacant(place) = self.samples.entry(n) {
                let per_segment = options.samples_per_segment;
                let sampled = samples(self.basis, self.wrap, n, per_segment);
                place.insert(sampled.unwrap_or_default());
            }
        }
    }

    /// The polylines of control points `cvs`.
    pub fn piece(
        &self,
        stage: &Stage,
        ix: usize,
        moment: Moment,
        cvs: &[f32],
        placement: Placement,
    ) -> Result<Piece> {
        let path = stage.path(ix);
        // Any number of prims can have a long name above them.
        stage.layer.spend_on(1, path.len())?;
        let matrix = stage.world_from(ix, moment)?;
        let to_groom = |point: [f32; 3]| match matrix == IDENTITY {
            true => placement.to_groom(point),
            false => {
                let world = transform::apply(&matrix, point.map(f64::from));
                let cm = world.map(|x| (x * placement.cm_per_unit) as f32);
                placement.up.file_to_y_up(cm)
            }
        };
        let (cvs, _) = cvs.as_chunks::<3>();
        let mut piece = Piece {
            points: Vec::with_capacity(self.n_points as usize),
            lengths: Vec::with_capacity(self.curves.len()),
            scale: transform::scale(&matrix) * placement.cm_per_unit,
            values: Vec::new(),
            path,
        };
        let mut moved = Vec::new();
        for curve in &self.curves {
            moved.clear();
            for (at, &cv) in cvs[curve.first_cv..][..curve.n_cvs].iter().enumerate() {
                let point = to_groom(cv);
                let range = -MAX_COORDINATE_CM..=MAX_COORDINATE_CM;
                if !point.iter().all(|x| range.contains(x)) {
                    return Err(Error::value(
                        format!("point {at} of curve {} of {}", curve.ix, piece.path),
                        format!("{cv:?}"),
                        format!("finite and within +-{MAX_COORDINATE_CM} cm of the origin"),
                    ));
                }
                moved.push(point);
            }
            let before = piece.points.len();
            match self.samples.get(&curve.n_cvs) {
                Some(samples) => {
                    let points = samples.iter().map(|sample| sample.point(&moved));
                    piece.points.extend(points);
                }
                None => piece.points.extend_from_slice(&moved),
            }
            piece.lengths.push((piece.points.len() - before) as u32);
        }
        Ok(piece)
    }

    /// What `n` values labelled `label` are for.
    pub fn interpolation(&self, n: usize, label: Option<Interpolation>) -> Option<Interpolation> {
        Interpolation::of(n, &self.counts, label)
    }

    /// Values of the strands or points of the polylines, from those of the curves. Integers are
    /// not interpolated: the nearest control point's are taken.
    pub fn values(
        &self,
        data: &[f32],
        components: usize,
        interpolation: Interpolation,
        is_integer: bool,
    ) -> (Domain, Vec<f32>) {
        let mut values = Vec::new();
        match interpolation {
            Interpolation::Constant => return (Domain::Groom, data.to_vec()),
            Interpolation::Uniform => {
                values.reserve(self.curves.len() * components);
                for curve in &self.curves {
                    values.extend_from_slice(&data[curve.ix * components..][..components]);
                }
                return (Domain::Strand, values);
            }
            Interpolation::Varying | Interpolation::Vertex => {}
        }
        let is_vertex = interpolation == Interpolation::Vertex;
        values.reserve(self.n_points as usize * components);
        for curve in &self.curves {
            let (first, n) = match is_vertex {
                true => (curve.first_cv, curve.n_cvs),
                false => (curve.first_varying, curve.n_varying),
            };
            let data = &data[first * components..][..n * components];
            let Some(samples) = self.samples.get(&curve.n_cvs) else {
                values.extend_from_slice(data);
                continue;
            };
            for sample in samples {
                for component in 0..components {
                    values.push(match (is_integer, is_vertex) {
                        (true, _) => data[nearest(sample, is_vertex) * components + component],
                        (_, true) => sample.vertex(data, components, component),
                        (_, false) => sample.varying(data, components, component),
                    });
                }
            }
        }
        (Domain::Point, values)
    }
}

/// The control point or segment end that has most part in `sample`.
fn nearest(sample: &Sample, is_vertex: bool) -> usize {
    if !is_vertex {
        return sample.ends[usize::from(sample.t > 0.5)] as usize;
    }
    let weight = |ix: &usize| sample.weights[*ix];
    let best = (0..4usize).max_by(|a, b| weight(a).total_cmp(&weight(b)));
    sample.cvs[best.unwrap_or(0)] as usize
}
