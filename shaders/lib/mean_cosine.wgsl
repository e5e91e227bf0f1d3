// #import lib/constants
// Z_j: the mean cosine of the inclination over a Gaussian.
// Twin: crates/scattering/src/closed_form/mean_cosine.rs, which explains each step.

// Least mean, so that grazing narrow light stays finite.
const MEAN_COSINE_MIN: f32 = 1e-3;

// Product of two complex numbers plus a real one.
fn complex_step(p: vec2f, t: vec2f, c: f32) -> vec2f {
    return vec2f(p.x * t.x - p.y * t.y + c, p.y * t.x + p.x * t.y);
}

// Imaginary part of the Faddeeva function w(x + i y), x > 0, y in 0..=9.
fn faddeeva_imaginary(x: f32, y: f32) -> f32 {
    let t = vec2f(y, -x);
    var a = vec2f(0.5642236 * y + 3.778987, -0.5642236 * x);
    a = complex_step(a, t, 11.96482);
    a = complex_step(a, t, 20.20933);
    a = complex_step(a, t, 16.4955);
    var b = vec2f(y + 6.699398, -x);
    b = complex_step(b, t, 21.69274);
    b = complex_step(b, t, 39.27121);
    b = complex_step(b, t, 38.82363);
    b = complex_step(b, t, 16.4955);
    return (a.y * b.x - a.x * b.y) / dot(b, b);
}

// Z_j = Int g^u(theta_i; theta_j, sigma_f) cos(theta_i) dtheta_i over +-pi/2, at least 1e-3.
fn mean_cosine(theta_j: f32, cos_theta_j: f32, sigma_f: f32) -> f32 {
    let x = 0.5 * sigma_f;
    let inverse = 1.0 / sigma_f;
    let near = min(max(HALF_PI - abs(theta_j), 0.0) * inverse, 9.0);
    let far = min((HALF_PI + abs(theta_j)) * inverse, 9.0);
    let ends = exp(-near * near) * faddeeva_imaginary(x, near)
        + exp(-far * far) * faddeeva_imaginary(x, far);
    return max(cos_theta_j * exp(-x * x) + 0.5 * ends, MEAN_COSINE_MIN);
}
