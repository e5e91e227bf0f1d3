// Light that reaches the surfaces of proxies through the hair. Twin: crates/cpu/src/proxy_light.rs.
// #import lib/grid

// What directions at or below the horizon weigh, so that there is a mean where all of them are.
const LEAST_COSINE: f32 = 1e-3;

// How far above the surface records are looked up where none beside it sees the light, voxels: a wide
// light is seen a little beyond the horizon of its middle.
const HIGHER: f32 = 3.0;

// How far along a ray the middles of the outer voxels are reached; below 0: never.
fn entry_of_volume(grid: Grid, position: vec3f, direction: vec3f) -> f32 {
    let d = select(direction, vec3f(1e-8), abs(direction) < vec3f(1e-8));
    let low = (grid.origin + 0.5 * grid.h - position) / d;
    let high = (grid.origin + (vec3f(grid.dims) - 0.5) * grid.h - position) / d;
    let near = min(low, high);
    let far = max(low, high);
    let entry = max(max(near.x, near.y), max(near.z, 0.0));
    return select(-1.0, entry, entry < min(far.x, min(far.y, far.z)));
}
