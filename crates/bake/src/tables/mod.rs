//! Baking and verifying the tables.
//!
//! - [`bake_tables`] fills `C`, `H_TT` and `H_TRT` as [`strandlight_scattering::table_layout`]
//!   describes them ([`bake_c_and_h`]) and fits the [lobes](strandlight_scattering::lobes) of TT
//!   and TRT; [`lobe_errors`] says how well. [`lean`] leaves out what drawing does not read.
//! - [`verify_tables`] recomputes them by other methods, at the texel centres and, sampled
//!   by the renderer's functions, between.
//! - [`float16_cost`] says what half precision would cost.

mod bake;
mod check;
mod float16;
mod layout;
mod lobes;
mod recorded;
mod verify;
mod verify_lobes;

pub use bake::{N_STEPS, bake_c_and_h, bake_tables, lean};
pub use check::{Check, Worst};
pub use float16::{Float16Cost, float16_cost};
pub use layout::{TableError, fresnel_of};
pub use lobes::{LobeErrors, REPORT_RANGE, REPORT_WIDTHS, lobe_errors};
pub use recorded::same_figures;
pub use verify::{TableReport, verify_tables};
