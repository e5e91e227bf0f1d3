//! The closed form of Xu 2011 in single precision: what the renderer evaluates.
//!
//! - [`Fibre`]: the parameters of one fibre, laid out as the shaders' uniform of the same name.
//! - [`Tables`]: a view of the baked tables C and H, with the sampling the shaders do.
//! - [`single_scattering()`]: the integral of one spherical Gaussian light over the fibre's
//!   scattering function (Eq 11), as the sum over the enabled modes.
//!
//! Every file here has a twin in `shaders/lib` with the same stem, the same function names and
//! the same order of operations; tests compare the two point by point. So arithmetic is written
//! for that pair, not for Rust idiom.
//!
//! The scheme is the paper's, with the misprints of its formulas mended: M_t has unit mass in
//! theta_i, N_TRT(0) sums all roots, the lobe above eta' = 2 keeps its energy. The Fresnel term
//! of R is Schlick's; TT and TRT follow the tables.

mod azimuthal;
mod circular_gaussian;
mod fibre;
mod frame;
mod fresnel;
mod outer_integral;
mod single_scattering;
mod special;
mod tables;

pub use azimuthal::{
    Inclination, Lag, azimuthal_r, azimuthal_trt, azimuthal_tt, eta_star, inclination, lag_between,
};
pub use circular_gaussian::{c_0, product_integral};
pub use fibre::{DEFAULT_SEGMENTS, Fibre, MODE_R, MODE_TRT, MODE_TT};
pub use frame::{DirectionInFrame, LightInFrame};
pub use fresnel::{transmittance_dielectric, transmittance_schlick};
pub use outer_integral::{Longitudinal, MAX_SEGMENTS, hat_weight, longitudinal, node_position};
pub use single_scattering::{LN_CULL, single_scattering, single_scattering_mode};
pub use special::{ErfPair, bessel_i0e, bessel_i1e, erf_pair};
pub use tables::{Cell, TableAxes, TableAxis, Tables, c_from_b, sample_c, sample_h, table_cell};

/// sqrt(pi).
pub(crate) const SQRT_PI: f32 = 1.772_453_9;
