//! Numerical integration in f64: Gauss-Legendre rules, an adaptive Gauss-Kronrod rule for
//! vector-valued integrands, and the tanh-sinh rule for checking the others.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::{Arc, PoisonError, RwLock};

/// A Gauss-Legendre rule on -1..=1.
#[derive(Clone, Debug)]
pub struct GaussLegendre {
    /// Nodes and weights.
    nodes: Arc<[(f64, f64)]>,
}

/// Rules of so many nodes at most are kept once they are found: inner integrals ask for the same ones over and over.
const MAX_KEPT: usize = 256;

static KEPT: RwLock<BTreeMap<usize, GaussLegendre>> = RwLock::new(BTreeMap::new());

impl GaussLegendre {
    /// The rule of `n` >= 1 nodes (n = 0 is taken as 1): exact to degree 2n - 1; nodes by
    /// Newton's method on the Legendre recurrence, good to 1e-15 for n in the hundreds.
    pub fn new(n: usize) -> Self {
        let n = n.max(1);
        if n > MAX_KEPT {
            return GaussLegendre::find(n);
        }
        let kept = KEPT.read().unwrap_or_else(PoisonError::into_inner);
        if let Some(rule) = kept.get(&n) {
            return rule.clone();
        }
        drop(kept);
        let rule = GaussLegendre::find(n);
        let mut kept = KEPT.write().unwrap_or_else(PoisonError::into_inner);
        kept.entry(n).or_insert(rule).clone()
    }

    fn find(n: usize) -> Self {
        let mut nodes = vec![(0.0, 0.0); n];
        for i in 0..n.div_ceil(2) {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (value, derivative) = legendre(n, x);
                slope = derivative;
                let step = value / derivative;
                x -= step;
                if step.abs() < 1e-16 {
                    break;
                }
            }
            if 2 * i + 1 == n {
                x = 0.0;
                slope = legendre(n, x).1;
            }
            let weight = 2.0 / ((1.0 - x * x) * slope * slope);
            nodes[i] = (-x, weight);
            nodes[n - 1 - i] = (x, weight);
        }
        GaussLegendre {
            nodes: nodes.into(),
        }
    }

    /// Nodes and weights on `a..=b`, in rising order.
    pub fn on(&self, a: f64, b: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let nodes = self.nodes.iter();
        nodes.map(move |(x, w)| (middle + half * x, half * w))
    }

    /// Nodes and weights on as many equal panels of `a..=b` as leave none longer than `longest`, their number
    /// within `counts`; in rising order.
    pub fn on_panels(
        &self,
        a: f64,
        b: f64,
        longest: f64,
        counts: RangeInclusive<u32>,
    ) -> impl Iterator<Item = (f64, f64)> + '_ {
        let [least, most] = [counts.start(), counts.end()].map(|n| f64::from(*n));
        let n = ((b - a) / longest).ceil().clamp(least, most);
        let at = move |ix: u32| a + (b - a) * f64::from(ix) / n;
        (0..n as u32).flat_map(move |ix| self.on(at(ix), at(ix + 1)))
    }

    /// Integral of `f` over `a..=b`.
    pub fn integrate(&self, a: f64, b: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
        self.on(a, b).map(|(x, w)| w * f(x)).sum()
    }
}

/// P_n(x) and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut here) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        let next = ((2.0 * k - 1.0) * x * here - (k - 1.0) * before) / k;
        before = here;
        here = next;
    }
    (here, n as f64 * (x * here - before) / (x * x - 1.0))
}

/// Gauss-Kronrod 7-15 (QUADPACK): nodes >= 0 and weights; every second node is a Gauss node.
const KRONROD_NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
const KRONROD_WEIGHTS: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_56,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
const GAUSS_WEIGHTS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_64,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];

/// Halvings of one panel at most: 2^-30 of it is below what any integrand here needs.
const MAX_DEPTH: u32 = 30;
/// Panels evaluated at most by one call; an integrand that is not finite ends here.
const MAX_PANELS: u32 = 20_000;

/// Integral of a vector-valued `f` over the panels between rising `breaks`, by adaptive
/// Gauss-Kronrod 7-15.
///
/// A panel is halved until the two rules differ by at most `tolerance` in every component; the
/// 15 point rule that is kept is far better than that difference for smooth integrands. Put
/// breaks at peaks and kinks: what falls between the nodes of a panel is not seen. Bounded work
/// for any `f`; NaN in, NaN out.
pub fn integrate_adaptive<const N: usize>(
    breaks: &[f64],
    tolerance: f64,
    mut f: impl FnMut(f64) -> [f64; N],
) -> [f64; N] {
    let mut total = [0.0; N];
    let mut n_panels = 0;
    let mut stack: Vec<(f64, f64, u32)> = Vec::new();
    for pair in breaks.windows(2) {
        stack.push((pair[0], pair[1], 0));
        while let Some((a, b, depth)) = stack.pop() {
            let (kronrod, difference) = kronrod_panel(a, b, &mut f);
            n_panels += 1;
            if difference > tolerance && depth < MAX_DEPTH && n_panels < MAX_PANELS {
                let middle = 0.5 * (a + b);
                stack.push((middle, b, depth + 1));
                stack.push((a, middle, depth + 1));
            } else {
                for (sum, value) in total.iter_mut().zip(kronrod) {
                    *sum += value;
                }
            }
        }
    }
    total
}

