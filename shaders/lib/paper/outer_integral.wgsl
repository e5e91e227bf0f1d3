// #import lib/constants
// #import lib/special
// A Gaussian times a smooth function, piecewise linear (Xu 2011 section 4.2.2).
// Twin: crates/scattering/src/closed_form/paper/outer_integral.rs.

// Weight of a node: the integral of exp(-x^2) times the hat function over [u_0, u, u_1].
fn paper_hat_weight(u_0: f32, u: f32, u_1: f32, e_0: ErfPair, e: ErfPair, e_1: ErfPair) -> f32 {
    let rise = 0.5 * ((e_0.gauss - e.gauss) - u_0 * SQRT_PI * (e.erf - e_0.erf));
    let fall = 0.5 * (u_1 * SQRT_PI * (e_1.erf - e.erf) - (e.gauss - e_1.gauss));
    return max(rise / max(u - u_0, 1e-6) + fall / max(u_1 - u, 1e-6), 0.0);
}

// Position of node `s` of 0..=segments in units of lambda from the mean.
fn paper_node_position(low: f32, high: f32, segments: u32, s: u32) -> f32 {
    if s == 0u {
        return low;
    }
    if s == segments {
        return high;
    }
    return clamp(f32(s) - 0.5 * f32(segments), low, high);
}
