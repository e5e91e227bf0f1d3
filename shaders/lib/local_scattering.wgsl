// #import lib/constants
// #import lib/special
// #import lib/frame
// #if PAINTED
// #import lib/painted_averages
// #else
// #import lib/averages
// #endif
// #import lib/half_circle
// #import lib/mean_cosine
// #import lib/outer_integral
// #import lib/fisher
// Eq 29: light that comes back out of the hair behind a fibre.
// Twin: crates/scattering/src/closed_form/local_scattering.rs, which explains the formulas.

// Most nodes of the integral over theta_i.
const LOCAL_NODES: u32 = 3;
// Keeps the mean over the channels finite for hair that sends nothing back.
const SHARE_MIN: f32 = 1e-20;

// Nodes, and which of the models they are for.
struct LocalRule {
    rule: OuterRule,
    energy: f32,
}

// Nodes for light of width sigma_f at inclination theta_j: for the mean of the channels.
fn local_rule(
    theta_j: f32,
    sigma_f: f32,
    theta_o: f32,
    averages: texture_2d<f32>,
    row: AverageRow,
) -> LocalRule {
    let at = sample_averages(averages, row, 0.5 * (theta_j - theta_o));
    let shares = at.attenuation_b + SHARE_MIN;
    let scale = 0.5 / (shares.x + shares.y + shares.z);
    let shift = scale * dot(shares, at.shift_b);
    let width_2 = scale * dot(shares, at.width_b_2);
    if at.energy > 0.5 {
        let lobe = fisher_lobe(2.0 * shift - theta_o, 2.0 * width_2);
        return LocalRule(fisher_rule(theta_j, sigma_f, lobe), at.energy);
    }
    return LocalRule(outer_rule(theta_j, sigma_f, theta_o, shift, sqrt(0.5 * width_2)), at.energy);
}

// A node of the rule.
fn local_place(rule: LocalRule, constants: vec4f) -> NodePlace {
    if rule.energy > 0.5 {
        return fisher_place(rule.rule, constants);
    }
    return node_place(rule.rule, constants);
}

// A_b g^u(theta_i; Delta_b - theta_o, sigma_b) cos^2(theta_i) / cos^2(theta_d) at a node, of model
// energy A_b M cos(theta_i), times its weight and exp(-fall).
fn local_term(theta_o: f32, place: NodePlace, fall: f32, at: Averages) -> vec3f {
    let cos_i = max(cos(place.theta_i), 0.0);
    if at.energy > 0.5 {
        let red = fisher_lobe(at.shift_b.x - theta_o, at.width_b_2.x);
        let green = fisher_lobe(at.shift_b.y - theta_o, at.width_b_2.y);
        let blue = fisher_lobe(at.shift_b.z - theta_o, at.width_b_2.z);
        let density = vec3f(
            fisher_density(red, place.theta_i - red.mean, cos_i, fall),
            fisher_density(green, place.theta_i - green.mean, cos_i, fall),
            fisher_density(blue, place.theta_i - blue.mean, cos_i, fall),
        );
        return place.weight * at.attenuation_b * density;
    }
    let cos_d = max(cos(0.5 * (theta_o - place.theta_i)), 1e-6);
    let ratio = min(cos_i / cos_d, 2.0);
    let factor = place.weight * (ratio * ratio) * (1.0 / SQRT_PI);
    let apart = place.theta_i + theta_o - at.shift_b;
    let inverse = 1.0 / at.width_b_2;
    return factor * at.attenuation_b * sqrt(inverse) * exp(-apart * apart * inverse - fall);
}

// M^L: the integral of psi_f against S_back cos(theta_i), linear RGB, >= 0.
fn local_scattering(
    light: DirectionInFrame,
    view: DirectionInFrame,
    sigma_f: f32,
    averages: texture_2d<f32>,
    row: AverageRow,
) -> vec3f {
    let lag = lag_between(view.cos_phi, view.sin_phi, light.cos_phi, light.sin_phi);
    // How much both half circles overlap.
    let overlap = PI - 2.0 * atan2(lag.sin_half, lag.cos_half);
    let cosine = mean_cosine(light.theta, light.cos_theta, sigma_f);
    let scale = overlap * (1.0 / (PI * PI)) / (SQRT_PI * sigma_f * cosine);
    let rule = local_rule(light.theta, sigma_f, view.theta, averages, row);
    let extent = node_extent(rule.rule);
    let count = node_count(extent, LOCAL_NODES);
    var total = vec3f(0.0);
    for (var ix = 0u; ix < count; ix++) {
        let place = local_place(rule, node_constants(extent, count, ix));
        let from_light = (rule.rule.to_light + place.step) / sigma_f;
        let at = sample_averages(averages, row, 0.5 * (place.theta_i - view.theta));
        total += scale * local_term(view.theta, place, from_light * from_light, at);
    }
    return total;
}

// M^{L,dir}: S_back cos(theta_i) averaged over a light that reaches the fibre unscattered.
fn direct_local_scattering(
    light: LightInFrame,
    view: DirectionInFrame,
    averages: texture_2d<f32>,
    row: AverageRow,
) -> vec3f {
    let at_light = light.direction;
    let lag = lag_between(view.cos_phi, view.sin_phi, at_light.cos_phi, at_light.sin_phi);
    let cosine = 1.0 - 2.0 * lag.sin_half * lag.sin_half;
    let variance = light.lambda * light.lambda;
    let kappa_j = 2.0 * at_light.cos_theta / variance;
    // 2 / Omega of a light of this width: the 2 pi of C_0 and the 1/pi of S_back.
    let scale = 2.0 / (PI * variance * (1.0 - exp(-4.0 / variance)));
    let rule = local_rule(at_light.theta, light.lambda, view.theta, averages, row);
    let extent = node_extent(rule.rule);
    let count = node_count(extent, LOCAL_NODES);
    var total = vec3f(0.0);
    for (var ix = 0u; ix < count; ix++) {
        let place = local_place(rule, node_constants(extent, count, ix));
        let from_light = sin(0.5 * (rule.rule.to_light + place.step));
        let fall = rule.rule.sharpness * (from_light * from_light);
        let kappa = kappa_j * max(cos(place.theta_i), 0.0);
        let in_azimuth = scale * bessel_i0e_fast(kappa) * half_circle(kappa, cosine);
        let at = sample_averages(averages, row, 0.5 * (place.theta_i - view.theta));
        total += in_azimuth * local_term(view.theta, place, fall, at);
    }
    return total;
}
