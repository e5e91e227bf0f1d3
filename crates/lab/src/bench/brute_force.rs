//! What the closed forms compete with: the exact model by plain quadrature in single precision.

use std::f32::consts::{FRAC_PI_2, PI};

use strandlight_scattering::closed_form::{
    DirectionInFrame, Fibre, LightInFrame, bessel_i0e, lag_between,
};
use strandlight_scattering::quadrature::GaussLegendre;

/// Half of the window in theta_i, in widths of the product of light and M_t: what lies outside is
/// 6e-6 of it.
const WINDOW: f32 = 3.2;

/// A tensor Gauss-Legendre rule over theta_i and the offset h = sin(gamma), for
/// `Int M_t g^c cos^2(theta_i)/cos^2(theta_d) 1/2 Int A_t(h) g^c(phi_o - phi_j - phi(p, h)) dh`
/// with the dielectric Fresnel term; no table, no root, no approximation but the nodes.
///
/// theta_i runs over the part of +-pi/2 within 3.2 widths of the product of light and M_t, so few
/// nodes do; h needs as many as the azimuthal Gaussian is narrow. Paths at h and -h share all but
/// the Gaussian.
#[derive(Clone, Debug)]
pub struct BruteForce {
    /// Nodes and weights on -1..=1.
    theta: Vec<[f32; 2]>,
    /// sin(gamma), cos(gamma), gamma and weight `1/2 cos(gamma) d gamma` on 0..pi/2.
    offsets: Vec<[f32; 4]>,
}

impl BruteForce {
    /// The rule with `n_theta` nodes in theta_i and `n_h` (even) in h.
    pub fn new(n_theta: u32, n_h: u32) -> BruteForce {
        let theta = GaussLegendre::new(n_theta as usize);
        let offsets = GaussLegendre::new(n_h as usize / 2);
        BruteForce {
            theta: theta
                .on(-1.0, 1.0)
                .map(|(x, w)| [x as f32, w as f32])
                .collect(),
            offsets: offsets
                .on(0.0, std::f64::consts::FRAC_PI_2)
                .map(|(gamma, w)| {
                    let (sin, cos) = gamma.sin_cos();
                    [sin, cos, gamma, 0.5 * cos * w].map(|x| x as f32)
                })
                .collect(),
        }
    }

    /// Eq 11 of `mode` 0 (R), 1 (TT), 2 (TRT), linear RGB.
    pub(crate) fn single_mode(
        &self,
        mode: u32,
        light: &LightInFrame,
        view: &DirectionInFrame,
        fibre: &Fibre,
    ) -> [f32; 3] {
        let at = light.direction;
        let width = 2.0 * fibre.beta[mode as usize];
        let centre = 2.0 * fibre.alpha[mode as usize] - view.theta;
        let variance_j = light.lambda * light.lambda;
        let [middle, half] = window(at.theta, light.lambda, centre, width);

        let lag = lag_between(view.cos_phi, view.sin_phi, at.cos_phi, at.sin_phi);
        let dphi = 2.0 * lag.sin_half.atan2(lag.cos_half);
        let mut total = [0.0f32; 3];
        for &[x, weight] in &self.theta {
            let theta_i = middle + half * x;
            let cos_i = theta_i.cos().max(0.0);
            let z = (theta_i - centre) / width;
            let s = (0.5 * (theta_i - at.theta)).sin();
            let fall = z * z + 4.0 * s * s / variance_j;
            let theta_d = 0.5 * (view.theta - theta_i);
            let cos_d = theta_d.cos().max(1e-4);
            let ratio = cos_i / cos_d;
            let factor = half * weight * (-fall).exp() * ratio * ratio / (PI.sqrt() * width);
            let kappa = 2.0 * at.cos_theta * cos_i / variance_j;
            let inner = self.azimuthal(mode, kappa, dphi, theta_d.sin(), cos_d, fibre);
            for channel in 0..3 {
                total[channel] += factor * inner[channel];
            }
        }
        total
    }

    /// The nodes in theta_i of [`BruteForce::single_mode`].
    pub(super) fn nodes(
        &self,
        mode: u32,
        light: &LightInFrame,
        view: &DirectionInFrame,
        fibre: &Fibre,
    ) -> Vec<f32> {
        let width = 2.0 * fibre.beta[mode as usize];
        let centre = 2.0 * fibre.alpha[mode as usize] - view.theta;
        let [middle, half] = window(light.direction.theta, light.lambda, centre, width);
        self.theta.iter().map(|[x, _]| middle + half * x).collect()
    }

