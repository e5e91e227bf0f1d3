//! Cubic splines with knots of their own, as XGen writes them.

use crate::curves::Sample;

/// How knots are stored: all n + 4 of them, or without the first and the last, which make no
/// difference to the curve, as Maya has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum KnotCount {
    All,
    WithoutEnds,
}

impl KnotCount {
    /// That of `n_knots` knots for curves of so many control points each.
    pub fn of(n_knots: usize, lengths: &[u32]) -> Option<KnotCount> {
        let n_cvs: usize = lengths.iter().map(|&n| n as usize).sum();
        match n_knots.checked_sub(n_cvs)? {
            extra if extra == 4 * lengths.len() => Some(KnotCount::All),
            extra if extra == 2 * lengths.len() => Some(KnotCount::WithoutEnds),
            _ => None,
        }
    }

    /// Number of knots of a curve of `n_cvs` control points.
    pub fn of_curve(self, n_cvs: usize) -> usize {
        match self {
            KnotCount::All => n_cvs + 4,
            KnotCount::WithoutEnds => n_cvs + 2,
        }
    }
}

/// Are knots those of a uniform spline: all equally far apart? Its curve is that without knots.
pub(super) fn is_uniform(knots: &[f32]) -> bool {
    let inner = match knots {
        [_, inner @ .., _] if inner.len() > 2 => inner,
        _ => return false,
    };
    let step = inner[1] - inner[0];
    let even = |pair: &[f32]| (pair[1] - pair[0] - step).abs() <= 1e-4 * step;
    step > 0.0 && inner.windows(2).all(even)
}

/// The points of the polyline that is drawn for a spline with these knots, `per_segment` of them in
/// each span that is not empty: Cox and de Boor's recursion (de Boor 1972).
///
/// # Errors
/// What is wrong with the knots.
pub(super) fn samples(
    knots: &[f32],
    count: KnotCount,
    n_cvs: usize,
    per_segment: u32,
) -> Result<Vec<Sample>, &'static str> {
    if n_cvs < 4 {
        return Err("at least 4");
    }
    if !knots.iter().all(|knot| knot.is_finite()) || knots.windows(2).any(|pair| pair[1] < pair[0])
    {
        return Err("knots that are finite and never fall");
    }
    // Knot k[i] of the full vector of n + 4.
    let first = if count == KnotCount::All { 0 } else { 1 };
    let knot = |ix: usize| f64::from(knots[(ix.max(first) - first).min(knots.len() - 1)]);
    let mut samples = Vec::new();
    let mut last = None;
    for span in 3..n_cvs {
        let (start, end) = (knot(span), knot(span + 1));
        if end <= start {
            continue;
        }
        for step in 0..per_segment {
            let t = f64::from(step) / f64::from(per_segment);
            samples.push(sample(&knot, span, t));
        }
        last = Some(span);
    }
    match last {
        Some(span) => samples.push(sample(&knot, span, 1.0)),
        None => return Err("knots that rise"),
    }
    Ok(samples)
}

/// The point at `t`, 0..=1, of the span between knots `span` and `span + 1`.
fn sample(knot: &impl Fn(usize) -> f64, span: usize, t: f64) -> Sample {
    let x = knot(span) * (1.0 - t) + knot(span + 1) * t;
    let mut weights = [1.0, 0.0, 0.0, 0.0];
    for degree in 1..4 {
        let mut saved = 0.0;
        for (r, weight) in weights.iter_mut().enumerate().take(degree) {
            let (right, left) = (knot(span + r + 1), knot(span + 1 + r - degree));
            let part = *weight / (right - left);
            *weight = saved + (right - x) * part;
            saved = (x - left) * part;
        }
        weights[degree] = saved;
    }
    let first = span as u32 - 3;
    // A sample of one point starts with it.
    let mut order = [0, 1, 2, 3];
    if weights[3] == 1.0 {
        order = [3, 0, 1, 2];
    }
    Sample {
        cvs: order.map(|ix| first + ix as u32),
        weights: order.map(|ix| weights[ix] as f32),
        ends: [first, first + 1],
        t: t as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::{self, Wrap};
    use crate::groom_format::CurveBasis;

    const CVS: [[f32; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [1.0, 2.0, 0.0],
        [3.0, 2.0, 1.0],
        [4.0, 0.0, 1.0],
        [5.0, -1.0, 0.0],
        [7.0, 1.0, 2.0],
    ];

    fn polyline(knots: &[f32], n_cvs: usize) -> Vec<[f32; 3]> {
        let count = KnotCount::of(knots.len(), &[n_cvs as u32]).unwrap();
        let samples = samples(knots, count, n_cvs, 4).unwrap();
        samples.iter().map(|sample| sample.point(&CVS)).collect()
    }

    fn assert_near(a: &[[f32; 3]], b: &[[f32; 3]]) {
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!((a - b).abs() < 1e-5, "{a} {b}");
        }
    }

    #[test]
    fn uniform_knots_are_no_knots() {
        let plain = curves::samples(CurveBasis::BSpline, Wrap::Open, 6, 4).unwrap();
        let plain: Vec<_> = plain.iter().map(|sample| sample.point(&CVS)).collect();
        let all: Vec<f32> = (0..10).map(|ix| 2.0 * ix as f32).collect();
        assert!(is_uniform(&all));
        assert_near(&polyline(&all, 6), &plain);
        assert_near(&polyline(&all[1..9], 6), &plain);
    }

    #[test]
    fn clamped_splines_reach_their_ends() {
        // One span: a Bezier curve.
        let bezier = curves::samples(CurveBasis::Bezier, Wrap::Open, 4, 4).unwrap();
        let bezier: Vec<_> = bezier.iter().map(|sample| sample.point(&CVS)).collect();
        let knots = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        assert!(!is_uniform(&knots));
        assert_near(&polyline(&knots, 4), &bezier);
        assert_near(&polyline(&knots[1..7], 4), &bezier);
        let knots = [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 3.0, 3.0, 3.0];
        let line = polyline(&knots, 6);
        assert_eq!((line.len(), line[0], line[12]), (13, CVS[0], CVS[5]));
        // At the first inner knot, by inserting it twice more.
        let at_1: Vec<f32> = (0..3)
            .map(|ix| CVS[1][ix] / 4.0 + CVS[2][ix] * 7.0 / 12.0 + CVS[3][ix] / 6.0)
            .collect();
        assert_near(&[line[4]], &[[at_1[0], at_1[1], at_1[2]]]);
        // Knots may be double inside; the empty span has no points.
        let knots = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 3.0, 3.0, 3.0, 3.0];
        assert_eq!(polyline(&knots, 6).len(), 9);
    }

    #[test]
    fn other_knots_are_refused() {
        let refused = |knots: &[f32], n_cvs| samples(knots, KnotCount::All, n_cvs, 4).unwrap_err();
        assert_eq!(refused(&[0.0; 8], 4), "knots that rise");
        assert!(refused(&[0.0, 0.0, 0.0, 2.0, 1.0, 1.0, 1.0, 1.0], 4).contains("never fall"));
        assert!(refused(&[f32::NAN; 8], 4).contains("finite"));
        assert_eq!(refused(&[0.0; 7], 3), "at least 4");
        assert_eq!(KnotCount::of(9, &[4]), None);
        assert_eq!(KnotCount::of(3, &[4]), None);
    }
}
