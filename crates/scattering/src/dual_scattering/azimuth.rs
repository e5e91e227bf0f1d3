//! What N_t sends forward and backward: `q_f`, `q_b`, by the offset h, without roots.
//!
//! `Int w(phi) N_t dphi = 1/2 Int A_t(h) w(phi(p, h)) dh` with `w = |phi|/pi`, which stands for
//! Xu's integrals of his fitted N_t (`2 Int phi N`, below Eq 33).

use std::f64::consts::{FRAC_PI_2, PI};

use crate::circular_gaussian::{sharpness, wrap};
use crate::exact::{FibreSection, eta_star};
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe, Model};
use crate::quadrature::GaussLegendre;
use crate::special::{bessel_i_scaled, erfc};

/// `q_f` and `q_b` of a mode at one theta_d, per channel; their sum is the mass of N_t.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Halves {
    /// `Int |phi| / pi N_t dphi`.
    pub forward: [f64; 3],
    /// `Int (1 - |phi| / pi) N_t dphi`.
    pub backward: [f64; 3],
}

/// Below this width the blur is that of a Gaussian on the line: 1e-6 of its own effect.
const NARROW: f64 = 0.03;

/// `|phi| / pi` blurred by a circular Gaussian of unit mass.
#[derive(Clone, Debug)]
pub enum LagBlur {
    /// Of this width, much less than a turn.
    Narrow(f64),
    /// `1/2 - sum c_n cos(n phi)`, n = 1, 3, 5, ...
    Series(Vec<f64>),
}

impl LagBlur {
    /// Blur by width `caustic_width` (w_c) > 0.
    pub fn new(caustic_width: f64) -> LagBlur {
        if caustic_width < NARROW {
            return LagBlur::Narrow(caustic_width);
        }
        // The moments of the Gaussian fall like exp(-(n w_c / 2)^2).
        let n_max = (7.0 / caustic_width) as usize + 12;
        let bessel = bessel_i_scaled(n_max, sharpness(caustic_width));
        let odd = (1..=n_max).step_by(2);
        LagBlur::Series(
            odd.map(|n| 4.0 / (PI * PI * (n * n) as f64) * bessel[n] / bessel[0])
                .collect(),
        )
    }

    /// Its value at `phi`, any turn; absolute error below 1e-6 for w_c up to 3.
    pub fn at(&self, phi: f64) -> f64 {
        match self {
            LagBlur::Narrow(width) => {
                // E|x + noise| - |x| for Gaussian noise, at the kinks 0 and pi.
                let excess = |x: f64| {
                    let z = x / width;
                    if z > 6.0 {
                        return 0.0;
                    }
                    width / PI.sqrt() * (-z * z).exp() - x * erfc(z)
                };
                let lag = wrap(phi).abs();
                (lag + excess(lag) - excess(PI - lag)) / PI
            }
            LagBlur::Series(coefficients) => {
                // cos((n + 2) phi) = 2 cos(2 phi) cos(n phi) - cos((n - 2) phi)
                let cos = phi.cos();
                let step = 4.0 * cos * cos - 2.0;
                let (mut before, mut here) = (cos, cos);
                let mut sum = 0.5;
                for c in coefficients {
                    sum -= c * here;
                    let next = step * here - before;
                    before = here;
                    here = next;
                }
                sum
            }
        }
    }
}

/// Quadrature over the offset h, with what of the fibre does not depend on theta_d.
#[derive(Clone, Debug)]
pub struct AzimuthRule {
    hair: HairParams,
    fresnel: Fresnel,
    blur: LagBlur,
    /// Indices of TRT, one unless the fibre is elliptic; each has the same share.
    trt_eta: Vec<f64>,
    rule: GaussLegendre,
}

impl AzimuthRule {
    /// `n` >= 1 nodes over half the fibre's width, twice where TRT's lag has a kink; an elliptic
    /// fibre's index at `n_turns` >= 1 half angles. 96 and 32 are good to 1e-7 of the mass.
    pub fn new(hair: &HairParams, fresnel: Fresnel, n: usize, n_turns: usize) -> AzimuthRule {
        let trt_eta = if hair.eccentricity == 1.0 {
            vec![hair.eta]
        } else {
            let turns = (0..n_turns).map(|ix| FRAC_PI_2 * (ix as f64 + 0.5) / n_turns as f64);
            turns
                .map(|phi_h| eta_star(hair.eta, hair.eccentricity, phi_h))
                .collect()
        };
        AzimuthRule {
            hair: *hair,
            fresnel,
            blur: LagBlur::new(hair.caustic_width),
            trt_eta,
            rule: GaussLegendre::new(n),
        }
    }

