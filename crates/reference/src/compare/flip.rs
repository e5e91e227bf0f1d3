//! LDR-FLIP: the difference that a person sees when two pictures alternate on a screen.
//!
//! P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. Fairchild, "FLIP: A
//! Difference Evaluator for Alternating Images", HPG 2020. Sections and constants are the paper's.

use crate::compare::{CompareError, Layer};

/// The paper's viewing conditions: 0.7 m from a monitor 0.7 m and 3840 pixels wide.
pub const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * (std::f64::consts::PI / 180.0);

/// Exponent of the colour difference (4.1.3).
const Q_C: f64 = 0.7;
/// Share of the largest colour difference that is mapped to [`P_T`] (4.1.3).
const P_C: f64 = 0.4;
/// What that share is mapped to.
const P_T: f64 = 0.95;
/// Exponent of the feature difference (4.2.2).
const Q_F: f64 = 0.5;
/// Width of the edge and point detectors in degrees (4.2.1).
const FEATURE_WIDTH_DEG: f64 = 0.082;

/// Contrast sensitivity as sums of Gaussians `a sqrt(pi / b) exp(-pi^2 r^2 / b)`, r in degrees
/// (Table 1): achromatic, red-green, blue-yellow.
const SENSITIVITY: [&[[f64; 2]]; 3] = [
    &[[1.0, 0.0047]],
    &[[1.0, 0.0053]],
    &[[34.1, 0.04], [13.5, 0.025]],
];
/// The widest `b` above: it sets the radius of all three filters.
const WIDEST: f64 = 0.04;

/// Linear sRGB to XYZ (D65), and the white that it gives.
const XYZ: [[f64; 3]; 3] = [
    [
        10135552.0 / 24577794.0,
        8788810.0 / 24577794.0,
        4435075.0 / 24577794.0,
    ],
    [
        2613072.0 / 12288897.0,
        8788810.0 / 12288897.0,
        887015.0 / 12288897.0,
    ],
    [
        1425312.0 / 73733382.0,
        8788810.0 / 73733382.0,
        70074185.0 / 73733382.0,
    ],
];

/// The error of each pixel, 0..=1, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// 0: no difference to be seen, 1: the largest there is.
    pub errors: Vec<f32>,
}

impl FlipMap {
    /// Mean over all pixels.
    pub fn mean(&self) -> f64 {
        self.errors.iter().map(|x| f64::from(*x)).sum::<f64>() / self.errors.len() as f64
    }

    /// The error below which pixels hold the share `q` of the sum of all errors (the paper's
    /// weighted percentile, section 5): 0.5 is the weighted median. 0 for equal pictures.
    pub fn weighted_percentile(&self, q: f64) -> f64 {
        let mut sorted = self.errors.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        let total: f64 = sorted.iter().map(|x| f64::from(*x)).sum();
        let mut sum = 0.0;
        for error in &sorted {
            sum += f64::from(*error);
            if sum >= q * total {
                return f64::from(*error);
            }
        }
        0.0
    }
}

/// FLIP of two pictures of linear sRGB as a screen shows it, 0..=1 (values outside are clamped),
/// `width` pixels in a row.
///
/// # Errors
/// Different or no sizes.
pub fn flip(
    reference: &[[f32; 3]],
    test: &[[f32; 3]],
    width: usize,
    pixels_per_degree: f64,
) -> Result<FlipMap, CompareError> {
    if width == 0
        || reference.is_empty()
        || reference.len() != test.len()
        || !reference.len().is_multiple_of(width)
    {
        return Err(CompareError::FlipSizes);
    }
    let [reference, test] = [reference, test].map(|rgb| opponent(rgb, width));
    // Colour pipeline (4.1).
    let [seen, seen_test] = [&reference, &test].map(|o| perceived(o, pixels_per_degree));
    let largest = largest_colour_difference();
    // Feature pipeline (4.2).
    let features = [&reference, &test].map(|o| features(&o[0], pixels_per_degree));
    let errors = (0..seen.len())
        .map(|ix| {
            let colour = redistribute(hyab(seen[ix], seen_test[ix]).powf(Q_C), largest);
            let [edge, point] = [0, 1].map(|k| (features[0][k][ix] - features[1][k][ix]).abs());
            let feature = (edge.max(point) * std::f64::consts::FRAC_1_SQRT_2)
                .powf(Q_F)
                .clamp(0.0, 1.0);
            // Eq 12.
            colour.powf(1.0 - feature) as f32
        })
        .collect();
    Ok(FlipMap {
        width,
        height: reference[0].values.len() / width,
        errors,
    })
}

