// #import lib/fibre
// #import lib/frame
// #import lib/eccentric
// #import lib/tables
// #import lib/lobes
// #if PAINTED
// #import lib/painted_lobes
// #endif
// #import lib/azimuthal_r
// #import lib/azimuthal
// #import lib/outer_integral
// #import lib/fisher
// Eq 11: one spherical Gaussian light over the scattering function.
// Twin: crates/scattering/src/closed_form/single_scattering.rs.

// What the shading of one fibre reads besides its textures: c, and the lobes of TT and of TRT,
// tt and trt below. Textures of modes that are not enabled are never read.
struct Shading {
    fibre: Fibre,
    reflectance: Reflectance,
// #if PAINTED
    tt: PaintedDecode,
    trt: PaintedDecode,
    layers_tt: array<LobeLayer, 3>,
    layers_trt: array<LobeLayer, 3>,
// #else
    tt: LobeDecode,
    trt: LobeDecode,
// #endif
}

// The lobes of TT and of TRT that shading of a fibre, or of a painted point, samples.
fn lobes_tt_at(tt: texture_2d<u32>, shading: Shading, cos_theta_d: f32) -> Lobes {
// #if PAINTED
    return sample_painted_lobes(tt, shading.tt, shading.layers_tt, cos_theta_d);
// #else
    return sample_row(tt, shading.tt, cos_theta_d);
// #endif
}

fn lobes_trt_at(trt: texture_2d<u32>, shading: Shading, eta: f32, cos_theta_d: f32) -> Lobes {
// #if PAINTED
    return sample_painted_lobes(trt, shading.trt, shading.layers_trt, cos_theta_d);
// #else
    return sample_lobes(trt, shading.trt, eta, cos_theta_d);
// #endif
}

// TRT of an elliptic fibre for a light of sharpness kappa and amplitude 1, at the node u of the outer
// integral.
fn azimuthal_elliptic(
    kappa: f32,
    lag: EllipticLag,
    cos_theta_d: f32,
    u: f32,
    shading: Shading,
    trt: texture_2d<u32>,
) -> vec3f {
    let cos_lag = 1.0 - 2.0 * lag.sin_half * lag.sin_half;
    let sin_lag = 2.0 * lag.sin_half * lag.cos_half;
    let product = vec2f(AZIMUTH_BUMP + kappa * cos_lag, kappa * sin_lag);
    let kappa_3 = max(sqrt(product.x * product.x + product.y * product.y), 1e-6);
    let centre = half_angle(product.x, product.y, kappa_3);
    let cosine = (lag.cos_view * product.x - lag.sin_view * product.y)
        / (0.5 + sqrt(kappa_3 * kappa_3 + 2.25));
    let mean = lobes_trt_at(trt, shading, eta_at(cosine, shading.fibre), cos_theta_d);
    let light = half_angle(kappa + AZIMUTH_BUMP * cos_lag, -AZIMUTH_BUMP * sin_lag, kappa_3);
    let reach = min(AZIMUTH_REACH / sqrt(kappa_3), PI);
    let by = moved(u, sin_lag, shading.fibre);
    let stretched = min(AZIMUTH_STRETCHED * kappa_3, 1.0);
    let step_of_t = reach * (0.25 * AZIMUTH_STRETCH);
    var total = vec3f(0.0);
    for (var ix = 0u; ix < 8u; ix++) {
        let node = azimuth_node(ix, by, stretched);
        let delta = 0.5 * reach * node.x;
        let sin_delta = sin(delta);
        let cos_delta = cos(delta);
        let sin_half = centre.x * cos_delta + centre.y * sin_delta;
        let cos_half = centre.y * cos_delta - centre.x * sin_delta;
        let from_light = light.x * cos_delta + light.y * sin_delta;
        let eta = eta_at_azimuth(lag, sin_half, cos_half, shading.fibre);
        let lobes = lobes_trt_at(trt, shading, eta, cos_theta_d);
        let step = step_of_t * node.y;
        let value = lobes_at_azimuth(lobes, sin_half, cos_half, step);
        let of_mean = lobes_at_azimuth(mean, sin_half, cos_half, step);
        total += node.y * height(kappa, from_light) * (value - of_mean);
    }
    let closed = azimuthal_lobes(kappa, lag.sin_half, lag.cos_half, mean);
    return max(closed + step_of_t * (0.5 / PI) * total, vec3f(0.0));
}

// Sum over the enabled modes: the integral of the light of amplitude 1 against S cos(theta_i),
// linear RGB, >= 0, before transmittance.
fn single_scattering(
    light: LightInFrame,
    view: DirectionInFrame,
    shading: Shading,
    axes: TableAxes,
    c: texture_2d<u32>,
    tt: texture_2d<u32>,
    trt: texture_2d<u32>,
) -> vec3f {
    return shadowed_single_scattering(light, view, shading, vec3f(1.0), axes, c, tt, trt);
}

// single_scattering with a share of the light for each mode (R, TT, TRT).
fn shadowed_single_scattering(
    light: LightInFrame,
    view: DirectionInFrame,
    shading: Shading,
    shares: vec3f,
    axes: TableAxes,
    c: texture_2d<u32>,
    tt: texture_2d<u32>,
    trt: texture_2d<u32>,
) -> vec3f {
    let at = light.direction;
    let lag = lag_between(view.cos_phi, view.sin_phi, at.cos_phi, at.sin_phi);
    // Not a loop over the modes: Mesa's lavapipe (22.3) crashes on one around texture loads.
    var total = vec3f(0.0);
    let modes = shading.fibre.modes & MODES;
    if (modes & MODE_R) != 0u {
        total += shares.x * mode_at_lag(0u, light, view, lag, shading, axes, c, tt, trt);
    }
    if (modes & MODE_TT) != 0u {
        total += shares.y * mode_at_lag(1u, light, view, lag, shading, axes, c, tt, trt);
    }
    if (modes & MODE_TRT) != 0u {
        total += shares.z * mode_at_lag(2u, light, view, lag, shading, axes, c, tt, trt);
    }
    return total;
}

