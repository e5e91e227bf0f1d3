//! Nodes and weights of the outer integral for eight lights. Twin: `closed_form/outer_integral.rs`.

use core::f32::consts::FRAC_PI_2;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{
    CLAMP, COSINE_SHARPNESS, FISHER_CLAMP, GAUSS_HERMITE, HALF_PI_SQUARED, INVERSE_CLAMP, MIDDLE,
    MIDDLE_END, NARROW, NARROW_END, SQRT_PI, VIEW_PULL, node_count,
};

use super::math::{clamp, exp, ln, sin};

/// Eight of [`crate::closed_form::OuterRule`], of one mode.
#[derive(Clone, Copy)]
pub(crate) struct OuterRules<S: Simd> {
    pub mean: f32x8<S>,
    pub to_light: f32x8<S>,
    pub to_lobe: f32x8<S>,
    pub spread: f32x8<S>,
    pub low: f32x8<S>,
    pub high: f32x8<S>,
    pub inverse_width: f32x8<S>,
    pub sharpness: f32x8<S>,
    pub extent: f32x8<S>,
}

/// Inclinations and weights of one node.
#[derive(Clone, Copy)]
pub(crate) struct OuterNodes<S: Simd> {
    pub theta_i: f32x8<S>,
    pub weight: f32x8<S>,
}

/// Places and weights of one node, for integrands other than the light's circular Gaussian times M_t.
#[derive(Clone, Copy)]
pub(crate) struct NodePlaces<S: Simd> {
    pub theta_i: f32x8<S>,
    pub step: f32x8<S>,
    pub weight: f32x8<S>,
}

/// -[`crate::closed_form::OuterRule::ln_bound`]; what is above -[`LN_CULL`] is not asked for.
/// `variance_j` = lambda_j^2.
///
/// [`LN_CULL`]: crate::closed_form::LN_CULL
#[inline(always)]
pub(crate) fn outer_bound<S: Simd>(
    theta_j: f32x8<S>,
    variance_j: f32x8<S>,
    theta_o: f32x8<S>,
    [alpha, beta]: [f32x8<S>; 2],
) -> f32x8<S> {
    let one = f32x8::splat(theta_j.token(), 1.0);
    let variance_m = beta * 4.0 * beta;
    let apart = theta_j - (alpha * 2.0 - theta_o);
    let variance_b = variance_j * HALF_PI_SQUARED;
    let sum_b = variance_b + variance_m;
    let inverse_b = one / (variance_b * sum_b);
    let mean_b = theta_j - apart * (variance_b * (variance_b * inverse_b));
    let beyond = (mean_b.abs() - FRAC_PI_2).max(0.0);
    apart * apart * (variance_b * inverse_b)
        + beyond * beyond * (sum_b * (sum_b * inverse_b)) * (one / variance_m)
}

/// [`crate::closed_form::outer_rule`], with the extents, for lanes that [`outer_bound`] does not rule
/// out. `variance_j` = lambda_j^2.
#[inline(always)]
pub(crate) fn outer_rules<S: Simd>(
    theta_j: f32x8<S>,
    variance_j: f32x8<S>,
    theta_o: f32x8<S>,
    [alpha, beta]: [f32x8<S>; 2],
) -> OuterRules<S> {
    let simd = theta_j.token();
    let one = f32x8::splat(simd, 1.0);
    let variance_m = beta * 4.0 * beta;
    let apart = theta_j - (alpha * 2.0 - theta_o);
    let sum = variance_j + variance_m;
    let product = variance_j * variance_m;
    let spread_2 = product / (sum + product * COSINE_SHARPNESS);
    let spread = spread_2.sqrt();
    let pull = spread_2 * (theta_o * -VIEW_PULL);
    let to_light = pull - apart * (variance_j / sum);
    let to_lobe = pull + apart * (variance_m / sum);
    let mean = theta_j + to_light;
    let inverse_k = f32x8::splat(simd, INVERSE_CLAMP) / spread;
    let scaled = mean * (1.0 / FRAC_PI_2);
    let cosine = (one - scaled * scaled).max(0.0);
    OuterRules {
        mean,
        to_light,
        to_lobe,
        spread,
        low: exp((-(mean + FRAC_PI_2) * inverse_k).min(80.0)),
        high: exp(((mean - FRAC_PI_2) * inverse_k).min(80.0)),
        inverse_width: f32x8::splat(simd, 0.5) / beta,
        sharpness: f32x8::splat(simd, 4.0) / variance_j,
        extent: spread / (cosine + spread).min(1.0),
    }
}

impl<S: Simd> OuterRules<S> {
    /// Numbers of nodes for extents below [`NARROW`], below [`MIDDLE`] and above, of a mode that
    /// may have `limit`.
    #[inline(always)]
    pub fn node_counts(limit: u32) -> [u32; 3] {
        [
            node_count(0.0, limit),
            node_count(NARROW, limit),
            node_count(MIDDLE, limit),
        ]
    }

    /// The most nodes that a lane asks for.
    #[inline(always)]
    pub fn most_nodes(&self, counts: [u32; 3]) -> u32 {
        if self.extent.simd_ge(MIDDLE).any_true() {
            counts[2]
        } else if self.extent.simd_ge(NARROW).any_true() {
            counts[1]
        } else {
            counts[0]
        }
    }

    /// Node `ix` of each lane; of weight 0 where the lane has no more.
    #[inline(always)]
    pub fn node(&self, counts: [u32; 3], ix: u32) -> OuterNodes<S> {
        outer_nodes(self, self.node_constants(counts, ix))
    }

