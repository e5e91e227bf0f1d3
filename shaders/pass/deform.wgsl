// Bends the strands in the wind: one thread walks a strand from its root, which stays. Writes
// points and frames. Twin: crates/scene/src/motion/wind.rs for the points, `find_frames` in
// crates/scene/src/strands.rs for the frames.
// #import lib/wind

@group(0) @binding(0) var<uniform> wind: Wind;
// At rest.
@group(0) @binding(1) var<storage, read> rest: array<vec4f>;
// First point and number of points of each strand.
@group(0) @binding(2) var<storage, read> strands: array<vec2u>;
@group(0) @binding(3) var<storage, read_write> points: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> tangents: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> normals: array<vec4f>;

fn normalize_or_zero(v: vec3f) -> vec3f {
    let size = length(v);
    return select(vec3f(0.0), v / max(size, 1e-30), size > 1e-30);
}

// A unit vector across the tangent: the world axis least along it, made perpendicular.
fn first_normal(tangent: vec3f) -> vec3f {
    let a = abs(tangent);
    var axis = vec3f(0.0, 1.0, 0.0);
    if a.x <= a.y && a.x <= a.z {
        axis = vec3f(1.0, 0.0, 0.0);
    } else if a.z <= a.y {
        axis = vec3f(0.0, 0.0, 1.0);
    }
    return normalize(axis - tangent * dot(axis, tangent));
}

// Carries a normal along by the smallest rotation between two tangents.
fn transport(normal: vec3f, before: vec3f, after: vec3f) -> vec3f {
    let cos_plus_one = 1.0 + dot(before, after);
    var turned = normal;
    if cos_plus_one > 1e-4 {
        turned = normal - (before + after) * (dot(normal, after) / cos_plus_one);
    }
    let across = turned - after * dot(turned, after);
    if dot(across, across) < 1e-30 {
        return first_normal(after);
    }
    return normalize(across);
}

@compute @workgroup_size(64)
fn deform(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let strand = id.x + id.y * groups.x * 64u;
    if strand >= wind.n_strands {
        return;
    }
    let first = strands[strand].x;
    let n = strands[strand].y;
    // Where the points went.
    var moved = vec3f(0.0);
    var length_cm = 0.0;
    var here = rest[first].xyz;
    var here_at_rest = here;
    var before = vec3f(0.0);
    var half_before = 0.0;
    var last_tangent = vec3f(0.0);
    var normal = vec3f(0.0);
    for (var ix = 0u; ix < n; ix++) {
        var next = here;
        var next_at_rest = here_at_rest;
        if ix + 1u < n {
            next_at_rest = rest[first + ix + 1u].xyz;
            let piece = next_at_rest - here_at_rest;
            let half_length = 0.5 * length(piece);
            let middle = 0.5 * (here_at_rest + next_at_rest);
            let pull = pull_at(wind, middle) * flexibility(wind, length_cm + half_length);
            moved += bent(piece, pull) - piece;
            length_cm += 2.0 * half_length;
            next = next_at_rest + moved;
        }
        let after = normalize_or_zero(next - here);
        var tangent = normalize_or_zero(before + after);
        if dot(tangent, tangent) == 0.0 {
            tangent = after;
        }
        if dot(tangent, tangent) == 0.0 {
            tangent = before;
        }
        if dot(tangent, tangent) == 0.0 {
            tangent = vec3f(0.0, 1.0, 0.0);
        }
        if ix == 0u {
            normal = first_normal(tangent);
        } else {
            normal = transport(normal, last_tangent, tangent);
        }
        let half_after = 0.5 * distance(here, next);
        let at = first + ix;
        points[at] = vec4f(here, rest[at].w);
        tangents[at] = vec4f(tangent, half_before);
        normals[at] = vec4f(normal, half_after);
        last_tangent = tangent;
        before = after;
        half_before = half_after;
        here = next;
        here_at_rest = next_at_rest;
    }
}
