// As pass/proxy_light, where there are meshes among the proxies: light is found at the texels of the
// light maps and at the vertices of the meshes. What the proxies hide of the lights was found on the CPU
// (crates/scene/src/beside.rs) and comes as a bit for each direction and place.
// Twin: crates/cpu/src/proxies.rs.
// #import lib/view
// #import lib/grid
// #import lib/light
// #import lib/transmittance
// #import lib/irradiance
// #import lib/surface_light

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> batch: Batch;
@group(0) @binding(2) var<uniform> grid: Grid;
@group(0) @binding(3) var<storage, read> lights: array<Light>;
@group(0) @binding(4) var<storage, read> sweeps: array<vec4f>;
// Packed records, [light of the batch][voxel].
@group(0) @binding(5) var<storage, read> records: array<vec2u>;
// [surface] position, normal, albedo
@group(0) @binding(6) var<storage, read> surfaces: array<array<vec4f, 3>>;
// [sweep][surface], [sweep][voxel]: a bit each, the lowest of a word first.
@group(0) @binding(7) var<storage, read> hidden_surfaces: array<u32>;
@group(0) @binding(8) var<storage, read> hidden_voxels: array<u32>;
// [surface] (rgb, 0), times the view's radiance scale.
@group(0) @binding(9) var<storage, read_write> light_maps: array<vec4f>;

// Directions of a light that no proxy blocks at a voxel.
fn count_open(light: Light, voxel: u32) -> f32 {
    let n_words = (grid.dims.x * grid.dims.y * grid.dims.z + 31u) / 32u;
    var n_open = 0.0;
    for (var k = 0u; k < light.n_sweeps; k++) {
        let word = hidden_voxels[(light.first_sweep + k) * n_words + voxel / 32u];
        n_open += select(1.0, 0.0, ((word >> (voxel % 32u)) & 1u) == 1u);
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
        let voxel = voxel_index(grid, base + offset);
        let n_open = count_open(light, voxel);
        if n_open > 0.0 {
            let w = select(1.0 - f, f, offset == vec3u(1u));
            let weight = w.x * w.y * w.z;
            let record = unpack_record(records[first + voxel]);
            sum += weight * record.shares.x * (f32(light.n_sweeps) / n_open);
            weights += weight;
        }
    }
    return select(-1.0, min(sum / max(weights, 1e-20), 1.0), weights > 0.0);
}

@compute @workgroup_size(64)
fn light_surfaces(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let own = id.x + id.y * groups.x * 64u;
    let n_surfaces = arrayLength(&surfaces);
    if own >= n_surfaces {
        return;
    }
    let position = surfaces[own][0].xyz;
    let normal = surfaces[own][1].xyz;
    let n_words = (n_surfaces + 31u) / 32u;
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
            let word = hidden_surfaces[(light.first_sweep + k) * n_words + own / 32u];
            if ((word >> (own % 32u)) & 1u) == 1u {
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
    let sent_back = surfaces[own][2].rgb * 0.31830987;
    // The first batch overwrites what was there.
    var before = vec4f(0.0);
    if batch.first_light > 0u {
        before = light_maps[own];
    }
    light_maps[own] = before + vec4f(sent_back * sum * view.radiance_scale, 0.0);
}
