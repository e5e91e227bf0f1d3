//! The exact model in f64, by quadrature: what the closed forms are measured against.
//!
//! Marschner's R + TT + TRT of a dielectric cylinder; the true incidence cosine in the Fresnel
//! term; TRT blurred by a normalised circular Gaussian of width w_c; the light an exact spherical
//! Gaussian; M_t = g^u(theta_i; 2 alpha_t - theta_o, 2 beta_t) of unit mass in theta_i.
//!
//! - [`azimuthal()`]: the inner integral over phi_i (Xu 2011 Eq 12), without solving for roots.
//! - [`single()`]: the double integral of one light (Eq 11).
//! - [`energy`]: mass of N_t.
//! - [`azimuthal_function`]: N_t itself, by its roots (Eq 9); not blurred.

mod azimuthal;
mod eccentric;
mod fibre;
mod roots;
mod single;

pub use azimuthal::{azimuthal, azimuthal_average, energy};
pub use eccentric::{azimuthal_eccentric, eta_star};
pub use fibre::FibreSection;
pub use roots::{azimuthal_function, roots};
pub use single::{Light, View, single};
