//! The scheme of Xu 2011 as published, with the misprints of its formulas mended: M_t has unit
//! mass in theta_i, N_TRT(0) sums all roots, the lobe above eta' = 2 keeps its energy. The Fresnel
//! term of R is Schlick's; TT and TRT follow the tables.
//!
//! Multiple scattering ([`global_scattering`], [`local_scattering`]) is on the CPU alone, for
//! comparison; psi_f is normalised by Z instead of cos(theta_j), and the lag of Eq 30 is that
//! between phi_j and phi_o.
//!
//! The twins in `shaders/lib/paper` carry the prefix `paper_`: WGSL has one name space.

mod azimuthal;
mod fresnel;
mod global;
mod local;
mod multiple;
mod outer_integral;
mod single_scattering;

pub use super::fibre::MAX_SEGMENTS;
pub use azimuthal::{azimuthal_r, azimuthal_trt, azimuthal_tt, eta_star};
pub use fresnel::{transmittance_dielectric, transmittance_schlick};
pub use global::{global_scattering, global_scattering_mode};
pub use local::{PublishedAverages, local_scattering};
pub use outer_integral::{hat_weight, node_position};
pub use single_scattering::{LN_CULL, single_scattering, single_scattering_mode};
