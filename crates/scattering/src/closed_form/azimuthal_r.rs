//! The inner integral of Eq 12 for R with the Fresnel term of a dielectric. Twin:
//! `shaders/lib/azimuthal_r.wgsl`.

use core::f64::consts::PI;

use crate::fresnel::Fresnel;
use crate::reflectance::{REFLECTANCE_DEGREE, ReflectanceFit};
use crate::table_layout::C_DEGREE;

use super::frame::{Inclination, Lag};
use super::special::bessel_i0e_fast;
use super::tables::{Tables, sample_c};

/// R's coefficients for one index of refraction, byte for byte the uniform `Reflectance` of the
/// shaders (240 bytes): [`ReflectanceFit`] in single precision.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Reflectance {
    /// `[j][i - 1]`: factor of y^j in the share of b_i, with the 1/4 of N_R and the 2 pi of
    /// C_0. In the shaders
    /// `array<vec4f, 14>`.
    pub coefficients: [[f32; C_DEGREE]; REFLECTANCE_DEGREE + 1],
    /// sqrt(eta^2 - 1), the scale of cos(theta_d).
    pub scale: f32,
    /// Fills the uniform; always 0.
    pub padding_0: f32,
    /// Fills the uniform; always 0.
    pub padding_1: f32,
    /// Fills the uniform; always 0.
    pub padding_2: f32,
}

crate::mirrors! {
    Reflectance as "Reflectance" in "lib/azimuthal_r" {
        coefficients, scale, padding_0, padding_1, padding_2,
    }
}

impl Reflectance {
    /// The coefficients for `fresnel` at `eta`, 1.0001..=3; refitted on each call.
    pub fn new(fresnel: Fresnel, eta: f64) -> Reflectance {
        let fit = ReflectanceFit::new(fresnel, eta);
        Reflectance {
            coefficients: fit
                .coefficients
                .map(|row| row.map(|f| (0.5 * PI * f) as f32)),
            scale: fit.scale as f32,
            padding_0: 0.0,
            padding_1: 0.0,
            padding_2: 0.0,
        }
    }

    /// R times `intensity`.
    pub fn scaled(self, intensity: f64) -> Reflectance {
        let scaled = |row: [f32; C_DEGREE]| row.map(|f| intensity as f32 * f);
        Reflectance {
            coefficients: self.coefficients.map(scaled),
            ..self
        }
    }
}

/// N_R against the light: 1/4 C_0 v^2 sum over i of P_i(y) b_i, see [`crate::reflectance`], not
/// below 0. `kappa` = 2 / lambda'^2, 0..=2e6; one bilinear fetch of C.
///
/// For lambda' from 0.05, fit, table and rounding together: error of the values at most 1e-3 of the
/// largest over dphi for eta in 1.3..=1.8, of the integral 2e-4; 3e-3 and 1.2e-3 up to eta = 3; of
/// the integral 5e-3 down to eta = 1.0001. Narrower lights add C's own error, 1e-4 of C_0.
pub fn azimuthal_r(
    kappa: f32,
    lag: &Lag,
    at: &Inclination,
    reflectance: &Reflectance,
    tables: &Tables,
) -> f32 {
    let b = sample_c(tables.c, &tables.axes, kappa, lag.cos_half);
    bessel_i0e_fast(kappa) * reflected(&b, at, reflectance)
}

