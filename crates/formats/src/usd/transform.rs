//! The stack of transforms of a prim.
//!
//! Points are rows: p' = p M. Of the operations `[a, b, c]` in `xformOpOrder` the last is applied
//! first, M = M_c M_b M_a; that of the prim comes before those of the prims above it.

use super::layer::Layer;
use super::model::Prim;
use super::time::{Moment, samples_of};
use crate::error::{Error, Result};

/// Rows of a matrix.
pub(super) type Matrix = [[f64; 4]; 4];

/// Leaves everything where it is.
pub(super) const IDENTITY: Matrix = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
    [0.0, 0.0, 0.0, 1.0],
];

/// `a`, then `b`.
pub(super) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let entry = |row: usize, column: usize| (0..4).map(|k| a[row][k] * b[k][column]).sum();
    [0, 1, 2, 3].map(|row| [0, 1, 2, 3].map(|column| entry(row, column)))
}

/// Where `point` goes.
pub(super) fn apply(matrix: &Matrix, point: [f64; 3]) -> [f64; 3] {
    let column = |column: usize| {
        let sum: f64 = (0..3).map(|row| point[row] * matrix[row][column]).sum();
        sum + matrix[3][column]
    };
    let w = column(3);
    [0, 1, 2].map(|axis| column(axis) / w)
}

/// How much longer lengths become on average: the cube root of the determinant.
pub(super) fn scale(matrix: &Matrix) -> f64 {
    determinant(matrix).abs().cbrt()
}

fn determinant(m: &Matrix) -> f64 {
    m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
        - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
        + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
}

/// The inverse, by Gauss and Jordan with pivots.
fn inverse(matrix: &Matrix) -> Option<Matrix> {
    let mut left = *matrix;
    let mut right = IDENTITY;
    for column in 0..4 {
        let pivot = (column..4).max_by(|&a, &b| {
            let size = |row: usize| left[row][column].abs();
            size(a).total_cmp(&size(b))
        })?;
        left.swap(column, pivot);
        right.swap(column, pivot);
        let by = left[column][column];
        if by == 0.0 || !by.is_finite() {
            return None;
        }
        for row in [&mut left[column], &mut right[column]] {
            row.iter_mut().for_each(|x| *x /= by);
        }
        for row in (0..4).filter(|&row| row != column) {
            let by = left[row][column];
            for k in 0..4 {
                left[row][k] -= by * left[column][k];
                right[row][k] -= by * right[column][k];
            }
        }
    }
    Some(right)
}

/// What a prim does to what is in it, at a moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    /// From the prim to the one above it.
    pub matrix: Matrix,
    /// Transforms of the prims above do not count.
    pub resets: bool,
}

/// The operations of `prim`, called `path` in messages.
pub(super) fn local(layer: &Layer, prim: &Prim, path: &str, moment: Moment) -> Result<Local> {
    let mut local = Local {
        matrix: IDENTITY,
        resets: false,
    };
    for name in operations(layer, prim)? {
        if name == RESET {
            local = Local {
                matrix: IDENTITY,
                resets: true,
            };
            continue;
        }
        let (is_inverse, name) = match name.strip_prefix("!invert!") {
            Some(name) => (true, name),
            None => (false, &*name),
        };
        let fault = |value: String| {
            let range = "one of USD's transforms with a value of its own";
            Err(Error::value(format!("{name} of {path}"), value, range))
        };
        // An operation without a value, or of one that is blocked, does nothing.
        let Some(property) = prim.properties.get(name) else {
            continue;
        };
        // `xformOp:translate:orientPivot` is none.
        let is_orient = name.split(':').nth(1) == Some("orient");
        let Some(numbers) = moment.transform(layer, property, is_orient)? else {
            continue;
        };
        let Some(matrix) = operation(name, &numbers) else {
            return fault(format!("{numbers:?}"));
        };
        let matrix = match is_inverse {
            true => inverse(&matrix),
            false => Some(matrix),
        };
        match matrix {
            Some(matrix) => local.matrix = product(&matrix, &local.matrix),
            None => return fault("without an inverse".to_owned()),
        }
    }
    Ok(local)
}

const RESET: &str = "!resetXformStack!";

/// Names in `xformOpOrder`.
fn operations(layer: &Layer, prim: &Prim) -> Result<Vec<String>> {
    let order = prim.properties.get("xformOpOrder");
    match order.and_then(|order| order.default.as_ref()) {
        Some(order) if !layer.is_blocked(order) => layer.strings(order),
        _ => Ok(Vec::new()),
    }
}

/// Times at which the transform of `prim` is written.
pub(super) fn times(layer: &Layer, prim: &Prim) -> Result<Vec<f64>> {
    let mut times = Vec::new();
    for name in operations(layer, prim)? {
        let name = name.strip_prefix("!invert!").unwrap_or(&name);
        times.extend(samples_of(prim.properties.get(name)));
    }
    Ok(times)
}

