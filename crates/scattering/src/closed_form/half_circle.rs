//! N_t^G: N_t averaged over the light of one half circle of azimuths, `1/pi Int N_t(phi_o - phi_i)
//! dphi_i` over `|phi_i - phi_j| < pi/2` (Xu 2011 Eq 28). Twin: `shaders/lib/half_circle.wgsl`.
//!
//! R is a polynomial in Bernstein's basis, whose integrals over a half circle depend on the lag
//! alone. TT and TRT are sums of circular Gaussians, of each of which the share within the half
//! circle is asked. Both halves of the circle sum to the whole, so that lags up to pi/2 do.

use crate::table_layout::C_DEGREE;

use super::azimuthal_r::{Reflectance, reflected};
use super::frame::{Inclination, Lag};
use super::lobes::{LobeAngles, Lobes, angles_to};
use super::special::{bessel_i0e_fast, erf_pair};

use core::f32::consts::{FRAC_1_PI, PI};

/// Integrals of B_1..B_8 of |cos(phi/2)| over the half circle at lag up to pi/2, over 2 pi^2:
/// `[j][i - 1]`, factor of sin^2j(lag/2). Off by at most 1.1e-4 / (2 pi).
#[allow(clippy::excessive_precision, reason = "as fitted")]
const HALF_CIRCLE_BASIS: [[f32; C_DEGREE]; 6] = [
    [
        2.37680851e-05,
        0.000113737905,
        0.000784299427,
        0.00322054623,
        0.00948560333,
        0.0210465016,
        0.0387481807,
        0.0857360896,
    ],
    [
        0.00011461574,
        0.0128068718,
        0.0384927921,
        0.0738587125,
        0.0566103044,
        -0.0356910235,
        -0.096222466,
        -0.0506605918,
    ],
    [
        0.0594127551,
        0.0489091384,
        0.0815874598,
        -0.160312959,
        -0.235666472,
        0.133864532,
        0.183518863,
        -0.101321183,
    ],
    [
        -0.170419835,
        0.268792718,
        -0.427094774,
        0.00224187527,
        0.486848749,
        -0.243648562,
        -0.100287974,
        0.067547455,
    ],
    [
        0.878373022,
        -1.10789101,
        0.434528481,
        0.373840054,
        -0.497531678,
        0.211381833,
        -0.0301974047,
        0.0,
    ],
    [
        -1.18172966,
        0.924449329,
        -0.0516372956,
        -0.327356086,
        0.200442947,
        -0.0674858642,
        0.00964083776,
        0.0,
    ],
];

/// The same over the whole circle.
#[allow(clippy::excessive_precision, reason = "as fitted")]
const WHOLE_CIRCLE_BASIS: [f32; C_DEGREE] = [
    0.0232020947,
    0.0239788025,
    0.0251701564,
    0.0269740456,
    0.0297966869,
    0.0346269677,
    0.04478921,
    0.0870378595,
];

/// Share of a circular Gaussian of sharpness `kappa`, 0..=1e7, within the half circle whose middle
/// is apart from its centre by an angle of this `cosine`, 0..=1.
///
/// `1/2 (1 + erf(s c (1 + t_1 c^2 + t_2 c^4)))`, s such that the slope at `c = 0` is exact, t
/// fitted; error at most 1.3e-3 (at kappa = 4), 2.5e-4 root mean square.
pub fn half_circle(kappa: f32, cosine: f32) -> f32 {
    let above = 1.0 + kappa * (0.454_857_64 + kappa * (0.169_984 + kappa * 0.088_943_85));
    let below = PI
        + kappa
            * (1.416_983_8 + kappa * (1.130_757_6 + kappa * (0.380_746_27 + kappa * 0.177_887_7)));
    let slope = kappa * (above / below).sqrt();
    let square = kappa * kappa;
    let t_1 = square / (8.0 * square + 12.5801 * kappa + 7.897_07);
    let t_2 = square * square
        / (square * (8.413_51 * square - 18.460_45 * kappa + 44.119_74) + 46.940_235);
    let c_2 = cosine * cosine;
    0.5 + 0.5 * erf_pair(slope * cosine * (1.0 + c_2 * (t_1 + t_2 * c_2))).erf
}

/// Integrals of B_1..B_8 over the half circle at this lag, over 2 pi^2; the same for all nodes of
/// a light.
pub fn half_circle_basis(lag: &Lag) -> [f32; C_DEGREE] {
    let is_behind = lag.sin_half > lag.cos_half;
    let near = lag.sin_half.min(lag.cos_half);
    let w = near * near;
    let mut b = HALF_CIRCLE_BASIS[5];
    for row in HALF_CIRCLE_BASIS[..5].iter().rev() {
        for (b, factor) in b.iter_mut().zip(row) {
            *b = *b * w + factor;
        }
    }
    if is_behind {
        for (b, whole) in b.iter_mut().zip(&WHOLE_CIRCLE_BASIS) {
            *b = whole - *b;
        }
    }
    b
}

/// N_R^G of a dielectric, for the integrals `b` of [`half_circle_basis`]; >= 0.
pub fn half_circle_r(b: &[f32; C_DEGREE], at: &Inclination, reflectance: &Reflectance) -> f32 {
    reflected(b, at, reflectance)
}

/// Sum over the lobes of amplitude times share within the half circle, per channel; `sin_half` and
/// `cos_half` of half the azimuth from the lobes' common centre to the middle of the half circle.
pub(super) fn half_circle_lobes(sin_half: f32, cos_half: f32, lobes: &Lobes) -> [f32; 3] {
    let LobeAngles {
        kappa: [kappa_0, kappa_1, kappa_2],
        near: [near_1, near_2],
        far: [far_1, far_2],
    } = angles_to(lobes, sin_half, cos_half);
    let p_0 = bessel_i0e_fast(kappa_0) * half_circle(kappa_0, 1.0 - 2.0 * sin_half * sin_half);
    let p_1 = bessel_i0e_fast(kappa_1)
        * (half_circle(kappa_1, 1.0 - 2.0 * near_1 * near_1)
            + half_circle(kappa_1, 1.0 - 2.0 * far_1 * far_1));
    let p_2 = bessel_i0e_fast(kappa_2)
        * (half_circle(kappa_2, 1.0 - 2.0 * near_2 * near_2)
            + half_circle(kappa_2, 1.0 - 2.0 * far_2 * far_2));
    std::array::from_fn(|channel| {
        FRAC_1_PI
            * (lobes.amplitude[0][channel] * p_0
                + lobes.amplitude[1][channel] * p_1
                + lobes.amplitude[2][channel] * p_2)
    })
}

/// N_TT^G, per channel.
pub fn half_circle_tt(lag: &Lag, lobes: &Lobes) -> [f32; 3] {
    // Seen from phi = pi, see azimuthal_tt.
    half_circle_lobes(lag.cos_half, lag.sin_half, lobes)
}

/// N_TRT^G, blurred by w_c (the lobes hold it), per channel.
pub fn half_circle_trt(lag: &Lag, lobes: &Lobes) -> [f32; 3] {
    half_circle_lobes(lag.sin_half, lag.cos_half, lobes)
}
