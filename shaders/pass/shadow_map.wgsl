// Shadow maps that resolve fibres. `cast_shadows` draws every segment, a ribbon facing the light,
// into the map: height and name of the highest segment over the middle of each texel.
// `receive_shadows` asks at some places along the strand around each point whether another strand
// stands above. Twin: crates/cpu/src/shadow_map.rs.
// #if PROXIES
// #import lib/proxy
// #endif

struct ShadowView {
    right: vec3f,
    texels_per_cm: f32,
    up: vec3f,
    reach: f32,
    towards: vec3f,
    weight: f32,
    centre: vec3f,
    side: u32,
    shadow_index: u32,
    ends: u32,
    n_segments: u32,
    n_points: u32,
    offset: f32,
    // Its place among all maps.
    map_index: u32,
    pad_0: u32,
    pad_1: u32,
}

@group(0) @binding(0) var<uniform> view: ShadowView;
@group(0) @binding(1) var<storage, read> points: array<vec4f>;
@group(0) @binding(2) var<storage, read> segments: array<u32>;
// Height from the lowest, then the name; 0: nothing.
@group(0) @binding(3) var<storage, read_write> map: array<atomic<u32>>;
// w: half the distance to the point before, or 0 at a root.
@group(0) @binding(4) var<storage, read> tangents: array<vec4f>;
// w: half the distance to the point after, or 0 at a tip.
@group(0) @binding(5) var<storage, read> normals: array<vec4f>;
// [point], of the slot at work
@group(0) @binding(6) var<storage, read_write> sums: array<f32>;
// [shadow_index / 4][mode][point], eight bits a slot: TT's are written by pass/through_shares.
@group(0) @binding(7) var<storage, read_write> visibility: array<u32>;
// [map_index / 4][point], eight bits a map: lit places, from the root on.
@group(0) @binding(10) var<storage, read_write> answers: array<u32>;

// #if PROXIES
@group(0) @binding(8) var<uniform> proxies: Proxies;
// #endif
// #if MESHES
// [point]: a bit each, the lowest of a word first.
@group(0) @binding(9) var<storage, read> hidden_points: array<u32>;
// #endif

// Bits of a name: the last ones of the number of the segment's first point.
const NAME_BITS: u32 = 12u;
// Largest height that the other bits hold.
const HEIGHT_UNITS: f32 = 1048575.0;
// Segments so many points away along the strand are the point's own: no shadow.
const OWN_POINTS: u32 = 3u;
// Other strands cast shadows from this many radii above on.
const CLEAR_RADII: f32 = 0.5;
// Places along the strand around a point.
const N_PLACES: u32 = 8u;
// Maps whose answers fill a word.
const MAPS_PER_WORD: u32 = 4u;

// x and y in texels from the corner, z the height in cm.
fn map_position(position: vec3f) -> vec3f {
    let d = position - view.centre;
    let middle = 0.5 * f32(view.side);
    let x = dot(d, view.right) * view.texels_per_cm + middle;
    let y = dot(d, view.up) * view.texels_per_cm + middle;
    return vec3f(x, y, dot(d, view.towards));
}

fn height_units(height: f32) -> u32 {
    return u32(clamp(0.5 * height / view.reach + 0.5, 0.0, 1.0) * HEIGHT_UNITS);
}

fn name_of(point: u32) -> u32 {
    return point & ((1u << NAME_BITS) - 1u);
}

