//! Special functions in f64.

mod bessel;
mod erf;

pub use bessel::{bessel_i_ratio_1, bessel_i_scaled, bessel_i0_scaled, bessel_i1_scaled};
pub use erf::{dawson, erf, erfc, erfcx};

#[cfg(test)]
mod reference_values;
