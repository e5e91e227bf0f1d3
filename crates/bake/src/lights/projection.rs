//! Variable projection: the geometry of lobes by Levenberg-Marquardt, their amplitudes always the
//! non-negative least-squares ones (Golub and Pereyra 1973, Kaufman 1975).

use rayon::prelude::*;

use super::cells::srbf_solid_angle;
use super::columns::{gram, product, sum_of_squares};
use super::linear::{Square, nnls};
use super::spectrum::{Filter, Profile};
use super::sphere::{Vec3, combine, normalize, tangents};

/// Weight of the squared error of the mean radiance, on top of its own part of the filter: keeps
/// each channel's energy right within a fraction of a percent before it is made exact.
const ENERGY_WEIGHT: f64 = 8.0;

/// Range of the bandwidth of a lobe. Below 0.02 the filtered lobe does not change any more;
/// above 3 it is an ambient light with a little slope.
pub(super) const LAMBDA_RANGE: [f64; 2] = [0.02, 3.0];

/// A step that lowers the cost by less than this part ends a refinement.
const STOP_GAIN: f64 = 3e-5;

/// Direction and bandwidth of a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lobe {
    pub axis: Vec3,
    pub lambda: f64,
}

/// The filtered map at points of equal area, and below them the mean radiance: what is fitted.
///
/// Rows 0..points are scaled by 1 / sqrt(points), so that sums of squares are means.
#[derive(Clone)]
pub(super) struct Target {
    pub points: Vec<[f32; 3]>,
    /// `points + 1` rows for each channel.
    pub rows: [Vec<f32>; 3],
}

impl Target {
    fn row_scale(&self) -> f32 {
        1.0 / (self.points.len() as f32).sqrt()
    }

    /// The filtered lobe of amplitude 1 on the rows.
    pub fn column(&self, filter: &Filter, lobe: &Lobe) -> Vec<f32> {
        self.column_of(&filter.profile(lobe.lambda), lobe)
    }

    /// [`Target::column`] with the profile of the lobe's bandwidth at hand.
    pub fn column_of(&self, profile: &Profile, lobe: &Lobe) -> Vec<f32> {
        let axis = lobe.axis.map(|x| x as f32);
        let scale = self.row_scale();
        let mut column: Vec<f32> = self
            .points
            .iter()
            .map(|p| scale * profile.at(p[0] * axis[0] + p[1] * axis[1] + p[2] * axis[2])[0])
            .collect();
        column.push(energy_row(srbf_solid_angle(lobe.lambda)) as f32);
        column
    }

    /// [`Target::column`] and its derivatives: along both tangents of the axis, by ln lambda, and
    /// the column itself.
    pub fn jacobian(&self, filter: &Filter, lobe: &Lobe) -> [Vec<f32>; 4] {
        let profile = filter.profile(lobe.lambda);
        let axis = lobe.axis.map(|x| x as f32);
        let [t, b] = tangents(lobe.axis).map(|v| v.map(|x| x as f32));
        let scale = self.row_scale();
        let rows = self.points.len() + 1;
        let mut out = [0; 4].map(|_| Vec::with_capacity(rows));
        let dot = |p: &[f32; 3], v: [f32; 3]| p[0] * v[0] + p[1] * v[1] + p[2] * v[2];
        for p in &self.points {
            let [value, by_cos, by_lambda] = profile.at(dot(p, axis)).map(|x| x * scale);
            out[0].push(by_cos * dot(p, t));
            out[1].push(by_cos * dot(p, b));
            out[2].push(by_lambda);
            out[3].push(value);
        }
        let h = 1e-4;
        let slope = (srbf_solid_angle(lobe.lambda * f64::exp(h))
            - srbf_solid_angle(lobe.lambda * f64::exp(-h)))
            / (2.0 * h);
        out[0].push(0.0);
        out[1].push(0.0);
        out[2].push(energy_row(slope) as f32);
        out[3].push(energy_row(srbf_solid_angle(lobe.lambda)) as f32);
        out
    }
}

/// The entry of an energy (integral over the sphere) in the last row.
pub(super) fn energy_row(energy: f64) -> f64 {
    ENERGY_WEIGHT.sqrt() * energy / (4.0 * std::f64::consts::PI)
}

