//! The inner integrals of Eq 12 for TT and TRT: lobes against the light's circular Gaussian in
//! azimuth. Twin: `shaders/lib/azimuthal.wgsl`.

use super::circular_gaussian::lobe_integral;
use super::frame::Lag;
use super::lobes::{LobeAngles, Lobes, angles_to};

/// Sum over the lobes of amplitude times [`lobe_integral`], per channel; `sin_half` and
/// `cos_half` of half the azimuth from the lobes' common centre to the light.
pub(super) fn azimuthal_lobes(kappa: f32, sin_half: f32, cos_half: f32, lobes: &Lobes) -> [f32; 3] {
    let LobeAngles {
        kappa: [kappa_0, kappa_1, kappa_2],
        near: [near_1, near_2],
        far: [far_1, far_2],
    } = angles_to(lobes, sin_half, cos_half);
    let p_0 = lobe_integral(kappa, kappa_0, sin_half * sin_half);
    let p_1 = lobe_integral(kappa, kappa_1, near_1 * near_1)
        + lobe_integral(kappa, kappa_1, far_1 * far_1);
    let p_2 = lobe_integral(kappa, kappa_2, near_2 * near_2)
        + lobe_integral(kappa, kappa_2, far_2 * far_2);
    std::array::from_fn(|channel| {
        lobes.amplitude[0][channel] * p_0
            + lobes.amplitude[1][channel] * p_1
            + lobes.amplitude[2][channel] * p_2
    })
}

/// TT, per channel, for a light of sharpness `kappa` = 2 / lambda'^2 >= 0 and amplitude 1.
pub fn azimuthal_tt(kappa: f32, lag: &Lag, lobes: &Lobes) -> [f32; 3] {
    // Seen from phi = pi: sin((phi - pi)/2) = -cos(phi/2); lobes are even.
    azimuthal_lobes(kappa, lag.cos_half, lag.sin_half, lobes)
}

/// TRT, per channel, blurred by w_c (the lobes hold it), as [`azimuthal_tt`].
pub fn azimuthal_trt(kappa: f32, lag: &Lag, lobes: &Lobes) -> [f32; 3] {
    azimuthal_lobes(kappa, lag.sin_half, lag.cos_half, lobes)
}
