// #import lib/constants
// #import lib/special
// #import lib/fibre
// #import lib/outer_integral
// M_t of model energy, a von Mises-Fisher lobe, and the orders beyond TRT.
// Twin: crates/scattering/src/closed_form/fisher.rs, which explains each step.

// Width k of the smooth clamp over the spread of the nodes, two thirds of CLAMP, and 1 over it.
const FISHER_CLAMP: f32 = 0.48;
const INVERSE_FISHER_CLAMP: f32 = 2.0833333;
// 1 over the largest squared spread of the nodes.
const FISHER_SPREAD: f32 = 0.4;
// Least 1/v.
const FISHER_LEAST: f32 = 1e-3;

// A lobe seen from one direction: its inclination mu, 1/v, cos(mu) / v, 1 / (v (1 - exp(-2/v))).
struct FisherLobe {
    mean: f32,
    inverse: f32,
    across: f32,
    norm: f32,
}

// The lobe around inclination `mean` of squared width width_2 (Xu's, of the full angle).
fn fisher_lobe(mean: f32, width_2: f32) -> FisherLobe {
    let inverse = max(2.0 / width_2, FISHER_LEAST);
    var inside = mean - 2.0 * PI * floor(mean * (0.5 / PI) + 0.5);
    if inside > HALF_PI {
        inside = PI - inside;
    } else if inside < -HALF_PI {
        inside = -PI - inside;
    }
    return FisherLobe(
        inside,
        inverse,
        max(cos(inside), 0.0) * inverse,
        inverse / (1.0 - exp(-2.0 * inverse)),
    );
}

// Nodes for a light of width lambda_j at inclination theta_j and this lobe.
fn fisher_rule(theta_j: f32, lambda_j: f32, lobe: FisherLobe) -> OuterRule {
    let variance_j = lambda_j * lambda_j;
    let variance_m = 2.0 / lobe.inverse;
    let apart = theta_j - lobe.mean;
    let sum = variance_j + variance_m;
    let product = variance_j * variance_m;
    let bump = FISHER_SPREAD * product;
    let spread = sqrt(product / sqrt(sum * sum + bump * bump));
    let to_light = -apart * (variance_j / sum);
    let to_lobe = apart * (variance_m / sum);
    let mean = theta_j + to_light;
    let inverse_k = INVERSE_FISHER_CLAMP / spread;
    return OuterRule(
        mean,
        to_light,
        to_lobe,
        spread,
        exp(min(-(mean + HALF_PI) * inverse_k, 80.0)),
        exp(min((mean - HALF_PI) * inverse_k, 80.0)),
        lobe.inverse,
        4.0 / variance_j,
        -apart * apart / (HALF_PI_SQUARED * sum),
    );
}

// node_place of these rules.
fn fisher_place(rule: OuterRule, constants: vec4f) -> NodePlace {
    let below = 1.0 + rule.low * (constants[2] * sqrt(constants[2]));
    let above = 1.0 + rule.high * (constants[3] * sqrt(constants[3]));
    let step = rule.spread * (constants[0] + FISHER_CLAMP * log(below / above));
    let slope = (1.0 - rule.low * rule.high) / (below * above);
    return NodePlace(
        clamp(rule.mean + step, -HALF_PI, HALF_PI),
        step,
        constants[1] * rule.spread * slope,
    );
}

// M cos(theta_i) exp(-fall) at apart = theta_i - mu, cos_i its cosine.
fn fisher_density(lobe: FisherLobe, apart: f32, cos_i: f32, fall: f32) -> f32 {
    let half = sin(0.5 * apart);
    let bessel = bessel_i0e_fast(cos_i * lobe.across);
    return lobe.norm * cos_i * bessel * exp(-2.0 * lobe.inverse * (half * half) - fall);
}

// Mass of the orders beyond TRT at cos_theta, linear RGB.
fn further_orders(fibre: Fibre, cos_theta: f32) -> vec3f {
    let y = further_place(fibre.further_scale, cos_theta);
    let x = 2.0 * y - 1.0;
    var further = fibre.further;
    var b_1 = vec3f(0.0);
    var b_2 = vec3f(0.0);
    for (var j = N_FURTHER - 1u; j > 0u; j--) {
        let b = 2.0 * x * b_1 - b_2 + further[j].xyz;
        b_2 = b_1;
        b_1 = b;
    }
    let sum = x * b_1 - b_2 + further[0].xyz;
    return (1.0 - y) * max(sum, vec3f(0.0));
}

// Where cos_theta stands: 0 at 1, 1 at 0, half way at about `scale`.
fn further_place(scale: f32, cos_theta: f32) -> f32 {
    return scale * (1.0 - cos_theta) / (scale + cos_theta);
}

// Int exp(-((theta_i - theta_j) / sigma_f)^2) M_t cos(theta_i) dtheta_i for mode 0 (R), 1 (TT), 2 (TRT).
fn forward_share(mode: u32, theta_j: f32, theta_o: f32, sigma_f: f32, fibre: Fibre) -> f32 {
    let beta = fibre.beta[mode];
    let lobe = fisher_lobe(2.0 * fibre.alpha[mode] - theta_o, 4.0 * beta * beta);
    let rule = fisher_rule(theta_j, sigma_f, lobe);
    var share = 0.0;
    if rule.ln_bound < LN_CULL {
        return share;
    }
    let extent = node_extent(rule);
    let count = node_count(extent, (fibre.nodes >> (4u * mode)) & 15u);
    for (var ix = 0u; ix < count; ix++) {
        let place = fisher_place(rule, node_constants(extent, count, ix));
        let from_light = (rule.to_light + place.step) / sigma_f;
        let cos_i = max(cos(place.theta_i), 0.0);
        let fall = from_light * from_light;
        share += place.weight * fisher_density(lobe, rule.to_lobe + place.step, cos_i, fall);
    }
    return share;
}
