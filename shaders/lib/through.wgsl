// Where TT takes its light from: directions about the line of sight, on the cone
// theta_i = -theta_o and at phi = pi across it.
// Twin: crates/scattering/src/closed_form/through.rs.

// Standard deviations, radians: over theta_i + theta_o, and over phi.
const THROUGH_THETA: f32 = 0.4;
const THROUGH_PHI: f32 = 0.7;
const THROUGH_LEAST: f32 = 1e-6;

// How much TT takes of light from `towards` on its way to the `eye`, up to a factor; both are
// components along (u, v, w) of unit vectors away from the fibre.
fn through_kernel(towards: vec3f, eye: vec3f) -> f32 {
    let cosines = sqrt(max((1.0 - towards.x * towards.x) * (1.0 - eye.x * eye.x), 1e-12));
    // Both are half the square of a small angle.
    let off_cone = 1.0 - cosines + towards.x * eye.x;
    let off_line = max(1.0 + dot(towards.yz, eye.yz) / cosines, 0.0);
    let exponent = off_cone * (1.0 / (THROUGH_THETA * THROUGH_THETA))
        + off_line * (1.0 / (THROUGH_PHI * THROUGH_PHI));
    return exp(-exponent) + THROUGH_LEAST;
}
