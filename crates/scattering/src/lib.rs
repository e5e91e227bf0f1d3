//! Hair scattering under spherical Gaussian lights: the mathematics, without files or GPU.
//!
//! - [`HairParams`]: the parameters of Marschner's fibre model.
//! - [`Lobe`]: the scattering modes R, TT, TRT.
//!
//! Conventions: radians; theta is the inclination to the normal plane; widths are Xu's
//! (`lambda = sqrt(2) * standard deviation`); sigma_a per fibre radius; directions point away
//! from the fibre; phi = phi_o - phi_i = pi is straight through.

pub mod axis;
pub mod c_integrals;
pub mod circular_gaussian;
pub mod closed_form;
pub mod exact;
pub mod fresnel;
pub mod h_moments;
mod hair;
pub mod quadrature;
pub mod special;
pub mod table_layout;

pub use hair::{HairParams, Lobe, ParamError, PerLobe};
