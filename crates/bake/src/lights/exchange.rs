//! Light sets for other programs: what their numbers mean, and arrays of them.
//!
//! Everywhere a light is `rgb * exp(sharpness * (dot(direction, axis) - 1))` with `sharpness = 2 /
//! lambda^2`: the spherical Gaussian of graphics in another notation of its width.

use std::f64::consts::PI;
use std::fmt::Write as _;

use strandlight_formats::{LightSet, SrbfLight};

use super::radiance;

/// Radiance from direction `w`, in terms of the fields of an exported light.
pub const FORMULA: &str =
    "radiance(w) = sum of rgb * exp(sharpness * (dot(w, direction) - 1)); sharpness = 2 / lambda^2";
/// What the axes of directions are.
pub const FRAME: &str = "right-handed, +Y up; OpenEXR's latitude-longitude maps have +Z in the middle and +X left of it";
/// What the nine coefficients of [`sh9`] are for.
pub const SH9_BASIS: &str = "real, of radiance, in the order 1, y, z, x, xy, yz, 3 z^2 - 1, xz, x^2 - y^2 with factors \
     0.282095, 3 x 0.488603, 1.092548, 1.092548, 0.315392, 1.092548, 0.546274";

/// Sharpness of a light of width `lambda`.
pub fn sharpness(lambda: f32) -> f64 {
    2.0 / f64::from(lambda).powi(2)
}

/// Width lambda of a light of that sharpness.
pub fn lambda(sharpness: f64) -> f64 {
    (2.0 / sharpness).sqrt()
}

/// A direction and what comes from there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestDirection {
    /// Unit vector.
    pub direction: [f64; 3],
    /// Radiance of the light set, linear RGB.
    pub radiance: [f64; 3],
}

/// Eight directions with their radiance, to check an evaluation by: the six axes and two that tell
/// mirrored axes apart.
pub fn test_directions(lights: &[SrbfLight]) -> [TestDirection; 8] {
    let slanted = |[x, y, z]: [f64; 3]| {
        let length = (x * x + y * y + z * z).sqrt();
        [x / length, y / length, z / length]
    };
    let directions = [
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        slanted([1.0, 2.0, 3.0]),
        slanted([-3.0, 1.0, 2.0]),
    ];
    directions.map(|direction| TestDirection {
        direction,
        radiance: radiance(lights, direction),
    })
}

/// Coefficients of the radiance in real spherical harmonics of degrees 0 to 2: see [`SH9_BASIS`].
///
/// A light is symmetric about its axis, so its coefficient is that of the axis times 4 pi exp(-s)
/// i_l(s), i_l the modified spherical Bessel function.
pub fn sh9(lights: &[SrbfLight]) -> [[f64; 3]; 9] {
    let mut sum = [[0.0; 3]; 9];
    for light in lights {
        let zonal = zonal(sharpness(light.lambda));
        let basis = basis(light.direction.map(f64::from));
        for (ix, (sum, basis)) in sum.iter_mut().zip(basis).enumerate() {
            let degree = [0, 1, 1, 1, 2, 2, 2, 2, 2][ix];
            for (sum, rgb) in sum.iter_mut().zip(light.rgb) {
                *sum += f64::from(rgb) * zonal[degree] * basis;
            }
        }
    }
    sum
}

/// Real spherical harmonics of degrees 0 to 2.
fn basis([x, y, z]: [f64; 3]) -> [f64; 9] {
    [
        0.282_094_791_773_878_14,
        0.488_602_511_902_919_9 * y,
        0.488_602_511_902_919_9 * z,
        0.488_602_511_902_919_9 * x,
        1.092_548_430_592_079_2 * x * y,
        1.092_548_430_592_079_2 * y * z,
        0.315_391_565_252_520_05 * (3.0 * z * z - 1.0),
        1.092_548_430_592_079_2 * x * z,
        0.546_274_215_296_039_6 * (x * x - y * y),
    ]
}

/// 2 pi times the integrals of exp(s (t - 1)) P_l(t) over t in -1..1, for l = 0, 1, 2.
fn zonal(s: f64) -> [f64; 3] {
    let e = (-2.0 * s).exp();
    let i0 = (1.0 - e) / (2.0 * s);
    // Differences of close numbers where the light is wide.
    let (i1, i2) = if s < 0.02 {
        let small = (-s).exp();
        (
            small * s / 3.0 * (1.0 + s * s / 10.0),
            small * s * s / 15.0 * (1.0 + s * s / 14.0),
        )
    } else {
        let i1 = (1.0 + e) / (2.0 * s) - i0 / s;
        (i1, i0 - 3.0 * i1 / s)
    };
    [i0, i1, i2].map(|i| 4.0 * PI * i)
}

/// Direction x, y, z, sharpness, r, g, b of each light: the layout of PhySG and its kin.
pub fn to_array(lights: &[SrbfLight]) -> Vec<f32> {
    let rows = lights.iter().flat_map(|light| {
        let ([x, y, z], [r, g, b]) = (light.direction, light.rgb);
        [x, y, z, sharpness(light.lambda) as f32, r, g, b]
    });
    rows.collect()
}

