// #import lib/single_scattering
// #import lib/half_circle
// #import lib/mean_cosine
// Eq 27: light that fibres in front scattered on, over the scattering function.
// Twin: crates/scattering/src/closed_form/global_scattering.rs, which explains the formulas.

// N_TRT^G of an elliptic fibre, at the node u of the outer integral.
fn half_circle_elliptic(
    lag: EllipticLag,
    cos_theta_d: f32,
    u: f32,
    shading: Shading,
    trt: texture_2d<u32>,
) -> vec3f {
    let cos_lag = 1.0 - 2.0 * lag.sin_half * lag.sin_half;
    let sin_lag = 2.0 * lag.sin_half * lag.cos_half;
    let by = moved(u, sin_lag, shading.fibre);
    let mean = lobes_trt_at(trt, shading, eta_at(lag.cos_view, shading.fibre), cos_theta_d);
    var total = vec3f(0.0);
    for (var ix = 0u; ix < 8u; ix++) {
        let node = azimuth_node(ix, by, 1.0);
        let delta = 0.5 * HALF_CIRCLE_REACH * node.x;
        let sin_delta = sin(delta);
        let cos_delta = cos(delta);
        let step = (0.25 * HALF_CIRCLE_REACH * AZIMUTH_STRETCH) * node.y;
        let from_light = (cos_delta * cos_delta - sin_delta * sin_delta) * cos_lag
            + 2.0 * sin_delta * cos_delta * sin_lag;
        let weight = step * clamp(0.5 + from_light / step, 0.0, 1.0);
        let eta = eta_at_azimuth(lag, sin_delta, cos_delta, shading.fibre);
        let lobes = lobes_trt_at(trt, shading, eta, cos_theta_d);
        let value = lobes_at_azimuth(lobes, sin_delta, cos_delta, step);
        total += weight * (value - lobes_at_azimuth(mean, sin_delta, cos_delta, step));
    }
    let closed = half_circle_lobes(lag.sin_half, lag.cos_half, mean);
    return max(closed + (0.5 / (PI * PI)) * total, vec3f(0.0));
}

// Sum over the enabled modes: the integral of psi_f against S cos(theta_i), linear RGB, >= 0.
fn global_scattering(
    light: DirectionInFrame,
    view: DirectionInFrame,
    sigma_f: f32,
    shading: Shading,
    tt: texture_2d<u32>,
    trt: texture_2d<u32>,
) -> vec3f {
    let lag = lag_between(view.cos_phi, view.sin_phi, light.cos_phi, light.sin_phi);
    let scale = 1.0 / (SQRT_PI * sigma_f * mean_cosine(light.theta, light.cos_theta, sigma_f));
    // Not a loop over the modes: Mesa's lavapipe (22.3) crashes on one around texture loads.
    var total = vec3f(0.0);
    let modes = shading.fibre.modes & MODES;
    if (modes & MODE_R) != 0u {
        total += global_mode_at_lag(0u, light, view, lag, sigma_f, scale, shading, tt, trt);
    }
    if (modes & MODE_TT) != 0u {
        total += global_mode_at_lag(1u, light, view, lag, sigma_f, scale, shading, tt, trt);
    }
    if (modes & MODE_TRT) != 0u {
        total += global_mode_at_lag(2u, light, view, lag, sigma_f, scale, shading, tt, trt);
    }
    return total;
}

// M_t^G for mode 0 (R), 1 (TT), 2 (TRT), enabled or not.
fn global_scattering_mode(
    mode: u32,
    light: DirectionInFrame,
    view: DirectionInFrame,
    sigma_f: f32,
    shading: Shading,
    tt: texture_2d<u32>,
    trt: texture_2d<u32>,
) -> vec3f {
    let lag = lag_between(view.cos_phi, view.sin_phi, light.cos_phi, light.sin_phi);
    let scale = 1.0 / (SQRT_PI * sigma_f * mean_cosine(light.theta, light.cos_theta, sigma_f));
    return global_mode_at_lag(mode, light, view, lag, sigma_f, scale, shading, tt, trt);
}

// global_scattering_mode with the lag and 1 / (sqrt(pi) sigma_f Z_j) at hand.
fn global_mode_at_lag(
    mode: u32,
    light: DirectionInFrame,
    view: DirectionInFrame,
    lag: Lag,
    sigma_f: f32,
    scale: f32,
    shading: Shading,
    tt: texture_2d<u32>,
    trt: texture_2d<u32>,
) -> vec3f {
    if is_energy(shading.fibre) {
        return global_energy_at_lag(mode, light, view, lag, sigma_f, scale, shading, tt, trt);
    }
    var total = vec3f(0.0);
    let alpha = shading.fibre.alpha[mode];
    let rule = outer_rule(light.theta, sigma_f, view.theta, alpha, shading.fibre.beta[mode]);
    if rule.ln_bound < LN_CULL {
        return total;
    }
    let basis = half_circle_basis(lag);
    let elliptic = elliptic_lag(view, light, lag);
    let extent = node_extent(rule);
    let count = node_count(extent, (shading.fibre.nodes >> (4u * mode)) & 15u);
    for (var ix = 0u; ix < count; ix++) {
        let constants = node_constants(extent, count, ix);
        let place = node_place(rule, constants);
        let lobe = (rule.to_lobe + place.step) * rule.inverse_width;
        let from_light = (rule.to_light + place.step) / sigma_f;
        let weight = place.weight * rule.inverse_width * (1.0 / SQRT_PI)
            * exp(-lobe * lobe - from_light * from_light);
        let cos_i = max(cos(place.theta_i), 0.0);
        let incline = inclination(0.5 * (view.theta - place.theta_i));
        // At most 2 for any two directions, but for rounding at the poles.
        let ratio = min(cos_i / incline.cos_theta_d, 2.0);
        let factor = scale * weight * (ratio * ratio);
        if mode == 0u {
            total += factor * half_circle_r(basis, incline, shading.reflectance);
        } else if mode == 1u {
            let lobes = lobes_tt_at(tt, shading, incline.cos_theta_d);
            total += factor * half_circle_tt(lag, lobes);
        } else if is_elliptic(shading.fibre) {
            total += factor
                * half_circle_elliptic(elliptic, incline.cos_theta_d, constants.x, shading, trt);
        } else {
            let lobes = lobes_trt_at(trt, shading, shading.fibre.eta, incline.cos_theta_d);
            total += factor * half_circle_trt(lag, lobes);
        }
    }
    return total;
}

// global_mode_at_lag of model energy: N_t^G at theta_o times the share of M_t.
fn global_energy_at_lag(
    mode: u32,
    light: DirectionInFrame,
    view: DirectionInFrame,
    lag: Lag,
    sigma_f: f32,
    scale: f32,
    shading: Shading,
    tt: texture_2d<u32>,
    trt: texture_2d<u32>,
) -> vec3f {
    let share = forward_share(mode, light.theta, view.theta, sigma_f, shading.fibre);
    var value = vec3f(0.0);
    if share <= 0.0 {
        return value;
    }
    let incline = inclination(view.theta);
    if mode == 0u {
        value += half_circle_r(half_circle_basis(lag), incline, shading.reflectance);
    } else if mode == 1u {
        value = half_circle_tt(lag, lobes_tt_at(tt, shading, incline.cos_theta_d));
    } else {
        let further = further_orders(shading.fibre, incline.cos_theta_d);
        let lobes = lobes_trt_at(trt, shading, shading.fibre.eta, incline.cos_theta_d);
        value = half_circle_trt(lag, lobes) + (0.5 / PI) * further;
    }
    return scale * share * value;
}
