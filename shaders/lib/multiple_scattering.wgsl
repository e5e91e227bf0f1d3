// #import lib/transmittance
// #import lib/hair_layers
// What the hair between a light and a point makes of the light: what multiple scattering starts
// from. Twin: crates/scattering/src/closed_form/multiple_scattering.rs, which explains the sum.

// Terms of the sum, as bits.
const TERM_SINGLE: u32 = 1u;
const TERM_LOCAL: u32 = 2u;
const TERM_GLOBAL: u32 = 4u;

// global_density where all light is blocked, and where none is.
const DENSITY_BLOCKED: f32 = 0.7;
const DENSITY_OPEN: f32 = 1.65;

// Light that reaches a point after forward scattering.
struct ForwardLight {
    // T_f - T_vol + T_b.
    gained: vec3f,
    // f_global (T_f - T_vol) + T_b.
    global: vec3f,
    // Its width in inclination.
    sigma_f: f32,
}

// Factor on global scattering where this share of a light comes unblocked.
fn global_density(open: f32) -> f32 {
    return DENSITY_BLOCKED + (DENSITY_OPEN - DENSITY_BLOCKED) * open;
}

// Least 1 - a_f: below it transmitted was not measured.
const LEAST_LOST: f32 = 0.03;

// Share of F - T_f that is drawn: layers have no sides, where part of the light between them leaves a head of hair.
const BETWEEN_LAYERS_SHARE: f32 = 0.5;

// Of a light of this colour and width, for fibres of average a_f and beta_f_2. The hair behind the point is such layers, and
// sends back density_back (d_b f_local) of what a stack without end would.
fn forward_light(
    record: ShadowRecord,
    a_f: vec3f,
    beta_f_2: vec3f,
    rgb: vec3f,
    lambda: f32,
    layers: HairLayers,
    density_back: vec3f,
) -> ForwardLight {
    let p_a_f = clamp(1.0 - a_f, vec3f(LEAST_LOST), vec3f(1.0));
    let t_f = transmitted(record, p_a_f);
    let p_q = clamp(1.0 - layers.gain * a_f, vec3f(LEAST_LOST), vec3f(1.0));
    let u = transmitted(record, p_q);
    let f = between_layers(layers, u, density_back);
    let forward = max(t_f - record.shares.x, vec3f(0.0));
    let t_b = BETWEEN_LAYERS_SHARE * max(f - t_f, vec3f(0.0));
    let gained = forward + t_b;
    let global_factor = global_density(record.shares.x);
    let global = global_factor * forward + t_b;
    // One width for all channels: each counts by what it carries.
    // Of a black light, too.
    let brightest = max(max(max(rgb.x, rgb.y), rgb.z), 1e-30);
    let carried = gained * (rgb / brightest) + 1e-12;
    let variance = beta_f_2 * forward_events(record, p_q, u);
    let mean = dot(carried, variance) / (carried.x + carried.y + carried.z);
    return ForwardLight(gained, global, sqrt(lambda * lambda + mean));
}
