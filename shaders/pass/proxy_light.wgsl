// Light that the proxies send back, at the texels of their light maps: matte, so the same in all
// directions. Each light's irradiance in the open is a closed form; how much of it is left is
// found along the directions of its sweeps: none behind the surface or another proxy, else what the
// light's records say where the ray enters the shadow volume. Twin: crates/bake/src/cpu/proxies.rs.
// #import lib/view
// #import lib/grid
// #import lib/light
// #import lib/transmittance
// #import lib/irradiance
// #import lib/proxy

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> batch: Batch;
@group(0) @binding(2) var<uniform> grid: Grid;
@group(0) @binding(3) var<uniform> proxies: Proxies;
@group(0) @binding(4) var<storage, read> lights: array<Light>;
@group(0) @binding(5) var<storage, read> sweeps: array<vec4f>;
// Packed records, [light of the batch][voxel].
@group(0) @binding(6) var<storage, read> records: array<vec2u>;
// [proxy][row][column] (rgb, 0), times the view's radiance scale.
@group(0) @binding(7) var<storage, read_write> light_maps: array<vec4f>;

fn share_of(at: u32) -> f32 {
    return unpack_record(records[at]).shares.x;
}

// Unblocked share in the records of one light.
fn share_at(first: u32, g: vec3f) -> f32 {
    let base = vec3u(g);
    let f = g - vec3f(base);
    let corner = first + voxel_index(grid, base);
    let row = grid.dims.x;
    let above = corner + grid.dims.x * grid.dims.y;
    let x00 = mix(share_of(corner), share_of(corner + 1u), f.x);
    let x10 = mix(share_of(corner + row), share_of(corner + row + 1u), f.x);
    let x01 = mix(share_of(above), share_of(above + 1u), f.x);
    let x11 = mix(share_of(above + row), share_of(above + row + 1u), f.x);
    return mix(mix(x00, x10, f.y), mix(x01, x11, f.y), f.z);
}

// How far along a ray the middles of the outer voxels are reached; below 0: never.
fn entry_of_volume(position: vec3f, direction: vec3f) -> f32 {
    let d = select(direction, vec3f(1e-8), abs(direction) < vec3f(1e-8));
    let low = (grid.origin + 0.5 * grid.h - position) / d;
    let high = (grid.origin + (vec3f(grid.dims) - 0.5) * grid.h - position) / d;
    let near = min(low, high);
    let far = max(low, high);
    let entry = max(max(near.x, near.y), max(near.z, 0.0));
    return select(-1.0, entry, entry < min(far.x, min(far.y, far.z)));
}

// Whether another proxy stands before a light.
fn is_behind_other(own: u32, position: vec3f, direction: vec3f) -> bool {
    for (var ix = 0u; ix < proxies.n; ix++) {
        if ix != own && is_blocked_by(proxies.list[ix], position, direction) {
            return true;
        }
    }
    return false;
}

@compute @workgroup_size(64)
fn light_proxies(@builtin(global_invocation_id) id: vec3u) {
    let own = id.y;
    if id.x >= LIGHT_MAP_SIDE * LIGHT_MAP_SIDE || own >= proxies.n {
        return;
    }
    let texel = vec2u(id.x % LIGHT_MAP_SIDE, id.x / LIGHT_MAP_SIDE);
    let position = texel_position(proxies.list[own], texel);
    let normal = surface_normal(proxies.list[own], position);
    let n_voxels = grid.dims.x * grid.dims.y * grid.dims.z;
    let lift = SELF_LIFT * grid.h;
    var sum = vec3f(0.0);
    for (var ix = 0u; ix < batch.n_lights; ix++) {
        let light = lights[batch.first_light + ix];
        let n = f32(light.n_sweeps);
        var above = 0.0;
        var n_open = 0.0;
        for (var k = 0u; k < light.n_sweeps; k++) {
            let d = sweeps[light.first_sweep + k].xyz;
            let cos_normal = dot(normal, d);
            above += max(cos_normal, 0.0);
            if cos_normal > 0.0 && !is_behind_other(own, position, d) {
                n_open += 1.0;
            }
        }
        if n_open == 0.0 {
            continue;
        }
        var arriving = 0.0;
        for (var k = 0u; k < light.n_sweeps; k++) {
            let d = sweeps[light.first_sweep + k].xyz;
            let cos_normal = dot(normal, d);
            if cos_normal <= 0.0 || is_behind_other(own, position, d) {
                continue;
            }
            var share = 1.0;
            let entry = entry_of_volume(position, d);
            if entry >= 0.0 {
                // Records hold the mean over all directions, none coming through proxies.
                let g = grid_position(grid, position + d * (entry + lift));
                share = min(share_at(light.record * n_voxels, g) * n / n_open, 1.0);
            }
            arriving += cos_normal * share;
        }
        let open = irradiance(dot(normal, light.direction), light.lambda);
        sum += light.rgb * (open * arriving / above);
    }
    let sent_back = proxies.list[own].albedo * 0.31830987;
    // The first batch overwrites what was there.
    let at = own * LIGHT_MAP_SIDE * LIGHT_MAP_SIDE + id.x;
    var before = vec4f(0.0);
    if batch.first_light > 0u {
        before = light_maps[at];
    }
    light_maps[at] = before + vec4f(sent_back * sum * view.radiance_scale, 0.0);
}
