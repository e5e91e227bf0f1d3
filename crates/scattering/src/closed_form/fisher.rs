//! M_t of model `energy`, and the orders beyond TRT. Twin: `shaders/lib/fisher.wgsl`.
//!
//! `M cos(theta_i)` is the density of the inclinations of a von Mises-Fisher lobe around inclination
//! mu = 2 alpha - theta_o (see [`crate::exact::FisherLobe`]):
//!
//! `M = exp(-2 sin^2((theta_i - mu)/2) / v) I0e(cos(theta_i) cos(mu) / v) / (v (1 - exp(-2/v)))`,
//!
//! one exponential, shared with the light's, and no division by cos^2(theta_d). N_t is taken at theta_o,
//! so that a point looks up its lobes once for all lights and nodes. Nodes are those of
//! [`super::outer_integral`] for the product of the light and a Gaussian of the lobe's width, but for the
//! clamp: the integrand falls to 0 with cos(theta_i) at the ends and not with its square, so that in y it
//! is most like a Gaussian where the clamp's width is two thirds of that for Marschner's.

use core::f32::consts::{FRAC_PI_2, PI};

use super::fibre::{Fibre, N_FURTHER};
use super::outer_integral::{
    HALF_PI_SQUARED, LN_CULL, NodePlace, OuterRule, node_constants, node_count, node_extent,
};
use super::special::bessel_i0e_fast;

/// Width k of the smooth clamp over the spread of the nodes, two thirds of [`super::outer_integral`]'s:
/// [`fisher_place`] takes powers of its exponentials.
pub(crate) const FISHER_CLAMP: f32 = 0.48;

/// 1/FISHER_CLAMP.
pub(crate) const INVERSE_FISHER_CLAMP: f32 = 2.083_333_3;

/// Largest squared spread of the nodes is 1 over this; found by search, as the clamp, with three nodes for
/// bumps of any width.
pub(crate) const FISHER_SPREAD: f32 = 0.4;

/// Least 1/v: the lobe is even over the sphere to within this. Light that many events spread asks for less.
const FISHER_LEAST: f32 = 1e-3;

/// A lobe seen from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FisherLobe {
    /// Its inclination mu, +-pi/2.
    pub mean: f32,
    /// 1/v.
    pub inverse: f32,
    /// cos(mu) / v.
    pub across: f32,
    /// 1 / (v (1 - exp(-2/v))).
    pub norm: f32,
}

/// The lobe around inclination `mean` of squared width `width_2` (Xu's, of the full angle), v = width_2 / 2.
/// Beyond a pole `mean` stands for the direction there, on the other side; many events take it round.
pub fn fisher_lobe(mean: f32, width_2: f32) -> FisherLobe {
    let inverse = (2.0 / width_2).max(FISHER_LEAST);
    let mut inside = mean - 2.0 * PI * (mean * (0.5 / PI) + 0.5).floor();
    if inside > FRAC_PI_2 {
        inside = PI - inside;
    } else if inside < -FRAC_PI_2 {
        inside = -PI - inside;
    }
    FisherLobe {
        mean: inside,
        inverse,
        across: inside.cos().max(0.0) * inverse,
        norm: inverse / (1.0 - (-2.0 * inverse).exp()),
    }
}

/// Nodes for a light of width `lambda_j` at inclination `theta_j` and this lobe, as
/// [`super::outer_rule`] has them for Marschner's M_t.
pub fn fisher_rule(theta_j: f32, lambda_j: f32, lobe: &FisherLobe) -> OuterRule {
    let variance_j = lambda_j * lambda_j;
    let variance_m = 2.0 / lobe.inverse;
    let apart = theta_j - lobe.mean;
    let sum = variance_j + variance_m;
    let product = variance_j * variance_m;
    let bump = FISHER_SPREAD * product;
    let spread = (product / (sum * sum + bump * bump).sqrt()).sqrt();
    let to_light = -apart * (variance_j / sum);
    let to_lobe = apart * (variance_m / sum);
    let mean = theta_j + to_light;
    let inverse_k = INVERSE_FISHER_CLAMP / spread;
    OuterRule {
        mean,
        to_light,
        to_lobe,
        spread,
        low: (-(mean + FRAC_PI_2) * inverse_k).min(80.0).exp(),
        high: ((mean - FRAC_PI_2) * inverse_k).min(80.0).exp(),
        inverse_width: lobe.inverse,
        sharpness: 4.0 / variance_j,
        // A circular Gaussian is at most the Gaussian of pi/2 times its width, on either side.
        ln_bound: -apart * apart / (HALF_PI_SQUARED * sum),
    }
}

