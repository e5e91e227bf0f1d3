//! Curves of other programs as polylines: one rule of sampling for points and attributes.
//!
//! A curve is sampled `samples_per_segment` times in each of its cubic segments, ends included.
//! Every sample is a sum of at most four control points, so values per control point (USD's
//! `vertex`) follow the same weights, and values per segment end (`varying`) are interpolated
//! linearly within the segment.

use crate::groom_format::CurveBasis;

/// What happens at the ends of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wrap {
    /// The segments that the control points have. B-splines and Catmull-Rom splines do not reach
    /// their outer control points.
    Open,
    /// One more segment at each end of a B-spline or Catmull-Rom spline, so that it starts and ends
    /// in its outer control points: the points beyond are reflections, 2 p_0 - p_1.
    Pinned,
    /// The end joins the start.
    Periodic,
}

/// A point of a polyline, as a sum of control points of its curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// Control points of the curve; those beyond the fourth part have a weight of 0.
    pub cvs: [u32; 4],
    /// Their weights; sum 1.
    pub weights: [f32; 4],
    /// Segment ends before and behind, of which there is one value each where values are
    /// `varying`.
    pub ends: [u32; 2],
    /// How far between them, 0..=1.
    pub t: f32,
}

/// What an array of an interchange file has one value for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Interpolation {
    /// One for all curves.
    Constant,
    /// One per curve.
    Uniform,
    /// One per end of a segment.
    Varying,
    /// One per control point.
    Vertex,
}

/// How many values arrays of each interpolation have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Counts {
    /// Number of curves.
    pub uniform: usize,
    /// Number of segment ends of all curves.
    pub varying: usize,
    /// Number of control points of all curves.
    pub vertex: usize,
}

impl Interpolation {
    /// The interpolation of an array of `n` values: the one that is written in the file if the
    /// number fits, else the first whose number does. Exporters label arrays wrongly.
    pub fn of(n: usize, counts: &Counts, label: Option<Interpolation>) -> Option<Interpolation> {
        let fits = |interpolation: &Interpolation| n == counts.of(*interpolation);
        let all = [
            Interpolation::Vertex,
            Interpolation::Varying,
            Interpolation::Uniform,
            Interpolation::Constant,
        ];
        label.filter(fits).or_else(|| all.into_iter().find(fits))
    }
}

impl Counts {
    fn of(&self, interpolation: Interpolation) -> usize {
        match interpolation {
            Interpolation::Constant => 1,
            Interpolation::Uniform => self.uniform,
            Interpolation::Varying => self.varying,
            Interpolation::Vertex => self.vertex,
        }
    }
}

/// How many segments a curve of `n_cvs` control points has.
///
/// # Errors
/// The numbers of control points that such a curve can have.
pub(crate) fn n_segments(
    basis: CurveBasis,
    wrap: Wrap,
    n_cvs: usize,
) -> Result<usize, &'static str> {
    use CurveBasis::{BSpline, Bezier, CatmullRom, Linear};
    match (basis, wrap) {
        (Linear, Wrap::Periodic) if n_cvs >= 3 => Ok(n_cvs),
        (Linear, Wrap::Periodic) => Err("at least 3"),
        (Linear, _) if n_cvs >= 2 => Ok(n_cvs - 1),
        (Linear, _) => Err("at least 2"),
        (Bezier, Wrap::Periodic) if n_cvs >= 3 && n_cvs.is_multiple_of(3) => Ok(n_cvs / 3),
        (Bezier, Wrap::Periodic) => Err("a multiple of 3"),
        (Bezier, _) if n_cvs >= 4 && n_cvs % 3 == 1 => Ok(n_cvs / 3),
        (Bezier, _) => Err("1 + 3 n: 4, 7, 10, ..."),
        (BSpline | CatmullRom, Wrap::Open) if n_cvs >= 4 => Ok(n_cvs - 3),
        (BSpline | CatmullRom, Wrap::Open) => Err("at least 4"),
        (BSpline | CatmullRom, Wrap::Pinned) if n_cvs >= 2 => Ok(n_cvs - 1),
        (BSpline | CatmullRom, Wrap::Pinned) => Err("at least 2"),
        (BSpline | CatmullRom, Wrap::Periodic) if n_cvs >= 3 => Ok(n_cvs),
        (BSpline | CatmullRom, Wrap::Periodic) => Err("at least 3"),
    }
}

