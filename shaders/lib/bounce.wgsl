// Lights in place of what proxies send back to the hair. Twin: crates/scene/src/bounce.rs.
// #import lib/light

// Of the ground, then of all other proxies.
const N_LOBES: u32 = 2u;
// Rays of a node of the bounce grid.
const N_RAYS: u32 = 48u;
// How far beyond the surface that it meets hair counts for a ray, voxels of the shadow volume.
const BEYOND: f32 = 1.0;
// Concentrations of a lobe's light.
const LEAST_KAPPA: f32 = 0.1;
const MOST_KAPPA: f32 = 200.0;

// The light of a lobe of power rgb, the sum of whose channels times unit vectors to where it comes from
// is vector: of the same mean cosine.
fn lobe_light(rgb: vec3f, vector: vec3f) -> Light {
    let all = rgb.x + rgb.y + rgb.z;
    let length_all = length(vector);
    let mean = min(length_all / max(all, 1e-30), 0.99);
    let square = mean * mean;
    let kappa = clamp(mean * (3.0 - square) / (1.0 - square), LEAST_KAPPA, MOST_KAPPA);
    let solid_angle = 6.2831853 * (1.0 - exp(-2.0 * kappa)) / kappa;
    let direction = select(vec3f(0.0, 1.0, 0.0), vector / max(length_all, 1e-30), length_all > 0.0);
    let power = max(max(rgb.x, rgb.y), rgb.z);
    return Light(direction, sqrt(2.0 / kappa), rgb / solid_angle, power, 0u, 0u, solid_angle, NO_SLOT,
        0u, 0u, 0u, 0u);
}