/// The two layers, tone mapped by `show`, through [`flip()`]; B is the reference.
impl FlipMap {
    /// FLIP of two layers after `show`, which maps linear radiance to linear sRGB in 0..=1.
    ///
    /// # Errors
    /// Different sizes.
    pub fn new(
        a: &Layer,
        b: &Layer,
        show: impl Fn([f32; 3]) -> [f32; 3],
    ) -> Result<FlipMap, CompareError> {
        let [test, reference] =
            [a, b].map(|layer| layer.rgb.iter().map(|rgb| show(*rgb)).collect::<Vec<_>>());
        if (a.width, a.height) != (b.width, b.height) {
            return Err(CompareError::FlipSizes);
        }
        flip(&reference, &test, a.width, PIXELS_PER_DEGREE)
    }
}

/// One channel of a picture.
struct Plane {
    width: usize,
    values: Vec<f64>,
}

impl Plane {
    /// Filters rows by `across` and columns by `down`, both of odd length; pixels beyond the
    /// border repeat it.
    fn filtered(&self, across: &[f64], down: &[f64]) -> Plane {
        let (width, height) = (self.width, self.values.len() / self.width);
        let clamped = |at: usize, tap: usize, radius: usize, end: usize| {
            (at + tap).saturating_sub(radius).min(end - 1)
        };
        let mut rows = vec![0.0; self.values.len()];
        for (row, source) in rows
            .chunks_exact_mut(width)
            .zip(self.values.chunks_exact(width))
        {
            for (x, out) in row.iter_mut().enumerate() {
                let taps = across.iter().enumerate();
                let at = |tap| source[clamped(x, tap, across.len() / 2, width)];
                *out = taps.map(|(tap, weight)| weight * at(tap)).sum();
            }
        }
        let mut values = vec![0.0; rows.len()];
        for (y, row) in values.chunks_exact_mut(width).enumerate() {
            for (tap, weight) in down.iter().enumerate() {
                let from = clamped(y, tap, down.len() / 2, height) * width;
                for (out, value) in row.iter_mut().zip(&rows[from..from + width]) {
                    *out += weight * value;
                }
            }
        }
        Plane { width, values }
    }
}

/// YCxCz of a picture (4.1.1).
fn opponent(rgb: &[[f32; 3]], width: usize) -> [Plane; 3] {
    let mut planes: [Vec<f64>; 3] = Default::default();
    for pixel in rgb {
        let [x, y, z] = relative_xyz(pixel.map(|v| f64::from(v.clamp(0.0, 1.0))));
        planes[0].push(116.0 * y - 16.0);
        planes[1].push(500.0 * (x - y));
        planes[2].push(200.0 * (y - z));
    }
    planes.map(|values| Plane { width, values })
}

/// XYZ over that of white.
fn relative_xyz(rgb: [f64; 3]) -> [f64; 3] {
    XYZ.map(|row| {
        let value: f64 = row.iter().zip(rgb).map(|(m, x)| m * x).sum();
        value / row.iter().sum::<f64>()
    })
}

