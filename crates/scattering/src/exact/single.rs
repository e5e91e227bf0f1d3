//! The outer integral: one spherical Gaussian light over the scattering function (Xu 2011 Eq 11).

use std::f64::consts::{FRAC_PI_2, PI};

use super::azimuthal::{azimuthal_section, residual};
use super::eccentric::azimuthal_eccentric;
use super::fibre::FibreSection;
use super::fisher::FisherLobe;
use crate::circular_gaussian::sharpness;
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe, Model, ParamError, in_range};
use crate::quadrature::GaussLegendre;
use crate::special::bessel_i0_scaled;

/// A spherical Gaussian light of amplitude 1 in the fibre's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Inclination of its centre, +-pi/2.
    pub theta: f64,
    /// Azimuth of its centre, +-1e6.
    pub phi: f64,
    /// Bandwidth, 0.001..=10.
    pub lambda: f64,
}

impl Light {
    /// Checks every field against its documented range.
    ///
    /// # Errors
    /// The first field outside its range, by name and value.
    pub fn validate(&self) -> Result<(), ParamError> {
        check_direction(["light.theta", "light.phi"], self.theta, self.phi)?;
        in_range("light.lambda", self.lambda, 0.001, 10.0)
    }
}

/// The direction to the eye in the fibre's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Inclination, +-pi/2.
    pub theta: f64,
    /// Azimuth, +-1e6.
    pub phi: f64,
}

impl View {
    /// Checks every field against its documented range.
    ///
    /// # Errors
    /// The first field outside its range, by name and value.
    pub fn validate(&self) -> Result<(), ParamError> {
        check_direction(["view.theta", "view.phi"], self.theta, self.phi)
    }
}

/// Azimuths beyond this have lost the digits that matter.
const MAX_PHI: f64 = 1e6;