// One thread a segment.
@compute @workgroup_size(64)
fn cast_shadows(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let segment = id.x + id.y * groups.x * 64u;
    if segment >= view.n_segments {
        return;
    }
    let first = segments[segment];
    let from_point = points[first];
    let to_point = points[first + 1u];
    var a = map_position(from_point.xyz);
    var b = map_position(to_point.xyz);
    // Steps go along x; a steep strand is turned over.
    let steep = abs(b.y - a.y) > abs(b.x - a.x);
    if steep {
        a = a.yxz;
        b = b.yxz;
    }
    if a.x > b.x {
        let swap = a;
        a = b;
        b = swap;
    }
    let run = b.x - a.x;
    if run < 1e-6 {
        return;
    }
    let rise = (b.yz - a.yz) / run;
    let radius = 0.5 * (from_point.w + to_point.w) * view.texels_per_cm;
    let half_width = radius * sqrt(1.0 + rise.x * rise.x);
    let side = i32(view.side);
    let name = name_of(first);
    // Texels whose middles lie inside.
    let last = min(i32(ceil(b.x - 0.5)), side);
    for (var column = max(i32(ceil(a.x - 0.5)), 0); column < last; column++) {
        let along = f32(column) + 0.5 - a.x;
        let y = a.y + rise.x * along;
        let top = min(i32(ceil(y + half_width - 0.5)), side);
        for (var row = max(i32(ceil(y - half_width - 0.5)), 0); row < top; row++) {
            let cell = select(column + side * row, row + side * column, steep);
            let height = height_units(a.z + rise.y * along);
            let value = (height << NAME_BITS) | name;
            // Looking is cheaper than changing, and most of what is drawn is hidden.
            if atomicLoad(&map[cell]) < value {
                atomicMax(&map[cell], value);
            }
        }
    }
}

// One thread a point.
@compute @workgroup_size(64)
fn receive_shadows(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let point_ix = id.x + id.y * groups.x * 64u;
    if point_ix >= view.n_points {
        return;
    }
    let point = points[point_ix];
    let before = tangents[point_ix].w;
    let after = normals[point_ix].w;
    let middle = map_position(point.xyz);
    var from_before = middle;
    if before > 0.0 {
        from_before = map_position(points[point_ix - 1u].xyz);
    }
    var to_after = middle;
    if after > 0.0 {
        to_after = map_position(points[point_ix + 1u].xyz);
    }
    var lit = 0u;
    for (var ix = 0u; ix < N_PLACES; ix++) {
        let place = (f32(ix) + view.offset) / f32(N_PLACES) * (before + after) - before;
        // As far as half way to the neighbour.
        var end = to_after;
        var share = 0.5 * place / max(after, 1e-20);
        if place < 0.0 {
            end = from_before;
            share = -0.5 * place / before;
        }
        let at = middle + (end - middle) * share;
        let texel = clamp(vec2i(floor(at.xy)), vec2i(0), vec2i(i32(view.side) - 1));
        let highest = atomicLoad(&map[texel.x + i32(view.side) * texel.y]);
        let is_above = (highest >> NAME_BITS) > height_units(at.z + CLEAR_RADII * point.w);
        let apart = name_of(highest - point_ix + OWN_POINTS);
        lit |= select(0u, 1u, !is_above || apart <= 2u * OWN_POINTS) << ix;
    }
    // #if PROXIES
    for (var ix = 0u; ix < proxies.n; ix++) {
        if is_blocked_by(proxies.list[ix], point.xyz, view.towards) {
            lit = 0u;
        }
    }
    // #endif
    // #if MESHES
    if ((hidden_points[point_ix / 32u] >> (point_ix % 32u)) & 1u) == 1u {
        lit = 0u;
    }
    // #endif
    let answer = view.map_index / MAPS_PER_WORD * view.n_points + point_ix;
    let answer_bit = 8u * (view.map_index % MAPS_PER_WORD);
    answers[answer] = (answers[answer] & ~(255u << answer_bit)) | (lit << answer_bit);
    var sum = view.weight * f32(countOneBits(lit)) / f32(N_PLACES);
    if (view.ends & 1u) == 0u {
        sum += sums[point_ix];
    }
    sums[point_ix] = sum;
    if (view.ends & 2u) != 0u {
        let word = 2u * (view.shadow_index / 4u) * view.n_points + point_ix;
        let shift = 8u * (view.shadow_index % 4u);
        let bits = u32(min(sum, 1.0) * 255.0 + 0.5) << shift;
        visibility[word] = (visibility[word] & ~(255u << shift)) | bits;
    }
}
