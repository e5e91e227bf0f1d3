// Radiance of every point towards the eye: for each light of the batch, its transmittance at the
// point times what the fibre scatters of it. Twin: crates/bake/src/cpu/shade.rs.
// #import lib/view
// #import lib/grid
// #import lib/light
// #import lib/single_scattering
// #import lib/transmittance

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> batch: Batch;
@group(0) @binding(2) var<uniform> grid: Grid;
@group(0) @binding(3) var<uniform> shading: Shading;
@group(0) @binding(4) var<storage, read> points: array<vec4f>;
@group(0) @binding(5) var<storage, read> tangents: array<vec4f>;
@group(0) @binding(6) var<storage, read> normals: array<vec4f>;
@group(0) @binding(7) var<storage, read> lights: array<Light>;
// Packed records, [light of the batch][voxel].
@group(0) @binding(8) var<storage, read> records: array<vec2u>;
@group(0) @binding(9) var<storage, read_write> radiance: array<vec4f>;
// 64 bit each, low word first: points skipped, products, products skipped.
@group(0) @binding(10) var<storage, read_write> counters: array<atomic<u32>>;
@group(0) @binding(11) var<uniform> axes: TableAxes;
@group(0) @binding(12) var table_c: texture_2d<u32>;
@group(0) @binding(13) var lobes_tt: texture_2d<u32>;
@group(0) @binding(14) var lobes_trt: texture_2d<u32>;

fn count(counter: u32, n: u32) {
    let before = atomicAdd(&counters[2u * counter], n);
    if before + n < before {
        atomicAdd(&counters[2u * counter + 1u], 1u);
    }
}

fn record_numbers(at: u32) -> vec4f {
    let record = unpack_record(records[at]);
    return vec4f(record.shares, record.sin_theta);
}

// Trilinear look-up in the records of one light.
fn record_at(first: u32, g: vec3f) -> ShadowRecord {
    let base = vec3u(g);
    let f = g - vec3f(base);
    let corner = first + voxel_index(grid, base);
    let row = grid.dims.x;
    let above = corner + grid.dims.x * grid.dims.y;
    let x00 = mix(record_numbers(corner), record_numbers(corner + 1u), f.x);
    let x10 = mix(record_numbers(corner + row), record_numbers(corner + row + 1u), f.x);
    let x01 = mix(record_numbers(above), record_numbers(above + 1u), f.x);
    let x11 = mix(record_numbers(above + row), record_numbers(above + row + 1u), f.x);
    let numbers = mix(mix(x00, x10, f.y), mix(x01, x11, f.y), f.z);
    return ShadowRecord(numbers.xyz, numbers.w);
}

// Whether a point at this place of the screen can touch the picture.
fn in_view(screen: vec3f) -> bool {
    let low = vec2f(-view.margin_px);
    let high = vec2f(view.size) + view.margin_px;
    return screen.z >= view.near && all(screen.xy > low) && all(screen.xy < high);
}

@compute @workgroup_size(64)
fn shade(@builtin(global_invocation_id) id: vec3u) {
    let point_ix = batch.first_point + id.x;
    if point_ix >= batch.end_point {
        return;
    }
    let position = points[point_ix].xyz;
    if !in_view(screen_position(view, position)) {
        count(0u, 1u);
        return;
    }
    let u = tangents[point_ix].xyz;
    let v = normals[point_ix].xyz;
    let w = cross(u, v);
    let frame = transpose(mat3x3f(u, v, w));
    let eye = direction_in_frame(frame * (view.eye - position));
    let g = grid_position(grid, position);
    let n_voxels = grid.dims.x * grid.dims.y * grid.dims.z;
    var sum = vec3f(0.0);
    var skipped = 0u;
    for (var ix = 0u; ix < batch.n_lights; ix++) {
        let light = lights[batch.first_light + ix];
        let record = record_at(ix * n_voxels, g);
        let unblocked = record.shares.x;
        if unblocked * light.power < batch.min_power {
            skipped++;
            continue;
        }
        let source = light_in_frame(frame * light.direction, light.lambda);
        let scattered = single_scattering(source, eye, shading, axes, table_c, lobes_tt, lobes_trt);
        sum += unblocked * light.rgb * scattered;
    }
    radiance[point_ix] += vec4f(sum * view.radiance_scale, 0.0);
    count(1u, batch.n_lights - skipped);
    count(2u, skipped);
}
