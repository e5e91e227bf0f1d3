//! What the hair between a light and a point makes of the light: what multiple scattering starts
//! from. Twin: `shaders/lib/multiple_scattering.wgsl`.
//!
//! A point's radiance is, per channel, the sum over the lights of
//!
//! ```text
//! L { T M^S + d_b f_local T Omega M^{L,dir}
//!     + d_f Omega [ (f_global (T_f - T_vol) + T_b) M^G + d_b f_local (T_f - T_vol + T_b) M^L ] }
//! T_b = max(F - T_f, 0) / 2
//! ```
//!
//! L and Omega being amplitude and solid angle of the light, T its unblocked share, T_f what the hair in
//! front lets through by factors of a_f ([`super::transmitted`]), and T_b what light that went to and fro between layers
//! adds to that, [`BETWEEN_LAYERS_SHARE`] of what F ([`between_layers`]) has above T_f. M^S is [`super::single_scattering()`]; M^{L,dir}
//! ([`super::direct_local_scattering`]) is what light that comes straight sends into the hair
//! behind and gets back; M^G ([`super::global_scattering`]) and M^L ([`super::local_scattering`])
//! are both for light that has been scattered before. Only blocked light has been, so no light is
//! counted twice: T_f - T_vol and not T_f multiplies them (Zinke 2008, Figure 5, adds both). T_f and
//! T_vol come from the shadow volume and are means over the hair about the point; T, before M^S and
//! M^{L,dir}, is the point's own. f_global is [`global_density`], f_local [`super::local_density`].

use super::averages::{AverageTexel, sample_averages};
use super::hair_layers::{HairLayers, between_layers};
use super::transmittance::{ShadowRecord, forward_events, transmitted};

/// T M^S: light that comes straight and is scattered once.
pub const TERM_SINGLE: u32 = 1;
/// The terms with d_b: light that comes back out of the hair behind a point.
pub const TERM_LOCAL: u32 = 2;
/// d_f Omega (f_global (T_f - T_vol) + T_b) M^G: light that the hair in front of a point scattered on.
pub const TERM_GLOBAL: u32 = 4;

/// d_f where a scene says nothing: share of blocked light that goes on forward, 0..=1. With both
/// densities 1 the mean colour of dual scattering is within 5 % of path tracing's for blond, brown
/// and dark hair.
pub const DENSITY_FORWARD: f32 = 1.0;
/// d_b where a scene says nothing: share of the hair behind a point that sends light back. 0..=1.
pub const DENSITY_BACK: f32 = 1.0;

/// Sines of the inclination in a [`ForwardTable`].
pub const N_FORWARD: usize = 64;

/// The averages that forward scattering needs, a_f then beta_f^2 (linear RGB and a zero each), at
/// [`N_FORWARD`] sines of the inclination, evenly over 0..=1. A record knows no sign of the
/// inclination, so they are means of +theta and -theta, beta_f^2 weighed by a_f.
pub type ForwardTable = [[f32; 4]; 2 * N_FORWARD];

/// Sines less one, the index of the last; twin in `shaders/pass/shade.wgsl`.
pub(crate) const LAST_FORWARD: f32 = 63.0;

/// The table of these averages; of no averages, zero.
pub fn forward_table(averages: &[AverageTexel]) -> ForwardTable {
    let mut table = [[0.0; 4]; 2 * N_FORWARD];
    if averages.is_empty() {
        return table;
    }
    for (ix, entry) in table.as_chunks_mut::<2>().0.iter_mut().enumerate() {
        let [a_f, beta_f_2] = entry;
        let theta = (ix as f32 / LAST_FORWARD).asin();
        let (up, down) = (
            sample_averages(averages, theta),
            sample_averages(averages, -theta),
        );
        let both = |c: usize| up.a_f[c] + down.a_f[c];
        let weighed = |c: usize| up.a_f[c] * up.beta_f_2[c] + down.a_f[c] * down.beta_f_2[c];
        for (c, (a_f, beta_f_2)) in a_f.iter_mut().zip(beta_f_2).enumerate().take(3) {
            *a_f = 0.5 * both(c);
            *beta_f_2 = weighed(c) / both(c).max(1e-12);
        }
    }
    table
}

