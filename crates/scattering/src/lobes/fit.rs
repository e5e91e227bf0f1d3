//! Fitting lobes to moments.
//!
//! N_t over its energy is replaced by `sum w_l S_l`, l = 0..3, `w_l >= 0`, `sum w_l = 1`: S_0 one
//! circular Gaussian at phi_t, S_1 and S_2 symmetric pairs at `phi_t +- mu_l`, each of unit mass.
//! Widths and offsets (the [`LobeShape`]) are shared by every absorption; the shares w follow the
//! absorption. Given a shape the best shares are a small least-squares problem with bounds
//! ([`best_shares`]), so only shapes are searched (variable projection).
//!
//! Shapes of one eta are found together along alpha ([`fit_path`]): Levenberg-Marquardt on the sum
//! of squared errors and of squared second differences, so that parameters are smooth in alpha.
//! `mu_1` keeps its sign through 0: N_TRT has one caustic for eta' > 2, a pair below, and
//! shoulders of a wide lobe far above, all of which S_1 follows without a jump.

use std::f64::consts::FRAC_PI_2;

use super::moments::{Moments, N_MOMENTS, ORDERS, Section, dot, gaussian_moments, stride};
use super::shape::turns;
use super::start::start;
use crate::fresnel::Fresnel;
use crate::hair::Lobe;
use crate::quadrature::GaussLegendre;

pub use super::shape::{LobeShape, N_SHAPE};

/// Effective absorptions that shapes are fitted to.
const FIT_SIGMAS: [f64; 5] = [0.0, 0.4, 1.0, 2.0, 3.5];
/// Widths of the light that errors are counted for, and how much.
const BLURS: [(f64, f64); 7] = [
    (0.02, 0.1),
    (0.05, 0.3),
    (0.1, 1.0),
    (0.2, 2.0),
    (0.5, 2.0),
    (1.0, 1.0),
    (2.0, 0.5),
];
/// TRT is counted as seen through the narrowest caustic width in use.
const CAUSTIC_WIDTH: f64 = 0.08;
/// Narrowest lobes fitted: narrower ones look the same through any light or caustic width.
const LAMBDA_MIN_TT: f64 = 0.003;
const LAMBDA_MIN_TRT: f64 = 0.03;
/// Weights of second and of first differences along the path. Errors squared are 1e-6 to 1e-4 a
/// point.
const BEND: f64 = 0.07;
const SLOPE: f64 = 5e-4;
/// Weight of the distance to the built-in start and to the shapes of a neighbouring eta.
const TIE_START: f64 = 5e-4;
const TIE_ROW: f64 = 3e-2;
const MAX_STEPS: usize = 40;

/// The weights of squared errors of moments that make squared relative errors of the inner
/// integral, summed over widths of the light.
#[derive(Clone, Debug)]
pub struct ErrorNorm {
    blurs: Vec<(Moments, f64)>,
}

impl ErrorNorm {
    /// The norm that fits minimise.
    pub fn fitting(lobe: Lobe) -> Self {
        ErrorNorm {
            blurs: BLURS
                .iter()
                .map(|&(lambda_p, weight)| (blur(lobe, lambda_p, CAUSTIC_WIDTH), weight))
                .collect(),
        }
    }

    /// The norm of one light of width `lambda_p`, TRT blurred by `caustic_width` too.
    pub fn single(lobe: Lobe, lambda_p: f64, caustic_width: f64) -> Self {
        ErrorNorm {
            blurs: vec![(blur(lobe, lambda_p, caustic_width), 1.0)],
        }
    }

    /// Weight of each squared error of a moment of `target`.
    pub fn weights(&self, target: &Moments) -> Moments {
        let mut weights = [0.0; N_MOMENTS];
        for (blur, weight) in &self.blurs {
            let mut norm = 0.5;
            for ix in 1..N_MOMENTS {
                norm += stride(ORDERS[ix]) as f64 * (target[ix] * blur[ix]).powi(2);
            }
            for ix in 1..N_MOMENTS {
                weights[ix] += weight / norm * stride(ORDERS[ix]) as f64 * blur[ix] * blur[ix];
            }
        }
        weights
    }

    /// Square root of the weighted sum of squares: for one light the relative RMSE over phi.
    pub fn error(&self, target: &Moments, found: &Moments) -> f64 {
        let weights = self.weights(target);
        (0..N_MOMENTS)
            .map(|n| weights[n] * (target[n] - found[n]).powi(2))
            .sum::<f64>()
            .sqrt()
    }
}

