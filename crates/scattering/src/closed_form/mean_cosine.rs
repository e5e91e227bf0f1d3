//! Z_j: the mean cosine of the inclination over a Gaussian. Twin: `shaders/lib/mean_cosine.wgsl`.

use core::f32::consts::FRAC_PI_2;

/// Least mean, so that grazing narrow light stays finite.
pub(crate) const MEAN_COSINE_MIN: f32 = 1e-3;

/// Product of two complex numbers plus a real one.
fn complex_step(p: [f32; 2], t: [f32; 2], c: f32) -> [f32; 2] {
    [p[0] * t[0] - p[1] * t[1] + c, p[1] * t[0] + p[0] * t[1]]
}

/// Humlicek's rational function (1982, region III): its numerator's leading factor and then what each step of
/// Horner's scheme adds, and the same of its denominator, whose leading factor is 1.
pub(crate) const HUMLICEK_ABOVE: [f32; 5] = [0.564_223_6, 3.778_987, 11.964_82, 20.209_33, 16.4955];
pub(crate) const HUMLICEK_BELOW: [f32; 5] = [6.699_398, 21.692_74, 39.271_21, 38.823_63, 16.4955];

/// Imaginary part of the Faddeeva function w(x + i y), x > 0, y in 0..=9, by Humlicek's rational
/// function of y - i x; relative error at most 6e-5 for x up to 5.
fn faddeeva_imaginary(x: f32, y: f32) -> f32 {
    let t = [y, -x];
    let [leading, above @ ..] = HUMLICEK_ABOVE;
    let mut a = [leading * y + above[0], -leading * x];
    for c in &above[1..] {
        a = complex_step(a, t, *c);
    }
    let mut b = [y + HUMLICEK_BELOW[0], -x];
    for c in &HUMLICEK_BELOW[1..] {
        b = complex_step(b, t, *c);
    }
    (a[1] * b[0] - a[0] * b[1]) / (b[0] * b[0] + b[1] * b[1])
}

/// Z_j = Int g^u(theta_i; theta_j, sigma_f) cos(theta_i) dtheta_i over +-pi/2, `sigma_f` in
/// 0.001..=10; at least 1e-3. With x = sigma_f / 2 and d either distance of theta_j from an end,
///
/// `Z_j = cos(theta_j) exp(-x^2) + 1/2 sum over d of exp(-(d / sigma_f)^2) Im w(x + i d / sigma_f)`,
///
/// no term of which is negative. Relative error at most 7e-5.
pub fn mean_cosine(theta_j: f32, cos_theta_j: f32, sigma_f: f32) -> f32 {
    let x = 0.5 * sigma_f;
    let inverse = 1.0 / sigma_f;
    // Beyond 9 widths nothing is left.
    let near = ((FRAC_PI_2 - theta_j.abs()).max(0.0) * inverse).min(9.0);
    let far = ((FRAC_PI_2 + theta_j.abs()) * inverse).min(9.0);
    let ends = (-near * near).exp() * faddeeva_imaginary(x, near)
        + (-far * far).exp() * faddeeva_imaginary(x, far);
    (cos_theta_j * (-x * x).exp() + 0.5 * ends).max(MEAN_COSINE_MIN)
}