/// [`super::node_place`] of these rules.
pub fn fisher_place(rule: &OuterRule, constants: [f32; 4]) -> NodePlace {
    // exp(-+u/CLAMP) to the power of CLAMP/FISHER_CLAMP.
    let below = 1.0 + rule.low * (constants[2] * constants[2].sqrt());
    let above = 1.0 + rule.high * (constants[3] * constants[3].sqrt());
    let step = rule.spread * (constants[0] + FISHER_CLAMP * (below / above).ln());
    let slope = (1.0 - rule.low * rule.high) / (below * above);
    NodePlace {
        theta_i: (rule.mean + step).clamp(-FRAC_PI_2, FRAC_PI_2),
        step,
        weight: constants[1] * rule.spread * slope,
    }
}

/// `M cos(theta_i) exp(-fall)` at `apart` = theta_i - mu, `cos_i` its cosine.
pub fn fisher_density(lobe: &FisherLobe, apart: f32, cos_i: f32, fall: f32) -> f32 {
    let half = (0.5 * apart).sin();
    let bessel = bessel_i0e_fast(cos_i * lobe.across);
    lobe.norm * cos_i * bessel * (-2.0 * lobe.inverse * (half * half) - fall).exp()
}

/// Mass of the orders beyond TRT at `cos_theta`, linear RGB: [`Fibre::further`] as a sum of Chebyshev
/// polynomials by Clenshaw's recurrence, times what falls to 0 at grazing angles; not below 0.
pub fn further_orders(fibre: &Fibre, cos_theta: f32) -> [f32; 3] {
    let y = further_place(fibre.further_scale, cos_theta);
    let x = 2.0 * y - 1.0;
    let (mut b_1, mut b_2) = ([0.0f32; 3], [0.0f32; 3]);
    for row in fibre.further[1..N_FURTHER].iter().rev() {
        for channel in 0..3 {
            let b = 2.0 * x * b_1[channel] - b_2[channel] + row[channel];
            b_2[channel] = b_1[channel];
            b_1[channel] = b;
        }
    }
    let mut mass = [0.0f32; 3];
    for channel in 0..3 {
        let sum = x * b_1[channel] - b_2[channel] + fibre.further[0][channel];
        mass[channel] = (1.0 - y) * sum.max(0.0);
    }
    mass
}

/// Where `cos_theta` stands: 0 at 1, 1 at 0, half way at about `scale`.
pub fn further_place(scale: f32, cos_theta: f32) -> f32 {
    scale * (1.0 - cos_theta) / (scale + cos_theta)
}