/// A C header: the lights as an array, and a function that evaluates them.
pub fn to_c_header(set: &LightSet) -> String {
    let n = set.lights.len();
    let mut text = format!(
        "/* {n} lights, spherical Gaussians.\n   {FORMULA}\n   Axes: {FRAME}.\n   Radiance is linear, Rec.709 primaries. */\n\
         #ifndef STRANDLIGHT_LIGHTS_H\n#define STRANDLIGHT_LIGHTS_H\n\n#include <math.h>\n\n\
         #define STRANDLIGHT_N_LIGHTS {n}\n\n\
         /* direction x, y, z, sharpness, r, g, b */\n\
         static const float strandlight_lights[STRANDLIGHT_N_LIGHTS][7] = {{\n"
    );
    for row in to_array(&set.lights).chunks_exact(7) {
        let numbers: Vec<String> = row.iter().map(|value| format!("{value:e}f")).collect();
        let _ = writeln!(text, "    {{{}}},", numbers.join(", "));
    }
    text += "};\n\n\
        /* Radiance from the unit vector w. */\n\
        static void strandlight_radiance(const float w[3], float rgb[3]) {\n\
        \x20   rgb[0] = rgb[1] = rgb[2] = 0.0f;\n\
        \x20   for (int i = 0; i < STRANDLIGHT_N_LIGHTS; i++) {\n\
        \x20       const float *l = strandlight_lights[i];\n\
        \x20       float x = w[0] - l[0], y = w[1] - l[1], z = w[2] - l[2];\n\
        \x20       /* dot - 1 = -|w - direction|^2 / 2, which keeps its digits for narrow lights */\n\
        \x20       float g = expf(-0.5f * l[3] * (x * x + y * y + z * z));\n\
        \x20       for (int c = 0; c < 3; c++) rgb[c] += l[4 + c] * g;\n\
        \x20   }\n\
        }\n\n\
        /* Radiance in spherical harmonics of degrees 0 to 2,\n   ";
    text += SH9_BASIS;
    text += ". */\nstatic const float strandlight_sh9[9][3] = {\n";
    for rgb in sh9(&set.lights) {
        let numbers = rgb.map(|value| format!("{:e}f", value as f32));
        let _ = writeln!(text, "    {{{}}},", numbers.join(", "));
    }
    text += "};\n\n#endif\n";
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lights() -> Vec<SrbfLight> {
        vec![
            SrbfLight {
                direction: [0.6, 0.0, 0.8],
                lambda: 0.7,
                rgb: [1.0, 2.0, 3.0],
            },
            SrbfLight {
                direction: [0.0, -1.0, 0.0],
                lambda: 2.0,
                rgb: [0.5, 0.25, 0.0],
            },
            SrbfLight {
                direction: [0.0, 0.8, -0.6],
                lambda: 10.0,
                rgb: [0.1, 0.1, 0.2],
            },
        ]
    }

    #[test]
    fn test_directions_are_the_formula() {
        let lights = lights();
        for test in test_directions(&lights) {
            let length: f64 = test.direction.iter().map(|x| x * x).sum();
            assert!((length - 1.0).abs() < 1e-12);
            for channel in 0..3 {
                let value: f64 = lights
                    .iter()
                    .map(|light| {
                        let dot: f64 = (0..3)
                            .map(|k| test.direction[k] * f64::from(light.direction[k]))
                            .sum();
                        f64::from(light.rgb[channel])
                            * (sharpness(light.lambda) * (dot - 1.0)).exp()
                    })
                    .sum();
                assert!((value - test.radiance[channel]).abs() < 1e-6 * (1.0 + value));
            }
        }
    }

    /// Against sums over a fine grid of directions.
    #[test]
    fn harmonics_are_those_of_the_radiance() {
        let lights = lights();
        let (n_rows, n_columns) = (400, 800);
        let mut sums = [[0.0; 3]; 9];
        for row in 0..n_rows {
            // Even steps in the cosine: equal solid angles.
            let z = 1.0 - 2.0 * (f64::from(row) + 0.5) / f64::from(n_rows);
            let r = (1.0 - z * z).sqrt();
            for column in 0..n_columns {
                let a = 2.0 * PI * (f64::from(column) + 0.5) / f64::from(n_columns);
                let direction = [r * a.cos(), r * a.sin(), z];
                let radiance = radiance(&lights, direction);
                for (sum, basis) in sums.iter_mut().zip(basis(direction)) {
                    for (sum, radiance) in sum.iter_mut().zip(radiance) {
                        *sum += basis * radiance;
                    }
                }
            }
        }
        let solid_angle = 4.0 * PI / f64::from(n_rows * n_columns);
        for (found, sum) in sh9(&lights).iter().flatten().zip(sums.iter().flatten()) {
            assert!(
                (found - sum * solid_angle).abs() < 2e-4,
                "{found} {}",
                sum * solid_angle
            );
        }
    }

    #[test]
    fn wide_lights_have_small_harmonics() {
        // Both ways of computing them meet.
        let (below, above) = (zonal(0.019_999_99), zonal(0.020_000_01));
        for (a, b) in below.iter().zip(above) {
            assert!((a - b).abs() < 1e-5 * a, "{a} {b}");
        }
    }
}