    /// Place u of node `ix` of each lane among [`GAUSS_HERMITE`].
    #[inline(always)]
    pub fn node_u(&self, counts: [u32; 3], ix: u32) -> f32x8<S> {
        let [u, ..] = self.node_constants(counts, ix);
        u
    }

    /// As [`OuterRules::node`], [`crate::closed_form::node_place`].
    #[inline(always)]
    pub fn place(&self, counts: [u32; 3], ix: u32) -> NodePlaces<S> {
        self.place_by(self.node_constants(counts, ix), CLAMP)
    }

    /// As [`OuterRules::node`], [`crate::closed_form::fisher_place`].
    #[inline(always)]
    pub fn fisher_place(&self, counts: [u32; 3], ix: u32) -> NodePlaces<S> {
        let [u, weight, fall, growth] = self.node_constants(counts, ix);
        let constants = [u, weight, fall * fall.sqrt(), growth * growth.sqrt()];
        self.place_by(constants, FISHER_CLAMP)
    }

    /// The node of these constants, by a clamp of this width over the spread.
    #[inline(always)]
    fn place_by(
        &self,
        [u, weight, fall, growth]: [f32x8<S>; 4],
        clamp_width: f32,
    ) -> NodePlaces<S> {
        let one = f32x8::splat(u.token(), 1.0);
        let below = self.low * fall + 1.0;
        let above = self.high * growth + 1.0;
        let inverse = one / (below * above);
        let step = self.spread * (u + ln(below * (below * inverse)) * clamp_width);
        NodePlaces {
            theta_i: clamp(self.mean + step, -FRAC_PI_2, FRAC_PI_2),
            step,
            weight: weight * self.spread * (one - self.low * self.high) * inverse,
        }
    }

    /// [`crate::closed_form::node_constants`].
    #[inline(always)]
    fn node_constants(&self, counts: [u32; 3], ix: u32) -> [f32x8<S>; 4] {
        let extent = self.extent;
        let simd = extent.token();
        let [few, some, all] = [row(counts[0], ix), row(counts[1], ix), row(counts[2], ix)];
        let is_few = extent.simd_lt(NARROW);
        let is_some = extent.simd_lt(MIDDLE);
        let mut constants = [extent; 4];
        for (i, constant) in constants.iter_mut().enumerate() {
            let some = is_some.select(f32x8::splat(simd, some[i]), f32x8::splat(simd, all[i]));
            *constant = is_few.select(f32x8::splat(simd, few[i]), some);
        }
        // Nodes that come in: at u, with a share of the mass. One where there are some, zero elsewhere: numbers stay in
        // registers where masks that are combined do not.
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let second = match counts[1] == 2 && ix < 2 {
            true => is_few.select(zero, extent.simd_lt(NARROW_END).select(one, zero)),
            false => zero,
        };
        let third = match counts[2] == 3 {
            true => is_some.select(zero, extent.simd_lt(MIDDLE_END).select(one, zero)),
            false => zero,
        };
        let smooth = second.max(third).simd_gt(0.5);
        if smooth.any_true() {
            let third = third.simd_gt(0.5);
            let side = ix as f32 - 1.0;
            let outer =
                f32x8::splat(simd, 0.5) - (extent - MIDDLE) * (1.0 / (3.0 * (MIDDLE_END - MIDDLE)));
            // Lanes that are not meant stay finite.
            let outer = third.select(outer, f32x8::splat(simd, 0.5));
            let u_of_three = (f32x8::splat(simd, 0.25) / outer).sqrt() * side;
            let share_of_three = match ix {
                1 => f32x8::splat(simd, 1.0) - outer * 2.0,
                _ => outer,
            };
            let u_of_two = (extent - NARROW) * (some[0] / (NARROW_END - NARROW));
            let u = third.select(u_of_three, u_of_two);
            let share = third.select(share_of_three, f32x8::splat(simd, 0.5));
            let growth = exp(u * INVERSE_CLAMP);
            let smoothed = [
                u,
                share * SQRT_PI * exp(u * u),
                f32x8::splat(simd, 1.0) / growth,
                growth,
            ];
            for (constant, smoothed) in constants.iter_mut().zip(smoothed) {
                *constant = smooth.select(smoothed, *constant);
            }
        }
        constants
    }
}

/// Row `ix` of the nodes for this count; a node of weight 0 in the middle beyond the last.
fn row(count: u32, ix: u32) -> [f32; 4] {
    match ix < count {
        true => GAUSS_HERMITE[(count * (count - 1) / 2 + ix) as usize],
        false => [0.0, 0.0, 1.0, 1.0],
    }
}

/// [`crate::closed_form::outer_node`].
#[inline(always)]
fn outer_nodes<S: Simd>(rule: &OuterRules<S>, constants: [f32x8<S>; 4]) -> OuterNodes<S> {
    let [u, weight, fall, growth] = constants;
    let one = f32x8::splat(u.token(), 1.0);
    let below = rule.low * fall + 1.0;
    let above = rule.high * growth + 1.0;
    let inverse = one / (below * above);
    let quotient = below * (below * inverse);
    let step = rule.spread * (u + ln(quotient) * CLAMP);
    let lobe = (rule.to_lobe + step) * rule.inverse_width;
    let light = sin((rule.to_light + step) * 0.5);
    let scale = rule.spread
        * (rule.inverse_width * (1.0 / SQRT_PI))
        * (one - rule.low * rule.high)
        * inverse;
    OuterNodes {
        theta_i: clamp(rule.mean + step, -FRAC_PI_2, FRAC_PI_2),
        weight: weight * scale * exp(-(lobe * lobe) - rule.sharpness * (light * light)),
    }
}
