//! The exact model in f64, by quadrature: what the closed forms are measured against.
//!
//! Marschner's R + TT + TRT of a dielectric cylinder; the true incidence cosine in the Fresnel
//! term; TRT blurred by a normalised circular Gaussian of width w_c; the light an exact spherical
//! Gaussian; M_t = g^u(theta_i; 2 alpha_t - theta_o, 2 beta_t) of unit mass in theta_i. Or that of
//! [`Model::Energy`](crate::Model::Energy): M_t a [`FisherLobe`], N_t at theta_o, all orders.
//!
//! - [`azimuthal()`]: the inner integral over phi_i (Xu 2011 Eq 12), without solving for roots.
//! - [`single()`]: the double integral of one light (Eq 11).
//! - [`global()`], [`local()`]: light that other fibres scattered forward ([`Forward`]), over S and
//!   over the backscatter of many fibres (Eq 27, 29); [`direct_local()`]: the latter of the light.
//! - [`energy`]: mass of N_t.
//! - [`Bcsdf`], [`PaintedBcsdf`]: S itself, and sampling it.
//! - [`azimuthal_function`]: N_t itself, by its roots (Eq 9); not blurred.

mod azimuthal;
mod bcsdf;
mod eccentric;
mod fibre;
mod fisher;
mod forward;
mod global;
mod half_circle;
mod local;
mod panels;
mod roots;
mod single;

pub(crate) use azimuthal::further_mass;
pub use azimuthal::{azimuthal, azimuthal_average, energy};
pub use bcsdf::{Bcsdf, BcsdfError, BcsdfView, PaintedBcsdf, Sample, Scattered};
pub use eccentric::{azimuthal_eccentric, eta_star};
pub use fibre::FibreSection;
pub use fisher::FisherLobe;
pub use forward::Forward;
pub use global::{azimuthal_global, global};
pub use half_circle::HalfCircle;
pub use local::{direct_local, local};
pub use roots::{azimuthal_function, roots};
pub use single::{Light, View, single};