fn blur(lobe: Lobe, lambda_p: f64, caustic_width: f64) -> Moments {
    let [mut blur, caustic] = gaussian_moments([lambda_p, caustic_width]);
    if lobe == Lobe::Trt {
        blur.iter_mut().zip(caustic).for_each(|(b, c)| *b *= c);
    }
    blur
}

/// The shares w >= 0 of sum 1 that bring `sum w_l moments_l` nearest to `target`, squared errors
/// of moments counted with `weights`.
pub fn best_shares(moments: &[Moments; 3], target: &Moments, weights: &Moments) -> [f64; 3] {
    let weighted = weigh(moments, weights);
    let mut gram = [[0.0; 3]; 3];
    let mut right = [0.0; 3];
    for i in 0..3 {
        right[i] = dot(&weighted[i], target);
        gram[i] = [0, 1, 2].map(|j| dot(&weighted[i], &moments[j]));
    }
    // Equal lobes leave their shares undetermined: a trace of preference for equal shares.
    let ridge = 1e-9 * (gram[0][0] + gram[1][1] + gram[2][2]);
    for i in 0..3 {
        gram[i][i] += ridge;
        right[i] += ridge / 3.0;
    }
    bounded_minimum(&gram, right)
}

fn weigh<const K: usize>(moments: &[Moments; K], weights: &Moments) -> [Moments; K] {
    std::array::from_fn(|k| std::array::from_fn(|n| moments[k][n] * weights[n]))
}

/// Minimum of `w' gram w - 2 right' w` over w >= 0, sum w = 1, by trying every face.
fn bounded_minimum(gram: &[[f64; 3]; 3], right: [f64; 3]) -> [f64; 3] {
    let value = |w: [f64; 3]| -> f64 {
        (0..3)
            .map(|i| w[i] * ((0..3).map(|j| gram[i][j] * w[j]).sum::<f64>() - 2.0 * right[i]))
            .sum()
    };
    // Inside: eliminate w_0 = 1 - w_1 - w_2.
    let reduced = |i: usize, j: usize| gram[i][j] - gram[0][i] - gram[0][j] + gram[0][0];
    let slope = |i: usize| right[i] - right[0] - gram[0][i] + gram[0][0];
    let det = reduced(1, 1) * reduced(2, 2) - reduced(1, 2) * reduced(1, 2);
    let w_1 = (slope(1) * reduced(2, 2) - slope(2) * reduced(1, 2)) / det;
    let w_2 = (slope(2) * reduced(1, 1) - slope(1) * reduced(1, 2)) / det;
    if w_1 >= 0.0 && w_2 >= 0.0 && w_1 + w_2 <= 1.0 {
        return [1.0 - w_1 - w_2, w_1, w_2];
    }
    let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
    for [i, j] in [[0, 1], [0, 2], [1, 2]] {
        let bend = gram[i][i] - 2.0 * gram[i][j] + gram[j][j];
        let at = (right[j] - right[i] - gram[i][j] + gram[i][i]) / bend;
        let at = if at.is_nan() { 0.5 } else { at.clamp(0.0, 1.0) };
        let mut w = [0.0; 3];
        w[i] = 1.0 - at;
        w[j] = at;
        let value = value(w);
        if value < best.1 {
            best = (w, value);
        }
    }
    best.0
}

/// Moments of the lobes together.
pub fn mixed(moments: &[Moments; 3], shares: [f64; 3]) -> Moments {
    std::array::from_fn(|n| (0..3).map(|l| shares[l] * moments[l][n]).sum())
}

/// Fit coordinates of a shape: logarithms of widths and offsets, over a natural width.
type Coordinates = [f64; N_SHAPE];

/// One alpha of a path: what is fitted there.
struct Point {
    targets: Vec<(Moments, Moments)>,
    scale: f64,
    lambda_min: f64,
    weight: f64,
}

/// Normal equations of one point.
struct Normal {
    matrix: [[f64; N_SHAPE]; N_SHAPE],
    gradient: [f64; N_SHAPE],
}

