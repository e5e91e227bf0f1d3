//! Unpolarised Fresnel reflectance in f64.

use std::str::FromStr;

/// Which Fresnel term.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Fresnel {
    /// The exact term of a dielectric.
    #[default]
    Dielectric,
    /// Schlick 1994, as in Xu 2011.
    Schlick,
}

impl Fresnel {
    /// Both terms.
    pub const ALL: [Fresnel; 2] = [Fresnel::Dielectric, Fresnel::Schlick];

    /// Name in files and flags: `dielectric`, `schlick`.
    pub const fn name(self) -> &'static str {
        match self {
            Fresnel::Dielectric => "dielectric",
            Fresnel::Schlick => "schlick",
        }
    }

    /// Reflectance of index `eta` >= 1 at incidence cosine `cosine` in 0..=1, the true cosine in
    /// space: `cos(theta_d) sqrt(1 - h^2)`. At eta = 1 the dielectric reflects nothing but at
    /// cosine 0 exactly, where the answer is 1.
    pub fn reflectance(self, eta: f64, cosine: f64) -> f64 {
        1.0 - self.transmittance(eta, cosine)
    }

    /// `1 - F`, which keeps its digits at grazing incidence.
    pub fn transmittance(self, eta: f64, cosine: f64) -> f64 {
        match self {
            Fresnel::Dielectric => {
                let q = ((eta - 1.0) * (eta + 1.0) + cosine * cosine).sqrt();
                dielectric_transmittance(eta, cosine, q)
            }
            Fresnel::Schlick => {
                let r = (eta - 1.0) / (eta + 1.0);
                (1.0 - r * r) * (1.0 - (1.0 - cosine).powi(5))
            }
        }
    }
}

/// No Fresnel term has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("fresnel is {0:?}, not dielectric or schlick")]
pub struct UnknownFresnel(pub String);

impl FromStr for Fresnel {
    type Err = UnknownFresnel;

    fn from_str(name: &str) -> Result<Fresnel, UnknownFresnel> {
        let mut terms = Fresnel::ALL.into_iter();
        let term = terms.find(|term| term.name() == name);
        term.ok_or_else(|| UnknownFresnel(name.to_owned()))
    }
}

/// `1 - F` of a dielectric from the cosines outside, `c`, and `q = eta cos(theta_t)` inside, both
/// times any common factor: `2 c q / (c+q)^2 + 2 eta^2 c q / (eta^2 c + q)^2`.
pub(crate) fn dielectric_transmittance(eta: f64, c: f64, q: f64) -> f64 {
    if c <= 0.0 {
        return 0.0;
    }
    let n = eta * eta * c;
    let (s, p) = (c + q, n + q);
    2.0 * q * (c / (s * s) + n / (p * p))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textbook_form_and_limits() {
        for eta in [1.0001, 1.3, 1.55, 3.0] {
            let f_0 = ((eta - 1.0f64) / (eta + 1.0)).powi(2);
            for term in Fresnel::ALL {
                assert!((term.reflectance(eta, 1.0) - f_0).abs() < 1e-15);
                assert_eq!(term.transmittance(eta, 0.0), 0.0);
            }
            for step in 1..50 {
                let c = f64::from(step) / 50.0;
                let q = (eta * eta - 1.0 + c * c).sqrt();
                let r_s = (c - q) / (c + q);
                let r_p = (eta * eta * c - q) / (eta * eta * c + q);
                let expected = 0.5 * (r_s * r_s + r_p * r_p);
                let got = Fresnel::Dielectric.reflectance(eta, c);
                assert!((got - expected).abs() < 1e-14);
            }
        }
        assert_eq!(Fresnel::Dielectric.transmittance(1.0, 0.3), 1.0);
    }

    #[test]
    fn names_are_inverse() {
        for term in Fresnel::ALL {
            assert_eq!(term.name().parse(), Ok(term));
        }
        let error = "Schlick".parse::<Fresnel>().unwrap_err();
        assert_eq!(
            error.to_string(),
            "fresnel is \"Schlick\", not dielectric or schlick"
        );
    }
}
