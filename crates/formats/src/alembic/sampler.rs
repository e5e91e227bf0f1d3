//! Samples of curves, one curve after another.

use super::archive::Archive;
use super::knots::{self, KnotCount};
use super::shapes::{Shape, refuse};
use super::tree::CurvesObject;
use crate::curves::{self, Counts, Sample, Wrap};
use crate::error::Result;
use crate::groom_format::CurveBasis;

/// The points of a polyline.
#[derive(Clone, Copy)]
pub(super) enum Polyline<'s> {
    /// The control points.
    Itself,
    /// Sums of control points.
    Samples(&'s [Sample]),
}

/// Finds the samples of one curve after another.
pub(super) struct Sampler<'s> {
    shapes: &'s [Shape],
    pub lengths: &'s [u32],
    per_segment: u32,
    /// Knots of all curves, and how many each has.
    knots: Option<(Vec<f32>, KnotCount)>,
    first_knot: usize,
    /// Those of the curve before, for the next may be like it.
    last: Vec<Sample>,
    last_of: Option<(CurveBasis, usize)>,
}

impl<'s> Sampler<'s> {
    /// For the curves of `object` at `time`, `per_segment` points a cubic segment.
    pub fn new(
        archive: &Archive<'_>,
        object: &CurvesObject<'_>,
        shapes: &'s [Shape],
        lengths: &'s [u32],
        time: f64,
        per_segment: u32,
    ) -> Result<Self> {
        let path = &*object.path;
        let mut sampler = Sampler {
            shapes,
            lengths,
            per_segment,
            knots: None,
            first_knot: 0,
            last: Vec::new(),
            last_of: None,
        };
        let Some(property) = object.geom.get(".knots") else {
            return Ok(sampler);
        };
        let values = archive.values_at(property, time, path)?;
        // Knots say nothing about lines, and only B-splines are made with them.
        let is_spline = |shape: &Shape| shape.basis == CurveBasis::BSpline;
        if values.len() == 0 || !shapes.iter().all(is_spline) {
            return Ok(sampler);
        }
        let Some(count) = KnotCount::of(values.len(), lengths) else {
            let (n, curves) = (values.len(), lengths.len());
            let total: u64 = lengths.iter().map(|&n| u64::from(n)).sum();
            let range = format!(
                "{} or {}, for {curves} cubic curves of {total} points",
                total + 4 * curves as u64,
                total + 2 * curves as u64
            );
            return Err(refuse(path, "number of knots", n, &range));
        };
        let knots: Vec<f32> = values.doubles().map(|x| x as f32).collect();
        archive.ogawa.spend(4 * knots.len() as u64, values.offset)?;
        let mut first = 0;
        for (ix, &n_cvs) in lengths.iter().enumerate() {
            let n = count.of_curve(n_cvs as usize);
            let own = &knots[first..first + n];
            first += n;
            let rises = own.windows(2).all(|pair| pair[0] <= pair[1]);
            let inner = own.get(if count == KnotCount::All { 3 } else { 2 }..);
            let inner = inner.and_then(|own| own.get(..(n_cvs as usize).saturating_sub(2)));
            let spans = inner.is_some_and(|own| own.first() < own.last());
            if n_cvs >= 4 && !(rises && spans && own.iter().all(|knot| knot.is_finite())) {
                let key = format!("knots of strand {ix}");
                return Err(refuse(path, &key, "not so", "finite and rising"));
            }
        }
        let uniform = knots::is_uniform(&knots[..count.of_curve(lengths[0] as usize)]);
        let same = lengths.iter().all(|n| *n == lengths[0]);
        let is_periodic = shapes[0].wrap == Wrap::Periodic;
        // The usual case is quicker without.
        let all_same = same
            && knots
                .chunks(count.of_curve(lengths[0] as usize))
                .all(knots::is_uniform);
        if !(uniform && all_same) || is_periodic {
            sampler.knots = Some((knots, count));
        }
        Ok(sampler)
    }

    fn shape(&self, curve: usize) -> Shape {
        self.shapes[if self.shapes.len() == 1 { 0 } else { curve }]
    }

    /// Number of segments of a curve; `None` if it has too few points.
    fn n_segments(&self, curve: usize) -> Option<usize> {
        let Shape { basis, wrap } = self.shape(curve);
        let n_cvs = self.lengths[curve] as usize;
        match self.knots {
            Some(_) => n_cvs.checked_sub(3).filter(|&n| n > 0),
            None => curves::n_segments(basis, wrap, n_cvs).ok(),
        }
    }

    /// Number of segment ends of a curve, of which `varying` values are; of one that is not drawn,
    /// of points.
    pub fn n_varying(&self, curve: usize) -> usize {
        let Shape { basis, wrap } = self.shape(curve);
        let n_cvs = self.lengths[curve] as usize;
        let n = match self.knots {
            Some(_) => self.n_segments(curve).map(|n| n + 1),
            None => curves::n_varying(basis, wrap, n_cvs).ok(),
        };
        n.unwrap_or(n_cvs)
    }

    /// How many values there are of what.
    pub fn counts(&self) -> Counts {
        Counts {
            uniform: self.lengths.len(),
            varying: (0..self.lengths.len()).map(|ix| self.n_varying(ix)).sum(),
            vertex: self.lengths.iter().map(|&n| n as usize).sum(),
        }
    }

    /// Most points that the polylines have.
    pub fn n_points(&self) -> u64 {
        let points = (0..self.lengths.len()).filter_map(|ix| {
            let per_segment = match self.shape(ix).basis {
                CurveBasis::Linear => 1,
                _ => u64::from(self.per_segment),
            };
            Some(self.n_segments(ix)? as u64 * per_segment + 1)
        });
        points.sum()
    }

    /// The samples of `curve`, asked for one after another; `None` if it has too few points.
    pub fn samples(&mut self, curve: usize) -> Option<Polyline<'_>> {
        let Shape { basis, wrap } = self.shape(curve);
        let n_cvs = self.lengths[curve] as usize;
        let knots = self.knots.as_ref().map(|(knots, count)| {
            let first = self.first_knot;
            let n = count.of_curve(n_cvs);
            self.first_knot += n;
            (&knots[first..first + n], *count)
        });
        self.n_segments(curve)?;
        if (basis, wrap) == (CurveBasis::Linear, Wrap::Open) {
            return Some(Polyline::Itself);
        }
        if let Some((knots, count)) = knots {
            self.last = knots::samples(knots, count, n_cvs, self.per_segment).ok()?;
        } else if self.last_of != Some((basis, n_cvs)) {
            self.last = curves::samples(basis, wrap, n_cvs, self.per_segment).ok()?;
            self.last_of = Some((basis, n_cvs));
        }
        Some(Polyline::Samples(&self.last))
    }
}