/// Lobes with their best amplitudes.
#[derive(Clone)]
pub(super) struct State {
    pub lobes: Vec<Lobe>,
    /// Amplitudes per channel.
    pub amplitudes: [Vec<f64>; 3],
    /// Target minus model, per channel.
    pub residual: [Vec<f32>; 3],
    /// Sum of squares of the residual.
    pub cost: f64,
    gram: Square,
}

impl State {
    /// Solves for the amplitudes; `start` are good guesses of them (or anything).
    pub fn solve(
        filter: &Filter,
        target: &Target,
        lobes: Vec<Lobe>,
        start: &[Vec<f64>; 3],
    ) -> State {
        let columns: Vec<Vec<f32>> = lobes
            .par_iter()
            .map(|lobe| target.column(filter, lobe))
            .collect();
        let gram = gram(&columns.iter().map(Vec::as_slice).collect::<Vec<_>>());
        State::from_columns(target, lobes, &columns, gram, start)
    }

    fn from_columns(
        target: &Target,
        lobes: Vec<Lobe>,
        columns: &[Vec<f32>],
        gram: Square,
        start: &[Vec<f64>; 3],
    ) -> State {
        let solved: Vec<(Vec<f64>, Vec<f32>)> = (0..3)
            .into_par_iter()
            .map(|c| {
                let q: Vec<f64> = columns
                    .iter()
                    .map(|column| product(column, &target.rows[c]))
                    .collect();
                let mut guess = start[c].clone();
                guess.resize(lobes.len(), 0.0);
                let amplitudes = nnls(&gram, &q, &guess);
                let mut residual = target.rows[c].clone();
                for (column, a) in columns.iter().zip(&amplitudes) {
                    if *a > 0.0 {
                        let a = *a as f32;
                        for (r, x) in residual.iter_mut().zip(column) {
                            *r -= a * x;
                        }
                    }
                }
                (amplitudes, residual)
            })
            .collect();
        let mut amplitudes = [const { Vec::new() }; 3];
        let mut residual = [const { Vec::new() }; 3];
        for (c, (a, r)) in solved.into_iter().enumerate() {
            amplitudes[c] = a;
            residual[c] = r;
        }
        let cost = sum_of_squares(&residual);
        State {
            lobes,
            amplitudes,
            residual,
            cost,
            gram,
        }
    }

    /// The lobes that have an amplitude in some channel.
    pub fn without_idle_lobes(&self) -> Vec<Lobe> {
        (0..self.lobes.len())
            .filter(|&j| self.amplitudes.iter().any(|a| a[j] > 0.0))
            .map(|j| self.lobes[j])
            .collect()
    }

    /// By how much the cost grows if a lobe is removed and the others' amplitudes follow.
    pub fn importance(&self) -> Vec<f64> {
        let n = self.lobes.len();
        let mut out = vec![0.0; n];
        for amplitudes in &self.amplitudes {
            let active: Vec<usize> = (0..n).filter(|&j| amplitudes[j] > 0.0).collect();
            let inverse = self.gram.select(&active).cholesky().inverse_diagonal();
            for (&j, d) in active.iter().zip(&inverse) {
                out[j] += amplitudes[j] * amplitudes[j] / d.max(1e-300);
            }
        }
        out
    }
}

