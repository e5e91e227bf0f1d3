//! Colour primaries of a file, converted to Rec.709.

use crate::error::DecodeError;

/// CIE 1931 xy of red, green, blue and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Primaries {
    pub red: [f64; 2],
    pub green: [f64; 2],
    pub blue: [f64; 2],
    pub white: [f64; 2],
}

/// Rec. ITU-R BT.709 with white D65.
pub(super) const REC_709: Primaries = Primaries {
    red: [0.64, 0.33],
    green: [0.30, 0.60],
    blue: [0.15, 0.06],
    white: [0.3127, 0.3290],
};

/// Three rows, applied to a column of red, green and blue.
pub(super) type Matrix = [[f64; 3]; 3];

/// Bradford cone response (Lam 1985).
const BRADFORD: Matrix = [
    [0.8951, 0.2664, -0.1614],
    [-0.7502, 1.7135, 0.0367],
    [0.0389, -0.0685, 1.0296],
];

impl Primaries {
    /// The matrix from RGB in these primaries to linear Rec.709; `None` if they are Rec.709's to
    /// the 3 digits that files state. White maps to white (Bradford adaptation), so a neutral
    /// map stays neutral.
    ///
    /// # Errors
    /// [`DecodeError::Primaries`] if they span no triangle.
    pub fn to_rec_709(self) -> Result<Option<Matrix>, DecodeError> {
        let flat = |p: Primaries| [p.red, p.green, p.blue, p.white];
        let same = flat(self)
            .iter()
            .flatten()
            .zip(flat(REC_709).iter().flatten())
            .all(|(a, b)| (a - b).abs() < 1e-3);
        if same {
            return Ok(None);
        }
        let unusable = || DecodeError::Primaries(flat(self));
        let own = self.to_xyz().ok_or_else(unusable)?;
        let from_xyz = REC_709
            .to_xyz()
            .and_then(|m| invert(&m))
            .ok_or_else(unusable)?;
        let cone = |white: [f64; 2]| apply(&BRADFORD, xyz_of(white));
        let (from, to) = (cone(self.white), cone(REC_709.white));
        let mut gain = BRADFORD;
        for k in 0..3 {
            let ratio = to[k] / from[k];
            gain[k] = gain[k].map(|x| x * ratio);
        }
        let adapt = invert(&BRADFORD)
            .map(|inverse| multiply(&inverse, &gain))
            .ok_or_else(unusable)?;
        let matrix = multiply(&from_xyz, &multiply(&adapt, &own));
        if matrix
            .iter()
            .flatten()
            .all(|x| x.is_finite() && x.abs() < 100.0)
        {
            Ok(Some(matrix))
        } else {
            Err(unusable())
        }
    }

    /// The matrix from RGB to XYZ with Y = 1 for white.
    fn to_xyz(self) -> Option<Matrix> {
        let [r, g, b] = [self.red, self.green, self.blue].map(xyz_of);
        let columns = [[r[0], g[0], b[0]], [r[1], g[1], b[1]], [r[2], g[2], b[2]]];
        let scale = apply(&invert(&columns)?, xyz_of(self.white));
        Some(columns.map(|row| [row[0] * scale[0], row[1] * scale[1], row[2] * scale[2]]))
    }
}

/// Applies `matrix` to a pixel.
pub(super) fn convert(matrix: &Matrix, rgb: [f32; 3]) -> [f32; 3] {
    apply(matrix, rgb.map(f64::from)).map(|x| x as f32)
}

fn xyz_of([x, y]: [f64; 2]) -> [f64; 3] {
    [x / y, 1.0, (1.0 - x - y) / y]
}

fn apply(m: &Matrix, v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    a.map(|row| {
        let mut out = [0.0; 3];
        for (c, value) in out.iter_mut().enumerate() {
            *value = (0..3).map(|k| row[k] * b[k][c]).sum();
        }
        out
    })
}

fn invert(m: &Matrix) -> Option<Matrix> {
    let minor = |r: usize, c: usize| {
        let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let determinant: f64 = (0..3).map(|c| m[0][c] * minor(0, c)).sum();
    if !determinant.is_finite() || determinant.abs() < 1e-9 {
        return None;
    }
    let mut out = [[0.0; 3]; 3];
    for (r, row) in out.iter_mut().enumerate() {
        for (c, value) in row.iter_mut().enumerate() {
            *value = minor(c, r) / determinant;
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ACES_AP0: Primaries = Primaries {
        red: [0.7347, 0.2653],
        green: [0.0, 1.0],
        blue: [0.0001, -0.077],
        white: [0.32168, 0.33767],
    };

    #[test]
    fn rec_709_needs_no_conversion() {
        assert!(matches!(REC_709.to_rec_709(), Ok(None)));
    }

    #[test]
    fn aces_converts_as_published() {
        // ACES2065-1 to linear Rec.709, Bradford: the widely published matrix.
        let expected = [
            [2.521_686, -1.134_131, -0.387_555],
            [-0.276_480, 1.372_719, -0.096_239],
            [-0.015_378, -0.152_975, 1.168_353],
        ];
        let matrix = ACES_AP0.to_rec_709().unwrap().unwrap();
        for (row, expected) in matrix.iter().zip(&expected) {
            for (a, b) in row.iter().zip(expected) {
                assert!((a - b).abs() < 2e-3, "{matrix:?}");
            }
        }
        let white = convert(&matrix, [1.0; 3]);
        assert!(white.iter().all(|x| (x - 1.0).abs() < 1e-6), "{white:?}");
    }

    #[test]
    fn primaries_without_area_are_refused() {
        let flat = Primaries {
            red: [0.3, 0.3],
            green: [0.3, 0.3],
            ..REC_709
        };
        assert!(flat.to_rec_709().is_err());
        let zero = Primaries {
            red: [0.0; 2],
            green: [0.0; 2],
            blue: [0.0; 2],
            white: [0.0; 2],
        };
        assert!(zero.to_rec_709().is_err());
    }
}
