// #import lib/circular_gaussian
// #import lib/frame
// #import lib/lobes
// The inner integrals of Eq 12 for TT and TRT.
// Twin: crates/scattering/src/closed_form/azimuthal.rs.

// Sum over the lobes of amplitude times product with the light; sin_half and cos_half of half the
// azimuth from the lobes' common centre to the light.
fn azimuthal_lobes(kappa: f32, sin_half: f32, cos_half: f32, lobes: Lobes) -> vec3f {
    let angles = angles_to(lobes, sin_half, cos_half);
    let kappas = angles.kappa;
    let near = angles.near;
    let far = angles.far;
    let p_0 = lobe_integral(kappa, kappas.x, sin_half * sin_half);
    let p_1 = lobe_integral(kappa, kappas.y, near.x * near.x)
        + lobe_integral(kappa, kappas.y, far.x * far.x);
    let p_2 = lobe_integral(kappa, kappas.z, near.y * near.y)
        + lobe_integral(kappa, kappas.z, far.y * far.y);
    return lobes.amplitude[0] * p_0 + lobes.amplitude[1] * p_1 + lobes.amplitude[2] * p_2;
}

// TT for a light of sharpness kappa and amplitude 1.
fn azimuthal_tt(kappa: f32, lag: Lag, lobes: Lobes) -> vec3f {
    return azimuthal_lobes(kappa, lag.cos_half, lag.sin_half, lobes);
}

// TRT, blurred by w_c, likewise.
fn azimuthal_trt(kappa: f32, lag: Lag, lobes: Lobes) -> vec3f {
    return azimuthal_lobes(kappa, lag.sin_half, lag.cos_half, lobes);
}