/// v^2 sum over i of P_i(y) b_i, see [`crate::reflectance`], not below 0.
pub(crate) fn reflected(b: &[f32; C_DEGREE], at: &Inclination, reflectance: &Reflectance) -> f32 {
    let x = at.cos_theta_d;
    let v = reflectance.scale / (reflectance.scale + x);
    let y = v * (1.0 - x);
    let mut f = reflectance.coefficients[REFLECTANCE_DEGREE];
    for row in reflectance.coefficients[..REFLECTANCE_DEGREE].iter().rev() {
        for (f, coefficient) in f.iter_mut().zip(row) {
            *f = *f * y + coefficient;
        }
    }
    let mut lanes = [0.0; 4];
    for (i, lane) in lanes.iter_mut().enumerate() {
        *lane = f[i] * b[i] + f[i + 4] * b[i + 4];
    }
    // In this order the lanes stay vectors.
    let sum = (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]);
    (v * v) * sum.max(0.0)
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::axis::Axis;
    use crate::c_integrals::BernsteinRule;
    use crate::closed_form::{TableAxes, c_0, inclination, lag_between, pack_shares};
    use crate::quadrature::GaussLegendre;
    use crate::special::bessel_i0_scaled;
    use crate::table_layout::{C_COLUMNS, C_ROWS};

    /// The default table C.
    fn table() -> (Vec<[u16; 8]>, TableAxes) {
        let rule = BernsteinRule::default();
        let values = |axis: &'static Axis| (0..axis.count).map(|ix| axis.value_at(ix));
        let columns: Vec<f64> = values(&C_COLUMNS).collect();
        let mut texels = Vec::new();
        for kappa in values(&C_ROWS) {
            for &cos_half in &columns {
                let [_, shares @ ..] = rule.shares(kappa, cos_half);
                texels.push(pack_shares(&shares.map(|share| share as f32)));
            }
        }
        let axes = TableAxes {
            c_rows: C_ROWS.into(),
            c_columns: C_COLUMNS.into(),
            ..bytemuck::Zeroable::zeroed()
        };
        (texels, axes)
    }

    /// N_R against the light by quadrature, split at the kink and over C_0.
    fn exact(eta: f64, kappa: f64, dphi: f64, theta_d: f64, rule: &GaussLegendre) -> f64 {
        let x = theta_d.cos();
        let half = (7.5 * (2.0 / kappa).sqrt()).min(PI);
        let kink = (dphi - PI).clamp(-half, half);
        let mut sum = 0.0;
        for (end, length) in [(kink, -(half + kink)), (kink, half - kink)] {
            // Dense at the kink, where the spike of eta near 1 is.
            for (t, weight) in rule.on(0.0, 1.0) {
                let at = end + length * t * t;
                let c = (0.5 * (dphi - at)).cos().abs();
                let g = (kappa * (at.cos() - 1.0)).exp();
                let f = Fresnel::Dielectric.reflectance(eta, x * c);
                sum += 2.0 * t * weight * length.abs() * 0.25 * c * f * g;
            }
        }
        sum / (2.0 * PI * bessel_i0_scaled(kappa))
    }

    #[test]
    fn matches_quadrature() {
        let (texels, axes) = table();
        let tables = Tables {
            c: &texels,
            h_tt: &[],
            h_trt: &[],
            axes,
        };
        let rule = GaussLegendre::new(48);
        // Largest error of the largest value over dphi, and relative error of the integral.
        for (etas, tolerance, energy_tolerance) in [
            (&[1.3, 1.45, 1.55, 1.65, 1.8][..], 1e-3, 2.5e-4),
            (&[2.2, 3.0], 3e-3, 1.2e-3),
            (&[1.1, 1.2], 6e-3, 1e-3),
            (&[1.0001, 1.001, 1.01, 1.03], 1.0, 5e-3),
        ] {
            let (mut worst, mut worst_energy) = (0.0f64, 0.0f64);
            for &eta in etas {
                let reflectance = Reflectance::new(Fresnel::Dielectric, eta);
                for lambda_p in [0.05, 0.2, 0.5, 1.0, 3.0] {
                    for step in 0..12 {
                        let theta_d = FRAC_PI_2 * 0.99 * f64::from(step) / 11.0;
                        let at = inclination(theta_d as f32);
                        let kappa = 2.0 / (lambda_p * lambda_p);
                        let (mut peak, mut error) = (0.0f64, 0.0f64);
                        let (mut found_energy, mut energy) = (0.0, 0.0);
                        for ix in 0..48 {
                            let dphi = PI * (f64::from(ix) + 0.5) / 48.0;
                            let lag = lag_between(dphi.cos() as f32, dphi.sin() as f32, 1.0, 0.0);
                            let found = azimuthal_r(kappa as f32, &lag, &at, &reflectance, &tables);
                            assert!(found >= 0.0 && found.is_finite());
                            let found = f64::from(found / c_0(kappa as f32));
                            let exact = exact(eta, kappa, dphi, theta_d, &rule);
                            peak = peak.max(exact);
                            error = error.max((found - exact).abs());
                            found_energy += found;
                            energy += exact;
                        }
                        worst = worst.max(error / peak);
                        worst_energy = worst_energy.max((found_energy / energy - 1.0).abs());
                    }
                }
            }
            println!("{etas:?}: {worst:.2e} of the peak, {worst_energy:.2e} of the energy");
            assert!(worst < tolerance && worst_energy < energy_tolerance);
        }
    }

    /// Over all dphi, whatever the light.
    #[test]
    fn energy_is_kept_by_every_light() {
        let (texels, axes) = table();
        let tables = Tables {
            c: &texels,
            h_tt: &[],
            h_trt: &[],
            axes,
        };
        let rule = GaussLegendre::new(200);
        let (mut worst, mut worst_near_1) = (0.0f64, 0.0f64);
        for eta in [
            1.0001, 1.0003, 1.001, 1.01, 1.03, 1.1, 1.3, 1.55, 1.8, 2.4, 3.0,
        ] {
            let reflectance = Reflectance::new(Fresnel::Dielectric, eta);
            for step in 0..=12 {
                let theta_d = FRAC_PI_2 * f64::from(step) / 12.0;
                let at = inclination(theta_d as f32);
                let x = f64::from(at.cos_theta_d);
                for lambda_p in [0.001f64, 0.01, 0.03, 0.2, 1.0, 10.0, 1e3] {
                    let kappa = (2.0 / (lambda_p * lambda_p)) as f32;
                    let (mut found, mut energy) = (0.0, 0.0);
                    // Dense at phi = pi.
                    for (t, weight) in rule.on(0.0, 1.0) {
                        let (cos_half, sin_half) = (FRAC_PI_2 * t * t).sin_cos();
                        let lag = Lag {
                            sin_half: sin_half as f32,
                            cos_half: cos_half as f32,
                            cos_sum: 1.0,
                            cos_view: 1.0,
                        };
                        let value = azimuthal_r(kappa, &lag, &at, &reflectance, &tables);
                        let f = Fresnel::Dielectric.reflectance(eta, x * cos_half);
                        found += t * weight * f64::from(value / c_0(kappa));
                        energy += t * weight * 0.25 * cos_half * f;
                    }
                    let error = (found / energy - 1.0).abs();
                    match eta < 1.05 {
                        true => worst_near_1 = worst_near_1.max(error),
                        false => worst = worst.max(error),
                    }
                }
            }
        }
        println!("energy: {worst:.2e}, {worst_near_1:.2e} for eta below 1.05");
        assert!(worst < 2e-3 && worst_near_1 < 1e-2);
    }
}
