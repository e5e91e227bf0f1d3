//! Shadow records of optical depths, which maps of layers hold.

use strandlight_scattering::closed_form::{P_1, P_2, ShadowRecord};

/// The record of one optical depth `[tau, integral of sin^2 theta dtau]`.
pub(super) fn record_of_depth([depth, sin_2]: [f64; 2]) -> ShadowRecord {
    let share = |p: f32| (-f64::from(p) * depth).exp() as f32;
    let sin_2 = if depth > 1e-12 { sin_2 / depth } else { 0.0 };
    ShadowRecord {
        shares: [share(1.0), share(P_1), share(P_2)],
        sin_theta: sin_2.clamp(0.0, 1.0).sqrt() as f32,
    }
}