    /// `q_f` and `q_b` of `lobe` at `cos(theta_d)` in 0..=1.
    pub fn halves(&self, lobe: Lobe, cos_theta_d: f64) -> Halves {
        let mut halves = Halves::default();
        self.each(lobe, cos_theta_d, |forward, kept| {
            for (c, kept) in kept.into_iter().enumerate() {
                halves.forward[c] += kept * forward;
                halves.backward[c] += kept * (1.0 - forward);
            }
        });
        halves
    }

    /// Hands on what is kept at each offset, times the offset's weight, and its share forward.
    pub(super) fn each(&self, lobe: Lobe, cos_theta_d: f64, mut see: impl FnMut(f64, [f64; 3])) {
        let etas = match lobe {
            Lobe::Trt => &self.trt_eta[..],
            Lobe::R | Lobe::Tt => std::slice::from_ref(&self.hair.eta),
        };
        let share = 1.0 / etas.len() as f64;
        for &eta in etas {
            let theta_d = cos_theta_d.clamp(0.0, 1.0).acos();
            let section = FibreSection::of(&self.hair, eta, theta_d, self.fresnel);
            // TRT leaves straight back where gamma = 2 gamma_t.
            let kink = (lobe == Lobe::Trt && section.eta_eff < 2.0)
                .then(|| 2.0 * (0.5 * section.eta_eff).acos())
                .filter(|&kink| kink < FRAC_PI_2);
            match kink {
                Some(kink) => {
                    self.add(lobe, &section, [0.0, kink], share, &mut see);
                    self.add(lobe, &section, [kink, FRAC_PI_2], share, &mut see);
                }
                None => self.add(lobe, &section, [0.0, FRAC_PI_2], share, &mut see),
            }
        }
    }

    /// Adds offsets `low..high` of gamma, and those of the other side.
    fn add(
        &self,
        lobe: Lobe,
        section: &FibreSection,
        [low, high]: [f64; 2],
        share: f64,
        see: &mut impl FnMut(f64, [f64; 3]),
    ) {
        // gamma = high - (high - low) s^2: dense near grazing, where the Fresnel term turns.
        for (s, weight) in self.rule.on(0.0, 1.0) {
            let gamma = high - (high - low) * s * s;
            let (sin, cos) = gamma.sin_cos();
            let weight = share * weight * 2.0 * (high - low) * s * cos;
            let forward = match lobe {
                Lobe::R => 2.0 * gamma / PI,
                Lobe::Tt => 1.0 - 2.0 / PI * (gamma - gamma_t(section, sin)),
                Lobe::Trt => self.blur.at(4.0 * gamma_t(section, sin) - 2.0 * gamma),
            };
            let kept = section.attenuation(lobe, sin, cos);
            see(forward, kept.map(|kept| weight * kept));
            if lobe == Lobe::Trt && self.hair.model == Model::Energy {
                // Further orders leave evenly.
                let kept = section.residual(sin, cos);
                see(0.5, kept.map(|kept| weight * kept));
            }
        }
    }
}

