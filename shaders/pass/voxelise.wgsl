// Splats the strands into the shadow volume: area density A = sum of length * diameter / h^3 and
// its orientation tensor Q = sum of length * diameter * u u^T / h^3, with trilinear weights.
// Sums are 64-bit fixed point in two words, so their order does not matter.
// Twins: crates/cpu/src/voxelise.rs, crates/cpu/src/axis_shares.rs.
// #import lib/grid

@group(0) @binding(0) var<uniform> grid: Grid;
@group(0) @binding(1) var<storage, read> points: array<vec4f>;
@group(0) @binding(2) var<storage, read> segments: array<u32>;
@group(0) @binding(3) var<storage, read_write> sums: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> volume: array<vec4f>;
// Three texels a voxel, of x, y and z: unorm16 of light from above, then from below.
@group(0) @binding(5) var axis_shares: texture_storage_3d<r32uint, write>;

fn add(cell: u32, value: f32) {
    let quanta = i32(round(value));
    if quanta == 0 {
        return;
    }
    let low = bitcast<u32>(quanta);
    let before = atomicAdd(&sums[2u * cell], low);
    let carry = select(0u, 1u, before + low < before);
    let high = select(0u, 0xffffffffu, quanta < 0) + carry;
    if high != 0u {
        atomicAdd(&sums[2u * cell + 1u], high);
    }
}

// One thread a segment, in pieces of at most a third of a voxel.
@compute @workgroup_size(64)
fn splat(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let segment = id.x + id.y * groups.x * 64u;
    if segment >= grid.n_segments {
        return;
    }
    let first = segments[segment];
    let a = points[first];
    let b = points[first + 1u];
    let along = b.xyz - a.xyz;
    let length_cm = length(along);
    if length_cm <= 0.0 {
        return;
    }
    let u = along / length_cm;
    let pieces = clamp(u32(ceil(3.0 * length_cm / grid.h)), 1u, 1024u);
    let quanta = (a.w + b.w) * length_cm / f32(pieces) * grid.quanta_per_area;
    for (var piece = 0u; piece < pieces; piece++) {
        let g = grid_position(grid, a.xyz + along * ((f32(piece) + 0.5) / f32(pieces)));
        let base = vec3u(g);
        let f = g - vec3f(base);
        for (var corner = 0u; corner < 8u; corner++) {
            let offset = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
            let w = select(1.0 - f, f, offset == vec3u(1u));
            let value = quanta * (w.x * w.y * w.z);
            let cell = 7u * voxel_index(grid, base + offset);
            add(cell, value);
            add(cell + 1u, value * (u.x * u.x));
            add(cell + 2u, value * (u.y * u.y));
            add(cell + 3u, value * (u.z * u.z));
            add(cell + 4u, value * (u.x * u.y));
            add(cell + 5u, value * (u.x * u.z));
            add(cell + 6u, value * (u.y * u.z));
        }
    }
}

fn density(cell: u32) -> f32 {
    let low = atomicLoad(&sums[2u * cell]);
    let high = atomicLoad(&sums[2u * cell + 1u]);
    if (high & 0x80000000u) == 0u {
        return (f32(high) * 4294967296.0 + f32(low)) * grid.density_per_quantum;
    }
    // Magnitude of a negative sum: two's complement of both words.
    let magnitude_low = ~low + 1u;
    let magnitude_high = ~high + select(0u, 1u, low == 0u);
    return -(f32(magnitude_high) * 4294967296.0 + f32(magnitude_low)) * grid.density_per_quantum;
}

// One thread a voxel: (A, Qxx, Qyy, Qzz), (Qxy, Qxz, Qyz, 0) in 1/cm.
@compute @workgroup_size(64)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    let voxel = id.x;
    if voxel >= grid.dims.x * grid.dims.y * grid.dims.z {
        return;
    }
    let cell = 7u * voxel;
    volume[2u * voxel] = vec4f(density(cell), density(cell + 1u), density(cell + 2u), density(cell + 3u));
    volume[2u * voxel + 1u] = vec4f(density(cell + 4u), density(cell + 5u), density(cell + 6u), 0.0);
}

// One thread a column of voxels, those along x first, then y, then z: what of the light along it comes through the hair to
// each voxel, up to SELF_LIFT before its centre.
@compute @workgroup_size(64)
fn find_axis_shares(@builtin(global_invocation_id) id: vec3u) {
    let n = grid.dims;
    let n_columns = vec3u(n.y * n.z, n.x * n.z, n.x * n.y);
    var axis = 0u;
    var column = id.x;
    while axis < 3u && column >= n_columns[axis] {
        column -= n_columns[axis];
        axis++;
    }
    if axis == 3u {
        return;
    }
    let b = select(0u, 1u, axis == 0u);
    let c = select(2u, 1u, axis == 2u);
    var voxel = vec3u(0u);
    voxel[b] = column % n[b];
    voxel[c] = column / n[b];
    var d = vec3f(0.0);
    d[axis] = 1.0;
    var all = 0.0;
    for (var ix = 0u; ix < n[axis]; ix++) {
        voxel[axis] = ix;
        all += depth_along(voxel, d);
    }
    var below = 0.0;
    for (var ix = 0u; ix < n[axis]; ix++) {
        voxel[axis] = ix;
        let depth = depth_along(voxel, d);
        let above = max(all - below - depth, 0.0);
        let here = (0.5 - SELF_LIFT) * depth;
        let shares = exp(-vec2f(above + here, below + here));
        let texel = vec3u(3u * voxel.x + axis, voxel.yz);
        textureStore(axis_shares, texel, vec4u(pack2x16unorm(shares), 0u, 0u, 0u));
        below += depth;
    }
}

// Optical depth of a voxel.
fn depth_along(voxel: vec3u, d: vec3f) -> f32 {
    let at = 2u * voxel_index(grid, voxel);
    return grid.h * extinction(volume[at], volume[at + 1u], d).x;
}
