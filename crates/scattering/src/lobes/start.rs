//! Where the search for shapes starts: shapes found once by continuation from eta' = 1.67 both
//! ways at eta = 1.5, rounded. Another start may end in another, worse, equally smooth path.

use std::f64::consts::FRAC_PI_2;

use super::shape::LobeShape;
use crate::hair::Lobe;

/// alpha, then lambda_0, lambda_1, mu_1, lambda_2, mu_2 over pi/2 - alpha.
const TT: [[f64; 6]; 6] = [
    [0.0, 0.465, 0.447, 0.520, 0.392, 1.023],
    [0.4, 0.556, 0.475, 0.616, 0.389, 1.131],
    [0.68, 0.641, 0.469, 0.680, 0.383, 1.176],
    [1.0, 0.430, 0.416, 0.510, 0.458, 1.013],
    [1.32, 0.242, 0.269, 0.374, 0.545, 0.730],
    [1.57, 0.100, 0.150, 0.200, 0.600, 0.300],
];

/// alpha, then lambda_0, lambda_1, mu_1, lambda_2, mu_2.
const TRT: [[f64; 6]; 27] = [
    [0.0, 0.730, 0.700, -0.820, 0.614, 1.605],
    [0.104, 0.686, 0.640, -0.785, 0.529, 1.495],
    [0.204, 0.644, 0.560, -0.737, 0.441, 1.341],
    [0.304, 0.590, 0.472, -0.683, 0.341, 1.172],
    [0.324, 0.560, 0.440, -0.450, 0.410, 0.950],
    [0.344, 0.590, 0.400, -0.200, 0.460, 0.800],
    [0.364, 0.583, 0.337, -0.100, 0.454, 0.737],
    [0.404, 0.517, 0.165, -0.070, 0.406, 0.679],
    [0.464, 0.369, 0.060, -0.060, 0.344, 0.554],
    [0.504, 0.307, 0.040, -0.030, 0.307, 0.466],
    [0.544, 0.270, 0.035, -0.002, 0.263, 0.400],
    [0.564, 0.220, 0.035, 0.018, 0.247, 0.347],
    [0.584, 0.155, 0.035, 0.045, 0.230, 0.280],
    [0.604, 0.120, 0.036, 0.079, 0.205, 0.250],
    [0.624, 0.118, 0.038, 0.121, 0.168, 0.251],
    [0.644, 0.131, 0.042, 0.158, 0.131, 0.260],
    [0.664, 0.150, 0.042, 0.200, 0.120, 0.230],
    [0.704, 0.158, 0.037, 0.304, 0.086, 0.198],
    [0.724, 0.182, 0.036, 0.355, 0.099, 0.241],
    [0.764, 0.251, 0.044, 0.453, 0.133, 0.308],
    [0.804, 0.368, 0.045, 0.563, 0.145, 0.415],
    [0.864, 0.533, 0.048, 0.735, 0.147, 0.588],
    [0.904, 0.610, 0.071, 0.844, 0.165, 0.668],
    [1.0, 0.630, 0.090, 1.135, 0.323, 0.789],
    [1.12, 0.810, 0.083, 1.537, 0.437, 1.083],
    [1.36, 1.220, 0.112, 2.347, 0.577, 1.730],
    [1.57, 1.700, 0.300, 2.820, 0.600, 2.140],
];

/// The start at `alpha` in 0..=pi/2.
pub(super) fn start(lobe: Lobe, alpha: f64) -> LobeShape {
    if lobe == Lobe::Trt {
        return interpolated(&TRT, alpha);
    }
    let scale = FRAC_PI_2 - alpha + 0.003;
    let shape = interpolated(&TT, alpha);
    LobeShape {
        lambda: shape.lambda.map(|lambda| scale * lambda),
        mu: shape.mu.map(|mu| scale * mu),
    }
}

fn interpolated(knots: &[[f64; 6]], alpha: f64) -> LobeShape {
    let after = knots
        .partition_point(|knot| knot[0] <= alpha)
        .clamp(1, knots.len() - 1);
    let (low, high) = (knots[after - 1], knots[after]);
    let t = ((alpha - low[0]) / (high[0] - low[0])).clamp(0.0, 1.0);
    LobeShape::from_array(std::array::from_fn(|i| {
        low[i + 1] + (high[i + 1] - low[i + 1]) * t
    }))
}
