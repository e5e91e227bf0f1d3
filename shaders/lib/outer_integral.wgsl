// #import lib/constants
// The outer integral of Eq 11, over theta_i: nodes and weights.
// Twin: crates/scattering/src/closed_form/outer_integral.rs, which explains each step.

// A mode is skipped where light and M_t overlap less than exp(LN_CULL).
const LN_CULL: f32 = -16.0;
// Width k of the smooth clamp over the spread of the nodes, and 1 over it.
const CLAMP: f32 = 0.72;
const INVERSE_CLAMP: f32 = 1.3888888;
// Sharpness that the cosines lend the widest bumps.
const COSINE_SHARPNESS: f32 = 0.4;
// How far the rest of the integrand pulls the bump, over spread^2 theta_o.
const VIEW_PULL: f32 = 0.2;
// Extents up to which a third, and two thirds, of the nodes do.
const NARROW: f32 = 0.05;
const MIDDLE: f32 = 0.2;
// From those on the further node comes in smoothly, up to these extents.
const NARROW_END: f32 = 0.075;
const MIDDLE_END: f32 = 0.25;
// Most nodes of a mode.
const MAX_NODES: u32 = 8;
// (pi/2)^2.
const HALF_PI_SQUARED: f32 = 2.467401;

// Gauss-Hermite nodes for 1, 2, .. MAX_NODES nodes, those of n from index n (n - 1) / 2:
// position u, weight times exp(u^2), exp(-u/CLAMP), exp(u/CLAMP). Never written to; but of a
// constant naga copies the whole array at every use of a variable index.
var<private> GAUSS_HERMITE: array<vec4f, 36> = array<vec4f, 36>(
    vec4f(0.0, 1.7724539, 1.0, 1.0),
    vec4f(-0.70710677, 1.4611412, 2.6700382, 0.3745265),
    vec4f(0.70710677, 1.4611412, 0.3745265, 2.6700382),
    vec4f(-1.2247449, 1.3239312, 5.4796133, 0.18249463),
    vec4f(0.0, 1.1816359, 1.0, 1.0),
    vec4f(1.2247449, 1.3239312, 0.18249463, 5.4796133),
    vec4f(-1.6506801, 1.2402258, 9.900758, 0.10100237),
    vec4f(-0.5246476, 1.0599645, 2.0723376, 0.48254687),
    vec4f(0.5246476, 1.0599645, 0.48254687, 2.0723376),
    vec4f(1.6506801, 1.2402258, 0.10100237, 9.900758),
    vec4f(-2.0201828, 1.1814886, 16.54046, 0.060457807),
    vec4f(-0.95857245, 0.98658097, 3.7861538, 0.26412028),
    vec4f(0.0, 0.94530874, 1.0, 1.0),
    vec4f(0.95857245, 0.98658097, 0.26412028, 3.7861538),
    vec4f(2.0201828, 1.1814886, 0.060457807, 16.54046),
    vec4f(-2.350605, 1.1369083, 26.173021, 0.03820728),
    vec4f(-1.335849, 0.93558055, 6.39391, 0.15639883),
    vec4f(-0.43607742, 0.8764013, 1.8324668, 0.5457125),
    vec4f(0.43607742, 0.8764013, 0.5457125, 1.8324668),
    vec4f(1.335849, 0.93558055, 0.15639883, 6.39391),
    vec4f(2.350605, 1.1369083, 0.03820728, 26.173021),
    vec4f(-2.6519613, 1.1013308, 39.776634, 0.025140388),
    vec4f(-1.6735517, 0.8971846, 10.220313, 0.097844355),
    vec4f(-0.8162879, 0.8286873, 3.1072347, 0.32182956),
    vec4f(0.0, 0.81026465, 1.0, 1.0),
    vec4f(0.8162879, 0.8286873, 0.32182956, 3.1072347),
    vec4f(1.6735517, 0.8971846, 0.097844355, 10.220313),
    vec4f(2.6519613, 1.1013308, 0.025140388, 39.776634),
    vec4f(-2.9306374, 1.0719302, 58.576275, 0.017071757),
    vec4f(-1.9816568, 0.8667526, 15.678668, 0.063780926),
    vec4f(-1.1571937, 0.7928901, 4.98889, 0.20044538),
    vec4f(-0.381187, 0.7645441, 1.697958, 0.5889427),
    vec4f(0.381187, 0.7645441, 0.5889427, 1.697958),
    vec4f(1.1571937, 0.7928901, 0.20044538, 4.98889),
    vec4f(1.9816568, 0.8667526, 0.063780926, 15.678668),
    vec4f(2.9306374, 1.0719302, 0.017071757, 58.576275),
);

// Where the nodes of one light and mode lie.
struct OuterRule {
    mean: f32,
    to_light: f32,
    to_lobe: f32,
    spread: f32,
    low: f32,
    high: f32,
    inverse_width: f32,
    sharpness: f32,
    ln_bound: f32,
}

// One node: inclination of the incident light and weight of
// cos^2(theta_i) / cos^2(theta_d) times the inner integral.
struct OuterNode {
    theta_i: f32,
    weight: f32,
}

