//! The outer integral of Eq 11: a Gaussian times a smooth function, piecewise linear (Xu 2011
//! section 4.2.2, preprint App B and E). Twin: `shaders/lib/paper/outer_integral.wgsl`.

use super::super::constants::SQRT_PI;
use super::super::special::ErfPair;

/// Weight >= 0 of a node of the piecewise linear rule, per unit of lambda: the integral of
/// exp(-u^2) times the hat function over [u_0, u, u_1], all in units of lambda from the mean.
pub fn hat_weight(u_0: f32, u: f32, u_1: f32, e_0: ErfPair, e: ErfPair, e_1: ErfPair) -> f32 {
    let rise = 0.5 * ((e_0.gauss - e.gauss) - u_0 * SQRT_PI * (e.erf - e_0.erf));
    let fall = 0.5 * (u_1 * SQRT_PI * (e_1.erf - e.erf) - (e.gauss - e_1.gauss));
    // An empty flank has no weight; the bound only keeps 0 / 0 away.
    (rise / (u - u_0).max(1e-6) + fall / (u_1 - u).max(1e-6)).max(0.0)
}

/// Position of node `s` of 0..=segments in units of lambda from the mean: the ends are those of
/// +-pi/2, `low` and `high`; between them a node each lambda, moved onto an end it would pass.
pub fn node_position(low: f32, high: f32, segments: u32, s: u32) -> f32 {
    if s == 0 {
        return low;
    }
    if s == segments {
        return high;
    }
    (s as f32 - 0.5 * segments as f32).clamp(low, high)
}

#[cfg(test)]
mod tests {
    use core::f32::consts::FRAC_PI_2;

    use super::super::super::longitudinal::longitudinal;
    use super::super::super::special::erf_pair;
    use super::*;

    /// The rule applied to cos^2, against quadrature of the same piecewise linear function.
    #[test]
    fn weights_integrate_the_piecewise_linear_function() {
        for (theta_j, lambda_j, theta_o, alpha, beta) in [
            (0.2f32, 0.3f32, 0.1f32, -0.05f32, 0.1f32),
            (1.4, 0.5, -1.2, 0.1, 0.3),
            (-1.5, 1.0, 1.5, -0.1, 0.8),
            (0.0, 5.0, 0.3, 0.0, 1.0),
        ] {
            for segments in [2, 3, 4, 12] {
                let product = longitudinal(theta_j, lambda_j, theta_o, alpha, beta);
                let low = (-FRAC_PI_2 - product.mean) / product.lambda;
                let high = (FRAC_PI_2 - product.mean) / product.lambda;
                let position = |s| node_position(low, high, segments, s);
                let nodes: Vec<(f32, f32)> = (1..segments)
                    .map(|s| {
                        let [u_0, u, u_1] = [s - 1, s, s + 1].map(position);
                        let [e_0, e, e_1] = [u_0, u, u_1].map(erf_pair);
                        let theta_i = product.mean + product.lambda * u;
                        (
                            theta_i,
                            product.lambda * hat_weight(u_0, u, u_1, e_0, e, e_1),
                        )
                    })
                    .collect();
                let value: f32 = nodes.iter().map(|n| n.1 * n.0.cos().powi(2)).sum();
                let mut corners = vec![(-FRAC_PI_2, 0.0)];
                corners.extend(nodes.iter().map(|n| (n.0, n.0.cos().powi(2))));
                corners.push((FRAC_PI_2, 0.0));
                let n = 20_000;
                let mut exact = 0.0f64;
                for i in 0..n {
                    let x = -FRAC_PI_2 + std::f32::consts::PI * (i as f32 + 0.5) / n as f32;
                    let k = corners
                        .partition_point(|c| c.0 <= x)
                        .clamp(1, corners.len() - 1);
                    let ((x_0, f_0), (x_1, f_1)) = (corners[k - 1], corners[k]);
                    let f = f_0 + (f_1 - f_0) * (x - x_0) / (x_1 - x_0).max(1e-9);
                    let u = (x - product.mean) / product.lambda;
                    exact += f64::from(f * (-u * u).exp()) * std::f64::consts::PI / n as f64;
                }
                // The published erf is good to 2.5e-5, in a weight of order lambda.
                let tolerance = 2e-4 * f64::from(product.lambda) + 1e-4 * exact;
                assert!(
                    (f64::from(value) - exact).abs() < tolerance,
                    "{segments} {product:?} {value} {exact}"
                );
            }
        }
    }
}
