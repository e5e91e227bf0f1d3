// Workgroups for the points of a list, whose number the device knows before anybody has read it: of all, then of each
// slice of them. They are arguments of dispatches of 64 threads a group.

// Twin: Slices in crates/render/src/passes/lighting/slices.rs.
struct Slices {
    n_slices: u32,
    // Points of each but the last.
    slice_points: u32,
}

@group(0) @binding(0) var<uniform> slices: Slices;
// As in pass/shade: the number of points that are listed is at N_SHADED.
@group(0) @binding(1) var<storage, read> counters: array<u32>;
// Three words each.
@group(0) @binding(2) var<storage, read_write> arguments: array<u32>;

const N_SHADED: u32 = 20u;

// Groups of one row at most.
const MOST_GROUPS: u32 = 32768u;

// A thread for all points, and for each slice.
@compute @workgroup_size(64)
fn find_arguments(@builtin(global_invocation_id) id: vec3u) {
    if id.x > slices.n_slices {
        return;
    }
    var n = counters[N_SHADED];
    if id.x > 0u {
        let first = min((id.x - 1u) * slices.slice_points, n);
        n = min(n - first, slices.slice_points);
    }
    // As groups_of_64 in crates/render/src/passes/resources.rs.
    let groups = (n + 63u) / 64u;
    let rows = max((groups + MOST_GROUPS - 1u) / MOST_GROUPS, 1u);
    arguments[3u * id.x] = (groups + rows - 1u) / rows;
    arguments[3u * id.x + 1u] = rows;
    arguments[3u * id.x + 2u] = 1u;
}