/// How many `varying` values such a curve has.
///
/// # Errors
/// As [`n_segments`].
pub(crate) fn n_varying(
    basis: CurveBasis,
    wrap: Wrap,
    n_cvs: usize,
) -> Result<usize, &'static str> {
    let n = n_segments(basis, wrap, n_cvs)?;
    Ok(n + usize::from(wrap != Wrap::Periodic))
}

/// The points of the polyline that is drawn for a curve of `n_cvs` control points, `n_segments *
/// samples_per_segment + 1` of them. Linear curves, whatever `samples_per_segment`, have their
/// control points.
///
/// # Errors
/// As [`n_segments`].
pub(crate) fn samples(
    basis: CurveBasis,
    wrap: Wrap,
    n_cvs: usize,
    samples_per_segment: u32,
) -> Result<Vec<Sample>, &'static str> {
    let n = n_segments(basis, wrap, n_cvs)?;
    let per_segment = match basis {
        CurveBasis::Linear => 1,
        _ => samples_per_segment.max(1),
    };
    let n_ends = n_varying(basis, wrap, n_cvs)?;
    let mut samples = Vec::with_capacity(n * per_segment as usize + 1);
    for segment in 0..n {
        for step in 0..per_segment {
            let t = f64::from(step) / f64::from(per_segment);
            samples.push(sample(basis, wrap, n_cvs, n_ends, segment, t));
        }
    }
    samples.push(sample(basis, wrap, n_cvs, n_ends, n - 1, 1.0));
    Ok(samples)
}

fn sample(
    basis: CurveBasis,
    wrap: Wrap,
    n_cvs: usize,
    n_ends: usize,
    segment: usize,
    t: f64,
) -> Sample {
    // Index of the first control point of the segment, -1 where it lies before the first.
    let first = match (basis, wrap) {
        (CurveBasis::Linear, _) => segment as isize,
        (CurveBasis::Bezier, _) => 3 * segment as isize,
        (_, Wrap::Open) => segment as isize,
        (_, Wrap::Pinned | Wrap::Periodic) => segment as isize - 1,
    };
    let mut sum = Sum::default();
    for (ix, weight) in (first..).zip(weights(basis, t)) {
        if weight == 0.0 {
            continue;
        }
        let n = n_cvs as isize;
        match wrap {
            Wrap::Periodic => sum.add(ix.rem_euclid(n), weight),
            _ if ix < 0 => {
                sum.add(0, 2.0 * weight);
                sum.add(1, -weight);
            }
            _ if ix >= n => {
                sum.add(n - 1, 2.0 * weight);
                sum.add(n - 2, -weight);
            }
            _ => sum.add(ix, weight),
        }
    }
    Sample {
        cvs: sum.cvs,
        weights: sum.weights.map(|weight| weight as f32),
        ends: [segment as u32, ((segment + 1) % n_ends) as u32],
        t: t as f32,
    }
}

/// Weights of the control points of a segment at `t`, 0..=1; of a linear one the first two.
fn weights(basis: CurveBasis, t: f64) -> [f64; 4] {
    let (s, t2, t3) = (1.0 - t, t * t, t * t * t);
    match basis {
        CurveBasis::Linear => [s, t, 0.0, 0.0],
        CurveBasis::Bezier => [s * s * s, 3.0 * t * s * s, 3.0 * t2 * s, t3],
        CurveBasis::BSpline => [
            s * s * s / 6.0,
            (4.0 - 6.0 * t2 + 3.0 * t3) / 6.0,
            (1.0 + 3.0 * t + 3.0 * t2 - 3.0 * t3) / 6.0,
            t3 / 6.0,
        ],
        CurveBasis::CatmullRom => [
            0.5 * (-t + 2.0 * t2 - t3),
            0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
            0.5 * (t + 4.0 * t2 - 3.0 * t3),
            0.5 * (t3 - t2),
        ],
    }
}

/// Control points with their weights, none twice.
#[derive(Default)]
struct Sum {
    cvs: [u32; 4],
    weights: [f64; 4],
    n: usize,
}