    /// Eq 12: 1/2 the integral over h of the attenuation times the Gaussian of sharpness `kappa`.
    pub(super) fn azimuthal(
        &self,
        mode: u32,
        kappa: f32,
        dphi: f32,
        sin_d: f32,
        cos_d: f32,
        fibre: &Fibre,
    ) -> [f32; 3] {
        let eta_2 = fibre.eta * fibre.eta;
        let inner = (eta_2 - sin_d * sin_d).sqrt();
        let eta_eff = inner / cos_d;
        let slant = -2.0 * fibre.eta / inner;
        let kappa_c = 2.0 / (fibre.caustic_width * fibre.caustic_width);
        let i0e_c = bessel_i0e(kappa_c);
        let gaussian = |phi: f32| {
            let s = (0.5 * phi).sin();
            if mode < 2 {
                return (-2.0 * kappa * s * s).exp();
            }
            // TRT's caustic blur: the product integral of two circular Gaussians, exact.
            let sum = kappa + kappa_c;
            let product = 4.0 * kappa * kappa_c * s * s;
            let kappa_3 = (sum * sum - product).max(0.0).sqrt();
            (-product / (sum + kappa_3)).exp() * bessel_i0e(kappa_3) / i0e_c
        };
        let mut total = [0.0f32; 3];
        for &[sin, cos, gamma, weight] in &self.offsets {
            let c = cos_d * cos;
            let q = (eta_2 - 1.0 + c * c).sqrt();
            let n = eta_2 * c;
            let through = 2.0 * q * (c / ((c + q) * (c + q)) + n / ((n + q) * (n + q)));
            let sin_t = (sin / eta_eff).min(1.0);
            let cos_t = (1.0 - sin_t * sin_t).max(0.0).sqrt();
            let turn = 2.0 * mode as f32 * sin_t.asin() - 2.0 * gamma;
            let straight = mode as f32 * PI;
            let both = gaussian(dphi - straight - turn) + gaussian(dphi - straight + turn);
            let value = weight * both;
            match mode {
                0 => {
                    let reflected = value * (1.0 - through);
                    total = total.map(|t| t + reflected);
                }
                1 => {
                    let kept = value * through * through;
                    for (total, sigma_a) in total.iter_mut().zip(fibre.sigma_a) {
                        *total += kept * (sigma_a * slant * cos_t).exp();
                    }
                }
                _ => {
                    let kept = value * through * through * (1.0 - through);
                    for (total, sigma_a) in total.iter_mut().zip(fibre.sigma_a) {
                        *total += kept * (2.0 * sigma_a * slant * cos_t).exp();
                    }
                }
            }
        }
        total
    }
}

/// Middle and half length of the window in theta_i: [`WINDOW`] widths around the product of the
/// light and M_t, of which at least half lies inside +-pi/2 where its centre does not.
fn window(theta_j: f32, lambda_j: f32, centre: f32, width: f32) -> [f32; 2] {
    let (variance_j, variance_m) = (lambda_j * lambda_j, width * width);
    let mean = theta_j - (theta_j - centre) * (variance_j / (variance_j + variance_m));
    let reach = WINDOW * width * lambda_j / (variance_j + variance_m).sqrt();
    let low = (mean - reach).clamp(-FRAC_PI_2, FRAC_PI_2 - reach.min(PI));
    let high = (mean + reach).clamp(reach.min(PI) - FRAC_PI_2, FRAC_PI_2);
    [0.5 * (low + high), 0.5 * (high - low)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::Set;
    use strandlight_scattering::Lobe;
    use strandlight_scattering::exact::single;
    use strandlight_scattering::fresnel::Fresnel;

    #[test]
    fn many_nodes_are_the_exact_model() {
        let [coarse, fine] = [BruteForce::new(4, 8), BruteForce::new(24, 400)];
        let mut errors = [[0.0f64; 2]; 3];
        let mut scale = [0.0f64; 3];
        for ix in 0..60 {
            let drawn = Set::Wide.draw(11, ix);
            let fibre = Fibre::new(&drawn.hair, &Lobe::ALL, 4).unwrap();
            let (light, view) = drawn.in_frame();
            for lobe in Lobe::ALL {
                let p = lobe.p() as usize;
                let exact = single(
                    lobe,
                    drawn.light,
                    drawn.view,
                    &drawn.hair,
                    Fresnel::Dielectric,
                );
                for (rule, error) in [&coarse, &fine].into_iter().zip(&mut errors[p]) {
                    let value = rule.single_mode(lobe.p(), &light, &view, &fibre);
                    for channel in 0..3 {
                        *error += (f64::from(value[channel]) - exact[channel]).powi(2);
                    }
                }
                scale[p] += exact.iter().map(|x| x * x).sum::<f64>();
            }
        }
        for p in 0..3 {
            let [coarse, fine] = errors[p].map(|error| (error / scale[p]).sqrt());
            println!("mode {p}: 4 x 8 nodes {coarse:.1e}, 24 x 400 {fine:.1e}");
            assert!(fine < 2e-4 && coarse > 1e-2);
        }
    }
}
