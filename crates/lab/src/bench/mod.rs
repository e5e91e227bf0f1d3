//! Run time against error: the closed forms beside the exact model and beside plain quadrature.
//!
//! - [`Set`] draws [`Configuration`]s of light, view and hair.
//! - [`Method`]: what is compared; [`Prepared`] holds its tables.
//! - [`Reference`] knows the exact values and measures [`Errors`]; [`cpu_costs`] and
//!   [`adapter_costs`] measure [`Cost`]s side by side.
//! - [`run_multiple`] does the same for the integrals of multiple scattering.
//! - [`run_transmittance`] measures what hair leaves of a scene's lights, against ray shooting.
//! - [`frames`]: what frames cost after an edit on a GPU; [`cpu_frames`]: on the CPU; [`window_frames`]: in
//!   a window there.
//! - [`estimate`]: what frames might cost on GPUs, estimated from what they counted.
//! - [`growth`]: how frames grow with the scene and the picture.
//! - [`pairs`]: frames of two builds side by side.
//! - [`peers`]: what brute force costs to a picture's error, beside that picture.
//! - [`run`] does all of it; [`Frontier`] writes it down. [`figures`] plots lobes and integrands.

mod accuracy;
mod brute_force;
mod configuration;
pub mod converge;
pub mod cpu_frames;
mod curves;
pub mod edit;
mod edits;
pub mod estimate;
pub mod frames;
mod frontier;
pub mod growth;
mod method;
mod multiple;
pub mod pairs;
pub mod peers;
pub mod plot;
mod process_clock;
mod tiles;
mod timing;
mod transmittance;
mod truth;
pub mod window_frames;

pub use accuracy::{Errors, Measured, N_SUMS, Reference, SUM_NAMES};
pub use brute_force::BruteForce;
pub use configuration::{Configuration, Set};
pub use curves::{CurvesError, figures};
pub use frontier::{Frontier, FrontierError, Options, Row, run};
pub use method::{Method, MethodError, MethodTables, OnFibre, Prepared};
pub use multiple::{
    INTEGRAL_NAMES, Multiple, MultipleCost, MultipleOptions, MultipleRow, run_multiple,
};
pub use timing::{Cost, Scene, adapter_costs, cpu_costs};
pub use transmittance::{
    CLASS_NAMES, ClassErrors, ShareErrors, TransmittanceBench, TransmittanceOptions,
    TransmittanceRow, run_transmittance,
};
