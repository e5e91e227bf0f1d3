// TT's unblocked share of each light with maps, from the answers of all maps: those in directions from
// which light goes through the fibre to the eye count.
// Twin: through_shares in crates/cpu/src/shadow_map.rs.
// #import lib/through

struct Through {
    eye: vec3f,
    n_points: u32,
    n_maps: u32,
    // Rows of four slots.
    n_rows: u32,
    pad_0: u32,
    pad_1: u32,
}

@group(0) @binding(0) var<uniform> through: Through;
@group(0) @binding(1) var<storage, read> points: array<vec4f>;
@group(0) @binding(2) var<storage, read> tangents: array<vec4f>;
@group(0) @binding(3) var<storage, read> normals: array<vec4f>;
// [map]: unit vectors towards the light.
@group(0) @binding(4) var<storage, read> towards: array<vec4f>;
// [row][map]: what it counts for four slots.
@group(0) @binding(5) var<storage, read> weights: array<vec4f>;
// [map / 4][point], eight bits a map: lit places.
@group(0) @binding(6) var<storage, read> answers: array<u32>;
// [row][mode][point], eight bits a slot: those of TT are written.
@group(0) @binding(7) var<storage, read_write> visibility: array<u32>;

const MAPS_PER_WORD: u32 = 4u;
const N_PLACES: u32 = 8u;

// One thread a point.
@compute @workgroup_size(64)
fn through_shares(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let point_ix = id.x + id.y * groups.x * 64u;
    if point_ix >= through.n_points {
        return;
    }
    let u = tangents[point_ix].xyz;
    let v = normals[point_ix].xyz;
    let frame = transpose(mat3x3f(u, v, cross(u, v)));
    let to_eye = through.eye - points[point_ix].xyz;
    let eye = frame * (to_eye / max(length(to_eye), 1e-20));
    for (var row = 0u; row < through.n_rows; row++) {
        var unblocked = vec4f(0.0);
        var all_of_it = vec4f(0.0);
        for (var map = 0u; map < through.n_maps; map++) {
            let word = answers[map / MAPS_PER_WORD * through.n_points + point_ix];
            let lit = countOneBits((word >> (8u * (map % MAPS_PER_WORD))) & 255u);
            let kernel = through_kernel(frame * towards[map].xyz, eye);
            let weight = weights[row * through.n_maps + map] * kernel;
            all_of_it += weight;
            unblocked += weight * f32(lit);
        }
        let shares = min(unblocked / (max(all_of_it, vec4f(1e-30)) * f32(N_PLACES)), vec4f(1.0));
        let bits = vec4u(shares * 255.0 + 0.5);
        visibility[(2u * row + 1u) * through.n_points + point_ix] =
            bits.x | (bits.y << 8u) | (bits.z << 16u) | (bits.w << 24u);
    }
}
