// A light of the scene. Twin: LightRecord in crates/scene/src/scene.rs.

struct Light {
    direction: vec3f,
    lambda: f32,
    rgb: vec3f,
    // Largest channel times solid angle: what it could send to a point in the open.
    power: f32,
    first_sweep: u32,
    n_sweeps: u32,
    // sr
    solid_angle: f32,
    // Row in the answers of the shadow maps, or NO_SLOT.
    shadow_index: u32,
    // Place among the records of its batch.
    record: u32,
    // Of narrow lights, whose shadows are found along segments: the first of its maps, and how many; none of
    // others.
    first_map: u32,
    n_maps: u32,
    pad: u32,
}

// Twin in crates/scene/src/shadow_maps.rs.
const NO_SLOT: u32 = 0xffffffffu;

// Lights and points that a dispatch works on. Twin: Batch in
// crates/render/src/passes/shadows.rs.
struct Batch {
    first_light: u32,
    n_lights: u32,
    first_point: u32,
    end_point: u32,
    // Products of less power than this are skipped.
    min_power: f32,
    // d_f, d_b.
    density_forward: f32,
    density_back: f32,
    // d_b times the largest A_b: what local scattering makes of power at most.
    max_local: f32,
    // 1 where single scattering of narrow lights is found along segments.
    are_along: u32,
    // 1 where the points are places in a list of them.
    are_listed: u32,
    pad_0: u32,
    pad_1: u32,
}

// L(omega) of one light (Xu 2011 Eq 1), in the form without cancellation.
fn light_radiance(light: Light, omega: vec3f) -> vec3f {
    let d = omega - light.direction;
    return light.rgb * exp(-dot(d, d) / (light.lambda * light.lambda));
}
