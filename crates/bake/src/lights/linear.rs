//! Small dense least squares: Cholesky and non-negative least squares on normal equations.

/// Problems above this size are solved by coordinate descent instead of an active set, whose
/// factorisations would take the cube of it.
const ACTIVE_SET_LIMIT: usize = 160;

/// Sweeps of the coordinate descent.
const SWEEPS: usize = 400;

/// A symmetric matrix or its Cholesky factor, row by row.
#[derive(Clone, Debug)]
pub(super) struct Square {
    pub n: usize,
    pub values: Vec<f64>,
}

impl Square {
    pub fn zeros(n: usize) -> Self {
        Square {
            n,
            values: vec![0.0; n * n],
        }
    }

    pub fn get(&self, i: usize, j: usize) -> f64 {
        self.values[i * self.n + j]
    }

    pub fn set(&mut self, i: usize, j: usize, value: f64) {
        self.values[i * self.n + j] = value;
    }

    /// Rows and columns `keep` of this matrix.
    pub fn select(&self, keep: &[usize]) -> Square {
        let mut out = Square::zeros(keep.len());
        for (a, &i) in keep.iter().enumerate() {
            for (b, &j) in keep.iter().enumerate() {
                out.set(a, b, self.get(i, j));
            }
        }
        out
    }

    /// The lower factor of `self + tiny diagonal`; pivots that are lost to rounding are replaced
    /// so that the unknown concerned becomes 0.
    pub fn cholesky(mut self) -> Cholesky {
        let n = self.n;
        let largest = (0..n).map(|i| self.get(i, i)).fold(0.0, f64::max);
        for j in 0..n {
            for i in j..n {
                let (head, tail) = self.values.split_at(i * n);
                let row_j = if i == j {
                    &tail[..j]
                } else {
                    &head[j * n..j * n + j]
                };
                let sum: f64 = tail[..j].iter().zip(row_j).map(|(a, b)| a * b).sum();
                let value = self.get(i, j) - sum;
                if i == j {
                    let lost = value <= 1e-12 * largest || !value.is_finite();
                    self.set(j, j, if lost { 1e150 } else { value.sqrt() });
                } else {
                    let pivot = self.get(j, j);
                    self.set(i, j, value / pivot);
                }
            }
        }
        Cholesky(self)
    }
}

/// A lower triangular factor.
pub(super) struct Cholesky(Square);

impl Cholesky {
    /// Solves `L y = b` in place.
    pub fn forward(&self, b: &mut [f64]) {
        let n = self.0.n;
        for i in 0..n {
            let row = &self.0.values[i * n..i * n + i];
            let sum: f64 = row.iter().zip(&*b).map(|(l, y)| l * y).sum();
            b[i] = (b[i] - sum) / self.0.get(i, i);
        }
    }

    /// Solves `L L^T x = b` in place.
    pub fn solve(&self, b: &mut [f64]) {
        self.forward(b);
        for i in (0..self.0.n).rev() {
            let x = b[i] / self.0.get(i, i);
            b[i] = x;
            for (j, value) in b[..i].iter_mut().enumerate() {
                *value -= self.0.get(i, j) * x;
            }
        }
    }

    /// The diagonal of the inverse of the factored matrix.
    pub fn inverse_diagonal(&self) -> Vec<f64> {
        let n = self.0.n;
        (0..n)
            .map(|k| {
                let mut e = vec![0.0; n];
                e[k] = 1.0;
                self.forward(&mut e);
                e.iter().map(|x| x * x).sum()
            })
            .collect()
    }
}

