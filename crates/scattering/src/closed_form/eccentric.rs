//! TRT of an elliptic fibre (Xu 2011 Eq 24 to 26). Twin: `shaders/lib/eccentric.wgsl`.
//!
//! TRT of an elliptic fibre has at every phi_i another index, eta* = mean + swing
//! cos(phi_o + phi_i), so that its inner integral has no closed form. Here it is the closed form of
//! one index plus the difference at nodes in psi = phi_i - phi_o, each of which takes the lobes at
//! its own index and at the one, times the light. So a fibre next to a round one is as that, and
//! what no node sees is not lost. Light and N_TRT, a bump about psi = 0, are both small away from
//! their product: nodes lie about that of the light and a circular Gaussian, `psi = centre + reach
//! sinh(a t) / sinh(a)` for even t in -1..1, and the one index is the mean over it.
//!
//! Nodes of the outer integral share the error of so few: each has its nodes in psi moved by
//! another part of a step, in proportion to its own place, which costs nothing and leaves a third
//! of it. Moved so, nothing jumps where the number of outer nodes changes. The shift of TRT says
//! which way, so that hair that is turned round, root for tip, is the same.
//!
//! Lobes narrower than a step would count in full or not at all: nodes see them blurred by a part of
//! it ([`AZIMUTH_BLUR`]).
//!
//! Relative RMSE of TRT in Eq 11, a in 0.8..1.25, lambda in 0.1..1.2: 1.6 %, where one index for
//! each light has 7.0 %. Of inner integrals as three outer nodes weigh them 1.9 % (one index 7.7
//! to 10 % on different draws), where an index at every azimuth, which is what the lobes allow, has
//! 1.5 %. Of half circles of light 2.6 % (9.6 to 11 %).

use super::fibre::Fibre;
use super::frame::{DirectionInFrame, Lag};
use super::lobes::{LobeAngles, Lobes, angles_to};

/// Sharpness of the bump that stands for N_TRT where nodes in azimuth are placed. This and the
/// next three were found by search.
pub(crate) const AZIMUTH_BUMP: f32 = 5.25;

/// How far the nodes reach from their centre, over 1 / sqrt(kappa_3) of the product; at most pi.
pub(crate) const AZIMUTH_REACH: f32 = 3.62;

/// The same of a half circle of light, radians.
pub(crate) const HALF_CIRCLE_REACH: f32 = 1.65;

/// How much denser nodes in azimuth are in the middle: a of psi = reach sinh(a t) / sinh(a).
pub(crate) const AZIMUTH_STRETCH: f32 = 2.3;

/// kappa_3 times this, pi^2 / [`AZIMUTH_REACH`]^2, is how much of that they are, under 1: about a
/// product that has no centre they are even, wherever the formulas say that it lies.
pub(crate) const AZIMUTH_STRETCHED: f32 = 0.753_15;

/// Lobes that a node looks at are wider by this share of the square of the step to the next one: narrow
/// lobes would count in full or not at all.
pub(crate) const AZIMUTH_BLUR: f32 = 0.05;

/// By how much of a they are moved for an outer node at u = 1, and at most (half a step).
pub(crate) const AZIMUTH_SHEAR: f32 = 0.207;
/// See [`AZIMUTH_SHEAR`].
pub(crate) const AZIMUTH_SHEAR_MAX: f32 = 0.2875;

/// Sine of the lag from which on they are moved by all of that, under 1: none at the view and
/// opposite.
pub(crate) const AZIMUTH_SIDE: f32 = 4.0;

/// The same of the shift alpha of TRT, under 1: none where the hair has no sense from root to tip.
pub(crate) const AZIMUTH_TILT: f32 = 20.0;

/// Nodes in azimuth, t = -7/8, -5/8, .. 7/8: sinh(a t) / sinh(a), cosh(a t) / sinh(a).
pub(crate) const AZIMUTHS: [[f32; 2]; 8] = [
    [-0.744_217_34, 0.771_289_47],
    [-0.402_336_15, 0.450_446_9],
    [-0.197_183_06, 0.282_682_1],
    [-0.059_039_753, 0.210_982_71],
    [0.059_039_753, 0.210_982_71],
    [0.197_183_06, 0.282_682_1],
    [0.402_336_15, 0.450_446_9],
    [0.744_217_34, 0.771_289_47],
];