/// The matrix of the operation called `xformOp:kind:suffix`.
fn operation(name: &str, numbers: &[f64]) -> Option<Matrix> {
    let kind = name.strip_prefix("xformOp:")?.split(':').next()?;
    let mut matrix = IDENTITY;
    match (kind, numbers) {
        ("translate", &[x, y, z]) => matrix[3] = [x, y, z, 1.0],
        ("translateX", &[x]) => matrix[3][0] = x,
        ("translateY", &[y]) => matrix[3][1] = y,
        ("translateZ", &[z]) => matrix[3][2] = z,
        ("scale", &[x, y, z]) => (matrix[0][0], matrix[1][1], matrix[2][2]) = (x, y, z),
        ("scaleX", &[x]) => matrix[0][0] = x,
        ("scaleY", &[y]) => matrix[1][1] = y,
        ("scaleZ", &[z]) => matrix[2][2] = z,
        ("orient", &[w, x, y, z]) => return Some(quaternion([w, x, y, z])),
        ("transform", numbers) => {
            let (rows, []) = numbers.as_chunks::<4>() else {
                return None;
            };
            return rows.try_into().ok();
        }
        _ => {
            let axes = kind.strip_prefix("rotate")?;
            if axes.len() != numbers.len() || !matches!(axes.len(), 1 | 3) {
                return None;
            }
            // Angles stand in the order x, y, z, whatever that of the turns.
            for axis in axes.bytes() {
                let axis = usize::from(axis.checked_sub(b'X')?);
                let angle = match numbers {
                    [angle] => angle,
                    angles => angles.get(axis)?,
                };
                matrix = product(&matrix, &rotation(axis, *angle)?);
            }
        }
    }
    Some(matrix)
}

/// A turn about an axis, 0..=2, by degrees.
fn rotation(axis: usize, degrees: f64) -> Option<Matrix> {
    let (a, b) = [(1, 2), (2, 0), (0, 1)].get(axis).copied()?;
    let (sin, cos) = match degrees {
        // Without rounding, so that axes stay axes.
        90.0 => (1.0, 0.0),
        -90.0 => (-1.0, 0.0),
        180.0 | -180.0 => (0.0, -1.0),
        _ => degrees.to_radians().sin_cos(),
    };
    let mut matrix = IDENTITY;
    (matrix[a][a], matrix[a][b]) = (cos, sin);
    (matrix[b][a], matrix[b][b]) = (-sin, cos);
    Some(matrix)
}

/// The turn of a quaternion, real part first, of whatever length.
fn quaternion([w, x, y, z]: [f64; 4]) -> Matrix {
    let square = w * w + x * x + y * y + z * z;
    if square == 0.0 {
        return IDENTITY;
    }
    let s = 2.0 / square;
    [
        [
            1.0 - s * (y * y + z * z),
            s * (x * y + z * w),
            s * (x * z - y * w),
            0.0,
        ],
        [
            s * (x * y - z * w),
            1.0 - s * (x * x + z * z),
            s * (y * z + x * w),
            0.0,
        ],
        [
            s * (x * z + y * w),
            s * (y * z - x * w),
            1.0 - s * (x * x + y * y),
            0.0,
        ],
        [0.0, 0.0, 0.0, 1.0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(name: &str, numbers: &[f64], point: [f64; 3]) -> [f64; 3] {
        apply(&operation(name, numbers).unwrap(), point)
    }

    fn assert_near(a: [f64; 3], b: [f64; 3]) {
        assert!(
            (0..3).all(|ix| (a[ix] - b[ix]).abs() < 1e-12),
            "{a:?} {b:?}"
        );
    }

    #[test]
    fn operations_move_points() {
        let point = [1.0, 2.0, 3.0];
        assert_near(
            moved("xformOp:translate", &[1.0, 0.0, -1.0], point),
            [2.0, 2.0, 2.0],
        );
        assert_near(
            moved("xformOp:scale:a:b", &[2.0, 3.0, 4.0], point),
            [2.0, 6.0, 12.0],
        );
        assert_near(moved("xformOp:scaleY", &[2.0], point), [1.0, 4.0, 3.0]);
        // x turns to y about z.
        assert_near(
            moved("xformOp:rotateZ", &[90.0], [1.0, 0.0, 0.0]),
            [0.0, 1.0, 0.0],
        );
        assert_near(
            moved("xformOp:rotateX", &[30.0], [0.0, 1.0, 0.0]),
            [0.0, 0.75f64.sqrt(), 0.5],
        );
        // About x first, then z.
        let turned = moved("xformOp:rotateXZY", &[90.0, 0.0, 90.0], [0.0, 1.0, 0.0]);
        assert_near(turned, [0.0, 0.0, 1.0]);
        let half = 0.5f64.sqrt();
        assert_near(
            moved("xformOp:orient", &[half, 0.0, 0.0, half], [1.0, 0.0, 0.0]),
            [0.0, 1.0, 0.0],
        );
        let mut flat = vec![0.0; 16];
        (0..4).for_each(|ix| flat[5 * ix] = 2.0);
        flat[12] = 4.0;
        assert_near(moved("xformOp:transform", &flat, point), [3.0, 2.0, 3.0]);
        for (name, n) in [
            ("xformOp:rotateXY", 2),
            ("xformOp:shear", 3),
            ("translate", 3),
            ("xformOp:transform", 9),
            ("xformOp:rotateABC", 3),
            ("xformOp:rotate", 0),
        ] {
            assert!(operation(name, &vec![1.0; n]).is_none(), "{name}");
        }
    }

    #[test]
    fn matrices_are_inverted() {
        let matrix = product(
            &operation("xformOp:rotateXYZ", &[10.0, 20.0, 30.0]).unwrap(),
            &operation("xformOp:translate", &[1.0, 2.0, 3.0]).unwrap(),
        );
        let back = apply(&inverse(&matrix).unwrap(), apply(&matrix, [4.0, 5.0, 6.0]));
        assert_near(back, [4.0, 5.0, 6.0]);
        assert!((scale(&matrix) - 1.0).abs() < 1e-12);
        assert!(inverse(&[[0.0; 4]; 4]).is_none());
    }
}
