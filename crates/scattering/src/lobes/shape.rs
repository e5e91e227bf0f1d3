//! The shape of the lobes of one section.

use super::moments::{Moments, N_MOMENTS, ORDERS, gaussian_moments};

/// Number of shape parameters.
pub const N_SHAPE: usize = 5;

/// Widths of the three lobes (Xu's sense) and offsets of the two pairs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LobeShape {
    /// Widths of S_0, S_1, S_2.
    pub lambda: [f64; 3],
    /// Offsets of S_1 and S_2 from phi_t; that of S_1 has a sign, which changes nothing but
    /// makes it smooth.
    pub mu: [f64; 2],
}

impl LobeShape {
    /// Moments of S_0, S_1, S_2.
    pub fn moments(&self) -> [Moments; 3] {
        let mut moments = gaussian_moments(self.lambda);
        for (pair, &mu) in self.mu.iter().enumerate() {
            let (cos, _) = turns(mu);
            for (moment, cos) in moments[1 + pair].iter_mut().zip(cos) {
                *moment *= cos;
            }
        }
        moments
    }

    /// As `[lambda_0, lambda_1, mu_1, lambda_2, mu_2]`.
    pub fn to_array(self) -> [f64; N_SHAPE] {
        let [l_0, l_1, l_2] = self.lambda;
        [l_0, l_1, self.mu[0], l_2, self.mu[1]]
    }

    /// Inverse of [`LobeShape::to_array`].
    pub fn from_array([l_0, l_1, mu_1, l_2, mu_2]: [f64; N_SHAPE]) -> Self {
        LobeShape {
            lambda: [l_0, l_1, l_2],
            mu: [mu_1, mu_2],
        }
    }
}

/// cos(n mu) and n sin(n mu) of the orders kept.
pub(super) fn turns(mu: f64) -> (Moments, Moments) {
    let (mut cos, mut sin) = ([1.0; N_MOMENTS], [0.0; N_MOMENTS]);
    let (step_sin, step_cos) = mu.sin_cos();
    let mut here = (1.0, 0.0);
    for ix in 1..N_MOMENTS {
        for _ in ORDERS[ix - 1]..ORDERS[ix] {
            here = (
                here.0 * step_cos - here.1 * step_sin,
                here.1 * step_cos + here.0 * step_sin,
            );
        }
        cos[ix] = here.0;
        sin[ix] = ORDERS[ix] as f64 * here.1;
    }
    (cos, sin)
}