/// Smallest (or eta, if less) and largest index of an elliptic fibre: Eq 24 passes 1 for strong
/// eccentricities, and tables end at 10. Clamped, so continuous.
pub const ETA_STAR_MIN: f32 = 1.05;
/// See [`ETA_STAR_MIN`].
pub const ETA_STAR_MAX: f32 = 10.0;

/// Azimuths that an elliptic fibre tells apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipticLag {
    /// Sine of half of phi_j - phi_o, the azimuth from the view to the light, -1..=1.
    pub sin_half: f32,
    /// Cosine of half of it, 0..=1.
    pub cos_half: f32,
    /// cos(2 phi_o).
    pub cos_view: f32,
    /// sin(2 phi_o).
    pub sin_view: f32,
}

/// The azimuths of `view` and `light`, `lag` apart.
pub fn elliptic_lag(view: &DirectionInFrame, light: &DirectionInFrame, lag: &Lag) -> EllipticLag {
    let turn = view.cos_phi * light.sin_phi - view.sin_phi * light.cos_phi;
    EllipticLag {
        sin_half: if turn < 0.0 {
            -lag.sin_half
        } else {
            lag.sin_half
        },
        cos_half: lag.cos_half,
        cos_view: lag.cos_view,
        sin_view: 2.0 * view.sin_phi * view.cos_phi,
    }
}

/// The index of an elliptic fibre where cos(phi_o + phi_i) is this `cosine`.
pub(crate) fn eta_at(cosine: f32, fibre: &Fibre) -> f32 {
    (fibre.eta_mean + fibre.eta_swing * cosine).clamp(fibre.eta.min(ETA_STAR_MIN), ETA_STAR_MAX)
}

/// Sine and cosine of half the angle, within +-pi, of a vector of components `x`, `y` and this
/// `length` > 0; the cosine is not negative.
pub(super) fn half_angle(x: f32, y: f32, length: f32) -> [f32; 2] {
    let large = (0.5 + 0.5 * (x.abs() / length)).sqrt();
    let small = 0.5 * y / (length * large);
    if x >= 0.0 {
        [small, large]
    } else {
        [if y < 0.0 { -large } else { large }, small.abs()]
    }
}

/// cosh and sinh of how far the nodes in azimuth are moved for the node of the outer integral at `u`;
/// `sin_lag` = sin(phi_j - phi_o). Its sign keeps mirrored azimuths alike, that of the shift mirrored
/// inclinations.
pub(super) fn moved(u: f32, sin_lag: f32, fibre: &Fibre) -> [f32; 2] {
    let side = (AZIMUTH_SIDE * sin_lag).clamp(-1.0, 1.0);
    let tilt = (AZIMUTH_TILT * fibre.alpha[2]).clamp(-1.0, 1.0);
    let growth = (AZIMUTH_SHEAR * u * side * tilt)
        .clamp(-AZIMUTH_SHEAR_MAX, AZIMUTH_SHEAR_MAX)
        .exp();
    let cosh = 0.5 * (growth + 1.0 / growth);
    [cosh, growth - cosh]
}

/// Where node `ix` of [`AZIMUTHS`] lies, over the reach, and how far from the next one, over a quarter
/// of it and a; stretched by a share of what all of them are, or even.
pub(super) fn azimuth_node(ix: usize, [cosh, sinh]: [f32; 2], stretched: f32) -> [f32; 2] {
    let [at, dense] = AZIMUTHS[ix];
    let [even, even_dense] = [0.25 * ix as f32 - 0.875, 1.0 / AZIMUTH_STRETCH];
    [
        even + stretched * (at * cosh + dense * sinh - even),
        even_dense + stretched * (dense * cosh + at * sinh - even_dense),
    ]
}

