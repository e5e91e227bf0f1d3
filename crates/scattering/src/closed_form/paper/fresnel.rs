//! Unpolarised Fresnel terms, as the transmitted part 1 - F, which keeps its digits at grazing
//! incidence. Twin: `shaders/lib/paper/fresnel.wgsl`.

/// 1 - F of a dielectric with index `eta` >= 1 at incidence cosine `cosine` in 0..=1, the true
/// cosine in space: cos(theta_d) sqrt(1 - h^2).
pub fn transmittance_dielectric(eta: f32, cosine: f32) -> f32 {
    let c = cosine;
    let q = ((eta - 1.0) * (eta + 1.0) + c * c).sqrt();
    let n = eta * eta * c;
    let s = c + q;
    let p = n + q;
    2.0 * q * (c / (s * s) + n / (p * p))
}

/// 1 - F by Schlick's approximation: (1 - F_0) (1 - (1 - cosine)^5).
pub fn transmittance_schlick(eta: f32, cosine: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    let g = 1.0 - cosine;
    let g_2 = g * g;
    (1.0 - r * r) * (1.0 - g_2 * g_2 * g)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_agree_head_on_and_vanish_at_grazing() {
        for eta in [1.0001f32, 1.2, 1.55, 3.0] {
            let f_0 = ((eta - 1.0) / (eta + 1.0)).powi(2);
            for transmittance in [transmittance_dielectric, transmittance_schlick] {
                assert!((transmittance(eta, 1.0) - (1.0 - f_0)).abs() < 3e-7);
                assert!(transmittance(eta, 0.0).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn dielectric_matches_the_textbook_form() {
        for i in 1..100 {
            let c = f64::from(i) / 100.0;
            let eta = 1.55f64;
            let q = (eta * eta - 1.0 + c * c).sqrt();
            let r_s = (c - q) / (c + q);
            let r_p = (eta * eta * c - q) / (eta * eta * c + q);
            let exact = 1.0 - 0.5 * (r_s * r_s + r_p * r_p);
            let value = f64::from(transmittance_dielectric(eta as f32, c as f32));
            assert!((value / exact - 1.0).abs() < 1e-6);
        }
    }
}