impl Sum {
    fn add(&mut self, cv: isize, weight: f64) {
        let cv = cv as u32;
        let known = self.cvs[..self.n].iter().position(|&other| other == cv);
        let at = known.unwrap_or(self.n);
        self.n = self.n.max(at + 1);
        self.cvs[at] = cv;
        self.weights[at] += weight;
    }
}

impl Sample {
    /// The point of the curve whose control points these are.
    pub fn point(&self, cvs: &[[f32; 3]]) -> [f32; 3] {
        [0, 1, 2].map(|axis: usize| self.sum(|cv| cvs[cv][axis]))
    }

    /// Component `component` of a value per control point; `data` are those of this curve.
    pub fn vertex(&self, data: &[f32], components: usize, component: usize) -> f32 {
        let value = |cv: usize| data[cv * components + component];
        let sum = self.sum(value);
        // Without negative weights the curve lies within its control points: rounding must not take a
        // value at the end of its range, such as a dye's weight of 1, out of it.
        if self.weights.iter().any(|weight| *weight < 0.0) {
            return sum;
        }
        let parts = self.cvs.iter().zip(self.weights);
        let parts = parts.filter(|(_, weight)| *weight > 0.0);
        let (least, most) = parts.fold((f32::MAX, f32::MIN), |(least, most), (&cv, _)| {
            let value = value(cv as usize);
            (value.min(least), value.max(most))
        });
        match sum {
            sum if sum > most => most,
            sum if sum < least => least,
            // Among them what is no number, for whoever judges it.
            sum => sum,
        }
    }

    /// Component `component` of a value per segment end; `data` are those of this curve.
    pub fn varying(&self, data: &[f32], components: usize, component: usize) -> f32 {
        let [a, b] = self
            .ends
            .map(|end| data[end as usize * components + component]);
        // Not a + (b - a) t, which misses b; in 64 bits, so that rounding does not leave the two.
        let (a, b, t) = (f64::from(a), f64::from(b), f64::from(self.t));
        (a * (1.0 - t) + b * t) as f32
    }

