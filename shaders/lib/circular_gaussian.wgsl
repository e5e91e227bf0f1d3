// #import lib/constants
// #import lib/special
// Circular Gaussians exp(kappa (cos(x - mu) - 1)), kappa = 2 / lambda^2.
// Twin: crates/scattering/src/closed_form/circular_gaussian.rs, which explains each step.

// Integral of a circular Gaussian over the circle, C_0.
fn c_0(kappa: f32) -> f32 {
    return 2.0 * PI * bessel_i0e(kappa);
}

// Integral over the circle of the product of two circular Gaussians whose centres are apart by
// delta; sin_half = sin(delta / 2).
fn product_integral(kappa_1: f32, kappa_2: f32, sin_half: f32) -> f32 {
    let s = min(sin_half * sin_half, 1.0);
    let sum = kappa_1 + kappa_2;
    let product = 4.0 * kappa_1 * kappa_2;
    let difference = kappa_1 - kappa_2;
    let kappa_3 = sqrt(difference * difference + product * (1.0 - s));
    let width = min(sqrt(2.0 * PI / max(kappa_3, 1e-6)), 2.0 * PI);
    return width * exp(-product * s / (sum + kappa_3));
}

// Integral over the circle of the product of two circular Gaussians whose centres are apart by
// delta, over 2 pi; sin_half_2 = sin^2(delta / 2).
fn lobe_integral(kappa_1: f32, kappa_2: f32, sin_half_2: f32) -> f32 {
    let sum = kappa_1 + kappa_2;
    let fall = 4.0 * kappa_1 * kappa_2 * sin_half_2;
    let kappa_3 = sqrt(max(sum * sum - fall, 0.0));
    return exp(-fall / max(sum + kappa_3, 1e-30)) * bessel_i0e_fast(kappa_3);
}
