//! Global multiple scattering as published (Xu 2011 Eq 27, 28): N_R a polynomial in cos(phi/2),
//! N_TT and N_TRT Gaussians, each integrated over the half circle of light.

use core::f32::consts::{FRAC_PI_2, PI};

use super::super::constants::SQRT_PI;
use super::super::fibre::Fibre;
use super::super::frame::{DirectionInFrame, Inclination, Lag, inclination, lag_between};
use super::super::special::erf_pair;
use super::super::tables::{Tables, table_cell};
use super::azimuthal::{eta_at, lobes_trt, lobes_tt};
use super::multiple::{forward_norm, outer_integral};

/// Sum of [`global_scattering_mode`] over the enabled modes.
pub fn global_scattering(
    light: &DirectionInFrame,
    view: &DirectionInFrame,
    sigma_f: f32,
    fibre: &Fibre,
    tables: &Tables,
) -> [f32; 3] {
    let mut total = [0.0f32; 3];
    for mode in (0..3).filter(|mode| fibre.modes & (1 << mode) != 0) {
        let value = global_scattering_mode(mode, light, view, sigma_f, fibre, tables);
        for channel in 0..3 {
            total[channel] += value[channel];
        }
    }
    total
}

/// M^G of `mode` 0 (R), 1 (TT), 2 (TRT): psi_f of width `sigma_f` around `light` over S_t
/// cos(theta_i), linear RGB, psi_f and M_t of unit mass.
pub fn global_scattering_mode(
    mode: u32,
    light: &DirectionInFrame,
    view: &DirectionInFrame,
    sigma_f: f32,
    fibre: &Fibre,
    tables: &Tables,
) -> [f32; 3] {
    let lag = lag_between(view.cos_phi, view.sin_phi, light.cos_phi, light.sin_phi);
    let row = table_cell(&tables.axes.h_rows, fibre.eta);
    // Mean of cos(phi_o + phi_i) over the half circle: 2/pi of that at its middle.
    let eta = eta_at(lag.cos_sum * (2.0 / PI), fibre);
    let shape = [fibre.alpha[mode as usize], fibre.beta[mode as usize]];
    let total = outer_integral(light, sigma_f, view, shape, fibre.segments, |theta_i| {
        let at = inclination(0.5 * (view.theta - theta_i));
        let ratio = theta_i.cos().max(0.0) / at.cos_theta_d;
        let value = match mode {
            0 => [global_r(&lag, &at, fibre); 3],
            1 => lobes_tt(&at, fibre, row, tables, |kappa| {
                half_integral(kappa, lag.cos_half)
            }),
            _ => lobes_trt(eta, &lag, &at, fibre, row, tables, half_integral),
        };
        value.map(|value| ratio * ratio / PI * value)
    });
    let norm = forward_norm(light, sigma_f);
    total.map(|value| norm * value)
}

/// Integral over the half circle around azimuth 0 of a Gaussian of sharpness `kappa` whose centre
/// is apart by delta, `sin_half` = sin(delta/2), either sign: erf, with the images a turn away.
fn half_integral(kappa: f32, sin_half: f32) -> f32 {
    let delta = 2.0 * sin_half.abs().min(1.0).asin();
    let lambda = (2.0 / kappa).sqrt();
    let share = |centre: f32| {
        erf_pair((FRAC_PI_2 - centre) / lambda).erf + erf_pair((FRAC_PI_2 + centre) / lambda).erf
    };
    let turn = 2.0 * PI;
    0.5 * SQRT_PI * lambda * (share(delta) + share(turn - delta) + share(turn + delta)).max(0.0)
}

/// Integral of N_R (Eq 13) over the half circle: the polynomial of Schlick's term in
/// c = |cos(phi/2)|, `1/4 [F_0 c + (1 - F_0) sum_k binom(5, k) (-cos theta_d)^k c^(k+1)]`.
fn global_r(lag: &Lag, at: &Inclination, fibre: &Fibre) -> f32 {
    let r = (fibre.eta - 1.0) / (fibre.eta + 1.0);
    let f_0 = r * r;
    let delta = 2.0 * lag.sin_half.atan2(lag.cos_half);
    let (low, high) = (powers(delta - FRAC_PI_2), powers(delta + FRAC_PI_2));
    let x = -at.cos_theta_d;
    let mut sum = 0.0;
    for (k, binomial) in [1.0, 5.0, 10.0, 10.0, 5.0, 1.0].into_iter().enumerate() {
        sum += binomial * x.powi(k as i32) * (high[k] - low[k]);
    }
    (0.25 * (f_0 * (high[0] - low[0]) + (1.0 - f_0) * sum)).max(0.0)
}

/// `Int_0^psi |cos(phi/2)|^k dphi` for k = 1..=6, psi in -2 pi..=2 pi.
fn powers(psi: f32) -> [f32; 6] {
    let sign = if psi < 0.0 { -1.0 } else { 1.0 };
    let folded = psi.abs();
    let whole = antiderivatives(PI);
    let here = antiderivatives(folded.min(2.0 * PI - folded));
    // The integrand is even around 0 and around pi.
    std::array::from_fn(|k| {
        let value = if folded > PI {
            2.0 * whole[k] - here[k]
        } else {
            here[k]
        };
        sign * value
    })
}

/// `Int_0^psi cos^k(phi/2) dphi` for k = 1..=6, psi in 0..=pi.
fn antiderivatives(psi: f32) -> [f32; 6] {
    let s = (0.5 * psi).sin();
    let s_2 = s * s;
    let [one, two, three] = [1.0, 2.0, 3.0f32].map(|n| (n * psi).sin());
    [
        2.0 * s,
        0.5 * psi + 0.5 * one,
        s * (2.0 - 2.0 / 3.0 * s_2),
        3.0 / 8.0 * psi + 0.5 * one + two / 16.0,
        s * (2.0 - s_2 * (4.0 / 3.0 - 2.0 / 5.0 * s_2)),
        5.0 / 16.0 * psi + 15.0 / 32.0 * one + 3.0 / 32.0 * two + three / 96.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_the_integrals() {
        for psi in [-1.5f32, -0.3, 0.0, 0.7, 3.0, 3.3, 4.7] {
            let found = powers(psi);
            let n = 20_000;
            for (k, found) in found.into_iter().enumerate() {
                let step = f64::from(psi) / f64::from(n);
                let exact: f64 = (0..n)
                    .map(|i| {
                        let phi = step * (f64::from(i) + 0.5);
                        (0.5 * phi).cos().abs().powi(k as i32 + 1) * step
                    })
                    .sum();
                assert!(
                    (f64::from(found) - exact).abs() < 2e-6,
                    "{psi} {k} {found} {exact}"
                );
            }
        }
    }

    #[test]
    fn halves_make_the_whole() {
        for lambda in [0.01f32, 0.3, 1.0, 2.0] {
            let kappa = 2.0 / (lambda * lambda);
            for delta in [0.0f32, 0.4, 1.57, 2.0, 3.1] {
                let (sin, cos) = (0.5 * delta).sin_cos();
                let whole = half_integral(kappa, sin) + half_integral(kappa, cos);
                let expected = SQRT_PI * lambda;
                assert!(
                    (whole / expected - 1.0).abs() < 1e-3,
                    "{lambda} {delta} {whole}"
                );
            }
        }
    }
}