/// Linear sRGB of YCxCz, clamped to what a screen can show.
fn rgb_of_opponent([y, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (y + 16.0) / 116.0;
    let relative = [y + cx / 500.0, y, y - cz / 200.0];
    let xyz = [0, 1, 2].map(|i| relative[i] * XYZ[i].iter().sum::<f64>());
    let m = glam::DMat3::from_cols_array_2d(&XYZ).transpose();
    (m.inverse() * glam::DVec3::from(xyz))
        .to_array()
        .map(|x| x.clamp(0.0, 1.0))
}

/// What is left after the eye's blur, in Hunt-adjusted L*a*b* (4.1.1, 4.1.2).
fn perceived(opponent: &[Plane; 3], pixels_per_degree: f64) -> Vec<[f64; 3]> {
    use std::f64::consts::PI;
    let radius = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
    let blurred: Vec<Vec<f64>> = opponent
        .iter()
        .zip(SENSITIVITY)
        .map(|(plane, gaussians)| {
            let kernels: Vec<(f64, Vec<f64>)> = gaussians
                .iter()
                .map(|[a, b]| {
                    let degrees = |tap: i32| f64::from(tap) / pixels_per_degree;
                    let taps: Vec<f64> = (-radius..=radius)
                        .map(|tap| (-PI * PI * degrees(tap).powi(2) / b).exp())
                        .collect();
                    (a * (PI / b).sqrt(), taps)
                })
                .collect();
            let mass = |(weight, taps): &(f64, Vec<f64>)| weight * taps.iter().sum::<f64>().powi(2);
            let total: f64 = kernels.iter().map(mass).sum();
            let mut sum = vec![0.0; plane.values.len()];
            for (weight, taps) in &kernels {
                let part = plane.filtered(taps, taps);
                for (sum, part) in sum.iter_mut().zip(&part.values) {
                    *sum += weight / total * part;
                }
            }
            sum
        })
        .collect();
    (0..blurred[0].len())
        .map(|ix| hunt_lab(rgb_of_opponent([0, 1, 2].map(|c| blurred[c][ix]))))
        .collect()
}

/// CIE L*a*b* with a* and b* scaled by L*/100: colours of dark places count less (4.1.2).
fn hunt_lab(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let [x, y, z] = relative_xyz(rgb).map(|t| {
        if t > DELTA.powi(3) {
            t.cbrt()
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    });
    let l = 116.0 * y - 16.0;
    [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
}

/// The HyAB distance: city block in lightness, Euclidean in colour (4.1.3).
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Between green and blue of sRGB, to the power [`Q_C`].
fn largest_colour_difference() -> f64 {
    hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(Q_C)
}

/// Stretches small differences over most of 0..=1 (4.1.3).
fn redistribute(difference: f64, largest: f64) -> f64 {
    let limit = P_C * largest;
    let value = if difference < limit {
        P_T / limit * difference
    } else {
        P_T + (difference - limit) / (largest - limit) * (1.0 - P_T)
    };
    value.clamp(0.0, 1.0)
}

/// Strength of edges and of points in the luminance (4.2.1).
fn features(luminance: &Plane, pixels_per_degree: f64) -> [Vec<f64>; 2] {
    let deviation = 0.5 * FEATURE_WIDTH_DEG * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as i32;
    let taps = || (-radius..=radius).map(f64::from);
    let gaussian: Vec<f64> = taps()
        .map(|x| (-x * x / (2.0 * deviation * deviation)).exp())
        .collect();
    let mass: f64 = gaussian.iter().sum();
    let smooth: Vec<f64> = gaussian.iter().map(|g| g / mass).collect();
    // First and second derivative; positive and negative weights have sum 1 each.
    let balanced = |weights: Vec<f64>| -> Vec<f64> {
        let sum = |sign: f64| -> f64 { weights.iter().map(|w| (sign * w).max(0.0)).sum() };
        let (positive, negative) = (sum(1.0), sum(-1.0));
        let scale = |w: f64| if w < 0.0 { w / negative } else { w / positive };
        weights.iter().map(|w| scale(*w)).collect()
    };
    let weighted = |factor: &dyn Fn(f64) -> f64| {
        balanced(taps().zip(&gaussian).map(|(x, g)| factor(x) * g).collect())
    };
    let edge = weighted(&|x| -x);
    let point = weighted(&|x| x * x / (deviation * deviation) - 1.0);
    let plane = Plane {
        width: luminance.width,
        values: luminance
            .values
            .iter()
            .map(|y| (y + 16.0) / 116.0)
            .collect(),
    };
    [edge, point].map(|kernel| {
        let across = plane.filtered(&kernel, &smooth);
        let down = plane.filtered(&smooth, &kernel);
        across
            .values
            .iter()
            .zip(&down.values)
            .map(|(x, y)| x.hypot(*y))
            .collect()
    })
}

#[cfg(test)]
#[path = "flip_tests.rs"]
mod tests;
