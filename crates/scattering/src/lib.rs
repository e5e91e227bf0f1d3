//! Hair scattering under spherical Gaussian lights: the mathematics, without files or GPU.
//!
//! - [`HairParams`]: the parameters of Marschner's fibre model.
//! - [`Lobe`]: the scattering modes R, TT, TRT.
//! - [`exact`]: the model in f64 by quadrature; [`closed_form`]: what the renderer evaluates, f32.
//! - [`dual_scattering`]: the averages of one scattering event and of many, f64.
//! - [`multiple_tables`]: multiple scattering of one fibre by look-up, made at an edit.
//! - [`lobes`]: TT and TRT as sums of circular Gaussians, fitted once for every fibre.
//! - [`table_layout`]: what the baked tables hold, with [`c_integrals`] and [`h_moments`] to fill
//!   them.
//! - [`wide`]: the closed form for eight lights at a time.
//!
//! ```
//! use strandlight_scattering::exact::{Light, View, single};
//! use strandlight_scattering::{HairParams, Lobe, fresnel::Fresnel};
//!
//! let light = Light { theta: 0.1, phi: 2.0, lambda: 0.3 };
//! let view = View { theta: 0.0, phi: 0.4 };
//! let rgb = single(Lobe::R, light, view, &HairParams::default(), Fresnel::Dielectric);
//! assert!(rgb[0] > 0.0);
//! ```
//!
//! Conventions: radians; theta is the inclination to the normal plane; widths are Xu's
//! (`lambda = sqrt(2) * standard deviation`); sigma_a per fibre radius; directions point away
//! from the fibre; phi = phi_o - phi_i = pi is straight through.

pub mod axis;
pub mod c_integrals;
pub mod circular_gaussian;
pub mod closed_form;
pub mod color;
pub mod dual_scattering;
pub mod exact;
pub mod fresnel;
pub mod h_moments;
mod hair;
#[doc(hidden)]
pub mod layout;
pub mod lobes;
pub mod multiple_tables;
pub mod quadrature;
pub mod random;
pub mod reflectance;
pub mod special;
pub mod spherical_gaussian;
pub mod table_layout;
pub mod wide;

pub use hair::{HairParams, Lobe, ParamError, Parameter, ParameterShape, PerLobe};