/// The 15 point rule over a panel and its largest difference from the 7 point rule.
fn kronrod_panel<const N: usize>(
    a: f64,
    b: f64,
    f: &mut impl FnMut(f64) -> [f64; N],
) -> ([f64; N], f64) {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let (mut kronrod, mut gauss) = ([0.0; N], [0.0; N]);
    for (i, (node, weight)) in KRONROD_NODES.iter().zip(KRONROD_WEIGHTS).enumerate() {
        let is_centre = i == 7;
        for x in [middle - half * node, middle + half * node] {
            let value = f(x);
            for c in 0..N {
                kronrod[c] += half * weight * value[c];
                if i % 2 == 1 {
                    gauss[c] += half * GAUSS_WEIGHTS[i / 2] * value[c];
                }
            }
            if is_centre {
                break;
            }
        }
    }
    let difference = (0..N)
        .map(|c| (kronrod[c] - gauss[c]).abs())
        .fold(0.0, f64::max);
    (kronrod, difference)
}

/// The tanh-sinh rule (Takahasi and Mori 1974) over `a..=b` with step `2^-level`: doubly
/// exponential also for integrands with singular derivatives at the ends. `f` gets the point's
/// distances from `a` and from `b`, both without cancellation.
pub fn integrate_tanh_sinh<const N: usize>(
    a: f64,
    b: f64,
    level: u32,
    mut f: impl FnMut(f64, f64) -> [f64; N],
) -> [f64; N] {
    let length = b - a;
    let step = 0.5f64.powi(level as i32);
    // Beyond |t| = 4 the weights are below 1e-36.
    let n = (4.0 / step) as i32;
    let mut total = [0.0; N];
    for i in -n..=n {
        let t = f64::from(i) * step;
        let s = std::f64::consts::FRAC_PI_2 * t.sinh();
        // (1 + tanh s)/2 = 1/(1 + e^(-2s))
        let from_a = length / (1.0 + (-2.0 * s).exp());
        let from_b = length / (1.0 + (2.0 * s).exp());
        let cosh = s.cosh();
        let weight = step * 0.5 * length * std::f64::consts::FRAC_PI_2 * t.cosh() / (cosh * cosh);
        let value = f(from_a, from_b);
        for (sum, value) in total.iter_mut().zip(value) {
            *sum += weight * value;
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_are_as_short_and_as_many_as_asked_for() {
        let rule = GaussLegendre::new(3);
        for (longest, counts, n) in [
            (0.5, 1..=9, 7),
            (0.5, 1..=4, 4),
            (9.0, 2..=9, 2),
            (0.0, 1..=5, 5),
        ] {
            let nodes: Vec<(f64, f64)> = rule.on_panels(-1.0, 2.2, longest, counts).collect();
            assert_eq!(nodes.len(), 3 * n);
            assert!(nodes.is_sorted_by(|a, b| a.0 < b.0));
            // Exact of the fifth degree.
            let integral: f64 = nodes.iter().map(|(x, weight)| weight * x.powi(5)).sum();
            let expected = (2.2f64.powi(6) - 1.0) / 6.0;
            assert!((integral / expected - 1.0).abs() < 1e-13, "{n}: {integral}");
        }
    }

    #[test]
    fn gauss_legendre_is_exact_to_its_degree() {
        for n in [1usize, 2, 5, 16, 48, 129, 400] {
            let rule = GaussLegendre::new(n);
            for degree in [0, 1, n - 1, 2 * n - 1, 2 * n - 2] {
                let got = rule.integrate(0.0, 1.0, |x| x.powi(degree as i32));
                let expected = 1.0 / (degree as f64 + 1.0);
                assert!((got - expected).abs() < 3e-14, "{n} {degree} {got}");
            }
        }
        // One degree more is not exact: the comparison above can fail.
        let rule = GaussLegendre::new(3);
        assert!((rule.integrate(0.0, 1.0, |x| x.powi(6)) - 1.0 / 7.0).abs() > 1e-4);
    }

    #[test]
    fn adaptive_finds_what_a_break_points_at() {
        let width = 3e-3;
        let got = integrate_adaptive(&[-1.0, 0.2, 3.0], 1e-13, |x| {
            [(-((x - 0.2) / width).powi(2)).exp() / width, x.abs().sqrt()]
        });
        assert!((got[0] - std::f64::consts::PI.sqrt()).abs() < 1e-9);
        let expected = 2.0 / 3.0 * (1.0 + 3.0f64.powf(1.5));
        assert!((got[1] - expected).abs() < 1e-7, "{}", got[1] - expected);
    }

    #[test]
    fn kronrod_is_exact_to_degree_22() {
        let (value, _) = kronrod_panel(0.0, 1.0, &mut |x: f64| [x.powi(22), x.powi(9)]);
        assert!((value[0] - 1.0 / 23.0).abs() < 1e-16);
        assert!((value[1] - 0.1).abs() < 1e-16);
    }

    #[test]
    fn adaptive_ends_on_nonsense() {
        let got = integrate_adaptive(&[0.0, 1.0], 1e-12, |_| [f64::NAN]);
        assert!(got[0].is_nan());
        let got = integrate_adaptive(&[0.0, 1.0], 0.0, |x| [1.0 / (x - 0.3)]);
        assert!(!got[0].is_nan());
    }

    #[test]
    fn tanh_sinh_takes_singular_ends() {
        let got = integrate_tanh_sinh(2.0, 5.0, 5, |from_a, from_b| {
            [from_a.sqrt(), (from_a * from_b).powf(-0.5)]
        });
        assert!((got[0] - 2.0 * 3.0f64.sqrt()).abs() < 1e-13);
        assert!((got[1] - std::f64::consts::PI).abs() < 1e-11);
    }
}
