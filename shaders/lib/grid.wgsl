// The shadow volume's grid. Twin: Grid in crates/scene/src/volume.rs.

struct Grid {
    origin: vec3f,
    h: f32,
    dims: vec3u,
    n_segments: u32,
    quanta_per_area: f32,
    density_per_quantum: f32,
    pad: vec2u,
}

// Position in voxels from the centre of voxel (0, 0, 0), kept where eight neighbours exist.
fn grid_position(grid: Grid, position: vec3f) -> vec3f {
    let g = (position - grid.origin) / grid.h - 0.5;
    return clamp(g, vec3f(0.0), vec3f(grid.dims) - 1.001);
}

// Where a ray is in the grid, `inset` voxels or more from its faces: the distances from `start` at which it enters, 0
// or more, and leaves; where it never is, it leaves before it enters.
fn span_in_grid(grid: Grid, start: vec3f, direction: vec3f, inset: f32) -> vec2f {
    let d = select(direction, vec3f(1e-8), abs(direction) < vec3f(1e-8));
    let low = (grid.origin + inset * grid.h - start) / d;
    let high = (grid.origin + (vec3f(grid.dims) - inset) * grid.h - start) / d;
    let near = min(low, high);
    let far = max(low, high);
    return vec2f(max(max(near.x, near.y), max(near.z, 0.0)), min(far.x, min(far.y, far.z)));
}

// How far towards a light its records are looked up, voxels; found by ray shooting.
const SELF_LIFT: f32 = 0.12;

// Of a voxel's eight numbers towards d: extinction sigma_t = sqrt(A (A - d^T Q d)), 1/cm, and the mean of sin^2
// of the inclination, d^T Q d / A.
fn extinction(v0: vec4f, v1: vec4f, d: vec3f) -> vec2f {
    let along = d.x * d.x * v0.y + d.y * d.y * v0.z + d.z * d.z * v0.w
        + 2.0 * (d.x * d.y * v1.x + d.x * d.z * v1.y + d.y * d.z * v1.z);
    let sigma_t = sqrt(max(v0.x * (v0.x - along), 0.0));
    return vec2f(sigma_t, clamp(along / max(v0.x, 1e-20), 0.0, 1.0));
}

// Index of a voxel; x varies fastest.
fn voxel_index(grid: Grid, voxel: vec3u) -> u32 {
    return voxel.x + grid.dims.x * (voxel.y + grid.dims.y * voxel.z);
}