/// a_f and beta_f^2 between two entries; `sample_forward` of the shading pass.
pub fn sample_forward(table: &ForwardTable, sin_theta: f32) -> ([f32; 3], [f32; 3]) {
    let at = sin_theta.clamp(0.0, 1.0) * LAST_FORWARD;
    let first = at.floor().min(LAST_FORWARD - 1.0);
    let fraction = at - first;
    let ix = 2 * first as usize;
    let mix = |low: [f32; 4], high: [f32; 4]| {
        [0, 1, 2].map(|c| low[c] * (1.0 - fraction) + high[c] * fraction)
    };
    (
        mix(table[ix], table[ix + 2]),
        mix(table[ix + 1], table[ix + 3]),
    )
}

/// [`global_density`] where all light is blocked.
pub(crate) const DENSITY_BLOCKED: f32 = 0.7;
/// [`global_density`] where none is.
pub(crate) const DENSITY_OPEN: f32 = 1.65;

/// Light that reaches a point after forward scattering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForwardLight {
    /// T_f - T_vol + T_b, 0..=1: what M^L is multiplied by.
    pub gained: [f32; 3],
    /// f_global (T_f - T_vol) + T_b: what M^G is multiplied by.
    pub global: [f32; 3],
    /// Its width in inclination, Xu's, radians: sigma_f^2 = lambda_j^2 + sigma_bar_f^2.
    pub sigma_f: f32,
}

/// Factor on global scattering where the share `open` of a light, 0..=1, comes unblocked: a straight line in
/// it, fitted to path tracing (`docs/book/src/theory/dual-scattering.md`). Dual scattering follows straight
/// lines to the light, while light that hair scatters forward spreads to the sides: more of it comes to hair
/// near the lit surface, less to hair far behind it.
pub fn global_density(open: f32) -> f32 {
    DENSITY_BLOCKED + (DENSITY_OPEN - DENSITY_BLOCKED) * open
}

/// Least 1 - a_f: below it [`transmitted`] was not measured.
pub(crate) const LEAST_LOST: f32 = 0.03;

/// Share of F - T_f that is drawn. F is that of layers without sides; in a head of hair part of the light between them leaves sideways.
/// Chosen by pictures (`docs/book/src/accuracy/accuracy.md#layers-that-end`): with 1, white hair on a head is up to 1.2 times too bright.
pub(crate) const BETWEEN_LAYERS_SHARE: f32 = 0.5;