/// The `x >= 0` that minimises `x^T s x - 2 q^T x`, by Lawson and Hanson's active set started from
/// the positive entries of `start`; by coordinate descent from `start` for large problems.
pub(super) fn nnls(s: &Square, q: &[f64], start: &[f64]) -> Vec<f64> {
    if s.n > ACTIVE_SET_LIMIT {
        return coordinate_descent(s, q, start);
    }
    let n = s.n;
    let scale = q.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let mut x = vec![0.0; n];
    let mut passive: Vec<bool> = start.iter().map(|a| *a > 0.0).collect();
    // Each entry enters a few times at most; the bound only guards against rounding cycles.
    let mut fresh = true;
    for _ in 0..4 * n + 8 {
        if !fresh {
            // The gradient of the entries at zero: let the steepest in.
            let best = (0..n)
                .filter(|&i| !passive[i] && s.get(i, i) > 0.0)
                .map(|i| (q[i] - dot_row(s, i, &x), i))
                .fold(
                    (1e-9 * scale, usize::MAX),
                    |a, b| if b.0 > a.0 { b } else { a },
                );
            if best.1 == usize::MAX {
                break;
            }
            passive[best.1] = true;
        }
        // Solve on the passive set; walk back until nothing is negative.
        for _ in 0..=n {
            let keep: Vec<usize> = (0..n).filter(|&i| passive[i]).collect();
            let mut z: Vec<f64> = keep.iter().map(|&i| q[i]).collect();
            s.select(&keep).cholesky().solve(&mut z);
            if z.iter().all(|v| *v > 0.0) {
                x = vec![0.0; n];
                for (&i, &v) in keep.iter().zip(&z) {
                    x[i] = v;
                }
                break;
            }
            if fresh {
                // No feasible point yet to walk from: drop what came out negative.
                for (&i, &v) in keep.iter().zip(&z) {
                    passive[i] = v > 0.0;
                }
                continue;
            }
            let step = keep
                .iter()
                .zip(&z)
                .filter(|(_, v)| **v <= 0.0)
                .map(|(&i, v)| x[i] / (x[i] - v))
                .fold(1.0f64, f64::min);
            for (&i, &v) in keep.iter().zip(&z) {
                x[i] += step * (v - x[i]);
                if x[i] <= 1e-14 || (v <= 0.0 && step == 0.0) {
                    x[i] = 0.0;
                    passive[i] = false;
                }
            }
        }
        fresh = false;
    }
    x
}

fn dot_row(s: &Square, i: usize, x: &[f64]) -> f64 {
    s.values[i * s.n..(i + 1) * s.n]
        .iter()
        .zip(x)
        .map(|(a, b)| a * b)
        .sum()
}

fn coordinate_descent(s: &Square, q: &[f64], start: &[f64]) -> Vec<f64> {
    let mut x = start.to_vec();
    let scale = q.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    for _ in 0..SWEEPS {
        let mut largest = 0.0f64;
        for i in 0..s.n {
            let diagonal = s.get(i, i);
            if diagonal <= 0.0 {
                continue;
            }
            let gradient = q[i] - dot_row(s, i, &x);
            let next = (x[i] + gradient / diagonal).max(0.0);
            largest = largest.max((next - x[i]).abs() * diagonal);
            x[i] = next;
        }
        if largest <= 1e-7 * scale {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::sphere::Random;

    fn random_problem(n: usize, seed: u64) -> (Square, Vec<f64>) {
        let mut random = Random::new(seed);
        let rows = 2 * n;
        let a: Vec<f64> = (0..rows * n).map(|_| random.uniform() - 0.3).collect();
        let b: Vec<f64> = (0..rows).map(|_| random.uniform() - 0.5).collect();
        let mut s = Square::zeros(n);
        for i in 0..n {
            for j in 0..n {
                s.set(i, j, (0..rows).map(|r| a[r * n + i] * a[r * n + j]).sum());
            }
        }
        let q = (0..n)
            .map(|i| (0..rows).map(|r| a[r * n + i] * b[r]).sum())
            .collect();
        (s, q)
    }

    #[test]
    fn cholesky_solves() {
        let (s, q) = random_problem(12, 3);
        let mut x = q.clone();
        s.clone().cholesky().solve(&mut x);
        for (i, q) in q.iter().enumerate() {
            assert!((dot_row(&s, i, &x) - q).abs() < 1e-9);
        }
    }

    #[test]
    fn solutions_meet_the_optimality_conditions() {
        for n in [1, 5, 30, 170] {
            for seed in 0..5 {
                let (s, q) = random_problem(n, seed);
                for start in [vec![0.0; n], vec![1.0; n]] {
                    let x = nnls(&s, &q, &start);
                    let scale = q.iter().fold(0.0f64, |m, v| m.max(v.abs()));
                    for i in 0..n {
                        let gradient = q[i] - dot_row(&s, i, &x);
                        assert!(x[i] >= 0.0);
                        assert!(gradient <= 1e-5 * scale, "{n} {seed} {i} {gradient}");
                        assert!(x[i] == 0.0 || gradient.abs() <= 1e-5 * scale);
                    }
                }
            }
        }
    }

    #[test]
    fn singular_problems_have_an_answer() {
        // Two equal columns.
        let mut s = Square::zeros(2);
        s.values = vec![1.0; 4];
        let x = nnls(&s, &[1.0, 1.0], &[1.0, 1.0]);
        assert!((x[0] + x[1] - 1.0).abs() < 1e-6, "{x:?}");
        assert_eq!(nnls(&Square::zeros(1), &[0.0], &[0.0]), [0.0]);
    }
}
