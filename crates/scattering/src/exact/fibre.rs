//! A fibre seen at one inclination: effective index and absorption, attenuation of each path.

use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe, PerLobe};

/// Inclinations nearer to pi/2 than this are treated as this near: the lobes vanish there and
/// the effective index runs to infinity.
const COS_THETA_D_MIN: f64 = 1e-8;

/// The cross section at inclination theta_d (Marschner 2003 section 4, Xu 2011 Table 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FibreSection {
    /// Index of refraction, >= 1.
    pub eta: f64,
    /// `cos(theta_d)`.
    pub cos_theta_d: f64,
    /// Effective index in the normal plane, `sqrt(eta^2 - sin^2 theta_d) / cos theta_d`.
    pub eta_eff: f64,
    /// Effective absorption per radius, `sigma_a / sqrt(1 - sin^2 theta_d / eta^2)`.
    pub sigma_eff: [f64; 3],
    /// Fresnel term.
    pub fresnel: Fresnel,
    /// Factors on the attenuation of each mode.
    pub intensity: PerLobe<f64>,
}

impl FibreSection {
    /// The section of a fibre of index `eta` and absorption `sigma_a` at `theta_d` in +-pi/2.
    pub fn new(eta: f64, sigma_a: [f64; 3], theta_d: f64, fresnel: Fresnel) -> Self {
        let (sin, cos) = theta_d.sin_cos();
        let cos = cos.abs().max(COS_THETA_D_MIN);
        let inner = ((eta - sin) * (eta + sin)).sqrt();
        FibreSection {
            eta,
            cos_theta_d: cos,
            eta_eff: inner / cos,
            sigma_eff: sigma_a.map(|sigma| sigma * eta / inner),
            fresnel,
            intensity: HairParams::default().intensity,
        }
    }

    /// The section of `hair` at `theta_d` in +-pi/2, its index being `eta`: `hair.eta`, or that of
    /// an elliptic fibre at some half angle.
    pub fn of(hair: &HairParams, eta: f64, theta_d: f64, fresnel: Fresnel) -> Self {
        FibreSection {
            intensity: hair.intensity,
            ..FibreSection::new(eta, hair.sigma_a, theta_d, fresnel)
        }
    }

    /// `A_t(h)` of Xu 2011 Eq 10 at `h = sin gamma`: what a path through `h` keeps, per channel.
    /// One crossing is `T = exp(-2 sigma_eff sqrt(1 - h^2 / eta_eff^2))`. Times the mode's
    /// intensity.
    pub fn attenuation(&self, lobe: Lobe, sin_gamma: f64, cos_gamma: f64) -> [f64; 3] {
        let through = self
            .fresnel
            .transmittance(self.eta, self.cos_theta_d * cos_gamma.abs());
        let reflected = 1.0 - through;
        let sin_t = sin_gamma / self.eta_eff;
        let crossing = -2.0 * (1.0 - sin_t * sin_t).max(0.0).sqrt();
        let kept = match lobe {
            Lobe::R => [reflected; 3],
            Lobe::Tt => self
                .sigma_eff
                .map(|sigma| through * through * (sigma * crossing).exp()),
            Lobe::Trt => self
                .sigma_eff
                .map(|sigma| through * through * reflected * (2.0 * sigma * crossing).exp()),
        };
        kept.map(|kept| self.intensity.get(lobe) * kept)
    }

    /// What of a path through `h = sin gamma` leaves after more than two segments, per channel: of every
    /// segment T, of every internal reflection F,
    ///
    /// `A_TRT (F T + F^2 T^2 + ...) = A_TRT F T / (1 - F T)` (d'Eon 2011 section 4.2); with TRT's
    /// intensity.
    pub fn residual(&self, sin_gamma: f64, cos_gamma: f64) -> [f64; 3] {
        let through = self
            .fresnel
            .transmittance(self.eta, self.cos_theta_d * cos_gamma.abs());
        let sin_t = sin_gamma / self.eta_eff;
        let crossing = -2.0 * (1.0 - sin_t * sin_t).max(0.0).sqrt();
        let reflected = 1.0 - through;
        let intensity = self.intensity.get(Lobe::Trt);
        self.sigma_eff.map(|sigma| {
            let optical = sigma * crossing;
            let kept = reflected * optical.exp();
            // 1 - F T = (1 - F) + F (1 - T), without cancellation.
            let lost = through - reflected * optical.exp_m1();
            match lost > 0.0 {
                true => intensity * optical.exp() * (through * kept) * (through * kept / lost),
                false => 0.0,
            }
        })
    }

    /// `phi(p, h) = 2 p gamma_t - 2 gamma_i + p pi` (Xu 2011 Eq 8), not wrapped.
    pub fn exit_azimuth(&self, lobe: Lobe, gamma: f64) -> f64 {
        let p = f64::from(lobe.p());
        let gamma_t = (gamma.sin() / self.eta_eff).clamp(-1.0, 1.0).asin();
        2.0 * p * gamma_t - 2.0 * gamma + p * std::f64::consts::PI
    }

    /// `d phi / d gamma = 2 p cos gamma / sqrt(eta_eff^2 - sin^2 gamma) - 2`.
    pub fn exit_azimuth_slope(&self, lobe: Lobe, gamma: f64) -> f64 {
        let (sin, cos) = gamma.sin_cos();
        let inner = (self.eta_eff * self.eta_eff - sin * sin).max(1e-300).sqrt();
        2.0 * f64::from(lobe.p()) * cos / inner - 2.0
    }

    /// The offset angle gamma > 0 of TRT's caustic, `sin^2 gamma = (4 - eta_eff^2)/3`; `None`
    /// where eta_eff >= 2.
    pub fn caustic(&self) -> Option<f64> {
        let square = (4.0 - self.eta_eff * self.eta_eff) / 3.0;
        (square > 0.0).then(|| square.min(1.0).sqrt().asin())
    }
}
