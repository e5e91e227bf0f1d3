// What the hair behind a point sends back: layers of fibres, as many as there are.
// Twin: crates/scattering/src/closed_form/hair_layers.rs, which explains the sum.

// Sine of the inclination whose averages stand for all hair behind a point, and that inclination.
const LAYERS_SINE: f32 = 0.4;
const LAYERS_THETA: f32 = 0.41151685;
// Least share of light that comes through the hair behind a point.
const LEAST_PASSING: f32 = 1e-5;
// Largest q^2, and largest R^2 q^2.
const MOST_ROUND_TRIP: f32 = 0.9999;
// Most that a stack without end reflects.
const MOST_REFLECTED: f32 = 0.999;

// Layers of one kind of fibre.
struct HairLayers {
    // k: optical depth of two layers, that into the hair and that out of it.
    two_layer_depth: vec3f,
    padding_0: u32,
    // R^2 q^2: share of the light that goes up and down once more.
    round_trip: vec3f,
    padding_1: u32,
    // q / a_f; q here is not bounded.
    gain: vec3f,
    padding_2: u32,
    // R.
    reflected: vec3f,
    padding_3: u32,
    // A_b.
    attenuation_b: vec3f,
    padding_4: u32,
}

// The layers of fibres of which one sends on a_f at an event, and a stack without end sends back A_b.
fn layers_of(a_f: vec3f, attenuation_b: vec3f) -> HairLayers {
    let a_f_2 = a_f * a_f;
    let one_minus_a_f_2 = max(1.0 - a_f_2, vec3f(0.0));
    let sum = attenuation_b * attenuation_b + a_f_2;
    let root = sqrt(sum * sum + 4.0 * attenuation_b * attenuation_b * one_minus_a_f_2);
    let a_b = 2.0 * attenuation_b * one_minus_a_f_2 / max(sum + root, vec3f(1e-20));
    let reflected = attenuation_b + a_b;
    let gain = 1.0 / max(1.0 - a_b * reflected, vec3f(1e-6));
    let q = a_f * gain;
    let q_2 = clamp(q * q, vec3f(1e-20), vec3f(MOST_ROUND_TRIP));
    return HairLayers(
        -log(q_2), 0u,
        min(reflected * reflected * q_2, vec3f(MOST_ROUND_TRIP)), 0u,
        gain, 0u,
        min(reflected, vec3f(MOST_REFLECTED)), 0u,
        attenuation_b, 0u,
    );
}

// Shares of light that come through the hair along x, y and z: from above, that is from +x, +y, +z, and from below.
struct AxisShares {
    above: vec3f,
    below: vec3f,
}

// f_local of the hair along x, y and z, by column.
struct AxisDensities {
    above: mat3x3f,
    below: mat3x3f,
}

// f_local of hair that such a share of the light comes through.
fn density_behind(layers: HairLayers, share: f32) -> vec3f {
    let share_both_ways = exp(layers.two_layer_depth * log(max(share, LEAST_PASSING)));
    return (1.0 - share_both_ways) / (1.0 - layers.round_trip * share_both_ways);
}

// f_local of hair along the axes.
fn axis_densities(layers: HairLayers, axis_shares: AxisShares) -> AxisDensities {
    let above = axis_shares.above;
    let below = axis_shares.below;
    return AxisDensities(
        mat3x3f(density_behind(layers, above.x), density_behind(layers, above.y), density_behind(layers, above.z)),
        mat3x3f(density_behind(layers, below.x), density_behind(layers, below.y), density_behind(layers, below.z)),
    );
}

// Factor f_local on local scattering of light from the unit vector `towards`.
fn local_density(densities: AxisDensities, towards: vec3f) -> vec3f {
    let is_up = towards > vec3f(0.0);
    let squares = towards * towards;
    return squares.x * select(densities.above[0], densities.below[0], is_up.x)
        + squares.y * select(densities.above[1], densities.below[1], is_up.y)
        + squares.z * select(densities.above[2], densities.below[2], is_up.z);
}

// F of a light of which factors of q leave the share u. The hair behind sends back density_back (d_b f_local) of what a stack
// without end would.
fn between_layers(layers: HairLayers, u: vec3f, density_back: vec3f) -> vec3f {
    let r = layers.reflected;
    // R - R_2.
    let missing = (1.0 - density_back) * layers.attenuation_b;
    let one_minus_r_2 = 1.0 - r * r;
    return min(u * one_minus_r_2 / (one_minus_r_2 + r * missing * (1.0 - u * u)), vec3f(1.0));
}
