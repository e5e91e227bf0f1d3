//! Light on a matte surface. Twin: `shaders/lib/irradiance.wgsl`.

use super::special::erf_pair;

/// Irradiance of an SRBF light of amplitude 1 and width `lambda` on a surface whose normal has the
/// cosine `cos_normal` with the light's direction: the integral over the hemisphere about the
/// normal of `exp(2 (omega . omega_j - 1) / lambda^2)` times the cosine to the normal, sr.
///
/// With kappa = 2 / lambda^2 it is exact where the light stands in the normal (`upper`) and
/// opposite to it (`lower`):
///
/// ```text
/// upper = 2 pi (kappa - 1 + e^-kappa) / kappa^2
/// lower = 2 pi e^-kappa (1 - (1 + kappa) e^-kappa) / kappa^2
/// ```
///
/// Between the two goes a ramp as a Gaussian blurs it, `x (1 + erf(t x)) + e^(-t^2 x^2) / (t sqrt
/// pi)`, its blur fitted. Against quadrature over all cosines and lambda in 0.02..=8 the error is
/// at most 1.7e-3 of `upper` (a test of `tests/tests/gpu/proxies.rs` measures it).
pub fn irradiance(cos_normal: f32, lambda: f32) -> f32 {
    Irradiance::new(lambda).at(cos_normal)
}

/// [`irradiance`] of a light on many surfaces.
#[derive(Clone, Copy, Debug)]
pub struct Irradiance {
    upper: f32,
    lower: f32,
    t: f32,
    /// The ramp at its ends.
    ramp: [f32; 2],
}

impl Irradiance {
    /// Of a light of width `lambda`.
    pub fn new(lambda: f32) -> Irradiance {
        let kappa = 2.0 / (lambda * lambda);
        let fall = (-kappa).exp();
        let squared = kappa * kappa;
        let mut upper = (kappa - 1.0 + fall) / squared;
        let mut lower = fall * (1.0 - (1.0 + kappa) * fall) / squared;
        if kappa < 0.1 {
            upper = 0.5 - kappa * (0.166_666_67 - 0.041_666_67 * kappa);
            lower = 0.5 - kappa * (0.833_333_3 - 0.708_333_3 * kappa);
        }
        let blur =
            (squared + 0.334_25 * kappa + 0.422_157) / (squared + 1.084_606 * kappa + 6.302_895);
        let t = (0.5 * kappa * blur).sqrt().max(0.05);
        Irradiance {
            upper,
            lower,
            t,
            ramp: [blurred_ramp(-1.0, t), blurred_ramp(1.0, t)],
        }
    }

    /// On a surface whose normal has this cosine with the light's direction, sr.
    pub fn at(&self, cos_normal: f32) -> f32 {
        let [least, most] = self.ramp;
        let share = (blurred_ramp(cos_normal, self.t) - least) / (most - least);
        let above = (self.upper - self.lower) * share.clamp(0.0, 1.0);
        2.0 * std::f32::consts::PI * (self.lower + above)
    }
}

/// Twice max(x, 0) blurred by a Gaussian of standard deviation 1 / (sqrt(2) t).
pub fn blurred_ramp(x: f32, t: f32) -> f32 {
    let pair = erf_pair(t * x);
    // 1 / sqrt(pi)
    x * (1.0 + pair.erf) + pair.gauss * 0.564_189_6 / t
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::special::bessel_i0_scaled;

    /// By quadrature over the angle to the normal; the azimuth is integrated by I_0.
    fn exact(cos_normal: f64, lambda: f64) -> f64 {
        let kappa = 2.0 / (lambda * lambda);
        let sin_normal = (1.0 - cos_normal * cos_normal).max(0.0).sqrt();
        let n = 4000;
        let step = std::f64::consts::FRAC_PI_2 / f64::from(n);
        let sum: f64 = (0..n)
            .map(|ix| {
                let (sin, cos) = ((f64::from(ix) + 0.5) * step).sin_cos();
                let across = kappa * sin * sin_normal;
                let lobe = (kappa * (cos * cos_normal - 1.0) + across).exp();
                cos * sin * lobe * bessel_i0_scaled(across)
            })
            .sum();
        std::f64::consts::TAU * sum * step
    }

    #[test]
    fn it_is_that_of_quadrature() {
        let mut worst = 0.0;
        for lambda in [
            0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.5, 2.5, 4.0, 8.0_f64,
        ] {
            let upper = exact(1.0, lambda);
            for ix in 0..=40 {
                let cos = -1.0 + 0.05 * f64::from(ix);
                let found = f64::from(irradiance(cos as f32, lambda as f32));
                worst = f64::max(worst, (found - exact(cos, lambda)).abs() / upper);
            }
        }
        println!("largest error {worst:.2e} of the largest value");
        assert!(worst < 2e-3, "{worst}");
    }

    #[test]
    fn the_whole_sphere_of_light_gives_pi_and_no_light_is_negative() {
        assert!((irradiance(0.3, 100.0) / std::f32::consts::PI - 1.0).abs() < 1e-3);
        for lambda in [1e-3, 0.02, 0.3, 3.0, 1e3] {
            for ix in 0..=20 {
                let value = irradiance(-1.0 + 0.1 * ix as f32, lambda);
                assert!(value.is_finite() && value >= 0.0, "{lambda} {ix} {value}");
            }
        }
    }
}
