//! Measures Strandlight: run time against error, and behaviour at the extremes.
//!
//! - [`bench`]: costs and errors of the closed forms, of shadows, edits and frames.
//! - [`stress`]: single and multiple scattering at corners and random extremes against f64.
//! - [`transmittance`]: earlier ways to find what hair leaves of a light, as baselines.

pub mod bench;
pub mod stress;
pub mod transmittance;
