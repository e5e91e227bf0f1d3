// How much the picture still changes: what it is now against what it was at half as many samples,
// at some of the pixels. One workgroup, so that its sum has one order.
// #import lib/view

struct Halves {
    // Samples of the picture now; those before were half as many, or 0: none.
    n_samples: u32,
    n_before: u32,
    n_pixels: u32,
    // Pixels from one that is looked at to the next.
    stride: u32,
}

@group(0) @binding(0) var<uniform> halves: Halves;
@group(0) @binding(1) var<storage, read> sums: array<vec4f>;
// What `sums` was, where it is looked at.
@group(0) @binding(2) var<storage, read_write> earlier: array<vec4f>;
// Mean square of the change, and of the radiance, times the same factor.
@group(0) @binding(3) var<storage, read_write> squares: array<vec2f>;

const N_THREADS: u32 = 128u;

var<workgroup> partial: array<vec2f, N_THREADS>;

@compute @workgroup_size(128)
fn compare(@builtin(local_invocation_index) thread: u32) {
    var sum = vec2f(0.0);
    let n_looked_at = halves.n_pixels / halves.stride;
    for (var ix = thread; ix < n_looked_at; ix += N_THREADS) {
        let now = sums[ix * halves.stride];
        let before = earlier[ix];
        let mean = now.rgb / f32(halves.n_samples);
        let change = mean - before.rgb / f32(max(halves.n_before, 1u));
        sum += vec2f(dot(change, change), dot(mean, mean));
        earlier[ix] = now;
    }
    partial[thread] = sum;
    for (var half = N_THREADS / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if thread < half {
            partial[thread] += partial[thread + half];
        }
    }
    if thread == 0u {
        squares[0] = partial[0];
    }
}
