//! What most of many vectors lies along: eigenvectors of symmetric matrices.

/// A symmetric matrix.
pub(super) type Matrix<const N: usize> = [[f64; N]; N];

/// The eigenvectors of the largest eigenvalues of a symmetric matrix, by Jacobi's rotations.
pub(super) fn leading<const N: usize, const COUNT: usize>(
    mut matrix: Matrix<N>,
) -> [[f64; N]; COUNT] {
    let mut vectors: Matrix<N> = std::array::from_fn(|a| {
        let mut unit = [0.0; N];
        unit[a] = 1.0;
        unit
    });
    for _sweep in 0..12 {
        for p in 0..N {
            for q in p + 1..N {
                let off = matrix[p][q];
                if off.abs() < 1e-30 {
                    continue;
                }
                let theta = (matrix[q][q] - matrix[p][p]) / (2.0 * off);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for row in &mut matrix {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                let (a, b) = (matrix[p], matrix[q]);
                matrix[p] = std::array::from_fn(|k| c * a[k] - s * b[k]);
                matrix[q] = std::array::from_fn(|k| s * a[k] + c * b[k]);
                let (a, b) = (vectors[p], vectors[q]);
                vectors[p] = std::array::from_fn(|k| c * a[k] - s * b[k]);
                vectors[q] = std::array::from_fn(|k| s * a[k] + c * b[k]);
            }
        }
    }
    let mut order: [usize; N] = std::array::from_fn(|k| k);
    order.sort_by(|&a, &b| matrix[b][b].total_cmp(&matrix[a][a]));
    std::array::from_fn(|f| vectors[order[f]])
}

/// Rounds of [`leading_space`].
const N_ROUNDS: usize = 12;

/// Orthonormal vectors that span about the space of those of the largest eigenvalues, by orthogonal
/// iteration, for matrices that are too large for all of them. Vectors of no eigenvalue are 0.
pub(super) fn leading_space<const N: usize, const COUNT: usize>(
    matrix: &Matrix<N>,
) -> [[f64; N]; COUNT] {
    let mut order: [usize; N] = std::array::from_fn(|k| k);
    order.sort_by(|&a, &b| matrix[b][b].total_cmp(&matrix[a][a]));
    let mut space: [[f64; N]; COUNT] = std::array::from_fn(|f| matrix[order[f]]);
    orthonormalise(&mut space);
    for _round in 0..N_ROUNDS {
        let product = |vector| std::array::from_fn(|a| dot(&matrix[a], &vector));
        space = space.map(product);
        orthonormalise(&mut space);
    }
    space
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// By Gram and Schmidt, each twice against rounding.
fn orthonormalise<const N: usize>(space: &mut [[f64; N]]) {
    for ix in 0..space.len() {
        let (before, [vector, ..]) = space.split_at_mut(ix) else {
            return;
        };
        let size = dot(vector, vector).sqrt();
        for _time in 0..2 {
            for other in &*before {
                let along = dot(other, vector);
                for (value, other) in vector.iter_mut().zip(other) {
                    *value -= along * other;
                }
            }
        }
        let rest = dot(vector, vector).sqrt();
        let scale = if rest > 1e-10 * size { 1.0 / rest } else { 0.0 };
        *vector = vector.map(|value| scale * value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 6;

    #[test]
    fn leading_vectors_are_eigenvectors() {
        let matrix: Matrix<SIZE> = std::array::from_fn(|a| {
            std::array::from_fn(|b| {
                let (a, b) = (a as f64, b as f64);
                1.0 / (1.0 + a + b) + if a == b { a * a } else { 0.0 }
            })
        });
        let mut last = f64::INFINITY;
        for vector in leading::<_, 3>(matrix) {
            let image: [f64; SIZE] =
                matrix.map(|row| row.iter().zip(vector).map(|(m, v)| m * v).sum());
            let value: f64 = image.iter().zip(vector).map(|(a, b)| a * b).sum();
            for (a, b) in image.into_iter().zip(vector) {
                assert!((a - value * b).abs() < 1e-9, "{a} {b}");
            }
            assert!(value < last);
            last = value;
        }
    }

    /// Of a matrix of three vectors, of lengths that fall.
    #[test]
    fn the_leading_space_is_that_of_the_leading_vectors() {
        let vectors: [[f64; SIZE]; 3] = std::array::from_fn(|f| {
            std::array::from_fn(|k| ((1.0 + f as f64) * (1.0 + k as f64)).sin() / (1 << f) as f64)
        });
        let entry = |a: usize, b: usize| vectors.iter().map(|v| v[a] * v[b]).sum();
        let matrix: Matrix<SIZE> = std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b)));
        let space: [_; 2] = leading_space(&matrix);
        for vector in leading::<SIZE, 2>(matrix) {
            let within: f64 = space.iter().map(|one| dot(one, &vector).powi(2)).sum();
            assert!((within - 1.0).abs() < 1e-4, "{within}");
        }
        // Beyond the three there is nothing.
        let all: [_; 5] = leading_space(&matrix);
        for (f, vector) in all.iter().enumerate() {
            let size = dot(vector, vector);
            assert!(
                (size - f64::from(u8::from(f < 3))).abs() < 1e-9,
                "{f}: {size}"
            );
        }
        let none: [_; 3] = leading_space(&[[0.0; SIZE]; SIZE]);
        assert_eq!(none, [[0.0; SIZE]; 3]);
    }
}
