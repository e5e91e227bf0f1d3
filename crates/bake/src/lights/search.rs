//! Where to put lobes: greedy choice from the residual, and moving the least useful ones.

use rayon::prelude::*;

use super::columns::product;
use super::projection::{Lobe, State, Target, refine};
use super::spectrum::Filter;
use super::sphere::fibonacci;

/// Bandwidths of the candidates.
const SCALES: [f64; 6] = [0.04, 0.2, 0.35, 0.55, 0.9, 1.5];

/// Lobes that could be added, filtered, on the rows of one target.
pub(super) struct Candidates {
    lobes: Vec<Lobe>,
    columns: Vec<Vec<f32>>,
    /// 1 / sum of squares of each column.
    inverse_norms: Vec<f64>,
}

impl Candidates {
    /// Every bandwidth of [`SCALES`] at `centres` points of the sphere, turned by `turn`.
    pub fn new(filter: &Filter, target: &Target, centres: usize, turn: f64) -> Candidates {
        let mut lobes = Vec::new();
        let mut columns = Vec::new();
        for lambda in SCALES {
            let profile = filter.profile(lambda);
            let of_scale: Vec<Lobe> = (0..centres)
                .map(|ix| Lobe {
                    axis: fibonacci(ix, centres, turn),
                    lambda,
                })
                .collect();
            columns.par_extend(
                of_scale
                    .par_iter()
                    .map(|lobe| target.column_of(&profile, lobe)),
            );
            lobes.extend(of_scale);
        }
        let inverse_norms = columns
            .par_iter()
            .map(|column| 1.0 / product(column, column).max(1e-300))
            .collect();
        Candidates {
            lobes,
            columns,
            inverse_norms,
        }
    }

    /// By how much each candidate lowers the cost on its own.
    fn scores(&self, residual: &[Vec<f32>; 3]) -> Vec<f64> {
        self.columns
            .par_iter()
            .with_min_len(64)
            .zip(&self.inverse_norms)
            .map(|(column, inverse_norm)| {
                residual
                    .iter()
                    .map(|r| product(column, r).max(0.0).powi(2) * inverse_norm)
                    .sum()
            })
            .collect()
    }

    /// The candidate that lowers the cost most; the first of equals.
    fn best(&self, residual: &[Vec<f32>; 3]) -> Option<Lobe> {
        let best = self.scores(residual).iter().enumerate().fold(
            (usize::MAX, 0.0),
            |best, (ix, score)| {
                if *score > best.1 { (ix, *score) } else { best }
            },
        );
        self.lobes.get(best.0).copied()
    }
}

/// Adds up to `count` lobes one by one, each the best for what is left.
pub(super) fn add_greedily(
    filter: &Filter,
    target: &Target,
    candidates: &Candidates,
    mut state: State,
    count: usize,
) -> State {
    for _ in 0..count {
        let Some(lobe) = candidates.best(&state.residual) else {
            break;
        };
        let mut lobes = state.lobes;
        lobes.push(lobe);
        state = State::solve(filter, target, lobes, &state.amplitudes);
    }
    state
}

/// Adds lobes until there are `count`, many at once: the best candidates that keep their distance
/// from each other.
pub(super) fn add_in_batches(
    filter: &Filter,
    target: &Target,
    candidates: &Candidates,
    mut state: State,
    count: usize,
) -> State {
    while state.lobes.len() < count {
        let before = state.lobes.len();
        let batch = (before / 4)
            .clamp(16, count - before + 16)
            .min(count - before);
        let scores = candidates.scores(&state.residual);
        let mut order: Vec<usize> = (0..scores.len()).filter(|&ix| scores[ix] > 0.0).collect();
        order.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]).then(a.cmp(&b)));
        let mut chosen: Vec<Lobe> = Vec::with_capacity(batch);
        for ix in order {
            if chosen.len() == batch {
                break;
            }
            let lobe = candidates.lobes[ix];
            let apart = |other: &Lobe| {
                let cos = super::sphere::dot(lobe.axis, other.axis).clamp(-1.0, 1.0);
                cos.acos() > 0.5 * lobe.lambda.max(other.lambda)
            };
            let known = |other: &Lobe| other == &lobe;
            if chosen.iter().all(apart) && !state.lobes.iter().any(known) {
                chosen.push(lobe);
            }
        }
        if chosen.is_empty() {
            break;
        }
        let mut lobes = state.lobes;
        lobes.extend(chosen);
        state = State::solve(filter, target, lobes, &state.amplitudes);
    }
    state
}

/// Grows a state to `count` lobes: some greedily, then all refined, and again.
pub(super) fn grow(
    filter: &Filter,
    target: &Target,
    candidates: &Candidates,
    mut state: State,
    count: usize,
) -> State {
    while state.lobes.len() < count {
        let before = state.lobes.len();
        let more = (before / 2).clamp(2, 16).min(count - before);
        state = add_greedily(filter, target, candidates, state, more);
        if state.lobes.len() == before {
            break;
        }
        state = refine(filter, target, state, 4);
    }
    state
}

/// Moves the least important lobes to where most is left to explain, `rounds` times, keeping
/// what lowers the cost.
pub(super) fn relocate(
    filter: &Filter,
    target: &Target,
    candidates: &Candidates,
    mut state: State,
    rounds: usize,
) -> State {
    let n = state.lobes.len();
    let mut moves = (n / 8).max(1);
    for _ in 0..rounds {
        let importance = state.importance();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| importance[a].total_cmp(&importance[b]).then(a.cmp(&b)));
        let mut kept = order[moves.min(n)..].to_vec();
        kept.sort_unstable();
        let lobes = kept.iter().map(|&j| state.lobes[j]).collect();
        let start = [0, 1, 2].map(|c| kept.iter().map(|&j| state.amplitudes[c][j]).collect());
        let trial = State::solve(filter, target, lobes, &start);
        let trial = add_greedily(filter, target, candidates, trial, n - kept.len());
        let trial = refine(filter, target, trial, 6);
        if trial.cost < state.cost && trial.lobes.len() == n {
            state = trial;
        } else if moves == 1 {
            break;
        } else {
            moves = (moves / 2).max(1);
        }
    }
    state
}
