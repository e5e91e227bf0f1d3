// #import lib/constants
// #import lib/special
// #import lib/circular_gaussian
// #import lib/paper/fresnel
// #import lib/fibre
// #import lib/frame
// #import lib/tables
// The inner integrals of Eq 12. Twin: crates/scattering/src/closed_form/paper/azimuthal.rs, which
// explains the formulas and the bounds.

const PAPER_LOBE_LAMBDA_MIN: f32 = 1e-3;
const PAPER_LOBE_LAMBDA_MAX: f32 = 3.5449077;
const PAPER_TRANSITION: f32 = 0.3;
const PAPER_ETA_GAP_MIN: f32 = 1e-4;
const PAPER_ETA_STAR_MIN: f32 = 1.05;
const PAPER_ETA_STAR_MAX: f32 = 10.0;

// 1 - F with the Fresnel term of the tables.
fn paper_transmittance(axes: TableAxes, eta: f32, cosine: f32) -> f32 {
    if axes.schlick != 0u {
        return paper_transmittance_schlick(eta, cosine);
    }
    return paper_transmittance_dielectric(eta, cosine);
}

// N_R (Eq 14) with Schlick's Fresnel term.
fn paper_azimuthal_r(
    kappa: f32,
    lag: Lag,
    at: Inclination,
    fibre: Fibre,
    axes: TableAxes,
    c: texture_2d<u32>,
) -> f32 {
    let shares = sample_c(c, axes, kappa, lag.cos_half);
    let r = (fibre.eta - 1.0) / (fibre.eta + 1.0);
    let f_0 = r * r;
    let f_1 = 1.0 - f_0;
    let g = 1.0 - at.cos_theta_d;
    let b = shares.first;
    let d = shares.second;
    let constant = b.x + 2.0 * b.y + 3.0 * b.z + 4.0 * b.w + 5.0 * d.x + 6.0 * d.y + 7.0 * d.z
        + 8.0 * d.w;
    let rising = b.x + 4.0 / 7.0 * b.y + 1.0 / 7.0 * b.z
        + g * (10.0 / 7.0 * (b.y + b.z) + 4.0 / 7.0 * b.w
        + g * (10.0 / 7.0 * (b.z + d.x) + 16.0 / 7.0 * b.w
        + g * (8.0 / 7.0 * b.w + 20.0 / 7.0 * (d.x + d.y)
        + g * (5.0 / 7.0 * d.x + 20.0 / 7.0 * d.y + 5.0 * d.z
        + g * (2.0 / 7.0 * d.y + 2.0 * d.z + 8.0 * d.w)))));
    return c_0(kappa) * (1.0 / 32.0) * (f_0 * constant + f_1 * rising);
}

// Energy of N_TT or N_TRT over exp(-s), by the fourth-order expansion (Eq 18, 19, 22, 23).
fn paper_lobe_energy(h: vec4f, s: vec3f, y: f32) -> vec3f {
    return 0.5 * (h.x + 0.5 * s * y * (h.y + 0.25 * (1.0 + s) * y * h.z));
}

// N_TT (Eq 16, 17) per channel.
fn paper_azimuthal_tt(
    kappa: f32,
    lag: Lag,
    at: Inclination,
    fibre: Fibre,
    row: Cell,
    axes: TableAxes,
    h_tt: texture_2d<f32>,
) -> vec3f {
    let eta = fibre.eta;
    let cos_2 = at.cos_theta_d * at.cos_theta_d;
    let sin_t = at.sin_theta_d / eta;
    let excess = (eta - 1.0) * (eta + 1.0);
    let eta_p = sqrt(1.0 + excess / cos_2);
    let y = 1.0 / (eta_p * eta_p);
    let gap = excess / (cos_2 * (eta_p + 1.0) * eta_p);
    let through = paper_transmittance(axes, eta, at.cos_theta_d);
    let height = through * through / (4.0 * gap);
    let h = sample_h(h_tt, axes, row, eta, at.cos_theta_d);
    let path = 2.0 / sqrt(1.0 - sin_t * sin_t);
    let s = fibre.sigma_a * path;
    let e = paper_lobe_energy(h, s, y);
    let lambda = clamp(
        e / (SQRT_PI * max(height, 1e-30)),
        vec3f(PAPER_LOBE_LAMBDA_MIN),
        vec3f(PAPER_LOBE_LAMBDA_MAX),
    );
    let amplitude = e * exp(-s) / (SQRT_PI * lambda);
    let kappa_t = 2.0 / (lambda * lambda);
    return amplitude * vec3f(
        product_integral(kappa, kappa_t.x, lag.cos_half),
        product_integral(kappa, kappa_t.y, lag.cos_half),
        product_integral(kappa, kappa_t.z, lag.cos_half),
    );
}

