//! The outer integral of the averages: `Int M_t cos(theta_o) cos(theta) / cos^2(theta_d) f
//! dtheta_o` over the inclination theta_o in +-pi/2 of the light that leaves.
//!
//! Where light grazes, the factor turns within `epsilon = pi/2 - |theta|` of the other end. With
//! `delta` the distance of theta_o from that end, all is formed without cancellation:
//! `s = theta_o + theta = delta - epsilon` (signs as of theta >= 0), `cos(theta_o) = sin(delta)`,
//! `cos(theta) = sin(epsilon)`, `cos(theta_d) = sin((delta + epsilon) / 2)`, and
//! `v = ln(1 + delta/epsilon)` takes steps that fit.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::hair::{HairParams, Lobe};
use crate::quadrature::GaussLegendre;

/// Angle nearest to grazing that is resolved; everything vanishes there.
const EPSILON_MIN: f64 = 1e-5;

/// A node of the integral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OutgoingNode {
    /// `theta + theta_o`.
    pub sum: f64,
    /// `cos(theta_d)`, theta_d half the difference of both inclinations.
    pub cos_theta_d: f64,
    /// `M_t cos(theta_o) cos(theta) / cos^2(theta_d)` times the rule's weight.
    pub weight: f64,
}

/// Nodes for incident inclination `theta`, and M_t of full-angle `shift` and `width`, cut off at
/// `reach` widths from its centre; `rule` on panels of at most `panel` in v and in widths.
pub(super) fn outgoing<'a>(
    theta: f64,
    shift: f64,
    width: f64,
    reach: f64,
    panel: f64,
    rule: &'a GaussLegendre,
) -> impl Iterator<Item = OutgoingNode> + 'a {
    let sign = if theta < 0.0 { -1.0 } else { 1.0 };
    let epsilon = (FRAC_PI_2 - theta.abs()).max(EPSILON_MIN);
    let centre = epsilon + sign * shift;
    let low = (centre - reach * width).max(0.0);
    // The right end may lie before the left one: no light leaves, and no panel is made.
    let high = (centre + reach * width).min(PI);
    let [v_low, v_high] = [low, high].map(|delta| (delta.max(0.0) / epsilon).ln_1p());
    let panels = ((high - low) / (panel * width)).max((v_high - v_low) / panel);
    let n_panels = if high > low {
        panels.ceil().clamp(1.0, 200.0) as u32
    } else {
        0
    };
    let peak = epsilon.sin() / (PI.sqrt() * width);
    let step = (v_high - v_low) / f64::from(n_panels.max(1));
    (0..n_panels).flat_map(move |ix| {
        let a = v_low + step * f64::from(ix);
        rule.on(a, a + step).map(move |(v, weight)| {
            let delta = epsilon * v.exp_m1();
            let z = (delta - centre) / width;
            let cos_theta_d = (0.5 * (delta + epsilon)).sin();
            let weight = weight * (delta + epsilon) * peak * delta.sin() * (-z * z).exp();
            OutgoingNode {
                sum: sign * (delta - epsilon),
                cos_theta_d,
                weight: weight / (cos_theta_d * cos_theta_d),
            }
        })
    })
}

/// Shift `2 alpha_t` and width `2 beta_t` of a mode in the full angle.
pub(super) fn full_angle(hair: &HairParams, lobe: Lobe) -> (f64, f64) {
    (2.0 * hair.shift.get(lobe), 2.0 * hair.width.get(lobe))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circular_gaussian::unit_gaussian;
    use crate::quadrature::integrate_tanh_sinh;

    #[test]
    fn is_the_integral_over_theta_o() {
        let rule = GaussLegendre::new(8);
        for theta in [-1.57f64, -1.2, 0.0, 0.7, 1.55] {
            for (shift, width) in [(0.0, 0.3), (-0.2, 0.15), (0.3, 0.7), (1.0, 3.0)] {
                let mut found = [0.0; 2];
                for node in outgoing(theta, shift, width, 6.0, 1.0, &rule) {
                    found[0] += node.weight;
                    found[1] += node.weight * node.sum * node.cos_theta_d;
                }
                let expected = integrate_tanh_sinh(-FRAC_PI_2, FRAC_PI_2, 7, |a, _| {
                    let theta_o = a - FRAC_PI_2;
                    let m = unit_gaussian(theta, shift - theta_o, width);
                    let cos_d = (0.5 * (theta_o - theta)).cos();
                    let value = m * theta_o.cos() * theta.cos() / (cos_d * cos_d);
                    [value, value * (theta + theta_o) * cos_d]
                });
                for i in 0..2 {
                    let error = (found[i] - expected[i]).abs();
                    assert!(error < 1e-8, "{theta} {shift} {width} {i} {error:e}");
                }
            }
        }
    }

    #[test]
    fn nothing_leaves_beyond_the_ends() {
        let rule = GaussLegendre::new(8);
        assert_eq!(outgoing(1.57, -0.5, 0.002, 6.0, 1.0, &rule).count(), 0);
        assert_ne!(outgoing(1.57, 0.5, 0.002, 6.0, 1.0, &rule).count(), 0);
    }
}
