//! Inner products of long single-precision columns.

use rayon::prelude::*;

use super::linear::Square;

/// Rows that are summed in f32 before they are added up in f64.
const STRIP: usize = 256;

/// Inner product of two columns.
pub(super) fn product(a: &[f32], b: &[f32]) -> f64 {
    let mut total = 0.0;
    for (a, b) in a.chunks(STRIP).zip(b.chunks(STRIP)) {
        let mut lanes = [0.0f32; 8];
        let (a8, a1) = a.as_chunks::<8>();
        let (b8, b1) = b.as_chunks::<8>();
        for (x, y) in a8.iter().zip(b8) {
            for k in 0..8 {
                lanes[k] += x[k] * y[k];
            }
        }
        let rest: f32 = a1.iter().zip(b1).map(|(x, y)| x * y).sum();
        total += f64::from(lanes.iter().sum::<f32>() + rest);
    }
    total
}

/// Sum of squares of all entries.
pub(super) fn sum_of_squares(columns: &[Vec<f32>; 3]) -> f64 {
    columns.iter().map(|column| product(column, column)).sum()
}

/// All inner products of `columns`. Each is made by one thread in one order, so the result does
/// not depend on their number.
pub(super) fn gram(columns: &[&[f32]]) -> Square {
    const TILE: usize = 4;
    let n = columns.len();
    let tiles = n.div_ceil(TILE);
    let pairs: Vec<(usize, usize)> = (0..tiles)
        .flat_map(|i| (0..=i).map(move |j| (i, j)))
        .collect();
    let blocks: Vec<[[f64; TILE]; TILE]> = pairs
        .par_iter()
        .with_min_len(16)
        .map(|&(i, j)| {
            let pick = |t: usize| [0, 1, 2, 3].map(|k| columns[(t * TILE + k).min(n - 1)]);
            tile(pick(i), pick(j))
        })
        .collect();
    let mut out = Square::zeros(n);
    for (&(i, j), block) in pairs.iter().zip(&blocks) {
        for (a, row) in block.iter().enumerate() {
            for (b, value) in row.iter().enumerate() {
                let (r, c) = (i * TILE + a, j * TILE + b);
                if r < n && c < n {
                    out.set(r, c, *value);
                    out.set(c, r, *value);
                }
            }
        }
    }
    out
}

/// Inner products of four columns with four others: each loaded value serves four products.
fn tile(a: [&[f32]; 4], b: [&[f32]; 4]) -> [[f64; 4]; 4] {
    let rows = a[0].len();
    let mut total = [[0.0f64; 4]; 4];
    for from in (0..rows).step_by(STRIP) {
        let to = (from + STRIP).min(rows);
        let strips_a = a.map(|column| &column[from..to]);
        let strips_b = b.map(|column| &column[from..to]);
        // Two by two, so that the sums stay in registers.
        for i in [0, 2] {
            for j in [0, 2] {
                let part = pair(
                    [strips_a[i], strips_a[i + 1]],
                    [strips_b[j], strips_b[j + 1]],
                );
                for (x, row) in part.iter().enumerate() {
                    for (y, value) in row.iter().enumerate() {
                        total[i + x][j + y] += f64::from(*value);
                    }
                }
            }
        }
    }
    total
}

fn pair(a: [&[f32]; 2], b: [&[f32]; 2]) -> [[f32; 2]; 2] {
    let (a0, a0_rest) = a[0].as_chunks::<8>();
    let (a1, a1_rest) = a[1].as_chunks::<8>();
    let (b0, b0_rest) = b[0].as_chunks::<8>();
    let (b1, b1_rest) = b[1].as_chunks::<8>();
    let mut lanes = [[[0.0f32; 8]; 2]; 2];
    for (((x0, x1), y0), y1) in a0.iter().zip(a1).zip(b0).zip(b1) {
        for k in 0..8 {
            lanes[0][0][k] += x0[k] * y0[k];
            lanes[0][1][k] += x0[k] * y1[k];
            lanes[1][0][k] += x1[k] * y0[k];
            lanes[1][1][k] += x1[k] * y1[k];
        }
    }
    let rest = |x: &[f32], y: &[f32]| -> f32 { x.iter().zip(y).map(|(x, y)| x * y).sum() };
    [
        [
            lanes[0][0].iter().sum::<f32>() + rest(a0_rest, b0_rest),
            lanes[0][1].iter().sum::<f32>() + rest(a0_rest, b1_rest),
        ],
        [
            lanes[1][0].iter().sum::<f32>() + rest(a1_rest, b0_rest),
            lanes[1][1].iter().sum::<f32>() + rest(a1_rest, b1_rest),
        ],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::sphere::Random;

    #[test]
    fn gram_matches_plain_products() {
        let mut random = Random::new(8);
        for (n, rows) in [(1, 3), (5, 600), (9, 257)] {
            let columns: Vec<Vec<f32>> = (0..n)
                .map(|_| (0..rows).map(|_| random.uniform() as f32 - 0.5).collect())
                .collect();
            let slices: Vec<&[f32]> = columns.iter().map(Vec::as_slice).collect();
            let gram = gram(&slices);
            for i in 0..n {
                for j in 0..n {
                    let exact: f64 = (0..rows)
                        .map(|k| f64::from(columns[i][k]) * f64::from(columns[j][k]))
                        .sum();
                    assert!((gram.get(i, j) - exact).abs() < 1e-5 * rows as f64);
                }
            }
        }
    }
}
