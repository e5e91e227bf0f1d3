//! Transforms of objects.
//!
//! Matrices multiply row vectors from the right, as in Alembic: p M, and a child's matrix stands
//! left of its parent's.

use super::archive::{Archive, Compound};
use crate::error::{Error, Result};

/// Rows, translation in the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Matrix([[f64; 4]; 4]);

impl Matrix {
    pub const IDENTITY: Matrix = Matrix([
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);

    fn scale(factors: [f64; 3]) -> Matrix {
        let mut matrix = Matrix::IDENTITY;
        for (axis, factor) in factors.into_iter().enumerate() {
            matrix.0[axis][axis] = factor;
        }
        matrix
    }

    fn translation([x, y, z]: [f64; 3]) -> Matrix {
        let mut matrix = Matrix::IDENTITY;
        matrix.0[3] = [x, y, z, 1.0];
        matrix
    }

    /// About `axis` by `degrees`; `None` without a direction.
    fn rotation(axis: [f64; 3], degrees: f64) -> Option<Matrix> {
        let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !(length.is_finite() && length > 0.0) {
            // No rotation needs no axis.
            return (degrees == 0.0).then_some(Matrix::IDENTITY);
        }
        let [x, y, z] = axis.map(|x| x / length);
        // Quarters exactly, for most files turn their axes so.
        let (sin, cos) = match degrees.rem_euclid(360.0) {
            0.0 => (0.0, 1.0),
            90.0 => (1.0, 0.0),
            180.0 => (0.0, -1.0),
            270.0 => (-1.0, 0.0),
            degrees => degrees.to_radians().sin_cos(),
        };
        let t = 1.0 - cos;
        Some(Matrix([
            [
                t * x * x + cos,
                t * x * y + sin * z,
                t * x * z - sin * y,
                0.0,
            ],
            [
                t * x * y - sin * z,
                t * y * y + cos,
                t * y * z + sin * x,
                0.0,
            ],
            [
                t * x * z + sin * y,
                t * y * z - sin * x,
                t * z * z + cos,
                0.0,
            ],
            [0.0, 0.0, 0.0, 1.0],
        ]))
    }

    /// `self` first, then `next`.
    pub fn then(&self, next: &Matrix) -> Matrix {
        let product = |row: usize, column: usize| -> f64 {
            (0..4).map(|k| self.0[row][k] * next.0[k][column]).sum()
        };
        Matrix([0, 1, 2, 3].map(|row| [0, 1, 2, 3].map(|column| product(row, column))))
    }

    /// Where `point` goes; exact for the identity.
    pub fn apply(&self, point: [f64; 3]) -> [f64; 3] {
        let rows = &self.0;
        [0, 1, 2].map(|axis| {
            point[0] * rows[0][axis]
                + point[1] * rows[1][axis]
                + point[2] * rows[2][axis]
                + rows[3][axis]
        })
    }

    /// How much longer things get: the cube root of how much larger volumes do.
    pub fn uniform_scale(&self) -> f64 {
        let [a, b, c, _] = &self.0;
        let determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        determinant.abs().cbrt()
    }

    /// Is it one of finite numbers that keeps parallels?
    fn is_affine(&self) -> bool {
        let finite = self.0.iter().flatten().all(|x| x.is_finite());
        let last = [0.0, 0.0, 0.0, 1.0];
        finite && (0..4).all(|row| (self.0[row][3] - last[row]).abs() <= 1e-9)
    }
}

/// The transform of the object called `path` at `time`, seconds, whose `.xform` this is, and does
/// that of its parent apply too?
///
/// An operation is a byte whose upper half says which, and takes its numbers from `.vals`; the last
/// one listed applies first.
pub(super) fn transform(
    archive: &Archive<'_>,
    xform: &Compound<'_>,
    time: f64,
    path: &str,
) -> Result<(Matrix, bool)> {
    let inherits = match xform.get(".inherits") {
        Some(property) => archive.values_at(property, time, path)?.doubles().next() != Some(0.0),
        None => true,
    };
    let (Some(ops), Some(vals)) = (xform.get(".ops"), xform.get(".vals")) else {
        return Ok((Matrix::IDENTITY, inherits));
    };
    let ops = archive.values_at(ops, time, path)?;
    let vals = archive.values_at(vals, time, path)?;
    let mut numbers = vals.doubles();
    let mut matrix = Matrix::IDENTITY;
    for op in ops.doubles() {
        let op = op as u8;
        let mut next = || {
            numbers.next().ok_or_else(|| {
                let what = format!("the transform of {path:?} lacks numbers for its operations");
                Error::invalid(what, vals.offset)
            })
        };
        let mut three = || Ok::<_, Error>([next()?, next()?, next()?]);
        let step = match op >> 4 {
            0 => Some(Matrix::scale(three()?)),
            1 => Some(Matrix::translation(three()?)),
            2 => {
                let axis = three()?;
                Matrix::rotation(axis, next()?)
            }
            3 => {
                let mut rows = Matrix::IDENTITY;
                for entry in rows.0.iter_mut().flatten() {
                    *entry = next()?;
                }
                Some(rows)
            }
            axis @ 4..=6 => {
                let mut unit = [0.0; 3];
                unit[usize::from(axis - 4)] = 1.0;
                Matrix::rotation(unit, next()?)
            }
            other => {
                let what = format!("the transform of {path:?} has an unknown operation, {other}");
                return Err(Error::invalid(what, ops.offset));
            }
        };
        let step = step.filter(Matrix::is_affine).ok_or_else(|| {
            let key = format!("transform of {path:?}");
            Error::value(key, format!("operation {}", op >> 4), "finite and affine")
        })?;
        matrix = step.then(&matrix);
    }
    Ok((matrix, inherits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_turn_the_right_way() {
        let turned = |axis, point| Matrix::rotation(axis, 90.0).unwrap().apply(point);
        for (axis, from, to) in [
            ([2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
            ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
            ([0.0, 0.0, 0.5], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ] {
            for (a, b) in turned(axis, from).into_iter().zip(to) {
                assert_eq!(a, b, "{axis:?}");
            }
        }
        let turned = Matrix::rotation([0.0, 0.0, 1.0], -30.0)
            .unwrap()
            .apply([2.0, 0.0, 0.0]);
        assert!((turned[0] - 3f64.sqrt()).abs() < 1e-15 && (turned[1] + 1.0).abs() < 1e-15);
        assert_eq!(Matrix::rotation([0.0; 3], 0.0), Some(Matrix::IDENTITY));
        assert_eq!(Matrix::rotation([0.0; 3], 1.0), None);
    }

    #[test]
    fn products_apply_from_left_to_right() {
        let both = Matrix::scale([2.0, 3.0, 4.0]).then(&Matrix::translation([1.0, 0.0, 0.0]));
        assert_eq!(both.apply([1.0, 1.0, 1.0]), [3.0, 3.0, 4.0]);
        assert!((both.uniform_scale() - 24f64.cbrt()).abs() < 1e-15);
        assert_eq!(Matrix::scale([-2.0, 2.0, 2.0]).uniform_scale(), 2.0);
        let mut projective = Matrix::IDENTITY;
        projective.0[0][3] = 0.1;
        assert!(!projective.is_affine() && both.is_affine());
    }
}
