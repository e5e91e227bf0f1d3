// Light that the proxies send back, at the texels of their light maps and, where there are meshes, at
// their vertices: matte, so the same in all directions. Each light's irradiance over the surface's own
// horizon is a closed form; how much of it is left is found along the directions of its sweeps: none
// behind another proxy, else what the light's records say where the ray enters the shadow volume.
// What meshes hide was found on the CPU (crates/scene/src/beside.rs) and comes as a bit for each direction
// and place. Twin: crates/cpu/src/proxy_light.rs.
// #import lib/view
// #import lib/grid
// #import lib/light
// #import lib/transmittance
// #import lib/bounce
// #import lib/irradiance
// #import lib/surface_light
// #if MESHES
// #else
// #import lib/proxy
// #endif

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> batch: Batch;
@group(0) @binding(2) var<uniform> grid: Grid;
@group(0) @binding(3) var<storage, read> lights: array<Light>;
@group(0) @binding(4) var<storage, read> sweeps: array<vec4f>;
// Packed records, [light of the batch][voxel].
@group(0) @binding(5) var<storage, read> records: array<vec2u>;
// [proxy][row][column], then [mesh][vertex] (rgb, 0), times the view's radiance scale.
@group(0) @binding(6) var<storage, read_write> light_maps: array<vec4f>;
// By channel, what the three shares of a record weigh: see passed_weights in crates/scene/src/bounce.rs.
@group(0) @binding(10) var<uniform> passed: array<vec4f, 3>;
@group(0) @binding(11) var<storage, read> volume: array<vec4f>;
// #if MESHES
// [surface] position, normal, albedo
@group(0) @binding(7) var<storage, read> surfaces: array<array<vec4f, 3>>;
// [sweep][surface], [sweep][voxel]: a bit each, the lowest of a word first.
@group(0) @binding(8) var<storage, read> hidden_surfaces: array<u32>;
@group(0) @binding(9) var<storage, read> hidden_voxels: array<u32>;
// #else
@group(0) @binding(7) var<uniform> proxies: Proxies;
// #endif

// Where light is found.
struct Surface {
    position: vec3f,
    normal: vec3f,
    albedo: vec3f,
}

// #if MESHES

fn n_surfaces() -> u32 {
    return arrayLength(&surfaces);
}

fn surface_at(own: u32) -> Surface {
    return Surface(surfaces[own][0].xyz, surfaces[own][1].xyz, surfaces[own][2].xyz);
}

// Whether another proxy, or another part of its own mesh, stands before a surface in direction `sweep`.
fn is_behind_other(own: u32, position: vec3f, sweep: u32) -> bool {
    let n_words = (n_surfaces() + 31u) / 32u;
    let word = hidden_surfaces[sweep * n_words + own / 32u];
    return ((word >> (own % 32u)) & 1u) == 1u;
}

// Whether a proxy stands before the middle of a voxel in direction `sweep`.
fn is_voxel_hidden(voxel: vec3u, sweep: u32) -> bool {
    let n_words = (grid.dims.x * grid.dims.y * grid.dims.z + 31u) / 32u;
    let at = voxel_index(grid, voxel);
    let word = hidden_voxels[sweep * n_words + at / 32u];
    return ((word >> (at % 32u)) & 1u) == 1u;
}

// #else

// Of a light map.
fn n_texels() -> u32 {
    return LIGHT_MAP_SIDE * LIGHT_MAP_SIDE;
}

fn n_surfaces() -> u32 {
    return proxies.n * n_texels();
}

fn surface_at(own: u32) -> Surface {
    let proxy = proxies.list[own / n_texels()];
    let texel = own % n_texels();
    let position = texel_position(proxy, vec2u(texel % LIGHT_MAP_SIDE, texel / LIGHT_MAP_SIDE));
    return Surface(position, surface_normal(proxy, position), proxy.albedo);
}

// Whether another proxy stands before a surface in direction `sweep`.
fn is_behind_other(own: u32, position: vec3f, sweep: u32) -> bool {
    for (var ix = 0u; ix < proxies.n; ix++) {
        let is_other = ix != own / n_texels();
        if is_other && is_blocked_by(proxies.list[ix], position, sweeps[sweep].xyz) {
            return true;
        }
    }
    return false;
}

// Whether a proxy stands before the middle of a voxel in direction `sweep`.
fn is_voxel_hidden(voxel: vec3u, sweep: u32) -> bool {
    let position = grid.origin + (vec3f(voxel) + 0.5) * grid.h;
    var is_hidden = false;
    for (var ix = 0u; ix < proxies.n; ix++) {
        is_hidden = is_hidden || is_blocked_by(proxies.list[ix], position, sweeps[sweep].xyz);
    }
    return is_hidden;
}

// #endif

// Directions of a light that no proxy blocks at a voxel.
fn count_open(light: Light, voxel: vec3u) -> f32 {
    var n_open = 0.0;
    for (var k = 0u; k < light.n_sweeps; k++) {
        n_open += select(1.0, 0.0, is_voxel_hidden(voxel, light.first_sweep + k));
    }
    return n_open;
}

