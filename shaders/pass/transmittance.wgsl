// Records of each light at every voxel: its unblocked share, and what the exponents below 1 leave.
// A dispatch takes one step: for every light of the batch, one slice along its k-th direction.
// Slices are marched from the light's side, carrying shares and not optical depth from slice to
// slice: interpolating shares is unbiased, and its diffusion acts as a free filter.
// Twin: crates/cpu/src/transmittance.rs.
// #import lib/grid
// #import lib/light
// #import lib/transmittance
// #if PROXIES
// #import lib/proxy
// #endif

struct Step {
    // Direction of each light, from 0.
    k: u32,
    // From the light's side.
    slice_ix: u32,
}

@group(0) @binding(0) var<uniform> grid: Grid;
@group(0) @binding(1) var<uniform> batch: Batch;
@group(0) @binding(2) var<storage, read> volume: array<vec4f>;
@group(0) @binding(3) var<storage, read> lights: array<Light>;
@group(0) @binding(4) var<storage, read> sweeps: array<vec4f>;
// Packed records, [light of the batch][voxel].
@group(0) @binding(5) var<storage, read_write> records: array<vec2u>;
// What leaves the slices of even and of odd number, [parity][light of the batch][cell].
@group(0) @binding(6) var<storage, read_write> leaving: array<vec4f>;
@group(0) @binding(7) var<uniform> step_at: Step;

// #if PROXIES
@group(0) @binding(8) var<uniform> proxies: Proxies;
// #endif
// #if MESHES
// [sweep][voxel]: a bit each, the lowest of a word first.
@group(0) @binding(9) var<storage, read> hidden_voxels: array<u32>;
// #endif

// In front of the first slice and beside the others all light is there.
const OPEN: vec4f = vec4f(1.0, 1.0, 1.0, 0.0);

fn leaving_at(first: u32, b: i32, c: i32, n_b: i32, n_c: i32) -> vec4f {
    if b < 0 || c < 0 || b >= n_b || c >= n_c {
        return OPEN;
    }
    return leaving[first + u32(b + n_b * c)];
}

@compute @workgroup_size(64)
fn sweep(@builtin(global_invocation_id) id: vec3u) {
    let light_ix = id.y;
    let light = lights[batch.first_light + light_ix];
    let k = step_at.k;
    if k >= light.n_sweeps {
        return;
    }
    let d = sweeps[light.first_sweep + k].xyz;
    // The axis most along the direction is marched; b and c span the slices.
    var axis = 0u;
    if abs(d.y) > abs(d[axis]) {
        axis = 1u;
    }
    if abs(d.z) > abs(d[axis]) {
        axis = 2u;
    }
    let axis_b = (axis + 1u) % 3u;
    let axis_c = (axis + 2u) % 3u;
    let n = grid.dims[axis];
    let n_b = grid.dims[axis_b];
    let n_c = grid.dims[axis_c];
    let cell = id.x;
    if step_at.slice_ix >= n || cell >= n_b * n_c {
        return;
    }
    let slope = 1.0 / abs(d[axis]);
    let slice = select(step_at.slice_ix, n - 1u - step_at.slice_ix, d[axis] > 0.0);
    let b = cell % n_b;
    let c = cell / n_b;
    let stride = max(max(grid.dims.x * grid.dims.y, grid.dims.y * grid.dims.z),
        grid.dims.z * grid.dims.x);
    let parity = step_at.slice_ix & 1u;
    let first_left = ((1u - parity) * batch.n_lights + light_ix) * stride;
    var entering = OPEN;
    if step_at.slice_ix > 0u {
        let x = f32(b) + d[axis_b] * slope;
        let y = f32(c) + d[axis_c] * slope;
        let x0 = floor(x);
        let y0 = floor(y);
        let fx = x - x0;
        let fy = y - y0;
        let ix = i32(x0);
        let iy = i32(y0);
        let row_0 = mix(leaving_at(first_left, ix, iy, i32(n_b), i32(n_c)),
            leaving_at(first_left, ix + 1, iy, i32(n_b), i32(n_c)), fx);
        let row_1 = mix(leaving_at(first_left, ix, iy + 1, i32(n_b), i32(n_c)),
            leaving_at(first_left, ix + 1, iy + 1, i32(n_b), i32(n_c)), fx);
        entering = mix(row_0, row_1, fy);
    }
    var voxel = vec3u(0u);
    voxel[axis] = slice;
    voxel[axis_b] = b;
    voxel[axis_c] = c;
    let index = voxel_index(grid, voxel);
    let hair = extinction(volume[2u * index], volume[2u * index + 1u], d);
    // Half a step from slice to slice before the voxel's centre and half behind it.
    let depth = 0.5 * grid.h * slope * hair.x;
    let here = pass_through(entering, depth, hair.y);
    leaving[(parity * batch.n_lights + light_ix) * stride + cell] = pass_through(here, depth, hair.y);
    let out = light_ix * grid.dims.x * grid.dims.y * grid.dims.z + index;
    var sum = ShadowRecord(vec3f(0.0), 0.0);
    if k > 0u {
        sum = unpack_record(records[out]);
    }
    var n_before = f32(k);
    // #if PROXIES
    let centre = grid.origin + (vec3f(voxel) + 0.5) * grid.h;
    for (var ix = 0u; ix < proxies.n; ix++) {
        if is_blocked_by(proxies.list[ix], centre, d) {
            records[out] = pack_record(sum);
            return;
        }
    }
    // Directions behind proxies say nothing of the hair's inclination.
    n_before = select(0.0, n_before, sum.shares.z > 0.0);
    // #endif
    // #if MESHES
    let n_words = (grid.dims.x * grid.dims.y * grid.dims.z + 31u) / 32u;
    let word = hidden_voxels[(light.first_sweep + k) * n_words + index / 32u];
    if ((word >> (index % 32u)) & 1u) == 1u {
        records[out] = pack_record(sum);
        return;
    }
    n_before = select(0.0, n_before, sum.shares.z > 0.0);
    // #endif
    records[out] = pack_record(add_to_record(sum, here, n_before, f32(light.n_sweeps)));
}