/// Improves the geometry of all lobes; at most `iterations` accepted or refused steps.
pub(super) fn refine(
    filter: &Filter,
    target: &Target,
    mut state: State,
    iterations: usize,
) -> State {
    let n = state.lobes.len();
    if n == 0 {
        return state;
    }
    let mut damping = 1e-2;
    let mut normal: Option<(Square, Vec<f64>)> = None;
    for _ in 0..iterations {
        let (matrix, gradient) =
            normal.get_or_insert_with(|| normal_equations(filter, target, &state));
        let mut damped = matrix.clone();
        let floor = 1e-6 * (0..3 * n).map(|k| matrix.get(k, k)).fold(0.0, f64::max);
        for k in 0..3 * n {
            damped.set(k, k, matrix.get(k, k) * (1.0 + damping) + floor);
        }
        let mut step = gradient.clone();
        damped.cholesky().solve(&mut step);
        let lobes = moved(&state.lobes, &step);
        let next = State::solve(filter, target, lobes, &state.amplitudes);
        if next.cost < state.cost {
            let gain = 1.0 - next.cost / state.cost;
            state = next;
            damping = (damping * 0.25).max(1e-7);
            normal = None;
            if gain < STOP_GAIN {
                break;
            }
        } else {
            damping *= 6.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    state
}

/// Lobes after a step, its size limited.
fn moved(lobes: &[Lobe], step: &[f64]) -> Vec<Lobe> {
    lobes
        .iter()
        .zip(step.chunks_exact(3))
        .map(|(lobe, step)| {
            let [t, b] = tangents(lobe.axis);
            let reach = 0.7 * (lobe.lambda * lobe.lambda + 0.03).sqrt();
            let length = step[0].hypot(step[1]);
            let shrink = if length > reach { reach / length } else { 1.0 };
            let axis = combine(lobe.axis, 1.0, t, step[0] * shrink, b, step[1] * shrink);
            let lambda = lobe.lambda * step[2].clamp(-0.4, 0.4).exp();
            Lobe {
                axis: normalize(axis),
                lambda: lambda.clamp(LAMBDA_RANGE[0], LAMBDA_RANGE[1]),
            }
        })
        .collect()
}

/// Kaufman's approximation of `J^T J` and `J^T r` of the projected residual, three unknowns a
/// lobe: two tangents, ln lambda.
pub(super) fn normal_equations(
    filter: &Filter,
    target: &Target,
    state: &State,
) -> (Square, Vec<f64>) {
    let n = state.lobes.len();
    let blocks: Vec<[Vec<f32>; 4]> = state
        .lobes
        .par_iter()
        .map(|lobe| target.jacobian(filter, lobe))
        .collect();
    // Columns: 3 n of geometry, then n of amplitude.
    let mut columns: Vec<&[f32]> = Vec::with_capacity(4 * n);
    for block in &blocks {
        columns.extend(block[..3].iter().map(Vec::as_slice));
    }
    columns.extend(blocks.iter().map(|block| block[3].as_slice()));
    let s = gram(&columns);

    let parts: Vec<(Square, Vec<f64>)> = (0..3)
        .into_par_iter()
        .map(|c| {
            let a = &state.amplitudes[c];
            let active: Vec<usize> = (0..n).filter(|&j| a[j] > 0.0).collect();
            let keep: Vec<usize> = active.iter().map(|j| 3 * n + j).collect();
            let factor = s.select(&keep).cholesky();
            // W = L^-1 S_Ag, one row for each geometry unknown.
            let w: Vec<Vec<f64>> = (0..3 * n)
                .map(|k| {
                    let mut row: Vec<f64> = keep.iter().map(|&j| s.get(k, j)).collect();
                    factor.forward(&mut row);
                    row
                })
                .collect();
            let mut matrix = Square::zeros(3 * n);
            let mut gradient = vec![0.0; 3 * n];
            for k in 0..3 * n {
                let a_k = a[k / 3];
                if a_k == 0.0 {
                    continue;
                }
                for l in 0..=k {
                    let a_l = a[l / 3];
                    if a_l == 0.0 {
                        continue;
                    }
                    let projected: f64 = w[k].iter().zip(&w[l]).map(|(x, y)| x * y).sum();
                    let value = a_k * a_l * (s.get(k, l) - projected);
                    matrix.set(k, l, value);
                    matrix.set(l, k, value);
                }
                gradient[k] = a_k * product(columns[k], &state.residual[c]);
            }
            (matrix, gradient)
        })
        .collect();
    let mut matrix = Square::zeros(3 * n);
    let mut gradient = vec![0.0; 3 * n];
    for (part, own) in parts {
        for (sum, x) in matrix.values.iter_mut().zip(part.values) {
            *sum += x;
        }
        for (sum, x) in gradient.iter_mut().zip(own) {
            *sum += x;
        }
    }
    (matrix, gradient)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::response::Response;
    use crate::lights::sphere::{Random, fibonacci};

    /// Points and a target made of known lobes.
    fn problem(lobes: &[(Lobe, [f64; 3])], count: usize) -> (Filter, Target) {
        let filter = Filter::new(&[Response::default()]);
        let points = (0..count)
            .map(|ix| fibonacci(ix, count, 0.0).map(|x| x as f32))
            .collect();
        let mut target = Target {
            points,
            rows: [0; 3].map(|_| vec![0.0; count + 1]),
        };
        for (lobe, rgb) in lobes {
            let column = target.column(&filter, lobe);
            for (rows, a) in target.rows.iter_mut().zip(rgb) {
                for (row, x) in rows.iter_mut().zip(&column) {
                    *row += *a as f32 * x;
                }
            }
        }
        (filter, target)
    }

    fn random_lobes(count: usize, seed: u64) -> Vec<(Lobe, [f64; 3])> {
        let mut random = Random::new(seed);
        (0..count)
            .map(|_| {
                let lobe = Lobe {
                    axis: random.direction(),
                    lambda: 0.1 * 8f64.powf(random.uniform()),
                };
                (lobe, [0; 3].map(|_| 0.2 + random.uniform()))
            })
            .collect()
    }

    #[test]
    fn the_jacobian_matches_differences() {
        let (filter, target) = problem(&[], 500);
        for (lobe, _) in random_lobes(6, 2) {
            let jacobian = target.jacobian(&filter, &lobe);
            let scale = jacobian.map(|column| product(&column, &column).sqrt());
            let jacobian = target.jacobian(&filter, &lobe);
            let [t, b] = tangents(lobe.axis);
            let h = 0.02 * lobe.lambda;
            for (d, column) in jacobian[..3].iter().enumerate() {
                let shifted = |h: f64| {
                    let (x, y, z) = [(h, 0.0, 0.0), (0.0, h, 0.0), (0.0, 0.0, h)][d];
                    let axis = normalize(combine(lobe.axis, 1.0, t, x, b, y));
                    let lambda = lobe.lambda * z.exp();
                    target.column(&filter, &Lobe { axis, lambda })
                };
                let (above, below) = (shifted(h), shifted(-h));
                let error: f64 = (0..column.len())
                    .map(|k| {
                        let difference = f64::from(above[k] - below[k]) / (2.0 * h);
                        (difference - f64::from(column[k])).powi(2)
                    })
                    .sum::<f64>()
                    .sqrt();
                assert!(
                    error < 0.01 * scale[d],
                    "{lobe:?} {d}: {error} {}",
                    scale[d]
                );
            }
        }
    }

    /// The gradient of the projected cost: amplitudes follow the geometry.
    #[test]
    fn the_projected_gradient_matches_differences() {
        let truth = random_lobes(6, 4);
        let (filter, target) = problem(&truth, 800);
        let lobes: Vec<Lobe> = random_lobes(4, 5)
            .into_iter()
            .map(|(lobe, _)| lobe)
            .collect();
        let state = State::solve(&filter, &target, lobes.clone(), &Default::default());
        let (_, gradient) = normal_equations(&filter, &target, &state);
        let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        for k in 0..12 {
            let cost = |h: f64| {
                let mut step = vec![0.0; 12];
                step[k] = h;
                let lobes = moved(&lobes, &step);
                State::solve(&filter, &target, lobes, &state.amplitudes).cost
            };
            let difference = -(cost(2e-3) - cost(-2e-3)) / (2.0 * 2e-3) / 2.0;
            assert!(
                (difference - gradient[k]).abs() < 0.02 * norm,
                "{k}: {difference} {}",
                gradient[k]
            );
        }
    }

    #[test]
    fn refinement_recovers_disturbed_lobes() {
        let truth = random_lobes(8, 11);
        let (filter, target) = problem(&truth, 1500);
        let mut random = Random::new(3);
        let lobes = truth
            .iter()
            .map(|(lobe, _)| {
                let [t, b] = tangents(lobe.axis);
                let [x, y] = [0; 2].map(|_| 0.1 * (random.uniform() - 0.5));
                Lobe {
                    axis: normalize(combine(lobe.axis, 1.0, t, x, b, y)),
                    lambda: lobe.lambda * (1.0 + 0.3 * (random.uniform() - 0.5)),
                }
            })
            .collect();
        let start = State::solve(&filter, &target, lobes, &Default::default());
        let norm: f64 = sum_of_squares(&target.rows);
        let state = refine(&filter, &target, start.clone(), 60);
        assert!(start.cost > 1e-5 * norm);
        assert!(state.cost < 1e-6 * norm, "{} of {norm}", state.cost);
        for (found, (lobe, _)) in state.lobes.iter().zip(&truth) {
            let chord = [0, 1, 2].map(|k| found.axis[k] - lobe.axis[k]);
            let off = chord.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!(off < 0.02, "{found:?} {lobe:?}");
        }
    }
}
