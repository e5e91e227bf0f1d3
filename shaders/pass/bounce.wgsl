// What the proxies send back to the hair, at the nodes of the bounce grid, and to each other: what rays meet, which was
// found on the CPU (crates/scene/src/bounce.rs, interreflection.rs), less what the hair before it blocks. Twins:
// crates/cpu/src/bounce.rs, interreflection.rs.
// #import lib/grid
// #import lib/transmittance
// #import lib/proxy
// #import lib/bounce

struct BounceHit {
    // Index in the light maps, or NO_SURFACE.
    surface: u32,
    // cm
    distance: f32,
}

struct BounceLayout {
    n_nodes: u32,
    // A bit for each proxy that is a ground.
    grounds: u32,
    pad: vec2u,
}

// A surface that light from others arrives at.
struct ReflectingSurface {
    position: vec3f,
    // First of what its rays meet, and how many.
    first: u32,
    // What a ray stands for: the albedo over the number of rays.
    weight: vec3f,
    n: u32,
}

// The shadow volume's, not that of the nodes.
@group(0) @binding(0) var<uniform> grid: Grid;
@group(0) @binding(1) var<uniform> sizes: BounceLayout;
@group(0) @binding(2) var<uniform> rays: array<vec4f, N_RAYS>;
@group(0) @binding(3) var<storage, read> volume: array<vec4f>;
// Where the rays of a node start, and as bits its index in the bounce grid.
@group(0) @binding(4) var<storage, read> nodes: array<vec4f>;
// [node][ray]
@group(0) @binding(5) var<storage, read> hits: array<BounceHit>;
// Radiance of the proxies times the view's radiance scale.
@group(0) @binding(6) var<storage, read> light_maps: array<vec4f>;
// [index in the bounce grid][lobe]: -ln of the three shares, whose interpolation holds on to the exponential,
// and the sine of the inclination; power; vector of it.
@group(0) @binding(7) var<storage, read_write> bounced: array<vec4f>;
@group(0) @binding(8) var<storage, read> reflecting: array<ReflectingSurface>;
// By ray that meets another surface, its direction, and how far away that is, cm.
@group(0) @binding(9) var<storage, read> ways: array<vec4f>;
// Which surface, as in the light maps.
@group(0) @binding(10) var<storage, read> met: array<u32>;
// What the hair before it lets pass at the smallest exponent.
@group(0) @binding(11) var<storage, read_write> passing: array<f32>;
// What the surfaces send back of the lights, and of each other as well; `light_maps` in the round before.
@group(0) @binding(12) var<storage, read> direct: array<vec4f>;
@group(0) @binding(13) var<storage, read_write> reflected: array<vec4f>;
// By channel, what the three shares weigh: see passed_weights in crates/scene/src/bounce.rs.
@group(0) @binding(14) var<uniform> passed: array<vec4f, 3>;

// Nothing is met.
const NO_SURFACE: u32 = 0xffffffffu;
// Optical depth from which on a ray is not followed.
const MOST_DEPTH: f32 = 100.0;
// Solid angle of a ray, sr.
const OF_RAY: f32 = 0.2617994;

// What hair lets pass where there is none.
const OPEN: vec4f = vec4f(1.0, 1.0, 1.0, 0.0);

// Which lobe a surface counts for.
fn lobe_of(surface: u32) -> u32 {
    let proxy = surface / (LIGHT_MAP_SIDE * LIGHT_MAP_SIDE);
    return 1u - ((sizes.grounds >> min(proxy, 31u)) & 1u);
}

