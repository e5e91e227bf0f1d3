// Light that reaches the surfaces of proxies through the hair. Twin: crates/cpu/src/proxy_light.rs.
// #import lib/grid

// What directions at or below the horizon weigh, so that there is a mean where all of them are.
const LEAST_COSINE: f32 = 1e-3;

// How far above the surface records are looked up where none beside it sees the light, voxels: a wide
// light is seen a little beyond the horizon of its middle.
const HIGHER: f32 = 3.0;

// How far along a ray the middles of the outer voxels are reached; below 0: never.
fn entry_of_volume(grid: Grid, position: vec3f, direction: vec3f) -> f32 {
    let span = span_in_grid(grid, position, direction, 0.5);
    return select(-1.0, span.x, span.x < span.y);
}