/// `Int exp(-((theta_i - theta_j) / sigma_f)^2) M_t cos(theta_i) dtheta_i` for `mode` 0 (R), 1 (TT), 2
/// (TRT) of a fibre of model `energy`.
pub fn forward_share(mode: u32, theta_j: f32, theta_o: f32, sigma_f: f32, fibre: &Fibre) -> f32 {
    let (alpha, beta) = (fibre.alpha[mode as usize], fibre.beta[mode as usize]);
    let lobe = fisher_lobe(2.0 * alpha - theta_o, 4.0 * beta * beta);
    let rule = fisher_rule(theta_j, sigma_f, &lobe);
    let mut share = 0.0;
    if rule.ln_bound < LN_CULL {
        return share;
    }
    let extent = node_extent(&rule);
    let count = node_count(extent, fibre.node_count(mode));
    for ix in 0..count {
        let place = fisher_place(&rule, node_constants(extent, count, ix));
        let from_light = (rule.to_light + place.step) / sigma_f;
        let cos_i = place.theta_i.cos().max(0.0);
        let fall = from_light * from_light;
        share += place.weight * fisher_density(&lobe, rule.to_lobe + place.step, cos_i, fall);
    }
    share
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact;
    use crate::fresnel::Fresnel;
    use crate::random::SplitMix64;
    use crate::{HairParams, Lobe, Model};

    #[test]
    fn the_lobe_is_that_of_double_precision() {
        let mut random = SplitMix64(4);
        let mut worst = 0.0f64;
        for _ in 0..20_000 {
            let mean = random.uniform(-12.0, 12.0);
            let width = random.log_uniform(0.01, 30.0);
            let theta = random.uniform(-1.57, 1.57);
            let expected = exact::FisherLobe::new(mean, width);
            let lobe = fisher_lobe(mean as f32, (width * width) as f32);
            let apart = theta as f32 - lobe.mean;
            let found = fisher_density(&lobe, apart, (theta as f32).cos(), 0.0);
            // Of the largest value, but where the lobe is wide.
            let peak = 1.0 / width.min(1.0);
            worst = worst.max((f64::from(found) - expected.density(theta)).abs() / peak);
        }
        println!("worst {worst:e}");
        assert!(worst < 1e-3, "{worst:e}");
    }

    /// Farthest off, 3e-3 of all light (5e-4 on average), where absorption is next to nothing and the view grazing.
    #[test]
    fn further_orders_are_those_of_the_exact_model() {
        let mut random = SplitMix64(6);
        let (mut worst, mut sum, mut n) = (0.0f64, 0.0, 0.0);
        for ix in 0..60 {
            let sigma_a = match ix {
                0 => [0.0; 3],
                _ => [(); 3].map(|()| random.log_uniform(1e-3, 3.0)),
            };
            let hair = HairParams {
                eta: random.uniform(1.3, 1.8),
                sigma_a,
                model: Model::Energy,
                ..HairParams::default()
            };
            let marschner = HairParams {
                model: Model::Marschner,
                ..hair
            };
            let fibre = Fibre::new(&hair, &Lobe::ALL, 4).unwrap();
            for step in 0..=50 {
                let theta = FRAC_PI_2 * step as f32 / 50.0;
                let found = further_orders(&fibre, theta.cos());
                let of =
                    |hair| exact::energy(Lobe::Trt, f64::from(theta), hair, Fresnel::Dielectric);
                let (with, without) = (of(&hair), of(&marschner));
                for c in 0..3 {
                    let error = (f64::from(found[c]) - (with[c] - without[c])).abs();
                    worst = worst.max(error);
                    (sum, n) = (sum + error, n + 1.0);
                }
            }
        }
        println!("worst {worst:e}, mean {:e}", sum / n);
        assert!(worst < 4e-3 && sum / n < 6e-4, "{worst:e}");
    }

    #[test]
    fn the_clamp_is_two_thirds_of_the_other() {
        use crate::closed_form::CLAMP;
        assert!((1.5 * FISHER_CLAMP - CLAMP).abs() < 1e-7);
        assert!((FISHER_CLAMP * INVERSE_FISHER_CLAMP - 1.0).abs() < 1e-7);
    }

    #[test]
    fn extremes_stay_finite() {
        for mean in [-100.0f32, -FRAC_PI_2, 0.0, 1.0, FRAC_PI_2, 3.2, 4.7] {
            for width_2 in [4e-6f32, 0.1, 9.0, 1e8] {
                let lobe = fisher_lobe(mean, width_2);
                assert!(lobe.mean.abs() <= FRAC_PI_2 && lobe.norm.is_finite());
                for theta in [-FRAC_PI_2, -0.3, 0.0, FRAC_PI_2] {
                    for lambda in [0.001f32, 0.3, 10.0] {
                        let rule = fisher_rule(theta, lambda, &lobe);
                        assert!(rule.mean.is_finite() && rule.ln_bound <= 0.0);
                    }
                    let cos = theta.cos().max(0.0);
                    let value = fisher_density(&lobe, theta - lobe.mean, cos, 0.0);
                    assert!(
                        value.is_finite() && value >= 0.0,
                        "{mean} {width_2} {theta}"
                    );
                }
            }
        }
    }
}