// Mean index of an elliptic fibre under the light (Eq 26).
fn paper_eta_star(kappa: f32, lag: Lag, fibre: Fibre) -> f32 {
    if fibre.eta_swing == 0.0 {
        return fibre.eta;
    }
    let ratio = bessel_i1e(kappa) / bessel_i0e(kappa);
    return clamp(
        fibre.eta_mean + fibre.eta_swing * lag.cos_sum * ratio,
        min(fibre.eta, PAPER_ETA_STAR_MIN),
        PAPER_ETA_STAR_MAX,
    );
}

// N_TRT (Eq 20 to 23, 25) per channel.
fn paper_azimuthal_trt(
    kappa: f32,
    lag: Lag,
    at: Inclination,
    fibre: Fibre,
    row: Cell,
    axes: TableAxes,
    h_trt: texture_2d<f32>,
) -> vec3f {
    let eta = paper_eta_star(kappa, lag, fibre);
    var eta_row = row;
    if fibre.eta_swing != 0.0 {
        eta_row = table_cell(axes.h_rows, eta);
    }
    let cos_2 = at.cos_theta_d * at.cos_theta_d;
    let sin_t = at.sin_theta_d / eta;
    let eta_p_2 = 1.0 + (eta - 1.0) * (eta + 1.0) / cos_2;
    let eta_p = sqrt(eta_p_2);
    let y = 1.0 / eta_p_2;
    let h = sample_h(h_trt, axes, eta_row, eta, at.cos_theta_d);
    let path = 4.0 / sqrt(1.0 - sin_t * sin_t);
    let through = paper_transmittance(axes, eta, at.cos_theta_d);
    let head_on = through * through * max(1.0 - through, 0.0);
    let w_c = fibre.caustic_width;
    let s = fibre.sigma_a * path;
    if eta_p >= 2.0 {
        let inverse = 4.0 * (eta_p - 2.0) / (SQRT_PI * eta_p * max(head_on, 1e-30));
        let t = clamp((eta_p - 2.0) / PAPER_TRANSITION, 0.0, 1.0);
        let blend = t * t * (3.0 - 2.0 * t);
        let e = paper_lobe_energy(h, s, y);
        let lambda_3 = clamp(e * inverse, vec3f(PAPER_LOBE_LAMBDA_MIN), vec3f(PAPER_LOBE_LAMBDA_MAX));
        let lambda = w_c + (lambda_3 - w_c) * blend;
        let amplitude = e * exp(-s) / (SQRT_PI * lambda);
        let kappa_t = 2.0 / (lambda * lambda);
        return amplitude * vec3f(
            product_integral(kappa, kappa_t.x, lag.sin_half),
            product_integral(kappa, kappa_t.y, lag.sin_half),
            product_integral(kappa, kappa_t.z, lag.sin_half),
        );
    }

    // The caustic.
    let sin_i_2 = clamp((4.0 - eta_p_2) / 3.0, 0.0, 1.0);
    let sin_i = sqrt(sin_i_2);
    let cos_i = sqrt(1.0 - sin_i_2);
    let sin_r = sin_i / eta_p;
    let cos_r = sqrt(1.0 - sin_r * sin_r);
    let sin_2r = 2.0 * sin_r * cos_r;
    let cos_2r = 1.0 - 2.0 * sin_r * sin_r;
    let sin_star = abs(sin_2r * cos_i - cos_2r * sin_i);
    let cos_star = cos_2r * cos_i + sin_2r * sin_i;
    let lambda_2 = clamp(2.0 * atan2(sin_star, cos_star), PAPER_LOBE_LAMBDA_MIN, PI);

    // N_TRT(0): the root h = 0 and the pair.
    let eta_gap = max(2.0 - eta_p, PAPER_ETA_GAP_MIN);
    let centre = eta_p / (4.0 * eta_gap) * head_on;
    let cos_pair = max(0.5 * eta_p_2 - 1.0, 0.0);
    let through_pair = paper_transmittance(axes, eta, at.cos_theta_d * cos_pair);
    let reflect_pair = max(1.0 - through_pair, 0.0);
    let pair = eta_p_2 * cos_pair / (2.0 * eta_gap * (2.0 + eta_p))
        * (through_pair * through_pair * reflect_pair);

    let exponent = 4.0 * sin_star * sin_star / (w_c * w_c);
    let outside = 1.0 - exp(-exponent);
    let kappa_c = 2.0 / (w_c * w_c);
    let sum = lag.sin_half * cos_star;
    let swing = lag.cos_half * sin_star;
    let pair_lobes = product_integral(kappa, kappa_c, sum - swing)
        + product_integral(kappa, kappa_c, sum + swing);
    let centre_lobe = product_integral(kappa, 2.0 / (lambda_2 * lambda_2), lag.sin_half);
    let e = paper_lobe_energy(h, s, y) * exp(-s);
    let at_zero = centre * exp(-s) + pair * exp(-0.5 * s * eta_p);
    let b_2 = min(at_zero * outside * outside, e / (SQRT_PI * lambda_2));
    let b_1 = max(e - b_2 * SQRT_PI * lambda_2, vec3f(0.0)) / (2.0 * SQRT_PI * w_c);
    return b_1 * pair_lobes + b_2 * centre_lobe;
}
