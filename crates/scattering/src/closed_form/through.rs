//! Where TT takes its light from. Twin: `shaders/lib/through.wgsl`.
//!
//! Light goes through a fibre nearly straight: seen from the eye, TT shows light of directions about
//! the line of sight, on the cone theta_i = -theta_o and at phi = pi across it. What shadows leave of a wide light there is not
//! what they leave of it in the mean, so TT has an unblocked share of its own: a mean over the directions of
//! shadow maps, weighed by [`through_kernel`].

/// Standard deviation of the kernel over theta_i + theta_o, radians.
///
/// Wider than TT of smooth fibres, so that some of the maps' directions lie within. Widths from 0.25 to 0.5 have
/// about the same error.
pub const THROUGH_THETA: f32 = 0.4;

/// Standard deviation of the kernel over phi, radians: about that of N_TT at eta 1.55, of which 0.5 is too
/// narrow and 0.85 too wide.
pub const THROUGH_PHI: f32 = 0.7;

/// What the kernel is at least: where all directions are far from the line of sight, TT has next to
/// nothing, and the mean over the light.
pub const THROUGH_LEAST: f32 = 1e-6;

/// How much TT takes of light from `towards` on its way to the `eye`, up to a factor:
/// [`THROUGH_LEAST`] to 1 + [`THROUGH_LEAST`]. Both are components along (u, v, w) of unit vectors away from the fibre.
pub fn through_kernel(towards: [f32; 3], eye: [f32; 3]) -> f32 {
    let [u_i, v_i, w_i] = towards;
    let [u_o, v_o, w_o] = eye;
    let cosines = ((1.0 - u_i * u_i) * (1.0 - u_o * u_o)).max(1e-12).sqrt();
    // Both are half the square of a small angle.
    let off_cone = 1.0 - cosines + u_i * u_o;
    let off_line = (1.0 + (v_i * v_o + w_i * w_o) / cosines).max(0.0);
    let exponent = off_cone * (1.0 / (THROUGH_THETA * THROUGH_THETA))
        + off_line * (1.0 / (THROUGH_PHI * THROUGH_PHI));
    (-exponent).exp() + THROUGH_LEAST
}

#[cfg(test)]
mod tests {
    use super::*;

    fn direction(theta: f32, phi: f32) -> [f32; 3] {
        [
            theta.sin(),
            theta.cos() * phi.cos(),
            theta.cos() * phi.sin(),
        ]
    }

    #[test]
    fn the_kernel_is_gaussian_about_the_line_of_sight() {
        let eye = direction(0.3, -0.4);
        let straight = direction(-0.3, -0.4 + std::f32::consts::PI);
        assert!((through_kernel(straight, eye) - 1.0).abs() < 1e-5);
        let gauss = |x: f32, width: f32| (-0.5 * (x / width).powi(2)).exp();
        for off in [0.05_f32, 0.1, -0.2] {
            let off_cone = direction(-0.3 + off, -0.4 + std::f32::consts::PI);
            let expected = gauss(off, THROUGH_THETA);
            assert!((through_kernel(off_cone, eye) - expected).abs() < 2e-3);
            let off_line = direction(-0.3, -0.4 + std::f32::consts::PI + off);
            let expected = gauss(off, THROUGH_PHI);
            assert!((through_kernel(off_line, eye) - expected).abs() < 2e-3);
        }
        let back = through_kernel(eye, eye);
        assert!((THROUGH_LEAST..0.02).contains(&back), "{back}");
    }

    #[test]
    fn poles_have_a_value() {
        for towards in [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
            let found = through_kernel(towards, [1.0, 0.0, 0.0]);
            assert!(found.is_finite() && found >= THROUGH_LEAST, "{found}");
        }
    }
}
