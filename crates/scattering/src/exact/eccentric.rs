//! TRT of an elliptic fibre: an index that follows the azimuthal half angle (Xu 2011 Eq 24-25).

use std::f64::consts::PI;

use super::fibre::FibreSection;
use super::panels::blurred_function;
use crate::circular_gaussian::{circular_gaussian, sharpness};
use crate::fresnel::Fresnel;
use crate::hair::HairParams;
use crate::quadrature::GaussLegendre;

/// Least index of an elliptic fibre; Eq 24 falls to 1 and below for a^2 <= 1/2 or a^2 >= 2,
/// whatever eta, where nothing would be reflected.
const ETA_STAR_MIN: f64 = 1.05;

/// Panels are no longer than twice this, radians: at a = 0.5 longer ones of 0.9 were off by 15 % of a
/// small integral.
const INDEX_TURN: f64 = 0.1;

/// `eta*(phi_h)` of Eq 24: `((e1 + e2) + cos(2 phi_h) (e1 - e2)) / 2`,
/// `e1 = 2 (eta-1) a^2 - eta + 2`, `e2` with `a^-2`; at least 1.05, or eta if that is less.
pub fn eta_star(eta: f64, eccentricity: f64, phi_h: f64) -> f64 {
    let square = eccentricity * eccentricity;
    let e_1 = 2.0 * (eta - 1.0) * square - eta + 2.0;
    let e_2 = 2.0 * (eta - 1.0) / square - eta + 2.0;
    let value = 0.5 * ((e_1 + e_2) + (2.0 * phi_h).cos() * (e_1 - e_2));
    value.max(ETA_STAR_MIN.min(eta))
}

/// Eq 25 unapproximated: `Int g^c(phi_i; phi_j, lambda_p) N_TRT(phi_o - phi_i; eta*(phi_h))
/// dphi_i` with `phi_h = (phi_o + phi_i)/2` inside the integral, N_TRT blurred by w_c at the index
/// of each phi_i. The index replaces eta in the Fresnel term and the absorption too.
///
/// Panelled Gauss-Legendre: some 1e-7 absolute; slow (milliseconds).
pub fn azimuthal_eccentric(
    lambda_p: f64,
    phi_j: f64,
    phi_o: f64,
    theta_d: f64,
    hair: &HairParams,
    fresnel: Fresnel,
) -> [f64; 3] {
    let kappa = sharpness(lambda_p);
    let kappa_c = sharpness(hair.caustic_width);
    let half = if kappa > 0.0 {
        (6.5 * (2.0 / kappa).sqrt()).min(PI)
    } else {
        PI
    };
    // Panels of about the narrowest of the light, the blurred lobe and the turn in which the index, and
    // with it the reflectance, changes several times over.
    let scale = (2.0 / kappa.max(2.0))
        .sqrt()
        .min(1.5 * hair.caustic_width)
        .min(INDEX_TURN);
    let rule = GaussLegendre::new(8);
    let mut total = [0.0; 3];
    for (x, weight) in rule.on_panels(-half, half, 2.0 * scale, 2..=400) {
        let phi_i = phi_j + x;
        let eta = eta_star(hair.eta, hair.eccentricity, 0.5 * (phi_o + phi_i));
        let section = FibreSection::of(hair, eta, theta_d, fresnel);
        let value = blurred_function(&section, phi_o - phi_i, kappa_c);
        let factor = weight * circular_gaussian(x, kappa);
        for c in 0..3 {
            total[c] += factor * value[c];
        }
    }
    total
}
