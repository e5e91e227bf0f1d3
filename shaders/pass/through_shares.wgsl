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
    // The points whose shares are found: all, or 1: those that are listed.
    are_listed: u32,
    pad: u32,
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

// As in pass/shade: at N_SHADED how many points are listed, and from FIRST_SHADED on which.
@group(0) @binding(8) var<storage, read> counters: array<u32>;

const MAPS_PER_WORD: u32 = 4u;
const N_PLACES: u32 = 8u;
const N_SHADED: u32 = 20u;
const FIRST_SHADED: u32 = 21u;

// Rows that are summed at a time.
const N_ROWS: u32 = 4u;

// One thread a point.
@compute @workgroup_size(64)
fn through_shares(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let place = id.x + id.y * groups.x * 64u;
    var end = through.n_points;
    if through.are_listed == 1u {
        end = counters[N_SHADED];
    }
    if place >= end {
        return;
    }
    var point_ix = place;
    if through.are_listed == 1u {
        point_ix = counters[FIRST_SHADED + place];
    }
    let u = tangents[point_ix].xyz;
    let v = normals[point_ix].xyz;
    let frame = transpose(mat3x3f(u, v, cross(u, v)));
    let to_eye = through.eye - points[point_ix].xyz;
    let eye = frame * (to_eye / max(length(to_eye), 1e-20));
    for (var first = 0u; first < through.n_rows; first += N_ROWS) {
        let end = min(first + N_ROWS, through.n_rows);
        var unblocked = array<vec4f, N_ROWS>();
        var all_of_it = array<vec4f, N_ROWS>();
        for (var map = 0u; map < through.n_maps; map++) {
            let word = answers[map / MAPS_PER_WORD * through.n_points + point_ix];
            let lit = countOneBits((word >> (8u * (map % MAPS_PER_WORD))) & 255u);
            let kernel = through_kernel(frame * towards[map].xyz, eye);
            for (var row = first; row < end; row++) {
                let weight = weights[row * through.n_maps + map] * kernel;
                all_of_it[row - first] += weight;
                unblocked[row - first] += weight * f32(lit);
            }
        }
        for (var row = first; row < end; row++) {
            let ratio = unblocked[row - first] / max(all_of_it[row - first], vec4f(1e-30));
            let bits = vec4u(min(ratio / f32(N_PLACES), vec4f(1.0)) * 255.0 + 0.5);
            visibility[(2u * row + 1u) * through.n_points + point_ix] =
                bits.x | (bits.y << 8u) | (bits.z << 16u) | (bits.w << 24u);
        }
    }
}
