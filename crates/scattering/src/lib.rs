//! Hair scattering under spherical Gaussian lights: the mathematics, without files or GPU.
//!
//! - [`HairParams`]: the parameters of a fibre; [`Model`]: Marschner's, or one that keeps all energy.
//! - [`Lobe`]: the scattering modes R, TT, TRT.
//! - [`exact`]: the model in f64 by quadrature.
//! - [`dual_scattering`]: the averages of one scattering event and of many, f64.
//!
//! What the renderer evaluates in f32 (`closed_form`, the twin of the shaders;
//! `wide`, eight lights at a time; `multiple_tables`, multiple scattering of one fibre by look-up), and what the tables are
//! baked with (`lobes`, `c_integrals`, `h_moments`, `table_layout` and their helpers), is public for the
//! other crates of Strandlight and hidden here: without a promise of stability.
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
#[doc(hidden)]
pub mod c_integrals;
#[doc(hidden)]
pub mod circular_gaussian;
#[doc(hidden)]
pub mod closed_form;
pub mod color;
pub mod dual_scattering;
pub mod exact;
pub mod fresnel;
#[doc(hidden)]
pub mod h_moments;
mod hair;
#[doc(hidden)]
pub mod jobs;
#[doc(hidden)]
pub mod layout;
#[doc(hidden)]
pub mod lobes;
#[doc(hidden)]
pub mod multiple_tables;
#[doc(hidden)]
pub mod quadrature;
#[doc(hidden)]
pub mod random;
#[doc(hidden)]
pub mod reflectance;
#[doc(hidden)]
pub mod special;
#[doc(hidden)]
pub mod spherical_gaussian;
#[doc(hidden)]
pub mod table_layout;
#[doc(hidden)]
pub mod wide;

pub use hair::{HairBits, HairParams, Lobe, Model, ParamError, Parameter, ParameterShape, PerLobe};
