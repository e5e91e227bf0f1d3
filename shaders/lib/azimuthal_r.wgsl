// #import lib/special
// #import lib/frame
// #import lib/tables
// The inner integral of Eq 12 for R with the Fresnel term of a dielectric. Twin:
// crates/scattering/src/closed_form/azimuthal_r.rs, which explains the formula.

// R's coefficients for one index of refraction: factors of y^j in the shares of b_1..b_4 and
// b_5..b_8, j = 0..=6.
struct Reflectance {
    coefficients: array<vec4f, 14>,
    scale: f32,
    padding_0: f32,
    padding_1: f32,
    padding_2: f32,
}

// N_R against the light, >= 0.
fn azimuthal_r(
    kappa: f32,
    lag: Lag,
    at: Inclination,
    reflectance: Reflectance,
    axes: TableAxes,
    c: texture_2d<u32>,
) -> f32 {
    let b = sample_c(c, axes, kappa, lag.cos_half);
    return bessel_i0e_fast(kappa) * reflected(b, at, reflectance);
}

// v^2 times the sum over i of P_i(y) b_i, not below 0.
fn reflected(b: CShares, at: Inclination, reflectance: Reflectance) -> f32 {
    let x = at.cos_theta_d;
    let v = reflectance.scale / (reflectance.scale + x);
    let y = v * (1.0 - x);
    let f = reflectance.coefficients;
    let first = (((((f[12] * y + f[10]) * y + f[8]) * y + f[6]) * y + f[4]) * y + f[2]) * y + f[0];
    let second = (((((f[13] * y + f[11]) * y + f[9]) * y + f[7]) * y + f[5]) * y + f[3]) * y + f[1];
    let lanes = first * b.first + second * b.second;
    let sum = (lanes.x + lanes.z) + (lanes.y + lanes.w);
    return (v * v) * max(sum, 0.0);
}