// Where a node lies: inclination, distance from the rule's mean, weight of the whole integrand.
struct NodePlace {
    theta_i: f32,
    step: f32,
    weight: f32,
}

// Nodes for a light of width lambda_j at inclination theta_j and
// M_t = g^u(theta_i; 2 alpha - theta_o, 2 beta), which has unit mass in theta_i.
fn outer_rule(theta_j: f32, lambda_j: f32, theta_o: f32, alpha: f32, beta: f32) -> OuterRule {
    let variance_j = lambda_j * lambda_j;
    let variance_m = 4.0 * beta * beta;
    let apart = theta_j - (2.0 * alpha - theta_o);
    let sum = variance_j + variance_m;
    let product = variance_j * variance_m;
    let spread_2 = product / (sum + COSINE_SHARPNESS * product);
    let spread = sqrt(spread_2);
    let pull = -VIEW_PULL * spread_2 * theta_o;
    let to_light = pull - apart * (variance_j / sum);
    let to_lobe = pull + apart * (variance_m / sum);
    let mean = theta_j + to_light;
    let inverse_k = INVERSE_CLAMP / spread;
    let variance_b = HALF_PI_SQUARED * variance_j;
    let sum_b = variance_b + variance_m;
    let mean_b = theta_j - apart * (variance_b / sum_b);
    let beyond = max(abs(mean_b) - HALF_PI, 0.0);
    return OuterRule(
        mean,
        to_light,
        to_lobe,
        spread,
        exp(min(-(mean + HALF_PI) * inverse_k, 80.0)),
        exp(min((mean - HALF_PI) * inverse_k, 80.0)),
        0.5 / beta,
        4.0 / variance_j,
        -(apart * apart + beyond * beyond * (sum_b * sum_b) / (variance_b * variance_m)) / sum_b,
    );
}

// How much the rest of the integrand varies over the bump: its spread, but up to 1 near the ends.
fn node_extent(rule: OuterRule) -> f32 {
    let mean = rule.mean / HALF_PI;
    let cosine = max(1.0 - mean * mean, 0.0);
    return rule.spread / min(cosine + rule.spread, 1.0);
}

// How many of at most `limit` nodes a bump of this extent is worth, 1 to MAX_NODES.
fn node_count(extent: f32, limit: u32) -> u32 {
    var thirds = 3u;
    if extent < NARROW {
        thirds = 1u;
    } else if extent < MIDDLE {
        thirds = 2u;
    }
    return clamp((limit * thirds + 2u) / 3u, 1u, MAX_NODES);
}

// Node `ix` of the `count` that node_count answers for this extent, as a row of GAUSS_HERMITE; the
// second and the third of at most three come in smoothly.
fn node_constants(extent: f32, count: u32, ix: u32) -> vec4f {
    let row = GAUSS_HERMITE[count * (count - 1u) / 2u + ix];
    if count == 2u && extent >= NARROW && extent < NARROW_END {
        let u = row[0] * ((extent - NARROW) / (NARROW_END - NARROW));
        let growth = exp(u * INVERSE_CLAMP);
        return vec4f(u, 0.5 * SQRT_PI * exp(u * u), 1.0 / growth, growth);
    }
    if count == 3u && extent >= MIDDLE && extent < MIDDLE_END {
        let share = 0.5 - (extent - MIDDLE) / (3.0 * (MIDDLE_END - MIDDLE));
        if ix == 1u {
            return vec4f(0.0, SQRT_PI * (1.0 - 2.0 * share), 1.0, 1.0);
        }
        let u = (f32(ix) - 1.0) * (0.5 / sqrt(share));
        let growth = exp(u * INVERSE_CLAMP);
        return vec4f(u, SQRT_PI * share * exp(u * u), 1.0 / growth, growth);
    }
    return row;
}

// The node `constants`, a row of GAUSS_HERMITE.
fn outer_node(rule: OuterRule, constants: vec4f) -> OuterNode {
    let below = 1.0 + rule.low * constants[2];
    let above = 1.0 + rule.high * constants[3];
    let step = rule.spread * (constants[0] + CLAMP * log(below / above));
    let lobe = (rule.to_lobe + step) * rule.inverse_width;
    let light = sin(0.5 * (rule.to_light + step));
    let scale = rule.spread * rule.inverse_width * (1.0 - rule.low * rule.high)
        / (SQRT_PI * (below * above));
    return OuterNode(
        clamp(rule.mean + step, -HALF_PI, HALF_PI),
        constants[1] * scale * exp(-lobe * lobe - rule.sharpness * (light * light)),
    );
}

// The place of the node `constants`, a row of GAUSS_HERMITE.
fn node_place(rule: OuterRule, constants: vec4f) -> NodePlace {
    let below = 1.0 + rule.low * constants[2];
    let above = 1.0 + rule.high * constants[3];
    let step = rule.spread * (constants[0] + CLAMP * log(below / above));
    let slope = (1.0 - rule.low * rule.high) / (below * above);
    return NodePlace(
        clamp(rule.mean + step, -HALF_PI, HALF_PI),
        step,
        constants[1] * rule.spread * slope,
    );
}