/// T_f and T_vol are the record's, means over the hair about the point, even where the point's own
/// unblocked share is known better: scattered light comes from all the hair around, from beside the
/// straight line to the light too.
///
/// Forward-scattered light of a light of colour `rgb` and width `lambda`; `a_f` and `beta_f_2` are
/// the averages at the record's inclination, means of +theta and -theta. They are those of the
/// fibre that is lit, painted or not: the fibres on the way count as such. sigma_bar_f^2 is
/// beta_f^2 times the events it underwent ([`forward_events`]), the mean of the channels by what
/// each carries; events are counted as if each sent on q of the light, in place of a_f.
///
/// Light that went to and fro between layers adds T_b = `BETWEEN_LAYERS_SHARE` max(F - T_f, 0), F by `between_layers`. The hair behind
/// the point is such `layers`, and sends back `density_back` (d_b f_local) of what a stack without end would.
pub fn forward_light(
    record: &ShadowRecord,
    a_f: [f32; 3],
    beta_f_2: [f32; 3],
    (rgb, lambda): ([f32; 3], f32),
    (layers, density_back): (&HairLayers, [f32; 3]),
) -> ForwardLight {
    let p_a_f = a_f.map(|a_f| (1.0 - a_f).clamp(LEAST_LOST, 1.0));
    let t_f = transmitted(record, p_a_f);
    let p_q = [0, 1, 2].map(|c: usize| (1.0 - layers.gain[c] * a_f[c]).clamp(LEAST_LOST, 1.0));
    let u = transmitted(record, p_q);
    let f = between_layers(layers, u, density_back);
    let forward = t_f.map(|t_f| (t_f - record.shares[0]).max(0.0));
    let t_b = [0, 1, 2].map(|c: usize| BETWEEN_LAYERS_SHARE * (f[c] - t_f[c]).max(0.0));
    let gained = [0, 1, 2].map(|c: usize| forward[c] + t_b[c]);
    let global_factor = global_density(record.shares[0]);
    // One width for all channels: each counts by what it carries.
    // Of a black light, too.
    let brightest = rgb[0].max(rgb[1]).max(rgb[2]).max(1e-30);
    let carried = [0, 1, 2].map(|c| gained[c] * (rgb[c] / brightest) + 1e-12);
    let events = forward_events(record, p_q, u);
    let mean = (carried[0] * (beta_f_2[0] * events[0])
        + carried[1] * (beta_f_2[1] * events[1])
        + carried[2] * (beta_f_2[2] * events[2]))
        / (carried[0] + carried[1] + carried[2]);
    ForwardLight {
        gained,
        global: [0, 1, 2].map(|c: usize| global_factor * forward[c] + t_b[c]),
        sigma_f: (lambda * lambda + mean).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::hair_layers::{NO_LAYERS, layers_of};
    use super::super::transmittance::{P_1, P_2};
    use super::*;

    /// Fibres that send nothing back.
    const NO_BACK: (&HairLayers, [f32; 3]) = (&NO_LAYERS, [1.0; 3]);

    fn record(tau: f32) -> ShadowRecord {
        ShadowRecord {
            shares: [1.0, P_1, P_2].map(|p| (-p * tau).exp()),
            sin_theta: 0.3,
        }
    }

    #[test]
    fn one_depth_gives_the_expected_count_law() {
        let (a_f, tau, beta_2, lambda) = ([0.9, 0.7, 0.4], 3.0_f32, 0.05, 0.3_f32);
        let forward = forward_light(
            &record(tau),
            a_f,
            [beta_2; 3],
            ([1.0, 0.0, 0.0], lambda),
            NO_BACK,
        );
        for (gained, a_f) in forward.gained.into_iter().zip(a_f) {
            let exact = (-tau * (1.0 - a_f)).exp() - (-tau).exp();
            assert!((gained - exact).abs() < 1e-4, "{gained} {exact}");
        }
        // Red alone carries light.
        let s = a_f[0] * tau;
        let variance = beta_2 * s / (1.0 - (-s).exp());
        let exact = (lambda * lambda + variance).sqrt();
        assert!(
            (forward.sigma_f / exact - 1.0).abs() < 1e-3,
            "{forward:?} {exact}"
        );
    }

    #[test]
    fn an_open_light_gains_nothing_and_keeps_one_event() {
        let forward = forward_light(
            &record(0.0),
            [0.9; 3],
            [0.04; 3],
            ([1e30, 1e-30, 0.0], 0.1),
            NO_BACK,
        );
        assert_eq!(forward.gained, [0.0; 3]);
        assert_eq!(forward.global, [0.0; 3]);
        assert!((forward.sigma_f - 0.05_f32.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn light_that_goes_up_and_down_adds_its_share_without_the_global_factor() {
        let layers = layers_of([0.75; 3], [0.6; 3]);
        let q = 0.75 * layers.gain[0];
        let [t, t_f, u] = [1.0, 1.0 - 0.75, 1.0 - q].map(|p: f32| (-6.0 * p).exp());
        let added = [0.0, 0.5, 1.0].map(|density_back| {
            let behind = (&layers, [density_back; 3]);
            let light = ([1.0; 3], 0.2);
            let found = forward_light(&record(6.0), [0.75; 3], [0.1; 3], light, behind);
            let [f, ..] = between_layers(&layers, [u; 3], [density_back; 3]);
            let t_b = BETWEEN_LAYERS_SHARE * (f - t_f);
            let pairs = [
                (found.gained, t_f - t + t_b),
                (found.global, global_density(t) * (t_f - t) + t_b),
            ];
            for (found, expected) in pairs {
                let error = found.map(|found| (found - expected).abs());
                assert!(error.iter().all(|x| *x < 1e-4), "{found:?} {expected}");
            }
            t_b
        });
        // More hair behind adds more.
        assert!(
            added[0] > 0.01 && added.is_sorted_by(|a, b| 1.2 * a < *b),
            "{added:?}"
        );
    }

    #[test]
    fn black_and_white_fibres_stay_in_range() {
        for tau in [0.0, 0.5, 20.0, 2000.0] {
            for a_f in [0.0, 0.5, 0.999] {
                let layers = layers_of([a_f; 3], [0.9 * a_f; 3]);
                let behind = (&layers, [0.5; 3]);
                let light = ([1.0; 3], 0.2);
                let forward = forward_light(&record(tau), [a_f; 3], [0.1; 3], light, behind);
                assert!(forward.gained.iter().all(|x| (0.0..=1.0).contains(x)));
                let most = forward.gained.map(|gained| DENSITY_OPEN * gained);
                let pairs = forward.global.into_iter().zip(most);
                assert!(
                    pairs
                        .clone()
                        .all(|(global, most)| (0.0..=most).contains(&global))
                );
                assert!(
                    (0.2..20.0).contains(&forward.sigma_f),
                    "{tau} {a_f}: {forward:?}"
                );
            }
        }
    }
}
