// #import lib/constants
// #import lib/special
// #import lib/fibre
// #import lib/frame
// #import lib/longitudinal
// #import lib/tables
// #import lib/paper/azimuthal
// #import lib/paper/outer_integral
// Eq 11: one spherical Gaussian light over the scattering function.
// Twin: crates/scattering/src/closed_form/paper/single_scattering.rs.

// A lobe is skipped where the product of light and M_t is below exp(PAPER_LN_CULL) of its peak.
const PAPER_LN_CULL: f32 = -16.0;

// Sum over the enabled modes: the integral of the light of amplitude 1 against S cos(theta_i),
// linear RGB, >= 0, before transmittance.
fn paper_single_scattering(
    light: LightInFrame,
    view: DirectionInFrame,
    fibre: Fibre,
    axes: TableAxes,
    c: texture_2d<u32>,
    h_tt: texture_2d<f32>,
    h_trt: texture_2d<f32>,
) -> vec3f {
    // Not a loop over the modes: Mesa's lavapipe (22.3) crashes on one around texture loads.
    var total = vec3f(0.0);
    if (fibre.modes & MODE_R) != 0u {
        total += paper_single_scattering_mode(0u, light, view, fibre, axes, c, h_tt, h_trt);
    }
    if (fibre.modes & MODE_TT) != 0u {
        total += paper_single_scattering_mode(1u, light, view, fibre, axes, c, h_tt, h_trt);
    }
    if (fibre.modes & MODE_TRT) != 0u {
        total += paper_single_scattering_mode(2u, light, view, fibre, axes, c, h_tt, h_trt);
    }
    return total;
}

// M_t of Eq 11 for `mode` 0 (R), 1 (TT), 2 (TRT), enabled or not.
fn paper_single_scattering_mode(
    mode: u32,
    light: LightInFrame,
    view: DirectionInFrame,
    fibre: Fibre,
    axes: TableAxes,
    c: texture_2d<u32>,
    h_tt: texture_2d<f32>,
    h_trt: texture_2d<f32>,
) -> vec3f {
    var total = vec3f(0.0);
    let at = light.direction;
    let product = longitudinal(
        at.theta,
        light.lambda,
        view.theta,
        fibre.alpha[mode],
        fibre.beta[mode],
    );
    if product.ln_b < PAPER_LN_CULL {
        return total;
    }
    let lag = lag_between(view.cos_phi, view.sin_phi, at.cos_phi, at.sin_phi);
    let kappa_j = 2.0 * at.cos_theta / (light.lambda * light.lambda);
    let row = table_cell(axes.h_rows, fibre.eta);
    let low = (-HALF_PI - product.mean) / product.lambda;
    let high = (HALF_PI - product.mean) / product.lambda;
    var u_0 = low;
    var u = paper_node_position(low, high, fibre.segments, 1u);
    var e_0 = erf_pair(u_0);
    var e = erf_pair(u);
    for (var s = 1u; s < fibre.segments; s++) {
        let u_1 = paper_node_position(low, high, fibre.segments, s + 1u);
        let e_1 = erf_pair(u_1);
        let weight = paper_hat_weight(u_0, u, u_1, e_0, e, e_1);
        if weight > 0.0 {
            let theta_i = product.mean + product.lambda * u;
            let cos_i = max(cos(theta_i), 0.0);
            let incline = inclination(0.5 * (view.theta - theta_i));
            let kappa = max(kappa_j * cos_i, 1e-6);
            let ratio = cos_i / incline.cos_theta_d;
            let factor = weight * ratio * ratio;
            if mode == 0u {
                total += factor * paper_azimuthal_r(kappa, lag, incline, fibre, axes, c);
            } else if mode == 1u {
                total += factor * paper_azimuthal_tt(kappa, lag, incline, fibre, row, axes, h_tt);
            } else {
                total += factor * paper_azimuthal_trt(kappa, lag, incline, fibre, row, axes, h_trt);
            }
        }
        u_0 = u;
        u = u_1;
        e_0 = e;
        e = e_1;
    }
    return total * (product.lambda * product.peak * exp(product.ln_b));
}
