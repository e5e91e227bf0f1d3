// #import lib/transmittance
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
    // Factor on what global scattering makes of it: global_density of T_vol.
    density: f32,
    // Its width in inclination.
    sigma_f: f32,
}

// Factor on global scattering where this share of a light comes unblocked.
fn global_density(open: f32) -> f32 {
    return DENSITY_BLOCKED + (DENSITY_OPEN - DENSITY_BLOCKED) * open;
}

// Share of the light that hair behind a point blocks, from which on that hair counts as layers without end.
const CLOSED_FROM: f32 = 0.8;

// Shares of light that come through the hair along x, y and z: from above, that is from +x, +y, +z, and from below.
struct AxisShares {
    above: vec3f,
    below: vec3f,
}

// Factor on local scattering of light from the unit vector `towards`: 0 where no hair is behind the point, away from the
// light, to send it back.
fn local_density(axis_shares: AxisShares, towards: vec3f) -> f32 {
    let away = select(axis_shares.above, axis_shares.below, towards > vec3f(0.0));
    let open = dot(towards * towards, away);
    return clamp((1.0 - open) * (1.0 / CLOSED_FROM), 0.0, 1.0);
}

// Of a light of this colour and width, for fibres of average a_f and beta_f_2.
fn forward_light(
    record: ShadowRecord,
    a_f: vec3f,
    beta_f_2: vec3f,
    rgb: vec3f,
    lambda: f32,
) -> ForwardLight {
    let p = clamp(1.0 - a_f, vec3f(0.03), vec3f(1.0));
    let share = transmitted(record, p);
    let gained = max(share - record.shares.x, vec3f(0.0));
    // One width for all channels: each counts by what it carries.
    // Of a black light, too.
    let brightest = max(max(max(rgb.x, rgb.y), rgb.z), 1e-30);
    let carried = gained * (rgb / brightest) + 1e-12;
    let variance = beta_f_2 * forward_events(record, p, share);
    let mean = dot(carried, variance) / (carried.x + carried.y + carried.z);
    return ForwardLight(gained, global_density(record.shares.x), sqrt(lambda * lambda + mean));
}
