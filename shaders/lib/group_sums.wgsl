// Sums over what the threads of one group go through.

// Threads of a group that goes through segments, triangles or a row.
const GROUP: u32 = 256u;

var<workgroup> sums: array<u32, GROUP>;

// The share of `n` that a thread of a group goes through: where it begins and ends.
fn share_of(local: u32, n: u32) -> vec2u {
    let share = (n + GROUP - 1u) / GROUP;
    let begin = min(local * share, n);
    return vec2u(begin, min(begin + share, n));
}

// Once every thread left a sum: that of the threads before.
fn sum_before(local: u32) -> u32 {
    workgroupBarrier();
    var before = 0u;
    for (var ix = 0u; ix < local; ix++) {
        before += sums[ix];
    }
    return before;
}
