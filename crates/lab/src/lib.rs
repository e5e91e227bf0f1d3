//! Measures Strandlight: run time against error, and behaviour at the extremes.
//!
//! The inside of `strandlight bench` and `strandlight stress`: its modules are public for that program,
//! hidden here, and without a promise of stability.
//!
//! - [`mod@bench`]: costs and errors of the closed forms, of shadows, edits and frames.
//! - [`stress`]: single and multiple scattering at corners and random extremes against f64.
//! - [`transmittance`]: earlier ways to find what hair leaves of a light, as baselines.
//!
//! ```
//! use strandlight_lab::bench::plot::{Figure, Panel};
//!
//! let panel = Panel { title: "TT".to_owned(), ..Panel::default() };
//! let figure = Figure { title: "Error".to_owned(), panels: vec![panel], columns: 1, ..Figure::default() };
//! assert!(figure.to_svg().starts_with("<svg"));
//! ```

#[doc(hidden)]
pub mod bench;
#[doc(hidden)]
pub mod stress;
#[doc(hidden)]
pub mod transmittance;