impl Point {
    fn new(
        lobe: Lobe,
        fresnel: Fresnel,
        eta: f64,
        alpha: f64,
        rule: &GaussLegendre,
        norm: &ErrorNorm,
    ) -> Self {
        let section = Section::new(lobe, fresnel, eta, alpha, rule);
        let targets = section
            .moments(&FIT_SIGMAS)
            .into_iter()
            .map(|target| {
                let weights = norm.weights(&target);
                (target, weights)
            })
            .collect();
        let trt = lobe == Lobe::Trt;
        Point {
            targets,
            // TT ends at psi = +-(pi - 2 alpha).
            scale: if trt { 1.0 } else { FRAC_PI_2 - alpha + 0.003 },
            lambda_min: if trt { LAMBDA_MIN_TRT } else { LAMBDA_MIN_TT },
            // Near eta' = 1 TRT is a broken ring that no three lobes follow and that has next
            // to no energy; it shall not rule the path.
            weight: if trt {
                0.1 + 0.9 / (1.0 + (alpha.sin() / 0.8).powi(20))
            } else {
                1.0
            },
        }
    }

    fn shape(&self, q: &Coordinates) -> LobeShape {
        let lambda = |q: f64| (self.scale * q.exp()).hypot(self.lambda_min);
        LobeShape {
            lambda: [lambda(q[0]), lambda(q[1]), lambda(q[3])],
            mu: [self.scale * q[2], self.scale * q[4]],
        }
    }

    fn coordinates(&self, shape: &LobeShape) -> Coordinates {
        let log = |lambda: f64| {
            let square = (lambda * lambda - self.lambda_min * self.lambda_min).max(1e-6);
            (square.sqrt() / self.scale).ln()
        };
        [
            log(shape.lambda[0]),
            log(shape.lambda[1]),
            shape.mu[0] / self.scale,
            log(shape.lambda[2]),
            shape.mu[1] / self.scale,
        ]
    }

    /// Weighted sum of squared errors with the best shares.
    fn cost(&self, q: &Coordinates) -> f64 {
        let moments = self.shape(q).moments();
        let mut sum = 0.0;
        for (target, weights) in &self.targets {
            let found = mixed(&moments, best_shares(&moments, target, weights));
            let error: Moments = std::array::from_fn(|n| found[n] - target[n]);
            let [weighted] = weigh(&[error], weights);
            sum += dot(&error, &weighted);
        }
        self.weight * sum
    }

    /// Moments and their derivatives by each coordinate (of the lobe that it moves).
    fn tangents(&self, q: &Coordinates) -> ([Moments; 3], [Moments; N_SHAPE]) {
        const STEP: f64 = 1e-5;
        let shape = self.shape(q);
        let moved = self.shape(&q.map(|q| q + STEP));
        let [g_0, g_1, g_2, h_0, h_1, h_2] = gaussian_moments([
            shape.lambda[0],
            shape.lambda[1],
            shape.lambda[2],
            moved.lambda[0],
            moved.lambda[1],
            moved.lambda[2],
        ]);
        let turns = shape.mu.map(turns);
        let by_width = |g: &Moments, h: &Moments, cos: &Moments| -> Moments {
            std::array::from_fn(|n| (h[n] - g[n]) / STEP * cos[n])
        };
        let by_offset = |g: &Moments, sin: &Moments| -> Moments {
            std::array::from_fn(|n| -self.scale * g[n] * sin[n])
        };
        let tangents = [
            by_width(&g_0, &h_0, &[1.0; N_MOMENTS]),
            by_width(&g_1, &h_1, &turns[0].0),
            by_offset(&g_1, &turns[0].1),
            by_width(&g_2, &h_2, &turns[1].0),
            by_offset(&g_2, &turns[1].1),
        ];
        let turned = |g: &Moments, cos: &Moments| std::array::from_fn(|n| g[n] * cos[n]);
        let moments = [g_0, turned(&g_1, &turns[0].0), turned(&g_2, &turns[1].0)];
        (moments, tangents)
    }