pub(super) fn check_direction(
    names: [&'static str; 2],
    theta: f64,
    phi: f64,
) -> Result<(), ParamError> {
    in_range(names[0], theta, -FRAC_PI_2, FRAC_PI_2)?;
    in_range(names[1], phi, -MAX_PHI, MAX_PHI)
}

/// Where the integrand has fallen by `exp(-CUTOFF)` from its peak it is left out.
pub(super) const CUTOFF: f64 = 40.0;

/// `Int G(omega_i) S_t(omega_i, omega_o) cos(theta_i) d omega_i` (Xu 2011 Eq 11), per channel.
///
/// The light is exact: `G = g^c(theta_i; theta_j, lambda) g^c(phi_i; phi_j, lambda_p)`,
/// `lambda_p = lambda / sqrt(cos theta_i cos theta_j)`, so the integral over theta_i in +-pi/2 is
/// of `M_t g^c cos^2(theta_i)/cos^2(theta_d)` times [`super::azimuthal()`], of model `energy`
/// `M_t g^c cos(theta_i)` times that at theta_o; panelled
/// Gauss-Legendre where both Gaussians live. Error some 1e-7 of the lobe's peak (tested against
/// twice the nodes and a direct integral over the sphere). Milliseconds a call, more with an
/// eccentric TRT.
pub fn single(
    lobe: Lobe,
    light: Light,
    view: View,
    hair: &HairParams,
    fresnel: Fresnel,
) -> [f64; 3] {
    single_with(lobe, light, view, hair, fresnel, 1.5)
}

/// [`single`] with panels of `panel` times the integrand's width.
fn single_with(
    lobe: Lobe,
    light: Light,
    view: View,
    hair: &HairParams,
    fresnel: Fresnel,
    panel: f64,
) -> [f64; 3] {
    let mean = 2.0 * hair.shift.get(lobe) - view.theta;
    let width = 2.0 * hair.width.get(lobe);
    let kappa = sharpness(light.lambda);
    if hair.model == Model::Energy {
        let m = FisherLobe::new(mean, width);
        return single_energy(lobe, light, view, hair, fresnel, &m, panel);
    }
    // Minus the logarithm of M_t g^c, up to a constant.
    let fall = |theta: f64| {
        let z = (theta - mean) / width;
        let s = (0.5 * (theta - light.theta)).sin();
        z * z + 2.0 * kappa * s * s
    };
    let (low, high) = window(&fall);
    // Narrower of the two Gaussians, and than what varies in the rest: 0.3 rad.
    let scale = (1.0 / (1.0 / (width * width) + 0.5 * kappa))
        .sqrt()
        .min(0.3);
    let rule = GaussLegendre::new(10);
    let peak = 1.0 / (PI.sqrt() * width);
    let mut total = [0.0; 3];
    for (theta_i, weight) in rule.on_panels(low, high, panel * scale, 1..=400) {
        let theta_d = 0.5 * (view.theta - theta_i);
        let cos_i = theta_i.cos();
        let factor = weight * peak * (-fall(theta_i)).exp() * (cos_i / theta_d.cos()).powi(2);
        if factor == 0.0 {
            continue;
        }
        let kappa_p = kappa * (cos_i * light.theta.cos()).max(0.0);
        let inner = if lobe == Lobe::Trt && hair.eccentricity != 1.0 {
            let lambda_p = (2.0 / kappa_p).sqrt();
            azimuthal_eccentric(lambda_p, light.phi, view.phi, theta_d, hair, fresnel)
        } else {
            let section = FibreSection::of(hair, hair.eta, theta_d, fresnel);
            let dphi = view.phi - light.phi;
            azimuthal_section(lobe, kappa_p, dphi, &section, hair.caustic_width)
        };
        for c in 0..3 {
            total[c] += factor * inner[c];
        }
    }
    total
}

/// [`single_with`] of model `energy`: the section is the same for all theta_i.
fn single_energy(
    lobe: Lobe,
    light: Light,
    view: View,
    hair: &HairParams,
    fresnel: Fresnel,
    m: &FisherLobe,
    panel: f64,
) -> [f64; 3] {
    let width = 2.0 * hair.width.get(lobe);
    let kappa = sharpness(light.lambda);
    let from_light = |theta: f64| {
        let s = (0.5 * (theta - light.theta)).sin();
        2.0 * kappa * s * s
    };
    let (low, high) = window(&|theta| m.fall(theta) + from_light(theta));
    let scale = (1.0 / (1.0 / (width * width) + 0.5 * kappa))
        .sqrt()
        .min(0.3);
    let section = FibreSection::of(hair, hair.eta, view.theta, fresnel);
    let further = residual(lobe, hair, &section);
    let rule = GaussLegendre::new(10);
    let mut total = [0.0; 3];
    for (theta_i, weight) in rule.on_panels(low, high, panel * scale, 1..=400) {
        let factor = weight * m.density(theta_i) * (-from_light(theta_i)).exp();
        if factor == 0.0 {
            continue;
        }
        let kappa_p = kappa * (theta_i.cos() * light.theta.cos()).max(0.0);
        let dphi = view.phi - light.phi;
        let inner = azimuthal_section(lobe, kappa_p, dphi, &section, hair.caustic_width);
        let even = bessel_i0_scaled(kappa_p);
        for c in 0..3 {
            total[c] += factor * (inner[c] + even * further[c]);
        }
    }
    total
}

/// The part of +-pi/2 where `fall` is within [`CUTOFF`] of its least value. Convex enough: a
/// parabola and a circular cosine, one valley within half a turn.
pub(super) fn window(fall: &impl Fn(f64) -> f64) -> (f64, f64) {
    // Coarse scan, then golden section around the best.
    const STEPS: u32 = 64;
    let at = |i: u32| -FRAC_PI_2 + PI * f64::from(i) / f64::from(STEPS);
    let best = (0..=STEPS)
        .min_by(|&i, &j| fall(at(i)).total_cmp(&fall(at(j))))
        .unwrap_or(0);
    let (mut a, mut b) = (at(best.saturating_sub(1)), at((best + 1).min(STEPS)));
    for _ in 0..60 {
        let (x, y) = (a + 0.382 * (b - a), a + 0.618 * (b - a));
        if fall(x) <= fall(y) {
            b = y;
        } else {
            a = x;
        }
    }
    let valley = 0.5 * (a + b);
    let limit = fall(valley) + CUTOFF;
    let edge = |end: f64| {
        if fall(end) <= limit {
            return end;
        }
        let (mut inside, mut outside) = (valley, end);
        for _ in 0..60 {
            let middle = 0.5 * (inside + outside);
            if fall(middle) <= limit {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        outside
    };
    (edge(-FRAC_PI_2), edge(FRAC_PI_2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Halton's sequence: the radical inverse of `i`.
    fn halton(mut i: u32, base: u32) -> f64 {
        let (mut value, mut scale) = (0.0, 1.0);
        while i > 0 {
            scale /= f64::from(base);
            value += scale * f64::from(i % base);
            i /= base;
        }
        value
    }

    #[test]
    fn narrower_panels_change_nothing() {
        for (model, lobe) in Model::ALL
            .into_iter()
            .flat_map(|model| Lobe::ALL.map(|lobe| (model, lobe)))
        {
            let hair = HairParams {
                model,
                ..HairParams::default()
            };
            let (mut peak, mut worst) = (0.0f64, 0.0f64);
            for i in 1..40 {
                let pick = |base, low: f64, high: f64| low + (high - low) * halton(i, base);
                let lambda = 0.05 * 30f64.powf(halton(i, 2));
                let light = Light {
                    theta: pick(3, -1.5, 1.5),
                    phi: pick(5, -PI, PI),
                    lambda,
                };
                let view = View {
                    theta: pick(7, -1.5, 1.5),
                    phi: pick(11, -PI, PI),
                };
                let [few, many] = [1.5, 0.4]
                    .map(|panel| single_with(lobe, light, view, &hair, Fresnel::Dielectric, panel));
                for c in 0..3 {
                    peak = peak.max(many[c]);
                    worst = worst.max((few[c] - many[c]).abs());
                }
            }
            println!("{}: {worst:e} of {peak:e}", lobe.name());
            assert!(worst < 1e-6 * peak);
        }
    }

    #[test]
    fn narrow_lights_and_lobes_are_not_missed() {
        // R of a narrow lobe under a narrow light, against the product of two Gaussians.
        let mut hair = HairParams::default();
        hair.width.r = 0.002;
        hair.shift.r = 0.0;
        let (theta, lambda) = (0.4, 0.001);
        let light = Light {
            theta,
            phi: 0.0,
            lambda,
        };
        let at = |view_theta: f64, phi: f64| {
            let view = View {
                theta: view_theta,
                phi,
            };
            single(Lobe::R, light, view, &hair, Fresnel::Dielectric)[0]
        };
        let peak = at(-theta, 0.6);
        // (pi lambda^2) cos theta g^u / cos^2 theta_d N_R(phi), the Gaussians convolved.
        let section = FibreSection::new(hair.eta, hair.sigma_a, -theta, Fresnel::Dielectric);
        let n = crate::exact::azimuthal_function(&section, Lobe::R, 0.6)[0];
        let width = (16e-6f64 + 1e-6).sqrt();
        let expected = PI * lambda * lambda * n / (PI.sqrt() * width) / theta.cos();
        assert!((peak / expected - 1.0).abs() < 1e-5, "{peak} {expected}");
        assert!(at(-theta + 0.05, 0.6) < 1e-60);
    }
}