// Shares that hair leaves of a light at three exponents, by its records around g. They hold the mean over all
// directions, none coming through proxies, and each voxel has a horizon of its own: voxels count by
// the directions that are open there, those without any not at all. Below 0 where that is all of them.
fn share_at(light: Light, g: vec3f) -> vec3f {
    let first = light.record * grid.dims.x * grid.dims.y * grid.dims.z;
    let base = vec3u(g);
    let f = g - vec3f(base);
    var sum = vec3f(0.0);
    var weights = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let offset = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
        let voxel = base + offset;
        let n_open = count_open(light, voxel);
        if n_open > 0.0 {
            let w = select(1.0 - f, f, offset == vec3u(1u));
            let weight = w.x * w.y * w.z;
            let record = unpack_record(records[first + voxel_index(grid, voxel)]);
            sum += weight * record.shares * (f32(light.n_sweeps) / n_open);
            weights += weight;
        }
    }
    return select(vec3f(-1.0), min(sum / max(weights, 1e-20), vec3f(1.0)), weights > 0.0);
}

// Optical depth along the normal of the hair on a surface, from a height above it: strands that lie on it are
// smeared over voxels on both sides of it.
fn depth_on_surface(surface: Surface, height: f32) -> f32 {
    let distance = height + BEYOND * grid.h;
    let n = ceil(distance / grid.h);
    let part = distance / n;
    var depth = 0.0;
    for (var ix = 0u; ix < u32(n); ix++) {
        let position = surface.position + surface.normal * (height - (f32(ix) + 0.5) * part);
        let voxel = floor((position - grid.origin) / grid.h);
        if all(voxel >= vec3f(0.0)) && all(voxel < vec3f(grid.dims)) {
            let at = 2u * voxel_index(grid, vec3u(voxel));
            depth += part * extinction(volume[at], volume[at + 1u], surface.normal).x;
        }
    }
    return depth;
}

// Shares at a height above a surface, less what the hair below that, of this optical depth, takes. Below 0 where there are none.
fn share_above(light: Light, surface: Surface, height: f32, depth: f32) -> vec3f {
    let share = share_at(light, grid_position(grid, surface.position + surface.normal * height));
    return select(share, pass_through(vec4f(share, 0.0), depth, 0.0).xyz, share.x >= 0.0);
}

// How much of a light's irradiance in the open there is on surface `own`, at three exponents; `depth` is that of the hair on it, from the lift.
fn share_of_light(light: Light, own: u32, surface: Surface, depth: f32) -> vec3f {
    let position = surface.position;
    let normal = surface.normal;
    var inside = vec3f(-1.0);
    var above = 0.0;
    var arriving = vec3f(0.0);
    for (var k = 0u; k < light.n_sweeps; k++) {
        let d = sweeps[light.first_sweep + k].xyz;
        let weight = max(dot(normal, d), LEAST_COSINE);
        above += weight;
        if is_behind_other(own, position, light.first_sweep + k) {
            continue;
        }
        var share = vec3f(1.0);
        let entry = entry_of_volume(grid, position, d);
        if entry > 0.0 {
            share = max(share_at(light, grid_position(grid, position + d * entry)), vec3f(0.0));
        } else if entry == 0.0 {
            // The same place for all directions.
            if inside.x < 0.0 {
                inside = share_above(light, surface, SELF_LIFT * grid.h, depth);
                if inside.x < 0.0 {
                    let height = HIGHER * grid.h;
                    let below = depth_on_surface(surface, height);
                    inside = max(share_above(light, surface, height, below), vec3f(0.0));
                }
            }
            share = inside;
        }
        arriving += weight * share;
    }
    return arriving / max(above, LEAST_COSINE);
}

// Threads that share the lights of a surface out.
const LANES: u32 = 8u;

// [surface of the group][lane]
var<workgroup> arrived: array<vec3f, 64>;

@compute @workgroup_size(64)
fn light_proxies(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let own = (group.x + group.y * groups.x) * (64u / LANES) + local / LANES;
    let lane = local % LANES;
    var sum = vec3f(0.0);
    if own < n_surfaces() {
        let surface = surface_at(own);
        let depth = depth_on_surface(surface, SELF_LIFT * grid.h);
        for (var ix = lane; ix < batch.n_lights; ix += LANES) {
            let light = lights[batch.first_light + ix];
            let open = irradiance(dot(surface.normal, light.direction), light.lambda);
            let shares = share_of_light(light, own, surface, depth);
            let arriving = vec3f(
                dot(passed[0].xyz, shares), dot(passed[1].xyz, shares), dot(passed[2].xyz, shares));
            sum += light.rgb * (open * arriving);
        }
    }
    arrived[local] = sum;
    workgroupBarrier();
    if lane > 0u || own >= n_surfaces() {
        return;
    }
    for (var other = 1u; other < LANES; other++) {
        sum += arrived[local + other];
    }
    let sent_back = surface_at(own).albedo * 0.31830987;
    // The first batch overwrites what was there.
    var before = vec4f(0.0);
    if batch.first_light > 0u {
        before = light_maps[own];
    }
    light_maps[own] = before + vec4f(sent_back * sum * view.radiance_scale, 0.0);
}