// M_t of Eq 11 for mode 0 (R), 1 (TT), 2 (TRT), enabled or not.
fn single_scattering_mode(
    mode: u32,
    light: LightInFrame,
    view: DirectionInFrame,
    shading: Shading,
    axes: TableAxes,
    c: texture_2d<u32>,
    tt: texture_2d<u32>,
    trt: texture_2d<u32>,
) -> vec3f {
    let at = light.direction;
    let lag = lag_between(view.cos_phi, view.sin_phi, at.cos_phi, at.sin_phi);
    return mode_at_lag(mode, light, view, lag, shading, axes, c, tt, trt);
}

// single_scattering_mode with the lag at hand.
fn mode_at_lag(
    mode: u32,
    light: LightInFrame,
    view: DirectionInFrame,
    lag: Lag,
    shading: Shading,
    axes: TableAxes,
    c: texture_2d<u32>,
    tt: texture_2d<u32>,
    trt: texture_2d<u32>,
) -> vec3f {
    if is_energy(shading.fibre) {
        return energy_mode_at_lag(mode, light, view, lag, shading, axes, c, tt, trt);
    }
    var total = vec3f(0.0);
    let at = light.direction;
    let alpha = shading.fibre.alpha[mode];
    let rule = outer_rule(at.theta, light.lambda, view.theta, alpha, shading.fibre.beta[mode]);
    if rule.ln_bound < LN_CULL {
        return total;
    }
    let kappa_j = 2.0 * at.cos_theta / (light.lambda * light.lambda);
    let extent = node_extent(rule);
    let count = node_count(extent, (shading.fibre.nodes >> (4u * mode)) & 15u);
    let elliptic = elliptic_lag(view, at, lag);
    for (var ix = 0u; ix < count; ix++) {
        let constants = node_constants(extent, count, ix);
        let node = outer_node(rule, constants);
        let cos_i = max(cos(node.theta_i), 0.0);
        let incline = inclination(0.5 * (view.theta - node.theta_i));
        let kappa = kappa_j * cos_i;
        // At most 2 for any two directions, but for rounding at the poles.
        let ratio = min(cos_i / incline.cos_theta_d, 2.0);
        let factor = node.weight * (ratio * ratio);
        if mode == 0u {
            total += factor * azimuthal_r(kappa, lag, incline, shading.reflectance, axes, c);
        } else if mode == 1u {
            let lobes = lobes_tt_at(tt, shading, incline.cos_theta_d);
            total += factor * azimuthal_tt(kappa, lag, lobes);
        } else if is_elliptic(shading.fibre) {
            total += factor
                * azimuthal_elliptic(kappa, elliptic, incline.cos_theta_d, constants.x, shading, trt);
        } else {
            let lobes = lobes_trt_at(trt, shading, shading.fibre.eta, incline.cos_theta_d);
            total += factor * azimuthal_trt(kappa, lag, lobes);
        }
    }
    return total;
}

// mode_at_lag of model energy: N_t is that at theta_o for all nodes.
fn energy_mode_at_lag(
    mode: u32,
    light: LightInFrame,
    view: DirectionInFrame,
    lag: Lag,
    shading: Shading,
    axes: TableAxes,
    c: texture_2d<u32>,
    tt: texture_2d<u32>,
    trt: texture_2d<u32>,
) -> vec3f {
    var total = vec3f(0.0);
    let at = light.direction;
    let beta = shading.fibre.beta[mode];
    let lobe = fisher_lobe(2.0 * shading.fibre.alpha[mode] - view.theta, 4.0 * beta * beta);
    let rule = fisher_rule(at.theta, light.lambda, lobe);
    if rule.ln_bound < LN_CULL {
        return total;
    }
    let kappa_j = 2.0 * at.cos_theta / (light.lambda * light.lambda);
    let incline = inclination(view.theta);
    let extent = node_extent(rule);
    let count = node_count(extent, (shading.fibre.nodes >> (4u * mode)) & 15u);
    var lobes: Lobes;
    var further = vec3f(0.0);
    if mode == 1u {
        lobes = lobes_tt_at(tt, shading, incline.cos_theta_d);
    } else if mode == 2u {
        further = further_orders(shading.fibre, incline.cos_theta_d);
        lobes = lobes_trt_at(trt, shading, shading.fibre.eta, incline.cos_theta_d);
    }
    for (var ix = 0u; ix < count; ix++) {
        let place = fisher_place(rule, node_constants(extent, count, ix));
        let from_light = sin(0.5 * (rule.to_light + place.step));
        let fall = rule.sharpness * (from_light * from_light);
        let cos_i = max(cos(place.theta_i), 0.0);
        let factor = place.weight * fisher_density(lobe, rule.to_lobe + place.step, cos_i, fall);
        let kappa = kappa_j * cos_i;
        if mode == 0u {
            total += factor * azimuthal_r(kappa, lag, incline, shading.reflectance, axes, c);
        } else if mode == 1u {
            total += factor * azimuthal_tt(kappa, lag, lobes);
        } else {
            let even = bessel_i0e_fast(kappa);
            total += factor * (azimuthal_trt(kappa, lag, lobes) + even * further);
        }
    }
    return total;
}
