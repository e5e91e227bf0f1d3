// Light that the proxies send back, at the texels of their light maps: matte, so the same in all
// directions. Each light's irradiance over the surface's own horizon is a closed form; how much of it
// is left is found along the directions of its sweeps: none behind another proxy, else what the
// light's records say where the ray enters the shadow volume. Twin: crates/cpu/src/proxies.rs.
// #import lib/view
// #import lib/grid
// #import lib/light
// #import lib/transmittance
// #import lib/irradiance
// #import lib/surface_light
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

// Directions of a light that no proxy blocks at a place.
fn count_open(light: Light, position: vec3f) -> f32 {
    var n_open = 0.0;
    for (var k = 0u; k < light.n_sweeps; k++) {
        let d = sweeps[light.first_sweep + k].xyz;
        var is_open = true;
        for (var ix = 0u; ix < proxies.n; ix++) {
            is_open = is_open && !is_blocked_by(proxies.list[ix], position, d);
        }
        n_open += select(0.0, 1.0, is_open);
    }
    return n_open;
}

// Share that hair leaves of a light, by its records around g. They hold the mean over all
// directions, none coming through proxies, and each voxel has a horizon of its own: voxels count by
// the directions that are open there, those without any not at all. Below 0 where that is all of them.
fn share_at(light: Light, first: u32, g: vec3f) -> f32 {
    let base = vec3u(g);
    let f = g - vec3f(base);
    var sum = 0.0;
    var weights = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let offset = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
        let voxel = base + offset;
        let n_open = count_open(light, grid.origin + (vec3f(voxel) + 0.5) * grid.h);
        if n_open > 0.0 {
            let w = select(1.0 - f, f, offset == vec3u(1u));
            let weight = w.x * w.y * w.z;
            let record = unpack_record(records[first + voxel_index(grid, voxel)]);
            sum += weight * record.shares.x * (f32(light.n_sweeps) / n_open);
            weights += weight;
        }
    }
    return select(-1.0, min(sum / max(weights, 1e-20), 1.0), weights > 0.0);
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
        let first = light.record * n_voxels;
        var inside = -1.0;
        var above = 0.0;
        var arriving = 0.0;
        for (var k = 0u; k < light.n_sweeps; k++) {
            let d = sweeps[light.first_sweep + k].xyz;
            let weight = max(dot(normal, d), LEAST_COSINE);
            above += weight;
            if is_behind_other(own, position, d) {
                continue;
            }
            var share = 1.0;
            let entry = entry_of_volume(grid, position, d);
            if entry > 0.0 {
                share = max(share_at(light, first, grid_position(grid, position + d * entry)), 0.0);
            } else if entry == 0.0 {
                // The same place for all directions.
                if inside < 0.0 {
                    inside = share_at(light, first, grid_position(grid, position + normal * lift));
                    if inside < 0.0 {
                        let higher = position + normal * (HIGHER * grid.h);
                        inside = max(share_at(light, first, grid_position(grid, higher)), 0.0);
                    }
                }
                share = inside;
            }
            arriving += weight * share;
        }
        let open = irradiance(dot(normal, light.direction), light.lambda);
        sum += light.rgb * (open * arriving / max(above, LEAST_COSINE));
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
