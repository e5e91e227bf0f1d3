// Adds the samples of each pixel of one pass to the picture, in full precision.
// #import lib/view

struct Pass {
    // 1/256 px
    jitter: vec2i,
    pass_ix: u32,
    // Samples of the pass that count, the first ones.
    n_samples: u32,
    even: vec4f,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var samples: texture_multisampled_2d<f32>;
@group(0) @binding(2) var<storage, read_write> picture: array<vec4f>;
@group(0) @binding(3) var<uniform> current: Pass;

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= view.extent.x || id.y >= view.extent.y {
        return;
    }
    let at = vec2i(id.xy);
    var sum = textureLoad(samples, at, 0);
    for (var sample = 1u; sample < current.n_samples; sample++) {
        sum += textureLoad(samples, at, sample);
    }
    picture[id.x + view.extent.x * id.y] += sum;
}