    fn sum(&self, value: impl Fn(usize) -> f32) -> f32 {
        // One control point alone is taken as it is, whatever its value.
        if self.weights[0] == 1.0 {
            return value(self.cvs[0] as usize);
        }
        let parts = self.cvs.iter().zip(self.weights);
        parts
            .filter(|(_, weight)| *weight != 0.0)
            .map(|(&cv, weight)| f64::from(weight) * f64::from(value(cv as usize)))
            .sum::<f64>() as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use CurveBasis::{BSpline, Bezier, CatmullRom, Linear};

    const CVS: [[f32; 3]; 7] = [
        [0.0, 0.0, 0.0],
        [1.0, 2.0, 0.0],
        [3.0, 2.0, 1.0],
        [4.0, 0.0, 1.0],
        [5.0, -1.0, 0.0],
        [7.0, 1.0, 2.0],
        [8.0, 2.0, 2.0],
    ];

    fn polyline(basis: CurveBasis, wrap: Wrap, cvs: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let samples = samples(basis, wrap, cvs.len(), 4).unwrap();
        samples.iter().map(|sample| sample.point(cvs)).collect()
    }

    fn assert_near(a: [f32; 3], b: [f32; 3]) {
        let far = (0..3).map(|ix| (a[ix] - b[ix]).abs()).fold(0.0, f32::max);
        assert!(far < 1e-6, "{a:?} {b:?}");
    }

    #[test]
    fn linear_curves_keep_their_points() {
        assert_eq!(polyline(Linear, Wrap::Open, &CVS), CVS);
        let ring = polyline(Linear, Wrap::Periodic, &CVS);
        assert_eq!(ring.len(), 8);
        assert_eq!((ring[0], ring[7]), (CVS[0], CVS[0]));
    }

    #[test]
    fn equal_values_stay_equal_between_control_points() {
        for (basis, wrap) in [
            (Bezier, Wrap::Open),
            (BSpline, Wrap::Open),
            (CatmullRom, Wrap::Open),
        ] {
            for n in 1..=9 {
                for value in [1.0, 0.3, 50.0, 0.0075] {
                    let data = [value; 7];
                    for sample in samples(basis, wrap, 7, n).unwrap() {
                        let overshoots = sample.weights.iter().any(|weight| *weight < 0.0);
                        if !overshoots {
                            assert_eq!(sample.vertex(&data, 1, 0), value);
                        }
                        assert_eq!(sample.varying(&data, 1, 0), value);
                    }
                }
            }
        }
    }

    #[test]
    fn curves_pass_through_what_they_should() {
        let bezier = polyline(Bezier, Wrap::Open, &CVS);
        assert_eq!(bezier.len(), 9);
        assert_eq!([bezier[0], bezier[4], bezier[8]], [CVS[0], CVS[3], CVS[6]]);
        // Its middle by hand: (p0 + 3 p1 + 3 p2 + p3) / 8.
        assert_near(bezier[2], [2.0, 1.5, 0.5]);
        let catmull = polyline(CatmullRom, Wrap::Open, &CVS);
        assert_eq!(catmull.len(), 17);
        assert_near(catmull[0], CVS[1]);
        assert_near(catmull[4], CVS[2]);
        assert_near(catmull[16], CVS[5]);
        let spline = polyline(BSpline, Wrap::Open, &CVS);
        // (p0 + 4 p1 + p2) / 6
        assert_near(spline[0], [7.0 / 6.0, 10.0 / 6.0, 1.0 / 6.0]);
        for basis in [CatmullRom, BSpline] {
            let pinned = polyline(basis, Wrap::Pinned, &CVS);
            assert_eq!(pinned.len(), 25);
            assert_near(pinned[0], CVS[0]);
            assert_near(pinned[24], CVS[6]);
            // Of two points a straight line.
            let line = polyline(basis, Wrap::Pinned, &CVS[..2]);
            assert_near(line[2], [0.5, 1.0, 0.0]);
            let ring = polyline(basis, Wrap::Periodic, &CVS);
            assert_near(ring[0], ring[28]);
        }
        let ring = polyline(Bezier, Wrap::Periodic, &CVS[..6]);
        assert_eq!((ring[0], ring[4], ring[8]), (CVS[0], CVS[3], CVS[0]));
    }

    #[test]
    fn values_follow_points() {
        for (basis, wrap) in [
            (Linear, Wrap::Open),
            (Bezier, Wrap::Open),
            (BSpline, Wrap::Open),
            (BSpline, Wrap::Pinned),
            (CatmullRom, Wrap::Pinned),
        ] {
            let n_ends = n_varying(basis, wrap, CVS.len()).unwrap();
            let ends: Vec<f32> = (0..n_ends).map(|ix| ix as f32).collect();
            let ones = [1.0; CVS.len()];
            let samples = samples(basis, wrap, CVS.len(), 3).unwrap();
            for (ix, sample) in samples.iter().enumerate() {
                assert!((sample.vertex(&ones, 1, 0) - 1.0).abs() < 1e-6);
                let per_segment = if basis == Linear { 1.0 } else { 3.0 };
                let varying = sample.varying(&ends, 1, 0);
                assert!((varying - ix as f32 / per_segment).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn numbers_that_do_not_fit_are_refused() {
        for (basis, wrap, n) in [
            (Linear, Wrap::Open, 1),
            (Bezier, Wrap::Open, 5),
            (Bezier, Wrap::Periodic, 4),
            (BSpline, Wrap::Open, 3),
            (CatmullRom, Wrap::Pinned, 1),
            (BSpline, Wrap::Periodic, 2),
            (Linear, Wrap::Open, 0),
        ] {
            assert!(
                samples(basis, wrap, n, 4).is_err(),
                "{basis:?} {wrap:?} {n}"
            );
        }
    }

    #[test]
    fn interpolation_is_found_by_the_number_of_values() {
        let counts = Counts {
            uniform: 16,
            varying: 86,
            vertex: 226,
        };
        let of = |n, label| Interpolation::of(n, &counts, label);
        // Blender labels one width per point as constant.
        let constant = Some(Interpolation::Constant);
        assert_eq!(of(226, constant), Some(Interpolation::Vertex));
        assert_eq!(of(86, None), Some(Interpolation::Varying));
        assert_eq!(of(16, constant), Some(Interpolation::Uniform));
        assert_eq!(of(1, None), Some(Interpolation::Constant));
        assert_eq!(of(87, None), None);
        // Where numbers agree the label decides.
        let line = Counts {
            uniform: 1,
            varying: 2,
            vertex: 2,
        };
        let varying = Some(Interpolation::Varying);
        assert_eq!(Interpolation::of(2, &line, varying), varying);
    }
}