    /// Gauss-Newton normal equations for the coordinates, shares eliminated (Kaufman 1975).
    fn normal(&self, q: &Coordinates) -> Normal {
        /// The lobe that each coordinate moves.
        const LOBE_OF: [usize; N_SHAPE] = [0, 1, 1, 2, 2];
        let (moments, tangents) = self.tangents(q);
        let mut normal = Normal {
            matrix: [[0.0; N_SHAPE]; N_SHAPE],
            gradient: [0.0; N_SHAPE],
        };
        for (target, weights) in &self.targets {
            let shares = best_shares(&moments, target, weights);
            let found = mixed(&moments, shares);
            let error: Moments = std::array::from_fn(|n| found[n] - target[n]);
            let weighted = weigh(&tangents, weights);
            let share = LOBE_OF.map(|l| shares[l]);
            let gradient: [f64; N_SHAPE] =
                std::array::from_fn(|i| share[i] * dot(&weighted[i], &error));
            let mut matrix: [[f64; N_SHAPE]; N_SHAPE] = std::array::from_fn(|i| {
                std::array::from_fn(|j| share[i] * share[j] * dot(&weighted[i], &tangents[j]))
            });
            // Shares that are free to follow: differences to the largest.
            let base = (0..3).fold(0, |best, l| if shares[l] > shares[best] { l } else { best });
            let free: Vec<Moments> = (0..3)
                .filter(|&l| l != base && shares[l] > 0.0)
                .map(|l| std::array::from_fn(|n| moments[l][n] - moments[base][n]))
                .collect();
            let mut directions: Vec<Moments> = Vec::new();
            for mut direction in free {
                // Orthonormal in the weighted product.
                for before in &directions {
                    let [weighted] = weigh(&[direction], weights);
                    let along = dot(&weighted, before);
                    for n in 0..N_MOMENTS {
                        direction[n] -= along * before[n];
                    }
                }
                let [weighted] = weigh(&[direction], weights);
                let square = dot(&weighted, &direction);
                if square > 1e-9 {
                    let scale = 1.0 / square.sqrt();
                    directions.push(direction.map(|x| x * scale));
                }
            }
            for direction in &directions {
                let along: [f64; N_SHAPE] =
                    std::array::from_fn(|i| share[i] * dot(&weighted[i], direction));
                for (row, a) in matrix.iter_mut().zip(along) {
                    row.iter_mut().zip(along).for_each(|(x, b)| *x -= a * b);
                }
            }
            for i in 0..N_SHAPE {
                normal.gradient[i] += self.weight * gradient[i];
                for (total, x) in normal.matrix[i].iter_mut().zip(matrix[i]) {
                    *total += self.weight * x;
                }
            }
        }
        normal
    }
}

/// Scale of each coordinate in the smoothness terms.
const SMOOTH: Coordinates = [1.0, 1.0, 2.0, 1.0, 2.0];

/// The quadratic terms that tie neighbours: rows of (point, factor), for each coordinate.
fn ties(n: usize) -> Vec<Vec<(usize, f64)>> {
    let mut rows = Vec::new();
    for i in 1..n {
        rows.push(vec![(i - 1, -SLOPE), (i, SLOPE)]);
        if i + 1 < n {
            rows.push(vec![(i - 1, BEND), (i, -2.0 * BEND), (i + 1, BEND)]);
        }
    }
    rows
}

fn smoothness(
    q: &[Coordinates],
    start: &[Coordinates],
    tie: f64,
    ties: &[Vec<(usize, f64)>],
) -> f64 {
    let mut sum = 0.0;
    for j in 0..N_SHAPE {
        for row in ties {
            let value: f64 = row.iter().map(|&(i, factor)| factor * q[i][j]).sum();
            sum += (SMOOTH[j] * value).powi(2);
        }
        for (q, start) in q.iter().zip(start) {
            sum += (SMOOTH[j] * tie * (q[j] - start[j])).powi(2);
        }
    }
    sum
}

/// Fits the shapes of one eta at every alpha of `alphas` (rising, evenly spaced).
///
/// Starts from `from` and stays near it: the shapes of a neighbouring eta at the same alphas, or a
/// built-in path.
pub fn fit_path(
    lobe: Lobe,
    fresnel: Fresnel,
    eta: f64,
    alphas: &[f64],
    rule: &GaussLegendre,
    from: Option<&[LobeShape]>,
) -> Vec<LobeShape> {
    let norm = ErrorNorm::fitting(lobe);
    let points: Vec<Point> = alphas
        .iter()
        .map(|&alpha| Point::new(lobe, fresnel, eta, alpha, rule, &norm))
        .collect();
    let start: Vec<Coordinates> = match from {
        Some(shapes) => points
            .iter()
            .zip(shapes)
            .map(|(p, s)| p.coordinates(s))
            .collect(),
        None => points
            .iter()
            .zip(alphas)
            .map(|(p, &alpha)| p.coordinates(&start(lobe, alpha)))
            .collect(),
    };
    let ties = ties(points.len());
    let tie = if from.is_some() { TIE_ROW } else { TIE_START };
    let total = |q: &[Coordinates]| {
        let fit: f64 = points.iter().zip(q).map(|(point, q)| point.cost(q)).sum();
        fit + smoothness(q, &start, tie, &ties)
    };
    let mut here = start.clone();
    let mut cost = total(&here);
    let mut damping = 1e-3;
    for _ in 0..MAX_STEPS {
        let (matrix, gradient) = assemble(&points, &here, &start, tie, &ties);
        let mut improved = false;
        while damping < 1e6 {
            let step = matrix.solve_damped(damping, &gradient);
            let moved: Vec<Coordinates> = here
                .iter()
                .enumerate()
                .map(|(i, q)| {
                    std::array::from_fn(|j| q[j] - step[i * N_SHAPE + j].clamp(-0.3, 0.3))
                })
                .collect();
            let moved_cost = total(&moved);
            if moved_cost < cost {
                improved = cost - moved_cost > 2e-4 * cost;
                here = moved;
                cost = moved_cost;
                damping *= 0.2;
                break;
            }
            damping *= 5.0;
        }
        if !improved {
            break;
        }
    }
    points.iter().zip(&here).map(|(p, q)| p.shape(q)).collect()
}

