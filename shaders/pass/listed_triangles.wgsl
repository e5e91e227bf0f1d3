// Sorts the triangles of meshes into the tiles of the picture that they may be seen in, for `pass/listed_pixels`:
// `count_triangles` counts those of each tile and leaves what the eye sees of them, `place_triangles` makes room, and
// `sort_triangles` puts them there. Twin: crates/cpu/src/triangles.rs.
// #import lib/view
// #import lib/visible_list
// #import lib/group_sums

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> list: ListLayout;
// The number of words of `tiles`.
@group(0) @binding(13) var<storage, read_write> totals: vec2u;
// [surface] position, normal, albedo
@group(0) @binding(20) var<storage, read> surfaces: array<array<vec4f, 3>>;
// [triangle][corner]: which surface.
@group(0) @binding(21) var<storage, read> corners: array<u32>;
@group(0) @binding(22) var<storage, read_write> placed_triangles: array<Triangle>;
// Of each tile its number of triangles, then where they start, then where they end; after that the triangles of all
// tiles.
@group(0) @binding(24) var<storage, read_write> tiles: array<atomic<u32>>;

// Depth up to which places on the screen are not to be trusted, cm.
const NEXT_TO_EYE: f32 = 0.01;

// How far beyond its outline a triangle is looked for, px.
const REACH: f32 = 1.0;

fn triangle_side(normal: vec3f) -> vec4f {
    return vec4f(view.focal_px * dot(normal, view.forward), dot(normal, view.right), -dot(normal, view.up), 0.0);
}

// The columns and rows of tiles that a triangle may be seen in, and where they end; all where a corner is next to the
// eye or behind it.
fn tiles_of(corners_from_eye: array<vec3f, 3>) -> vec4u {
    let most = vec2f(list.n_tiles);
    var low = vec2f(1e30);
    var high = vec2f(-1e30);
    var n_next = 0u;
    var n_behind = 0u;
    for (var ix = 0u; ix < 3u; ix++) {
        let corner = corners_from_eye[ix];
        let depth = dot(corner, view.forward);
        n_next += select(0u, 1u, depth <= NEXT_TO_EYE);
        n_behind += select(0u, 1u, depth <= 0.0);
        let across = vec2f(dot(corner, view.right), -dot(corner, view.up));
        let at = 0.5 * vec2f(view.size) + view.focal_px * across / max(depth, NEXT_TO_EYE);
        low = min(low, at);
        high = max(high, at);
    }
    if n_behind == 3u {
        return vec4u(0u);
    }
    if n_next > 0u {
        return vec4u(0u, 0u, list.n_tiles);
    }
    let origin = vec2f(view.origin);
    let first = clamp(floor((low - REACH - origin) / f32(TILE)), vec2f(0.0), most);
    let end = clamp(floor((high + REACH - origin) / f32(TILE)) + 1.0, vec2f(0.0), most);
    return vec4u(vec2u(first), vec2u(end));
}

fn corners_of(triangle: u32) -> array<vec3f, 3> {
    return array<vec3f, 3>(
        surfaces[corners[3u * triangle]][0].xyz - view.eye,
        surfaces[corners[3u * triangle + 1u]][0].xyz - view.eye,
        surfaces[corners[3u * triangle + 2u]][0].xyz - view.eye,
    );
}

@compute @workgroup_size(GROUP)
fn count_triangles(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let triangle = id.x + id.y * groups.x * GROUP;
    if triangle >= arrayLength(&corners) / 3u {
        return;
    }
    let from_eye = corners_of(triangle);
    let a = from_eye[0];
    let b = from_eye[1];
    let c = from_eye[2];
    let sides = array<vec4f, 3>(triangle_side(cross(b, c)), triangle_side(cross(c, a)), triangle_side(cross(a, b)));
    let of_corners = vec3u(corners[3u * triangle], corners[3u * triangle + 1u], corners[3u * triangle + 2u]);
    placed_triangles[triangle] = Triangle(sides, of_corners, view.focal_px * dot(a, cross(b, c)));
    let near = tiles_of(from_eye);
    for (var row = near.y; row < near.w; row++) {
        for (var column = near.x; column < near.z; column++) {
            atomicAdd(&tiles[column + list.n_tiles.x * row], 1u);
        }
    }
}

@compute @workgroup_size(GROUP)
fn place_triangles(@builtin(local_invocation_index) local: u32) {
    let n_tiles = list.n_tiles.x * list.n_tiles.y;
    let share = share_of(local, n_tiles);
    var sum = 0u;
    for (var tile = share.x; tile < share.y; tile++) {
        sum += atomicLoad(&tiles[tile]);
    }
    sums[local] = sum;
    var before = n_tiles + sum_before(local);
    for (var tile = share.x; tile < share.y; tile++) {
        let n = atomicLoad(&tiles[tile]);
        atomicStore(&tiles[tile], before);
        before += n;
    }
    if local == GROUP - 1u {
        totals = vec2u(before, 0u);
    }
}

@compute @workgroup_size(GROUP)
fn sort_triangles(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let triangle = id.x + id.y * groups.x * GROUP;
    if triangle >= arrayLength(&corners) / 3u {
        return;
    }
    let near = tiles_of(corners_of(triangle));
    for (var row = near.y; row < near.w; row++) {
        for (var column = near.x; column < near.z; column++) {
            let place = atomicAdd(&tiles[column + list.n_tiles.x * row], 1u);
            atomicStore(&tiles[place], triangle);
        }
    }
}
