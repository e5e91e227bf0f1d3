// Unblocked share of each light at every voxel. One workgroup a light; for each of the light's
// directions it marches slices from the light's side, carrying transmittance and not optical
// depth from slice to slice: interpolating transmittance is unbiased, and its diffusion acts as
// a free filter. Twin: crates/bake/src/cpu/transmittance.rs.
// #import lib/grid
// #import lib/light

@group(0) @binding(0) var<uniform> grid: Grid;
@group(0) @binding(1) var<uniform> batch: Batch;
@group(0) @binding(2) var<storage, read> volume: array<vec4f>;
@group(0) @binding(3) var<storage, read> lights: array<Light>;
@group(0) @binding(4) var<storage, read> sweeps: array<vec4f>;
// [light of the batch][voxel]
@group(0) @binding(5) var<storage, read_write> transmittance: array<f32>;

// Light that leaves the last slice: 64 x 64 cells, all of the workgroup memory there is.
var<workgroup> leaving: array<f32, 4096>;

fn leaving_at(b: i32, c: i32, n_b: i32, n_c: i32) -> f32 {
    if b < 0 || c < 0 || b >= n_b || c >= n_c {
        return 1.0;
    }
    return leaving[b + n_b * c];
}

@compute @workgroup_size(256)
fn sweep(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let light = lights[batch.first_light + group.x];
    let out = group.x * grid.dims.x * grid.dims.y * grid.dims.z;
    let weight = 1.0 / f32(light.n_sweeps);
    for (var k = 0u; k < light.n_sweeps; k++) {
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
        let slope = 1.0 / abs(d[axis]);
        let shift_b = d[axis_b] * slope;
        let shift_c = d[axis_c] * slope;
        // Half a step from slice to slice.
        let half_step = 0.5 * grid.h * slope;
        for (var slice_ix = 0u; slice_ix < n; slice_ix++) {
            let slice = select(slice_ix, n - 1u - slice_ix, d[axis] > 0.0);
            var next: array<f32, 16>;
            for (var item = 0u; item < 16u; item++) {
                let cell = thread + 256u * item;
                if cell >= n_b * n_c {
                    break;
                }
                let b = cell % n_b;
                let c = cell / n_b;
                var entering = 1.0;
                if slice_ix > 0u {
                    let x = f32(b) + shift_b;
                    let y = f32(c) + shift_c;
                    let x0 = floor(x);
                    let y0 = floor(y);
                    let fx = x - x0;
                    let fy = y - y0;
                    let ix = i32(x0);
                    let iy = i32(y0);
                    let row_0 = mix(leaving_at(ix, iy, i32(n_b), i32(n_c)),
                        leaving_at(ix + 1, iy, i32(n_b), i32(n_c)), fx);
                    let row_1 = mix(leaving_at(ix, iy + 1, i32(n_b), i32(n_c)),
                        leaving_at(ix + 1, iy + 1, i32(n_b), i32(n_c)), fx);
                    entering = mix(row_0, row_1, fy);
                }
                var voxel = vec3u(0u);
                voxel[axis] = slice;
                voxel[axis_b] = b;
                voxel[axis_c] = c;
                let index = voxel_index(grid, voxel);
                let v0 = volume[2u * index];
                let v1 = volume[2u * index + 1u];
                // sigma_t = sqrt(A (A - d^T Q d))
                let along = d.x * d.x * v0.y + d.y * d.y * v0.z + d.z * d.z * v0.w
                    + 2.0 * (d.x * d.y * v1.x + d.x * d.z * v1.y + d.y * d.z * v1.z);
                let sigma_t = sqrt(max(v0.x * (v0.x - along), 0.0));
                let half_pass = exp(-half_step * sigma_t);
                let here = entering * half_pass;
                next[item] = here * half_pass;
                if k == 0u {
                    transmittance[out + index] = weight * here;
                } else {
                    transmittance[out + index] += weight * here;
                }
            }
            workgroupBarrier();
            for (var item = 0u; item < 16u; item++) {
                let cell = thread + 256u * item;
                if cell < n_b * n_c {
                    leaving[cell] = next[item];
                }
            }
            workgroupBarrier();
        }
        // The next direction adds to voxels that other threads wrote.
        storageBarrier();
    }
}