/// Half bandwidth: second differences reach two points away.
const BAND: usize = 3 * N_SHAPE;

/// A symmetric positive banded matrix: row i holds columns i-BAND+1..=i, the diagonal last.
struct Banded {
    rows: Vec<[f64; BAND]>,
}

fn assemble(
    points: &[Point],
    here: &[Coordinates],
    start: &[Coordinates],
    tie: f64,
    ties: &[Vec<(usize, f64)>],
) -> (Banded, Vec<f64>) {
    let n = points.len() * N_SHAPE;
    let mut rows = vec![[0.0; BAND]; n];
    let mut gradient = vec![0.0; n];
    let mut add = |i: usize, j: usize, value: f64| {
        if j <= i {
            rows[i][BAND - 1 - (i - j)] += value;
        }
    };
    for (p, (point, q)) in points.iter().zip(here).enumerate() {
        let normal = point.normal(q);
        for i in 0..N_SHAPE {
            for j in 0..=i {
                add(p * N_SHAPE + i, p * N_SHAPE + j, normal.matrix[i][j]);
            }
            let tie = (SMOOTH[i] * tie).powi(2);
            add(p * N_SHAPE + i, p * N_SHAPE + i, tie);
            gradient[p * N_SHAPE + i] += normal.gradient[i] + tie * (q[i] - start[p][i]);
        }
    }
    for j in 0..N_SHAPE {
        let square = SMOOTH[j] * SMOOTH[j];
        for row in ties {
            let value: f64 = row.iter().map(|&(i, factor)| factor * here[i][j]).sum();
            for &(a, factor_a) in row {
                gradient[a * N_SHAPE + j] += square * factor_a * value;
                for &(b, factor_b) in row {
                    add(
                        a * N_SHAPE + j,
                        b * N_SHAPE + j,
                        square * factor_a * factor_b,
                    );
                }
            }
        }
    }
    (Banded { rows }, gradient)
}

impl Banded {
    /// Solves with the diagonal multiplied by `1 + damping`, by Cholesky.
    fn solve_damped(&self, damping: f64, right: &[f64]) -> Vec<f64> {
        let n = self.rows.len();
        let mut factor = self.rows.clone();
        let mut x = right.to_vec();
        for i in 0..n {
            factor[i][BAND - 1] *= 1.0 + damping;
            factor[i][BAND - 1] += 1e-14;
            let first = i.saturating_sub(BAND - 1);
            for j in first..=i {
                let mut sum = factor[i][BAND - 1 - (i - j)];
                for k in first.max(j.saturating_sub(BAND - 1))..j {
                    sum -= factor[i][BAND - 1 - (i - k)] * factor[j][BAND - 1 - (j - k)];
                }
                factor[i][BAND - 1 - (i - j)] = if j < i {
                    sum / factor[j][BAND - 1]
                } else {
                    sum.max(1e-18).sqrt()
                };
            }
            let mut sum = x[i];
            for k in first..i {
                sum -= factor[i][BAND - 1 - (i - k)] * x[k];
            }
            x[i] = sum / factor[i][BAND - 1];
        }
        for i in (0..n).rev() {
            let mut sum = x[i];
            for k in i + 1..n.min(i + BAND) {
                sum -= factor[k][BAND - 1 - (k - i)] * x[k];
            }
            x[i] = sum / factor[i][BAND - 1];
        }
        x
    }
}