fn gamma_t(section: &FibreSection, sin_gamma: f64) -> f64 {
    (sin_gamma / section.eta_eff).min(1.0).asin()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circular_gaussian::{circular_gaussian, circular_gaussian_integral};
    use crate::exact::energy;

    #[test]
    fn blurred_lag_is_the_convolution() {
        let rule = GaussLegendre::new(24);
        for width in [0.01, 0.0299, 0.0301, 0.1, 0.5, 1.5] {
            let blur = LagBlur::new(width);
            let kappa = sharpness(width);
            let mass = circular_gaussian_integral(kappa);
            for step in 0..=24 {
                let phi = 4.0 * PI * f64::from(step) / 24.0 - 2.0 * PI + 0.3 * width;
                // Panels with edges at the kinks, where phi - x = 0 or pi.
                let half = (7.0 * width).min(PI);
                let mut edges: Vec<f64> = (0..=16)
                    .map(|ix| -half + half * f64::from(ix) / 8.0)
                    .collect();
                edges.extend([wrap(phi), wrap(phi - PI)]);
                edges.retain(|x| x.abs() <= half);
                edges.sort_by(f64::total_cmp);
                let expected: f64 = edges
                    .windows(2)
                    .map(|pair| {
                        rule.integrate(pair[0], pair[1], |x| {
                            circular_gaussian(x, kappa) * wrap(phi - x).abs()
                        })
                    })
                    .sum();
                let error = (blur.at(phi) - expected / (mass * PI)).abs();
                assert!(error < 1e-6, "{width} {phi} {error:e}");
            }
        }
    }

    #[test]
    fn golden_values() {
        // theta_d 0, sigma_a 0.1: Int N, 2 Int phi N, TT's by 30 digit quadrature.
        let hair = HairParams {
            sigma_a: [0.1; 3],
            caustic_width: 0.01,
            ..HairParams::default()
        };
        let rule = AzimuthRule::new(&hair, Fresnel::Dielectric, 96, 1);
        for (lobe, mass, forward, tolerance) in [
            (Lobe::R, 0.07495526, 0.12352015, 1e-8),
            (Lobe::Tt, 0.71526629, 1.93474277, 1e-8),
            // Without the blur, which adds 2e-4 of the mass here.
            (Lobe::Trt, 0.03887308, 0.00784620, 1e-4),
        ] {
            let halves = rule.halves(lobe, 1.0);
            let sum = halves.forward[0] + halves.backward[0];
            assert!((sum - mass).abs() < 1e-8, "{lobe:?} {sum}");
            let found = PI * halves.forward[0];
            assert!(
                (found - forward).abs() < tolerance,
                "{lobe:?} {found} {forward}"
            );
        }
    }

    #[test]
    fn both_halves_make_the_energy() {
        for eta in [1.0001, 1.2, 1.55, 3.0] {
            for theta_d in [0.0f64, 0.5, 1.2, 1.55] {
                for lobe in Lobe::ALL {
                    let hair = HairParams {
                        eta,
                        ..HairParams::default()
                    };
                    let rule = AzimuthRule::new(&hair, Fresnel::Dielectric, 96, 1);
                    let halves = rule.halves(lobe, theta_d.cos());
                    let expected = energy(lobe, theta_d, &hair, Fresnel::Dielectric);
                    for (c, expected) in expected.into_iter().enumerate() {
                        let sum = halves.forward[c] + halves.backward[c];
                        let error = (sum - expected).abs();
                        assert!(error < 1e-7, "{eta} {theta_d} {lobe:?} {error:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn twice_the_nodes_change_nothing() {
        let mut worst = 0.0f64;
        for eta in [1.0001, 1.01, 1.3, 1.55, 3.0] {
            for (sigma, caustic_width) in [(0.0, 0.01), (0.3, 0.1), (50.0, 1.5)] {
                for eccentricity in [1.0, 0.7, 2.0] {
                    let hair = HairParams {
                        eta,
                        sigma_a: [sigma, 0.1 * sigma, 0.01 * sigma],
                        caustic_width,
                        eccentricity,
                        ..HairParams::default()
                    };
                    let [few, many] = [(96, 32), (200, 32)]
                        .map(|(n, turns)| AzimuthRule::new(&hair, Fresnel::Dielectric, n, turns));
                    for cos_theta_d in [1e-6, 0.01, 0.3, 0.7, 1.0] {
                        for lobe in Lobe::ALL {
                            let (a, b) = (
                                few.halves(lobe, cos_theta_d),
                                many.halves(lobe, cos_theta_d),
                            );
                            for c in 0..3 {
                                worst = worst.max((a.forward[c] - b.forward[c]).abs());
                                worst = worst.max((a.backward[c] - b.backward[c]).abs());
                            }
                        }
                    }
                }
            }
        }
        println!("96 nodes against 200: {worst:e}");
        assert!(worst < 1e-6, "{worst:e}");
    }
}