/// Circular Gaussian of sharpness `kappa`, `sin_half` of half the azimuth from its centre.
pub(super) fn height(kappa: f32, sin_half: f32) -> f32 {
    (-2.0 * kappa * (sin_half * sin_half)).exp()
}

/// The index at psi, given by `sin_half` and `cos_half` of half of it.
pub(super) fn eta_at_azimuth(
    lag: &EllipticLag,
    sin_half: f32,
    cos_half: f32,
    fibre: &Fibre,
) -> f32 {
    let cos_psi = 1.0 - 2.0 * sin_half * sin_half;
    let sin_psi = 2.0 * sin_half * cos_half;
    eta_at(lag.cos_view * cos_psi - lag.sin_view * sin_psi, fibre)
}

/// Sum over the lobes of amplitude times height, per channel, as a node sees them that is a `step` from the
/// next one; `sin_half` and `cos_half` of half the azimuth from their common centre.
pub(crate) fn lobes_at_azimuth(lobes: &Lobes, sin_half: f32, cos_half: f32, step: f32) -> [f32; 3] {
    let LobeAngles {
        near: [near_1, near_2],
        far: [far_1, far_2],
        ..
    } = angles_to(lobes, sin_half, cos_half);
    let blur = AZIMUTH_BLUR * (step * step);
    let [kappa_0, kappa_1, kappa_2] = lobes.lambda.map(|lambda| 2.0 / (lambda * lambda + blur));
    // They keep their mass.
    let lower = |lambda: f32, kappa: f32| lambda * (0.5 * kappa).sqrt();
    let [lambda_0, lambda_1, lambda_2] = lobes.lambda;
    let p_0 = lower(lambda_0, kappa_0) * height(kappa_0, sin_half);
    let p_1 = lower(lambda_1, kappa_1) * (height(kappa_1, near_1) + height(kappa_1, far_1));
    let p_2 = lower(lambda_2, kappa_2) * (height(kappa_2, near_2) + height(kappa_2, far_2));
    std::array::from_fn(|channel| {
        lobes.amplitude[0][channel] * p_0
            + lobes.amplitude[1][channel] * p_1
            + lobes.amplitude[2][channel] * p_2
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form::{
        DirectionInFrame, GAUSS_HERMITE, SampleLobes, azimuthal_elliptic, half_circle_elliptic,
        lag_between,
    };
    use crate::{HairParams, Lobe};
    use std::f64::consts::PI;

    /// Lobes that turn with the index as those of TRT do.
    struct Turning;

    impl SampleLobes for Turning {
        fn lobes_at(&self, eta: f32, _: f32) -> Lobes {
            let mu = [1.1 - 0.5 * (eta - 1.0), 0.6].map(|mu: f32| 0.5 * mu.clamp(0.1, 1.5));
            Lobes {
                lambda: [0.9, 0.35, 0.5],
                cos_half: mu.map(f32::cos),
                sin_half: mu.map(f32::sin),
                amplitude: [[1.0, 0.3, 0.0], [2.0 - 0.5 * eta, 1.0, 0.5], [0.1 * eta; 3]],
            }
        }
    }

    fn fibre(eccentricity: f64) -> Fibre {
        let hair = HairParams {
            eccentricity,
            ..HairParams::default()
        };
        Fibre::new(&hair, &Lobe::ALL, 4).unwrap()
    }

    fn lag_of(phi_o: f64, phi_j: f64) -> EllipticLag {
        let [view, light] =
            [phi_o, phi_j].map(|phi| DirectionInFrame::from_angles(0.0, phi as f32));
        let lag = lag_between(view.cos_phi, view.sin_phi, light.cos_phi, light.sin_phi);
        elliptic_lag(&view, &light, &lag)
    }

    /// As the three nodes of the outer integral weigh it.
    fn of_three_nodes(value: impl Fn(f32) -> [f32; 3]) -> [f32; 3] {
        let mut total = [0.0f32; 3];
        for [u, weight, ..] in &GAUSS_HERMITE[3..6] {
            let share = weight * (-u * u).exp() / core::f32::consts::PI.sqrt();
            for (total, value) in total.iter_mut().zip(value(*u)) {
                *total += share * value;
            }
        }
        total
    }

    /// Relative RMSE of `found(lag)` against the integral of `light(phi_i - phi_j)` over N_TRT of
    /// [`Turning`].
    fn error(
        eccentricity: f64,
        light: impl Fn(f64) -> f64,
        found: impl Fn(&EllipticLag, &Fibre) -> [f32; 3],
    ) -> f64 {
        let fibre = fibre(eccentricity);
        let (mut error, mut norm) = (0.0, 0.0);
        for i in 0..120 {
            let phi_o = 2.4 * f64::from(i);
            let phi_j = phi_o - PI + PI / 60.0 * f64::from(i);
            let n = 4000;
            let mut exact = [0.0f64; 3];
            for k in 0..n {
                let phi_i = 2.0 * PI * f64::from(k) / f64::from(n);
                let eta = crate::exact::eta_star(1.55, eccentricity, 0.5 * (phi_o + phi_i));
                let half = 0.5 * (phi_i - phi_o);
                let lobes = Turning.lobes_at(eta as f32, 1.0);
                let value = lobes_at_azimuth(&lobes, half.sin() as f32, half.cos() as f32, 0.0);
                for (exact, value) in exact.iter_mut().zip(value) {
                    *exact += light(phi_i - phi_j) * f64::from(value) / f64::from(n);
                }
            }
            for (found, exact) in found(&lag_of(phi_o, phi_j), &fibre).iter().zip(exact) {
                error += (f64::from(*found) - exact).powi(2);
                norm += exact * exact;
            }
        }
        (error / norm).sqrt()
    }

    #[test]
    fn nodes_are_those_that_they_say() {
        let a = f64::from(AZIMUTH_STRETCH);
        for (k, node) in AZIMUTHS.iter().enumerate() {
            let t = (2.0 * k as f64 + 1.0) / 8.0 - 1.0;
            let expected = [(a * t).sinh() / a.sinh(), (a * t).cosh() / a.sinh()];
            for (found, expected) in node.iter().zip(expected) {
                assert!((f64::from(*found) - expected).abs() < 1e-7, "{k}");
            }
        }
        let stretched = (PI / f64::from(AZIMUTH_REACH)).powi(2);
        assert!((f64::from(AZIMUTH_STRETCHED) - stretched).abs() < 1e-4);
        // Half a step of t.
        assert!((f64::from(AZIMUTH_SHEAR_MAX) - a / 8.0).abs() < 1e-7);
    }

    #[test]
    fn sums_are_near_the_integrals() {
        for eccentricity in [0.8, 1.0, 1.25] {
            for (kappa, allowed) in [(0.5f32, 0.03), (2.0, 0.02), (20.0, 0.02), (2e3, 0.02)] {
                let light = |x: f64| (f64::from(kappa) * (x.cos() - 1.0)).exp();
                let found = |lag: &EllipticLag, fibre: &Fibre| {
                    of_three_nodes(|u| azimuthal_elliptic(kappa, lag, 1.0, u, fibre, &Turning))
                };
                let error = error(eccentricity, light, found);
                println!("{eccentricity} {kappa}: {error:.4}");
                assert!(error < allowed, "{eccentricity} {kappa} {error}");
            }
            let light = |x: f64| f64::from(u8::from(x.cos() > 0.0)) / PI;
            let found = |lag: &EllipticLag, fibre: &Fibre| {
                of_three_nodes(|u| half_circle_elliptic(lag, 1.0, u, fibre, &Turning))
            };
            let error = error(eccentricity, light, found);
            println!("{eccentricity} half circle: {error:.4}");
            assert!(error < 0.035, "{eccentricity} {error}");
        }
    }

    /// Neither where the light passes the view or what is opposite, nor where indices are clamped.
    #[test]
    fn nothing_jumps() {
        for eccentricity in [0.5, 0.8, 2.0] {
            let fibre = fibre(eccentricity);
            for kappa in [0.3f32, AZIMUTH_BUMP, 300.0] {
                let value = |phi_j: f64| {
                    let lag = lag_of(0.7, phi_j);
                    let one = azimuthal_elliptic(kappa, &lag, 1.0, 0.7, &fibre, &Turning)[0];
                    [
                        one,
                        half_circle_elliptic(&lag, 1.0, 0.7, &fibre, &Turning)[0],
                    ]
                };
                let peak = value(0.7);
                let mut before = value(-3.0);
                for step in 1..=7000 {
                    let here = value(-3.0 + 1e-3 * f64::from(step));
                    for i in 0..2 {
                        assert!(here[i] >= 0.0 && here[i].is_finite());
                        let jump = (here[i] - before[i]).abs() / peak[i];
                        let slope = 1e-3 * (3.0 + f64::from(kappa).sqrt());
                        assert!(
                            f64::from(jump) < slope,
                            "{eccentricity} {kappa} {step} {jump}"
                        );
                    }
                    before = here;
                }
            }
        }
    }

    #[test]
    fn mirrored_azimuths_are_alike() {
        let fibre = fibre(1.25);
        for (phi_o, phi_j) in [(0.3, 0.9), (-2.8, 1.4), (3.0, -0.2), (1.2, 1.3)] {
            for kappa in [0.3f32, 20.0] {
                let both = [1.0, -1.0].map(|side| {
                    let lag = lag_of(side * phi_o, side * phi_j);
                    let one = azimuthal_elliptic(kappa, &lag, 1.0, 0.7, &fibre, &Turning)[0];
                    [
                        one,
                        half_circle_elliptic(&lag, 1.0, 0.7, &fibre, &Turning)[0],
                    ]
                });
                for (one, other) in both[0].into_iter().zip(both[1]) {
                    assert!(
                        (one - other).abs() < 1e-5 * one,
                        "{phi_o} {phi_j} {one} {other}"
                    );
                }
            }
        }
    }

    /// Hair that is turned round, root for tip, has its outer nodes the other way round, too.
    #[test]
    fn mirrored_inclinations_are_alike() {
        let fibre = fibre(1.25);
        let mirrored = Fibre {
            alpha: fibre.alpha.map(|alpha| -alpha),
            ..fibre
        };
        let lag = lag_of(0.3, 0.9);
        for u in [-1.2, 0.3, 0.7] {
            let value = |u, fibre: &Fibre| {
                let one = azimuthal_elliptic(2.0, &lag, 1.0, u, fibre, &Turning);
                [one, half_circle_elliptic(&lag, 1.0, u, fibre, &Turning)]
            };
            assert_eq!(value(u, &fibre), value(-u, &mirrored));
            assert_ne!(value(u, &fibre), value(-u, &fibre), "nothing is moved");
        }
    }

    /// Opposite to the view the centre of light times bump is at either, by which of them is sharper.
    #[test]
    fn nothing_jumps_where_a_product_has_no_centre() {
        for eccentricity in [0.5, 1.25] {
            let fibre = fibre(eccentricity);
            let lag = lag_of(0.7, 0.7 + PI);
            let value = |kappa| azimuthal_elliptic(kappa, &lag, 1.0, 0.7, &fibre, &Turning)[0];
            let [below, above] = [-1e-4, 1e-4].map(|by| value(AZIMUTH_BUMP + by));
            assert!((below - above).abs() < 1e-3 * below, "{below} {above}");
        }
    }

    #[test]
    fn indices_are_clamped() {
        for (eccentricity, low, high) in [(0.5, 1.05, 4.85), (1.0, 1.55, 1.55), (0.8, 1.154, 2.169)]
        {
            let fibre = fibre(eccentricity);
            let indices = [-1.0, 1.0].map(|cosine| eta_at(cosine, &fibre));
            let [least, most] = [f32::min, f32::max].map(|of| of(indices[0], indices[1]));
            assert!(
                (least - low).abs() < 1e-3 && (most - high).abs() < 1e-3,
                "{indices:?}"
            );
        }
        assert!(fibre(0.9).is_elliptic() && !fibre(1.0).is_elliptic());
    }
}