// What hair lets pass on `distance` cm from `start`, to a surface on which hair may lie.
fn pass_hair(start: vec3f, direction: vec3f, distance: f32) -> vec4f {
    let span = span_in_grid(grid, start, direction, 0.0);
    let entry = span.x;
    let exit = min(span.y, distance + BEYOND * grid.h);
    if exit <= entry {
        return OPEN;
    }
    let last = vec3f(grid.dims) - 1.0;
    let n = ceil((exit - entry) / grid.h);
    let part = (exit - entry) / n;
    var depth = 0.0;
    var sin_2_depth = 0.0;
    for (var ix = 0u; ix < u32(n); ix++) {
        let position = start + direction * (entry + (f32(ix) + 0.5) * part);
        let voxel = clamp(floor((position - grid.origin) / grid.h), vec3f(0.0), last);
        let index = voxel_index(grid, vec3u(voxel));
        let hair = extinction(volume[2u * index], volume[2u * index + 1u], direction);
        depth += hair.x * part;
        sin_2_depth += hair.x * part * hair.y;
        if depth > MOST_DEPTH {
            break;
        }
    }
    return vec4f(pass_through(OPEN, depth, 0.0).xyz, sin_2_depth);
}

@compute @workgroup_size(64)
fn find_bounce(@builtin(global_invocation_id) id: vec3u) {
    let node = id.x;
    if node >= sizes.n_nodes {
        return;
    }
    let start = nodes[node].xyz;
    var records = array<vec4f, N_LOBES>();
    var powers = array<vec4f, N_LOBES>();
    var vectors = array<vec4f, N_LOBES>();
    var depths = array<f32, N_LOBES>();
    for (var ray = 0u; ray < N_RAYS; ray++) {
        let hit = hits[node * N_RAYS + ray];
        if hit.surface == NO_SURFACE {
            continue;
        }
        let direction = rays[ray].xyz;
        let here = pass_hair(start, direction, hit.distance);
        let rgb = light_maps[hit.surface].xyz * OF_RAY;
        let all = rgb.x + rgb.y + rgb.z;
        let lobe = lobe_of(hit.surface);
        records[lobe] += all * here;
        powers[lobe] += vec4f(rgb, 0.0);
        vectors[lobe] += vec4f(all * direction, 0.0);
        depths[lobe] += all * depth_of_share(here.z);
    }
    let first = bitcast<u32>(nodes[node].w) * N_LOBES * 3u;
    for (var lobe = 0u; lobe < N_LOBES; lobe++) {
        let power = powers[lobe];
        let all = power.x + power.y + power.z;
        let sin_2 = records[lobe].w / max(max(depths[lobe], 1e-6 * all), 1e-30);
        let shares = max(records[lobe].xyz / max(all, 1e-30), vec3f(LEAST_SHARE));
        let depths_of = select(vec3f(0.0), -log(shares), all > 0.0);
        bounced[first + 3u * lobe] = vec4f(depths_of, sqrt(clamp(sin_2, 0.0, 1.0)));
        bounced[first + 3u * lobe + 1u] = power;
        bounced[first + 3u * lobe + 2u] = vectors[lobe];
    }
}

@compute @workgroup_size(64)
fn find_passing(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let own = (group.x + group.y * groups.x) * 64u + local;
    if own >= arrayLength(&reflecting) {
        return;
    }
    let surface = reflecting[own];
    for (var ix = surface.first; ix < surface.first + surface.n; ix++) {
        // Hair may lie on the surface that it leaves, too.
        let before = BEYOND * grid.h;
        let start = surface.position - before * ways[ix].xyz;
        passing[ix] = pass_hair(start, ways[ix].xyz, before + ways[ix].w).z;
    }
}

@compute @workgroup_size(64)
fn reflect_light(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let own = (group.x + group.y * groups.x) * 64u + local;
    if own >= arrayLength(&reflecting) {
        return;
    }
    let surface = reflecting[own];
    var arriving = vec3f(0.0);
    for (var ix = surface.first; ix < surface.first + surface.n; ix++) {
        let shares = shares_of_ray(passing[ix]);
        let share = vec3f(
            dot(passed[0].xyz, shares), dot(passed[1].xyz, shares), dot(passed[2].xyz, shares));
        arriving += share * light_maps[met[ix]].xyz;
    }
    reflected[own] = direct[own] + vec4f(surface.weight * arriving, 0.0);
}
