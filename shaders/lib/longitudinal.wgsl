// #import lib/constants
// The light times M_t in theta_i (Xu 2011 section 4.2.2).
// Twin: crates/scattering/src/closed_form/longitudinal.rs.

// Product of the light's Gaussian in theta_i and M_t: peak exp(ln_b) g(theta_i; mean, lambda).
struct Longitudinal {
    mean: f32,
    lambda: f32,
    ln_b: f32,
    peak: f32,
}

// Product of g(theta_i; theta_j, lambda_j) and g^u(theta_i; 2 alpha - theta_o, 2 beta).
fn longitudinal(theta_j: f32, lambda_j: f32, theta_o: f32, alpha: f32, beta: f32) -> Longitudinal {
    let centre = 2.0 * alpha - theta_o;
    let variance_j = lambda_j * lambda_j;
    let variance_m = 4.0 * beta * beta;
    let sum = variance_j + variance_m;
    let apart = theta_j - centre;
    return Longitudinal(
        theta_j - apart * (variance_j / sum),
        2.0 * beta * (lambda_j / sqrt(sum)),
        -apart * apart / sum,
        0.5 / (SQRT_PI * beta),
    );
}
