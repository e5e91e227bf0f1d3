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
    // T_f - T_vol.
    gained: vec3f,
    // What global scattering is made of.
    global: vec3f,
    // Its width in inclination.
    sigma_f: f32,
}

// Factor on global scattering where this share of a light comes unblocked.
fn global_density(open: f32) -> f32 {
    return DENSITY_BLOCKED + (DENSITY_OPEN - DENSITY_BLOCKED) * open;
}

// Least share of the light that an event loses.
const LEAST_LOST: f32 = 0.03;

// Share of the light that goes up and down between layers which comes to a point.
const BETWEEN_LAYERS_SHARE: f32 = 0.5;

// Of a light of this colour and width, for fibres of average a_f and beta_f_2,
// where the share `density` of the hair behind, d_b f_local, sends light back.
fn forward_light(
    record: ShadowRecord,
    a_f: vec3f,
    beta_f_2: vec3f,
    rgb: vec3f,
    lambda: f32,
    layers: HairLayers,
    density: vec3f,
) -> ForwardLight {
    let p = clamp(1.0 - a_f, vec3f(LEAST_LOST), vec3f(1.0));
    let share = transmitted(record, p);
    let lost = clamp(1.0 - layers.gain * a_f, vec3f(LEAST_LOST), vec3f(1.0));
    let left = transmitted(record, lost);
    let all = between_layers(layers, left, density);
    let forward = max(share - record.shares.x, vec3f(0.0));
    let returned = BETWEEN_LAYERS_SHARE * max(all - share, vec3f(0.0));
    let gained = forward + returned;
    let global = global_density(record.shares.x) * forward + returned;
    // One width for all channels: each counts by what it carries.
    // Of a black light, too.
    let brightest = max(max(max(rgb.x, rgb.y), rgb.z), 1e-30);
    let carried = gained * (rgb / brightest) + 1e-12;
    let variance = beta_f_2 * forward_events(record, lost, left);
    let mean = dot(carried, variance) / (carried.x + carried.y + carried.z);
    return ForwardLight(gained, global, sqrt(lambda * lambda + mean));
}
